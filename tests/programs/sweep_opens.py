#!/usr/bin/env python3
"""Reads the HDF5 of `tpm sweep` with h5py and xarray and checks it against the CSV beside it and against Eqs. 15 and
16 of the paper.

    sweep_opens.py TPM
"""

import csv
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import h5py
import numpy as np
import xarray

SWEEP = {
    "model": "single_contact",
    "material": {"E1": "12 kPa", "E2": "12 kPa", "Eprime": "12 kPa", "eta1": "5 Pa s"},
    "indentation": {"kind": "step_hold"},
    "axes": [
        {"parameter": "depth", "from": "1 mm", "to": "8 mm", "count": 8},
        {"parameter": "spacing", "name": "x", "from": "20 mm", "to": "40 mm", "count": 5},
        {"name": "tissue", "together": {"E2": {"values": ["6 kPa", "12 kPa", "24 kPa"]}}},
    ],
    "skip": [{"when": "depth > 0.007 && x < 0.03", "reason": "too deep"}],
    "outputs": ["lambda1", "peak_force", "end_force", {"force_over": {"values": ["0 s", "1 s"]}, "name": "force"}],
    "block": 11,
}


def main():
    tpm = sys.argv[1]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "s.json").write_text(json.dumps(SWEEP))
        subprocess.run([tpm, "sweep", folder / "s.json", "-o", folder / "s.h5"], check=True, stdout=subprocess.DEVNULL)
        assert {p.name for p in folder.iterdir()} == {"s.json", "s.h5", "s.csv", "s.run.json"}
        with h5py.File(folder / "s.h5") as file:
            force = file["force"]
            assert [d.label or d[0].name for d in force.dims] == ["/depth", "/x", "/tissue", "/force_time_s"], list(force.dims)
        with (folder / "s.csv").open() as file:
            rows = list(csv.DictReader(file))
        with xarray.open_dataset(folder / "s.h5", engine="h5netcdf") as data:
            assert data.peak_force.dims == ("depth", "x", "tissue") and data.force.dims[-1] == "force_time_s"
            assert data.E2.dims == ("tissue",) and data.peak_force.attrs["units"] == "N"
            # Eqs. 2, 15 and 16 by numpy's own broadcasting over the named dimensions.
            lambda1 = 2 * 12e3 * (1 - np.cos(np.arctan(data.depth / data.x)))
            peak = (data.E2 + lambda1) * data.depth * 12.56e-3
            end = (12e3 * data.E2 / (12e3 + data.E2) + lambda1) * data.depth * 12.56e-3
            kept = data.status == 0
            assert int(kept.sum()) == 8 * 5 * 3 - 1 * 3 * 3 + 3, int(kept.sum())
            for found, truth in ((data.peak_force, peak), (data.end_force, end)):
                truth = truth.transpose(*found.dims)
                assert np.allclose(found.where(kept, 0), truth.where(kept, 0), rtol=1e-12, atol=0)
                assert bool(np.isnan(found.where(~kept)).all())
            assert set(data.reasons.values[data.reason.values[~kept.values]]) == {"too deep"}
            # The CSV: the same numbers, cell by cell.
            assert len(rows) == data.peak_force.size
            for row, value, status in zip(rows, data.peak_force.values.ravel(), data.status.values.ravel()):
                assert row["status"] == ("done", "skipped", "failed")[status]
                assert np.isnan(value) if row["peak_force N"] == "" else float(row["peak_force N"]) == value
    print(f"{len(rows)} cells")


if __name__ == "__main__":
    main()
