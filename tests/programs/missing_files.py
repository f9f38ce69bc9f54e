#!/usr/bin/env python3
"""A file that is not there: every command says so in the same words, with exit code 3, before anything is computed.

    missing_files.py SOURCE TPM

Every argument and option that `tpm --json-usage` calls a file, or that takes one, has a line below or is named as
one that is written.
"""

import json
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

COMMANDS = """
data show gone.csv
data check gone.csv
data check gone.json
data import gone.csv -o out.csv
data pack gone.csv -o out.h5
fit gone.csv
fit gone.json
fit recording.csv gone.csv
predict gone.json recording.csv
predict fitted/law.json gone.csv
validate gone.json other.csv
validate fitted/law.json gone.csv
validate fitted/law.json gone.tpmrec
validate fitted/law.json other.csv gone.csv
validate fitted/law.json other.csv --session gone.tpmrec
validate fitted/law.json other.csv --instrument gone.json
validate fitted/law.json other.csv --calibration-instrument gone.json
validate fitted/law.json other.csv --credibility out.html --evidence calibration=gone.csv
validate --recheck gone.html
identify gone.csv
export gone.json --to sofa -o out
design gone.json
view gone.h5
view gone.json
view gone.tpmrec
network build gone.json -o out.h5
network check gone.json
network show gone.json
material gone.json scene.json recording.csv
material fitted/law.json gone.json recording.csv
material fitted/law.json scene.json gone.csv
simulate gone.json
simulate scene.json --planned --budget-file gone.json --tolerance data
simulate scene.json --planned --costs gone.json
plan gone.json
plan scene.json --tolerance data --budget-file gone.json
plan scene.json --costs gone.json
sweep gone.json -o out.h5
sweep merge gone.json shard.h5 -o out.h5
sweep merge sweep.json gone.h5 -o out.h5
sweep show gone.h5
sweep sensitivity gone.h5
sweep convergence gone.h5
sweep best gone.h5 --objective peak_force
sweep best gone.h5 --objective peak_force --configuration sweep.json --write-configuration out.json
sweep plot gone.h5
hil devices --dhd-library gone.so
hil devices --plugin gone.so
hil run gone.json -o out.tpmrec
hil run session.json --law gone.json -o out.tpmrec
hil run session.json --replay-motion gone.csv -o out.tpmrec
hil run session.json --device-file gone.json -o out.tpmrec
hil run session.json --device replay --device-recording gone.tpmrec -o out.tpmrec
hil run session.json --device plugin --plugin gone.so -o out.tpmrec
hil run session.json --device omega7 --dhd-library gone.so -o out.tpmrec
hil serve gone.json
hil check gone.json
hil check session.json --device-file gone.json
hil check session.json --device replay --device-recording gone.tpmrec
hil check session.json --device plugin --plugin gone.so
hil check session.json --device omega7 --dhd-library gone.so
hil identify gone.json
hil identify session.json --device-file gone.json -o out.json
hil identify session.json --device plugin --plugin gone.so -o out.json
hil identify session.json --device omega7 --dhd-library gone.so -o out.json
hil verify gone.tpmrec
hil report gone.tpmrec
hil export gone.tpmrec -o out.h5
budget gone.json recording.csv
budget fitted/law.json gone.csv
budget fitted/law.json recording.csv --scene gone.json
budget fitted/law.json --scene scene.json --finer gone.json
paper audit gone.json
paper experiments gone.json
"""
WRITTEN = {"--output", "--folder", "--credibility", "--write-scene", "--write-configuration", "--append-to"}
# Refused beside what would read it, or read only where another file is there already.
ELSEWHERE = {("hil identify", "--device-recording"), ("sweep best", "--configuration")}


def usages(command, path=()):
    path = (*path, command["name"])
    yield " ".join(path[1:]), command
    for each in command.get("commands", []):
        yield from usages(each, path)


def main():
    source, tpm = Path(sys.argv[1]), sys.argv[2]
    lines = [line for line in COMMANDS.splitlines() if line]
    usage = json.loads(subprocess.run([tpm, "--json-usage"], check=True, stdout=subprocess.PIPE, text=True).stdout)
    wrong = []
    for name, command in usages(usage):
        for option in command["options"]:
            word = option["names"][-1]
            if "FILE" not in option.get("kind", "") or word in WRITTEN or (name, word) in ELSEWHERE:
                continue
            if not any(line.startswith(name + " ") and re.search(word + r" [\w=]*gone\.", line) for line in lines):
                wrong.append(f"{name} {word}: no line here tries it with a file that is not there")
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        rows = [f"{0.1 * i:.1f},{min(max(0.1 * i - 1.0, 0.0), 3.0):.3f},{0.06 * min(max(0.1 * i - 1.0, 0.0), 3.0):.5f}"
                for i in range(120)]
        for name in ("recording.csv", "other.csv"):
            (folder / name).write_text("\n".join(["time [s],depth [mm],force [N]", *rows, ""]))
        for name, config in (("scene", "liver_poke"), ("sweep", "sweep_x_depth"), ("session", "hil_law")):
            shutil.copy(source / f"configs/{config}.json", folder / f"{name}.json")
        subprocess.run([tpm, "fit", "recording.csv", "--folder", "fitted"], cwd=folder, check=True,
                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        for line in lines:
            gone = re.search(r"gone\.\w+", line)[0]
            done = subprocess.run([tpm, *line.split()], cwd=folder, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                  stderr=subprocess.PIPE, text=True, timeout=600)
            if (done.returncode, done.stdout) != (3, "") or done.stderr != f"tpm: {gone}: no such file; expected a readable file\n":
                wrong.append(f"tpm {line}\n    exit code {done.returncode}: {(done.stdout + done.stderr).strip()[-300:]}")
            for path in folder.glob("out*"):
                wrong.append(f"tpm {line}\n    leaves {path.name} behind")
                shutil.rmtree(path) if path.is_dir() else path.unlink()
    print("\n".join(wrong) if wrong else f"{len(lines)} commands")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
