#!/usr/bin/env python3
"""Loads the MJCF of `tpm export` with the MuJoCo library of the distribution and checks what it makes of it.

    mjcf_loads.py TPM

Exits with 77, which is "skipped", where there is no libmujoco.
"""

import ctypes
import ctypes.util
import json
import subprocess
import sys
import tempfile
from pathlib import Path

ANCHORS = [{"kind": "half_space", "point": ["0 mm", "0 mm", "1 mm"], "normal": [0, 0, -1]}]


def block(cells):
    organ = {"kind": "block", "cells": [cells, cells, cells], "spacing": "10 mm", "lattice": "fcc"}
    return {"organ": organ, "anchors": ANCHORS}


def library():
    for name in (ctypes.util.find_library("mujoco"), "libmujoco.so.2.2.2", "libmujoco.so"):
        try:
            if name:
                return ctypes.CDLL(name)
        except OSError:
            pass
    return None


def main():
    mujoco = library()
    if mujoco is None:
        print("no libmujoco")
        sys.exit(77)
    for cells in (2, 5):  # few spheres, and so many that memory counts
        check(mujoco, sys.argv[1], block(cells))


def check(mujoco, tpm, scene):
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "s.json").write_text(json.dumps(scene))
        subprocess.run([tpm, "export", folder / "s.json", "--to", "mjcf", "-o", folder / "s.xml"], check=True,
                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        text = (folder / "s.xml").read_text()
        told = ctypes.create_string_buffer(1000)
        load = mujoco.mj_loadXML
        load.restype = ctypes.c_void_p
        load.argtypes = [ctypes.c_char_p, ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int]
        model = load(str(folder / "s.xml").encode(), None, told, 1000)
        assert model, told.value.decode()
        # The first numbers of a model: nq, nv, nu, na, nbody; every free sphere has three slides.
        nq, nv, _, _, nbody = (ctypes.c_int * 5).from_address(model)
        bodies = text.count("<body ")
        assert (nq, nv, nbody) == (3 * bodies, 3 * bodies, bodies + 1), (nq, nv, nbody, bodies)
        make = mujoco.mj_makeData
        make.restype = ctypes.c_void_p
        make.argtypes = [ctypes.c_void_p]
        data = make(model)
        assert data
        step = mujoco.mj_step
        step.argtypes = [ctypes.c_void_p, ctypes.c_void_p]
        step(model, data)
        print(f"{bodies} bodies, {text.count('<spatial ')} tendons, one step")


main()
