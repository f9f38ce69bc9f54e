#!/usr/bin/env python3
"""Runs a liver with a tumour (configs/liver_tumour.json), linear and with bonds that stiffen, as quasi-static and
inertial network and in sessions on the simulated device, and prints what came of it as a table.

    python3 scripts/material_runs.py build/release/tpm
"""
import json
import os
import re
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))


def read(name):
    with open(os.path.join(HERE, "configs", name), encoding="utf-8") as file:
        return json.load(file)


def write(folder, name, content):
    path = os.path.join(folder, name)
    with open(path, "w", encoding="utf-8") as file:
        json.dump(content, file)
    return path


def said(*command):
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    return run.stdout + run.stderr


def line(text, pattern):
    found = re.search(pattern, text, re.MULTILINE)
    return found.group(1).strip() if found else "nothing"


def materials():
    linear = read("liver_tumour.json")
    stiffening = json.loads(json.dumps(linear))
    stiffening["material"]["potential"] = {"shape": "cubic", "stiffening": "8 mm"}
    return {"tumour": linear, "tumour, W cubic with s = 8 mm": stiffening}


def main(tpm):
    print("| material | run | answer |\n| --- | --- | --- |")
    with tempfile.TemporaryDirectory() as folder:
        for name, scene in materials().items():
            for kind in ("quasi_static", "inertial"):
                path = write(folder, "scene.json", {**scene, "formulation": {"kind": kind}})
                output = os.path.join(folder, "out.h5")
                if os.path.exists(output):
                    os.remove(output)
                text = said(tpm, "simulate", path, "-o", output)
                print(f"| {name} | simulate, {kind} | largest force {line(text, 'largest force: ([0-9.]+ [munk]?N)')},"
                      f" at the end {line(text, '^at the end, [^:]*: ([0-9.]+ [munk]?N)')} |")
            for kind in ("condensed", "network", "planned"):
                session = read("hil_planned.json")
                session["model"] = {"kind": kind, "scene": {k: scene[k] for k in ("organ", "material")}}
                if kind == "planned":
                    session["model"]["tolerance"] = "1%"
                session["indentations"].update({"hold": "10 s", "rest": "200 s"})
                path = write(folder, "session.json", session)
                recording = os.path.join(folder, "session.tpmrec")
                text = said(tpm, "hil", "run", path, "-o", recording, "--overwrite")
                model = line(text, r"^model: ([a-z_0-9]+)")
                verified = line(said(tpm, "hil", "verify", recording, "--window", "0 s", "--verbose"),
                                r"^all +[0-9]+ +[0-9.e-]+ +[0-9.e-]+ +([0-9.e-]+ %)")
                print(f"| {name} | hil, {kind} ({model}) | {line(text, '^end: (.*)')}; largest difference from the"
                      f" quasi-static network {verified} of the peak |")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(os.path.abspath(sys.argv[1]))
