#!/usr/bin/env python3
"""Opens a result of `tpm simulate` with the XDMF reader of ParaView and checks the network in motion.

    paraview_opens.py TPM
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline as Pipeline
from vtkmodules.vtkIOXdmf2 import vtkXdmfReader

SCENE = {
    "organ": {"kind": "liver", "count": 60},
    "protocol": {"kind": "ramp_hold", "depth": "4 mm", "rate": "2 mm/s", "hold": "1 s"},
    "outputs": {"count": 7, "fields": ["force", "bond_force", "viscous"]},
}


def simulated(tpm, folder):
    scene = folder / "scene.json"
    scene.write_text(json.dumps(SCENE))
    told = subprocess.run([tpm, "simulate", scene, "-o", folder / "result.h5", "--format", "json"], check=True,
                          stdout=subprocess.PIPE).stdout
    return json.loads(told)


def arrays(data):
    return {data.GetArrayName(k): vtk_to_numpy(data.GetArray(k)) for k in range(data.GetNumberOfArrays())}


def check_step(output, result, time):
    """The two grids of a step; returns where the spheres were at rest."""
    assert output.GetNumberOfBlocks() == 2
    spheres, bonds = output.GetBlock(0), output.GetBlock(1)
    assert spheres.GetNumberOfPoints() == spheres.GetNumberOfCells() == result["spheres"]
    assert bonds.GetNumberOfCells() == result["bonds"]
    at = vtk_to_numpy(spheres.GetPoints().GetData())
    assert np.array_equal(at, vtk_to_numpy(bonds.GetPoints().GetData()))
    fields = arrays(spheres.GetPointData())
    assert {"number", "layer", "constraint", "contact", "displacement_m", "displacement_magnitude_m", "validity", "force_N",
            "largest_bond_force_N"} == set(fields), fields.keys()
    contact = result["contacts"][0]["sphere"] - 1
    assert fields["number"][contact] == contact + 1
    depth = fields["displacement_m"][contact] @ result["contacts"][0]["direction"]
    assert abs(depth - min(2e-3 * time, 4e-3)) < 1e-10, (time, depth)
    assert np.allclose(np.linalg.norm(fields["displacement_m"], axis=1), fields["displacement_magnitude_m"], 1e-12)
    on_bonds = arrays(bonds.GetCellData())
    assert {"kind", "bond_force_N", "viscous_m"} == set(on_bonds), on_bonds.keys()
    check_forces(bonds, at, fields, on_bonds["bond_force_N"])
    return at - fields["displacement_m"]


def check_forces(bonds, at, fields, bond_force):
    """The bonds pull the spheres with the forces that the file gives for spheres."""
    total = np.zeros_like(at)
    for k in range(bonds.GetNumberOfCells()):
        cell = bonds.GetCell(k)
        assert cell.GetNumberOfPoints() == 2
        a, b = cell.GetPointId(0), cell.GetPointId(1)
        pull = bond_force[k] * (at[b] - at[a]) / np.linalg.norm(at[b] - at[a])
        total[a] += pull
        total[b] -= pull
    assert np.abs(total - fields["force_N"]).max() <= 1e-9 * max(np.abs(bond_force).max(), 1e-9)


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        result = simulated(sys.argv[1], folder)
        reader = vtkXdmfReader()
        reader.SetFileName(str(folder / "result.xdmf"))
        reader.UpdateInformation()
        information = reader.GetOutputInformation(0)
        times = [information.Get(Pipeline.TIME_STEPS(), k) for k in range(information.Length(Pipeline.TIME_STEPS()))]
        assert np.allclose(times, np.linspace(0, 3, 7)), times
        rest = None
        for time in times:
            reader.UpdateTimeStep(time)
            at_rest = check_step(reader.GetOutputDataObject(0), result, time)
            assert rest is None or np.abs(at_rest - rest).max() < 1e-12
            rest = at_rest
    print(f"ParaView's reader shows {len(times)} times of {result['spheres']} spheres and {result['bonds']} bonds")


if __name__ == "__main__":
    main()
