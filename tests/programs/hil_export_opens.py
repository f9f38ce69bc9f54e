#!/usr/bin/env python3
"""Reads the HDF5 of `tpm hil export` with h5py and checks it against the session that was asked for, and against
itself by mechanics: work of the hand, depth along the push.

    hil_export_opens.py TPM
"""

import hashlib
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import h5py
import numpy as np

PUSH = np.array([0.0, 0.6, -0.8])
SESSION = {
    "title": "read by h5py",
    "model": {"kind": "element", "scene": {
        "organ": {"kind": "star", "spacing": "30 mm"},
        "material": {"E1": "12 kPa", "E2": "12 kPa", "Eprime": "12 kPa", "eta1": "2.4e4 Pa s"}}},
    "push": PUSH.tolist(),
    "indentations": {"depths": ["4 mm"], "rates": ["4 mm/s"], "hold": "1 s", "rest": "1 s"},
}


def main():
    tpm = sys.argv[1]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "s.json").write_text(json.dumps(SESSION))
        subprocess.run([tpm, "hil", "run", folder / "s.json", "-o", folder / "r.tpmrec"], check=True,
                       stdout=subprocess.DEVNULL)
        subprocess.run([tpm, "hil", "export", folder / "r.tpmrec", "-o", folder / "r.h5"], check=True,
                       stdout=subprocess.DEVNULL)
        # Onto itself, and from what is no recording: refused in one line, nothing left behind.
        for source, target in (("r.tpmrec", "r.tpmrec"), ("s.json", "t.h5")):
            told = subprocess.run([tpm, "hil", "export", folder / source, "-o", folder / target],
                                  stderr=subprocess.PIPE, text=True)
            assert told.returncode in (2, 3) and told.stderr.count("\n") == 1, told
        assert {p.name for p in folder.iterdir()} == {"s.json", "r.tpmrec", "r.h5"}
        with h5py.File(folder / "r.h5") as file:
            assert file.attrs["simulated_device"] == 1 and file["header/device"].attrs["kind"] == "virtual"
            assert file["inputs/sha256"].asstr()[0] == hashlib.sha256((folder / "r.tpmrec").read_bytes()).hexdigest()
            header = json.loads(file["header_json"][0])
            assert header["session"]["title"] == SESSION["title"] == file.attrs["title"]
            rows = {name: values[:] for name, values in file["rows"].items()}
            assert all("unit" in values.attrs and "meaning" in values.attrs for values in file["rows"].values())
            end = file["phases/end_s"][-1]
            assert file["phases/kind"].asstr()[1] == "indent" and file["phases/to"][1] == 0.004
    count = len(rows["cycle"])
    assert all(len(values) == count for values in rows.values())
    assert np.array_equal(rows["cycle"], np.arange(count)) and abs(rows["time_s"][-1] - end) < 1e-9
    # The last row tells the end only.
    at = np.stack([rows[f"position_{k}_m"] for k in "xyz"], axis=1)[:-1]
    force = np.stack([rows[f"commanded_{k}_N"] for k in "xyz"], axis=1)[:-1]
    assert np.allclose(at @ PUSH, rows["tool_depth_m"][:-1], rtol=0, atol=1e-15)
    assert np.allclose(-force @ PUSH, rows["commanded_N"][:-1], rtol=0, atol=1e-12)
    work = -np.cumsum(np.einsum("ij,ij->i", force[:-1], np.diff(at, axis=0)))
    assert np.abs(work - rows["observed_J"][1:-1]).max() < 1e-12
    assert rows["commanded_N"].max() > 0.4 and np.all(rows["touching"][rows["model_force_N"] > 0] == 1)
    print(f"{count} rows")


if __name__ == "__main__":
    main()
