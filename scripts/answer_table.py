#!/usr/bin/env python3
"""Gives the same hostile inputs to two versions of the program and makes one table of both answers.

    python3 scripts/answer_table.py OLD/tpm build/release/tpm build/release/tests/libfault_at.so \
        -o reports/faults/inputs.md

Each program is build/PRESET/tpm of its own source tree, whose data it uses. Every case runs in a folder of its own, with 30 s and 4 GB. An answer is the exit code (or the signal, or that
time was up), how many lines the message has and its first, and what the case looks at afterwards. Needs numpy
and h5py. The last column names the test that holds the answer.
"""
import argparse
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Callable, Optional

SOURCE = Path(__file__).resolve().parent.parent
SECONDS, BYTES = 30, 4_000_000
SHOWN = 150  # characters of a message that are shown

LIVER = {"organ": {"kind": "liver", "count": 60}, "material": {"eta1": "16800 Pa s"}}
INDENTED = {**LIVER, "anchors": [{"kind": "far_side", "fraction": 0.3}],
            "protocol": {"kind": "ramp_hold", "depth": "2 mm", "rate": "4 mm/s", "hold": "2 s"},
            "outputs": {"spacing": "0.05 s"}}
SWEEP = {"model": "single_contact", "indentation": {"kind": "step_hold"},
         "axes": [{"parameter": "depth", "values": ["2 mm", "4 mm"]}], "outputs": ["peak_force"]}
LAW = {"law": "linear-1", "drive": "indentation_depth", "response": "contact_force", "reference_m": 0.001,
       "provenance": "assumed", "parameters": {"k_inf_N_per_m": 20.0, "k1_N_per_m": 30.0, "tau1_s": 1.5}}
TETRAHEDRON = "v 0 0 0\nv 60 0 0\nv 0 60 0\nv 0 0 60\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


def meshed(name: str) -> dict:
    return {"organ": {"kind": "mesh", "mesh": name, "unit": "mm", "count": 40}}


@dataclass
class Case:
    """`make(folder)` writes the inputs; `line` is given to a shell; `look(folder)` says what there is then."""
    item: str
    what: str
    make: Callable
    line: str
    test: str
    look: Optional[Callable] = None


def files(**contents) -> Callable:
    """Writes files; the first "__" of a name stands for its dot."""
    def make(folder: Path) -> None:
        for name, content in contents.items():
            text = content if isinstance(content, str) else json.dumps(content)
            (folder / name.replace("__", ".", 1)).write_text(text)
    return make


def changed(name: str, before: str) -> Callable:
    def look(folder: Path) -> str:
        path = folder / name
        return "input whole" if path.exists() and path.read_text() == before else "**input lost**"
    return look


def exists(name: str, yes: str, no: str) -> Callable:
    return lambda folder: yes if (folder / name).exists() else no


def parts_left(folder: Path) -> str:
    left = [p.name for p in folder.iterdir() if ".part" in p.name]
    return f"**{len(left)} temporary files left**" if left else "no temporary file left"


def own_modules(folder: Path) -> None:
    files(organ__json=LIVER)(folder)
    for name in ("matplotlib.py", "numpy.py"):
        (folder / name).write_text(f"open('{folder}/was_run', 'w')\n")


def many_texts(folder: Path) -> None:
    import h5py
    subprocess.run([TPM_FOR_INPUTS, "data", "pack", "evren_static", "-o", "c.h5"], cwd=folder, check=True,
                   capture_output=True)
    with h5py.File(folder / "c.h5", "r+") as file:
        for name in list(file.attrs):
            file.attrs[name] = [f"text number {i} of many" * 4 for i in range(2000)]


def linked_outside(folder: Path) -> None:
    import h5py
    subprocess.run([TPM_FOR_INPUTS, "data", "pack", "evren_static", "-o", "other.h5"], cwd=folder, check=True,
                   capture_output=True)
    with h5py.File(folder / "other.h5", "r") as other, h5py.File(folder / "c.h5", "w") as file:
        for key, value in other.attrs.items():
            file.attrs[key] = value
        for name in other:
            file[name] = h5py.ExternalLink("other.h5", "/" + name)


def simulation_cut(folder: Path) -> None:
    """A checkpoint of a run that was interrupted, made by the version that is tried."""
    files(s__json={**INDENTED, "protocol": {**INDENTED["protocol"], "hold": "400 s"}})(folder)


FLIPS = r"""timeout -s INT -k 5 1 $TPM simulate s.json -o o.h5 --checkpoint-every "0.1 s" >/dev/null 2>&1
test -e o.h5.checkpoint || { echo 'no checkpoint' >&2; exit 9; }
cp o.h5.checkpoint kept; $TPM simulate s.json -o o.h5 >/dev/null 2>&1; mv o.h5 whole.h5 || exit 9
$PYTHON - "$TPM" <<'END'
import random, subprocess, sys
import h5py, numpy
kept, draw = open("kept", "rb").read(), random.Random(0)
def fields(name):
    found = {}
    with h5py.File(name) as file:
        file.visititems(lambda key, item: found.update({key: item[()]}) if isinstance(item, h5py.Dataset) and item.dtype.kind == "f" else None)
    return found
whole, wrong, refused, same, longer = fields("whole.h5"), 0, 0, 0, 0
for flip in range(22):
    at = draw.randrange(len(kept))
    open("o.h5.checkpoint", "wb").write(kept[:at] + bytes([kept[at] ^ 1 << draw.randrange(8)]) + kept[at + 1:])
    try: done = subprocess.run([sys.argv[1], "simulate", "s.json", "-o", "o.h5"], capture_output=True, timeout=60)
    except subprocess.TimeoutExpired:
        longer += 1
        continue
    if done.returncode: refused += 1
    elif all(numpy.array_equal(v, fields("o.h5").get(k), equal_nan=True) for k, v in whole.items()): same += 1
    else: wrong += 1
print(f"{refused} refused, {same} the same result, {wrong} another result with exit 0, {longer} still running after 60 s", file=sys.stderr)
END"""

MUTANTS = r"""$PYTHON - "$TPM" <<'END'
import random, subprocess, sys
whole, draw, answers = open("c.h5", "rb").read(), random.Random(0), {}
for case in range(200):
    bytes_ = bytearray(whole)
    for _ in range(draw.choice([1, 3, 10])): bytes_[draw.randrange(len(bytes_))] = draw.choice([0, 1, 127, 128, 255, draw.randrange(256)])
    open("m.h5", "wb").write(bytes_)
    try:
        done = subprocess.run([sys.argv[1], "data", "show", "m.h5"], capture_output=True, timeout=10)
        lines = done.stderr.decode(errors="replace").count("\n")
        kind = f"signal {-done.returncode}" if done.returncode < 0 else "read" if not done.returncode else "one line" if lines == 1 else f"{lines} lines"
    except subprocess.TimeoutExpired: kind = "10 s and more"
    answers[kind] = answers.get(kind, 0) + 1
print(", ".join(f"{n} {kind}" for kind, n in sorted(answers.items())), file=sys.stderr)
END"""


def packed(folder: Path) -> None:
    subprocess.run([TPM_FOR_INPUTS, "data", "pack", "evren_static", "-o", "c.h5"], cwd=folder, check=True,
                   capture_output=True)


def polygon(folder: Path) -> None:
    import math
    corners = 600_000
    with open(folder / "p.obj", "w") as out:
        for i in range(corners):
            angle = 2 * math.pi * i / corners
            out.write(f"v {50 * math.cos(angle):.6f} {50 * math.sin(angle):.6f} 0\n")
        out.write("f " + " ".join(str(i + 1) for i in range(corners)) + "\n")
    files(s__json=meshed("p.obj"))(folder)


def doubling_claims(folder: Path) -> None:
    claims = json.loads((SOURCE / "data/paper_claims.json").read_text())
    doubled = [{**claims["definitions"][0], "name": f"a{i}", "expression": f"a{i - 1} + a{i - 1}" if i else "1"}
               for i in range(40)]
    claims["definitions"] = doubled + claims["definitions"]
    for definition in claims["definitions"]:
        if definition["name"] == "eq15":
            definition["expression"] += " + 0 * a39"
    (folder / "claims.json").write_text(json.dumps(claims))


def private_output(folder: Path) -> None:
    (folder / "t.txt").write_text("old")
    os.chmod(folder / "t.txt", 0o600)


def linked_output(folder: Path) -> None:
    (folder / "real.txt").write_text("old")
    os.symlink("real.txt", folder / "t.txt")


DEEP = "[" * 100_000 + "]" * 100_000
DEEP_COMMANDS = ["network check d.json", "simulate d.json -o o.h5", "sweep d.json -o o.h5", "fit d.json", "plan d.json",
                 "design d.json", "hil run d.json -o o.tpmrec", "spectrum d.json", "audit d.json"]
SCENE_TEXT = json.dumps(LIVER)
MACHINE = (SOURCE / "tests/fixtures/machine_french.csv").read_bytes()

CASES = [
    Case("1", "`matplotlib.py` and `numpy.py` where the user stands", own_modules,
         "$TPM network show organ.json -o net", "test_streams: The search for a Python",
         exists("was_run", "**they were run**", "they were not run")),
    Case("2", "HDF5 attributes of 2,000 texts", many_texts, "$TPM data show c.h5",
         "test_streams: An attribute of many texts"),
    Case("2", "HDF5 whose groups are links into another file", linked_outside, "$TPM data show c.h5",
         "test_hdf5_contained"),
    Case("2", "200 HDF5 files with 1 to 10 bytes changed", packed, MUTANTS, "test_hdf5_contained, fuzz: hdf5"),
    Case("3", "22 checkpoints with one bit changed", simulation_cut, FLIPS, "test_files: sealed files"),
    Case("4", "a disk with room for 16 kB of HDF5", files(organ__json=LIVER),
         "( ulimit -f 32; trap '' XFSZ; exec $TPM network build organ.json -o o.h5 )",
         "test_files: A disk that gets full", parts_left),
    Case("4", "a temporary file of a killed run", files(organ__json=LIVER, **{"o__h5.part.4711": "x"}),
         "$TPM network build organ.json -o o.h5", "test_files: Temporary files of dead writers", parts_left),
    *[Case("5", f"100,000 levels of `[` for `{command}`", files(d__json=DEEP), f"$TPM {command}",
           "test_streams: JSON that is nested") for command in DEEP_COMMANDS],
    Case("6", "`network show organ.json -o organ`", files(organ__json=SCENE_TEXT), "$TPM network show organ.json -o organ",
         "test_files: No command writes over", changed("organ.json", SCENE_TEXT)),
    Case("6", "`simulate x.xdmf -o x.h5`", files(x__xdmf=json.dumps(INDENTED)), "$TPM simulate x.xdmf -o x.h5",
         "test_files: No command writes over", changed("x.xdmf", json.dumps(INDENTED))),
    Case("6", "`data import d.csv -o d --force`", lambda folder: (folder / "d.csv").write_bytes(MACHINE) and None,
         "$TPM data import d.csv -o d --force", "test_files: No command writes over",
         lambda folder: "input whole" if (folder / "d.csv").read_bytes() == MACHINE else "**input lost**"),
    Case("7", "`tables > /dev/full`", files(), "$TPM tables > /dev/full", "test_streams: Output that cannot be written"),
    Case("7", "`version` with standard error closed", files(), "$TPM version > /dev/null 2>&-",
         "test_streams: Standard error that is closed"),
    Case("7", "a wrong option, with standard error full", files(), "$TPM tables --no-such 2> /dev/full",
         "test_streams: Standard error that is closed"),
    Case("8", "40 definitions of claims, each twice the one before", doubling_claims, "$TPM audit claims.json",
         "test_audit"),
    Case("8", "OBJ that names another file, a pipe",
         lambda folder: (files(m__obj="mtllib other.mtl\n" + TETRAHEDRON, s__json=meshed("m.obj"))(folder),
                         os.mkfifo(folder / "other.mtl")) and None,
         "$TPM network check s.json", "test_errors: mesh that names an endless file"),
    Case("8", "OBJ that is a pipe without a writer", lambda folder: (files(s__json=meshed("m.obj"))(folder),
                                                                     os.mkfifo(folder / "m.obj")) and None,
         "$TPM network check s.json", "test_errors"),
    Case("8", "HDF5 cut in the middle, for `data check`", lambda folder: (packed(folder), os.truncate(folder / "c.h5", 4096)) and None,
         "$TPM data check c.h5", "test_errors"),
    Case("8", "4294967299 cells of a block", files(s__json={"organ": {"kind": "block", "cells": [4294967299, 3, 3]}}),
         "$TPM network check s.json", "test_errors: cells"),
    Case("8", "`tables --depths 1e300`", files(), "$TPM tables --depths 1e300", "test_errors: depth that overflows"),
    Case("8", "`spectrum` to 1e308 Hz", files(l__json=LAW), '$TPM spectrum l.json --from "1 Hz" --to "1e308 Hz"',
         "test_errors: frequency that overflows"),
    Case("8", "a sweep of 1e12 cells",
         files(s__json={**SWEEP, "axes": [{"parameter": name, "from": low, "to": high, "count": 1_000_000}
                                          for name, low, high in [("depth", "1 mm", "8 mm"), ("spacing", "10 mm", "40 mm")]]}),
         "$TPM sweep s.json -o o.h5", "test_errors"),
    Case("8", "`simulate /dev/zero`", files(), "$TPM simulate /dev/zero -o o.h5", "test_files: Inputs without an end"),
    Case("9", "control characters in a title", files(s__json={**LIVER, "title": "\x1b[31mred"}),
         "$TPM network check s.json > said", "test_files: Control characters",
         lambda folder: "**they reach the terminal**" if "\x1b[31m" in (folder / "said").read_text() else "escaped"),
    Case("9", "a message about a name with a line break", files(), "$TPM network check \"$(printf 'no\\nfile')\"",
         "test_files: Control characters"),
    Case("9", "an output of mode 600", private_output, "$TPM tables -o t.txt", "test_files: A file that is replaced",
         lambda folder: f"mode {os.stat(folder / 't.txt').st_mode & 0o777:o}"),
    Case("9", "an output that is a symbolic link", linked_output, "$TPM tables -o t.txt",
         "test_files: A file that is replaced",
         lambda folder: "still a link" if (folder / "t.txt").is_symlink() else "**the link is replaced**"),
    Case("9", "an output of 245 bytes of name", files(), "$TPM tables -o " + "n" * 245, "test_files: Names up to"),
    Case("9", "a seed of 2^63", files(organ__json={"organ": {"kind": "liver", "count": 60, "seed": 2**63}}),
         "$TPM network check organ.json", "test_errors: seeds"),
    Case("9", "a polygon of 600,000 corners", polygon, "$TPM network check s.json", "test_mesh"),
]


def limits() -> None:
    import resource
    resource.setrlimit(resource.RLIMIT_AS, (BYTES * 1000, BYTES * 1000))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    os.setsid()


def answer(case: Case, tpm: Path, fault: Path) -> str:
    with tempfile.TemporaryDirectory(prefix="tpm-answer-") as name:
        folder = Path(name)
        case.make(folder)
        begun = time.monotonic()
        process = subprocess.Popen(["sh", "-c", case.line], cwd=folder, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                   stderr=subprocess.PIPE, preexec_fn=limits,
                                   env={**os.environ, "TPM": str(tpm), "FAULT": str(fault), "PYTHON": sys.executable,
                                        "TPMKIT_SHARE": str(tpm.parents[2])})
        try:
            _, said = process.communicate(timeout=SECONDS if "<<" not in case.line else 40 * SECONDS)
            code = process.returncode
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.communicate()
            said, code = b"", None
        took = time.monotonic() - begun
        lines = [line for line in said.decode(errors="replace").replace(name, "").splitlines() if line.strip()]
        if code is None:
            parts = [f"**still running after {SECONDS} s**"]
        elif code < 0 or code > 128:
            number = -code if code < 0 else code - 128
            parts = [f"**ended by {signal.Signals(number).name}**"]
        else:
            parts = [f"exit {code}"]
        if lines:
            shown = re.sub(r"[^\x20-\x7e]", "?", lines[0]).replace("|", "/")
            if len(shown) > SHOWN:
                shown = shown[:SHOWN - 1] + "..."
            parts.append(shown if len(lines) == 1 else f"{len(lines)} lines: {shown}")
        if "600,000" in case.what:
            parts.append(f"{took:.0f} s" if took >= 1.5 else "under 2 s")
        if case.look is not None:
            parts.append(case.look(folder))
        return "; ".join(parts)


def main() -> int:
    global TPM_FOR_INPUTS
    description = __doc__.split("\n\n")
    parser = argparse.ArgumentParser(description=description[0], formatter_class=argparse.RawDescriptionHelpFormatter,
                                     epilog="\n\n".join(description[1:]))
    parser.add_argument("old", type=Path)
    parser.add_argument("new", type=Path)
    parser.add_argument("fault", type=Path, help="libfault_at.so")
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--only", help="cases whose text contains this")
    options = parser.parse_args()
    old, new, fault = options.old.resolve(), options.new.resolve(), options.fault.resolve()
    TPM_FOR_INPUTS = str(new)
    os.environ["TPMKIT_SHARE"] = str(new.parents[2])
    lines = ["# Hostile inputs", "",
             "Every row: an input, what version dfed67b answered, what this version answers, and the test that holds it.",
             "Made by `python3 scripts/answer_table.py OLD NEW libfault_at.so -o reports/faults/inputs.md`.", "",
             "| item | input | earlier answer | answer | test |", "| --- | --- | --- | --- | --- |"]
    for case in CASES:
        if options.only and options.only not in case.what:
            continue
        row = f"| {case.item} | {case.what} | {answer(case, old, fault)} | {answer(case, new, fault)} | {case.test} |"
        print(row, file=sys.stderr, flush=True)
        lines.append(row)
    options.output.write_text("\n".join(lines) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
