#!/usr/bin/env python3
"""Every command that draws answers without matplotlib: one warning, exit code 0, all but the drawings written.

    without_matplotlib.py TPM

Each command runs twice, with this Python and with one whose matplotlib cannot be imported. The second run has to print
the same, and write the same files with the same content, but for the drawings and what names them.
"""
import os
import subprocess
import sys
import tempfile
from pathlib import Path

RUNS = {
    "fit": "example recording --folder .; fit recording.csv --laws linear-1 --starts 2",
    "configuration": "fit configs/liver_relaxation.json --starts 2 --folder fitted",
    "predict": "predict ../fit/recording_fit/law.json --depth 4mm --rate 1mm/s --hold 30s --folder predicted",
    "budget": "budget ../fit/recording_fit/law.json --depth 4mm --rate 1mm/s --hold 30s --folder budget",
    "identify": "identify ../fit/recording.csv --folder identified",
    "validate": "validate ../fit/recording_fit/law.json ../fit/recording.csv --require 10% --folder validated",
    "design": "design configs/design_liver.json --repetitions 0 --folder drawn",
    "network": "network show --spheres 100 -o liver",
    "simulate": "simulate configs/liver_poke.json -o poke.h5 --folder pictures",
    "sweep": "sweep configs/sweep_x_depth.json -o sweep.h5; sweep plot sweep.h5 --folder maps",
    "session": "hil run configs/hil_law.json -o session.tpmrec; hil report session.tpmrec --folder page",
    "borders": "hil stability --folder borders",
    "report": "paper report --folder paper",
}
DRAWINGS = {".svg", ".png", ".pdf"}
# They differ from run to run anyway, or hold or name the drawings.
NOT_COMPARED = {".html", ".tpmrec", ".h5", ".xdmf"}
WARNING = "tpm: warning: figures are not drawn: no Python with matplotlib; tried "


def run(tpm, folder, line, python):
    folder.mkdir(parents=True)
    outcome = []
    for call in line.split("; "):
        done = subprocess.run([tpm, *call.split()], cwd=folder, env={**os.environ, "TPMKIT_PYTHON": str(python)},
                              capture_output=True, text=True, check=False)
        outcome.append(done)
    return outcome


def files_of(folder):
    return {p.relative_to(folder): p for p in folder.rglob("*") if p.is_file()}


def answers(text):
    """What was printed, but for the lines that name files."""
    return [line for line in text.splitlines() if not line.startswith(("wrote ", "written to "))]


def faults_of(tpm, work, name, line, stub):
    whole = run(tpm, work / "with" / name, line, sys.executable)
    bare = run(tpm, work / "without" / name, line, stub)
    for a, b in zip(whole, bare):
        if a.returncode != b.returncode or a.returncode not in (0, 1):
            yield f"{name}: ended with {b.returncode}, with matplotlib with {a.returncode}: {b.stderr}{a.stderr}"
        if name != "session" and answers(a.stdout) != answers(b.stdout):
            yield f"{name}: prints another answer: {b.stdout}"
        for ending in DRAWINGS:
            if ending in b.stdout:
                yield f"{name}: says that it wrote {ending}: {b.stdout}"
    warnings = [w for b in bare for w in b.stderr.splitlines() if w.startswith(WARNING)]
    if len(warnings) != 1:
        yield f"{name}: warned {len(warnings)} times: {[b.stderr for b in bare]}"
    if any(WARNING in a.stderr for a in whole):
        yield f"{name}: warned where matplotlib is"
    drawn, kept = files_of(work / "with" / name), files_of(work / "without" / name)
    expected = {p for p in drawn if p.suffix not in DRAWINGS}
    if len(expected) == len(drawn):
        yield f"{name}: draws nothing with matplotlib: the test shows nothing"
    if set(kept) != expected:
        yield f"{name}: files differ: {sorted(map(str, expected ^ set(kept)))}"
    for path in sorted(expected & set(kept)):
        if path.suffix in NOT_COMPARED or path.name.endswith(".run.json") or path.name == "report.md" or name == "session":
            continue
        if drawn[path].read_bytes() != kept[path].read_bytes():
            yield f"{name}: {path} differs"
    for path in kept:  # no page leads to a drawing that is not there
        if path.suffix == ".md" and "](figures/" in kept[path].read_text(encoding="utf-8"):
            yield f"{name}: {path} shows a figure that was not drawn"


def main():
    tpm = Path(sys.argv[1]).resolve()
    chosen = sys.argv[2:] or RUNS
    with tempfile.TemporaryDirectory() as name:
        work = Path(name)
        (work / "stub").mkdir()
        (work / "stub/matplotlib.py").write_text('raise ImportError("none here")\n')
        stub = work / "python"
        stub.write_text(f'#!/bin/sh\nPYTHONPATH={work}/stub exec {sys.executable} "$@"\n')
        stub.chmod(0o755)
        faults = [fault for name in chosen for fault in faults_of(tpm, work, name, RUNS[name], stub)]
    for fault in faults:
        print(fault)
    print(f"{len(faults)} faults in {len(chosen)} runs")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
