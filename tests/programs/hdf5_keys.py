#!/usr/bin/env python3
"""Walks an HDF5 file of every command that writes one: each attribute is named by a key of the JSON answer of the same
command or of a schema, those of the root have the value that the answer gives, and truths and numbers are no texts.

    hdf5_keys.py SOURCES TPM
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import h5py

STAR = {
    "organ": {"kind": "star", "spacing": "30 mm"},
    "material": {"E1": "12 kPa", "E2": "12 kPa", "Eprime": "12 kPa", "eta1": "2.4e4 Pa s"},
}
SCENE = {**STAR, "protocol": {"kind": "ramp_hold", "depth": "3 mm", "rate": "10 mm/s", "hold": "0.2 s"},
         "outputs": {"count": 2}}
LIVER = {**SCENE, "organ": {"kind": "liver", "count": 60}, "material": {}}
SESSION = {"title": "walked", "model": {"kind": "element", "scene": STAR},
           "indentations": {"depths": ["2 mm"], "rates": ["4 mm/s"], "hold": "0.1 s", "rest": "0.1 s"}}
SWEEP = {"model": "single_contact", "material": STAR["material"], "indentation": {"kind": "step_hold"},
         "axes": [{"parameter": "depth", "from": "1 mm", "to": "2 mm", "count": 2}],
         "outputs": ["peak_force", {"force_over": {"values": ["0 s", "1 s"]}, "name": "force"}]}

# Names that no JSON has, each with its reason.
OTHERS = {
    "scene": "the text of the scene, which its JSON does not repeat",
    "meaning": "of a column or a group, in words; a key of `tpm sweep show`",
    "drive_key": "which packed column is imposed, as in Python", "response_key": "likewise",
    "quantity": "of a column of a packed curve", "missing": "how a packed column says that there is no value",
    "sweep_json": "the text of the sweep", "sweep_fingerprint": "by which a sweep finds its own file again",
    "units": "the name that the CF conventions and xarray prescribe", "long_name": "likewise",
    "Version": "prescribed by VTKHDF", "Type": "prescribed by VTKHDF", "NSteps": "prescribed by VTKHDF",
    "CLASS": "of HDF5's dimension scales", "NAME": "likewise", "DIMENSION_LIST": "likewise", "REFERENCE_LIST": "likewise",
}


def keys_of(value):
    if isinstance(value, list):
        return set().union(*map(keys_of, value))
    if isinstance(value, dict):
        return set(value).union(*map(keys_of, value.values()))
    return set()


def plain(value):
    if isinstance(value, bytes):
        return value.decode()
    return value.item() if getattr(value, "size", 0) == 1 else value


def faults_of(path, answer, declared):
    """What is wrong with the attributes of a file."""
    faults, seen = [], 0

    def look(name, thing):
        nonlocal seen
        for key, value in thing.attrs.items():
            seen += 1
            where = f"{path.name}: {name or '/'}: {key}"
            if key not in declared and key not in OTHERS:
                faults.append(f"{where} is no key")
            value = plain(value)
            if isinstance(value, str) and value in ("true", "false", "yes", "no"):
                faults.append(f"{where} = {value!r} is a truth as a text")
            said = answer.get(key) if name == "" else None
            if isinstance(said, str | bool | int | float) and said != value:
                faults.append(f"{where} = {value!r}; the answer says {said!r}")

    with h5py.File(path) as file:
        look("", file)
        file.visititems(look)
    assert seen > 3, (path, seen)
    return faults


def main():
    sources, tpm = Path(sys.argv[1]), sys.argv[2]
    declared = set()
    for schema in (sources / "schemas").glob("*.json"):
        declared |= keys_of(json.loads(schema.read_text()))
    faults = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for title, document in (("star", SCENE), ("liver", LIVER), ("session", SESSION), ("sweep", SWEEP)):
            (folder / f"{title}.json").write_text(json.dumps(document))
        masses = {**LIVER, "formulation": {"kind": "inertial"}}
        (folder / "masses.json").write_text(json.dumps(masses))
        (folder / "element.json").write_text(json.dumps({**SCENE, "formulation": {"kind": "element", "step": "1 ms"}}))
        (folder / "c.csv").write_text("time_s,depth_m,force_N\n0,0,0\n1,0.001,0.1\n2,0.002,0.25\n")
        (folder / "c.json").write_text(json.dumps({
            "id": "c", "title": "walked", "kind": "recording", "observable": "contact_force", "provenance": "assumed",
            "probe": {"shape": "sphere", "diameter": "6 mm", "provenance": "assumed"},
            "columns": {"time_s": {"quantity": "time", "unit": "s"},
                        "depth_m": {"quantity": "indentation_depth", "unit": "m"},
                        "force_N": {"quantity": "contact_force", "unit": "N"}}}))
        subprocess.run([tpm, "hil", "run", "session.json", "-o", "r.tpmrec"], cwd=folder, check=True,
                       stdout=subprocess.DEVNULL)
        for line in ("network build liver.json -o net.h5", "simulate liver.json -o a.h5 --vtkhdf",
                     "simulate masses.json -o masses.h5", "simulate element.json -o element.h5",
                     "simulate star.json -o planned.h5 --planned --tolerance 10% --costs nominal",
                     "simulate liver.json -o field.h5 --planned --outputs field --tolerance 10% --costs nominal",
                     "hil export r.tpmrec -o session.h5", "data pack c.csv evren_static amy_abstract -o pack.h5",
                     "sweep sweep.json -o sweep.h5"):
            before = set(folder.iterdir())
            run = subprocess.run([tpm, *line.split(), "--format", "json"], cwd=folder, capture_output=True, text=True)
            assert run.returncode in (0, 1), (line, run.stderr)
            answer = json.loads(run.stdout)
            keys = keys_of(answer)
            # What a file holds, its view may say as well.
            for view in {"sweep": ["sweep show sweep.h5"], "data": ["data show pack.h5"],
                         "hil": ["hil report r.tpmrec", "hil verify r.tpmrec"]}.get(line.split()[0], []):
                said = subprocess.run([tpm, *view.split(), "--format", "json"], cwd=folder, capture_output=True, text=True)
                keys |= keys_of(json.loads(said.stdout)) if said.stdout else set()
            for path in sorted(set(folder.iterdir()) - before):
                if path.suffix in (".h5", ".vtkhdf"):
                    faults += faults_of(path, answer, declared | keys)
                    print(path.name)
    assert not faults, "\n" + "\n".join(faults)


if __name__ == "__main__":
    main()
