#!/usr/bin/env python3
"""Reads the VTKHDF of `tpm simulate --vtkhdf` by the rules of its specification (docs.vtk.org, VTKHDF 2.0,
temporal unstructured grids) and compares every time with the HDF5 result beside it.

    vtkhdf_layout.py TPM
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import h5py
import numpy as np

SCENE = {
    "organ": {"kind": "liver", "count": 60},
    "protocol": {"kind": "ramp_hold", "depth": "4 mm", "rate": "2 mm/s", "hold": "1 s"},
    "outputs": {"count": 4, "fields": ["force", "bond_force", "viscous"]},
}


def part_of(root, steps, k):
    """Points, cells and fields of a step."""
    part = steps["PartOffsets"][k]
    assert steps["NumberOfParts"][k] == 1
    n, m = root["NumberOfPoints"][part], root["NumberOfCells"][part]
    at = steps["PointOffsets"][k]
    cell, first = steps["CellOffsets"][k], steps["ConnectivityIdOffsets"][k]
    ends = root["Connectivity"][first:first + root["NumberOfConnectivityIds"][part]]
    begins = root["Offsets"][cell:cell + m + 1]
    assert np.array_equal(np.diff(begins), np.full(m, 2)) and np.all(root["Types"][cell:cell + m] == 3)
    fields = {}
    for kind, size in (("PointData", n), ("CellData", m)):
        assert set(root[kind]) == set(steps[kind + "Offsets"])
        for name, values in root[kind].items():
            begin = steps[kind + "Offsets"][name][k]
            fields[name] = values[begin:begin + size]
            assert len(fields[name]) == size, name
    return root["Points"][at:at + n], ends.reshape(-1, 2), fields


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "s.json").write_text(json.dumps(SCENE))
        subprocess.run([sys.argv[1], "simulate", folder / "s.json", "-o", folder / "r.h5", "--vtkhdf"], check=True)
        with h5py.File(folder / "r.h5") as result, h5py.File(folder / "r.vtkhdf") as file:
            root = file["VTKHDF"]
            assert root.attrs["Type"] == b"UnstructuredGrid" and list(root.attrs["Version"]) == [2, 0]
            steps = root["Steps"]
            assert steps.attrs["NSteps"] == len(steps["Values"]) == 4
            assert np.array_equal(steps["Values"], result["steps/time_s"])
            for k in range(4):
                points, ends, fields = part_of(root, steps, k)
                step = result[f"steps/{k:05}"]
                assert np.array_equal(points, step["position_m"])
                assert np.array_equal(ends, result["bonds/ends"])
                for field in set(step) - {"position_m"}:
                    assert np.array_equal(fields[field], step[field]), field
                for field in ("number", "layer", "constraint"):
                    assert np.array_equal(fields[field], result["spheres"][field]), field
                assert np.array_equal(fields["kind"], result["bonds/kind"])
    print("4 times agree")


if __name__ == "__main__":
    main()
