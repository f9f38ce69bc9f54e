#!/usr/bin/env python3
"""Gives the same hostile inputs to two versions of the program and makes one table of both answers.

    python3 scripts/answer_table.py inputs OLD/build/release/tpm build/release/tpm -o out/inputs.md
    python3 scripts/answer_table.py sessions OLD/build/release/tpm build/release/tpm -o out/sessions.md
    python3 scripts/answer_table.py fits OLD/build/release/tpm build/release/tpm -o out/answers.md

`inputs`: files, names and disks; `sessions`: the haptic loop, on the simulated device and through the stand-in for
the vendor's library: each version's own, but where a case is about the library's strictness the new one's; `fits`:
what fits say (scripts/answer_fits.py).

Each program is build/PRESET/tpm of its own source tree, whose data it uses. Every case runs in a folder of its own,
with 30 s and 4 GB (cases of many runs: 20 minutes). An answer is the exit code (or the signal, or that time was up),
how many lines the message has and its first, and what the case looks at afterwards. Needs numpy and h5py. The last
column names the test that holds the answer.
"""
import argparse
import datetime
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

import answer_fits

SOURCE = Path(__file__).resolve().parent.parent
SECONDS, BYTES = 30, 4_000_000
STAND_IN = "tests/stand_in_dhd/libstand_in_dhd_whole.so"
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


def wrong_depth(folder: Path) -> None:
    import h5py
    packed(folder)
    with h5py.File(folder / "c.h5", "r+") as file:
        file["curves/evren_static/depth"][1] = -1.0


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
                 "design d.json", "hil run d.json -o o.tpmrec", "predict d.json --frequencies 1Hz", "paper audit d.json"]
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
    Case("3", "22 checkpoints with one bit changed", simulation_cut, FLIPS, "test_files: files with a check sum"),
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
    Case("7", "`paper tables > /dev/full`", files(), "$TPM paper tables > /dev/full", "test_streams: Output that cannot be written"),
    Case("7", "`version` with standard error closed", files(), "$TPM version > /dev/null 2>&-",
         "test_streams: Standard error that is closed"),
    Case("7", "a wrong option, with standard error full", files(), "$TPM paper tables --no-such 2> /dev/full",
         "test_streams: Standard error that is closed"),
    Case("8", "40 definitions of claims, each twice the one before", doubling_claims, "$TPM paper audit claims.json",
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
    Case("8", "HDF5 with a depth of -1 m, for `data check`", wrong_depth, "$TPM data check c.h5",
         "test_curve: packed curves are checked"),
    Case("8", "4294967299 cells of a block", files(s__json={"organ": {"kind": "block", "cells": [4294967299, 3, 3]}}),
         "$TPM network check s.json", "test_errors: cells"),
    Case("8", "`paper tables --depths 1e300`", files(), "$TPM paper tables --depths 1e300", "test_errors: depth that overflows"),
    Case("8", "`predict --frequencies` to 1e308 Hz", files(l__json=LAW), '$TPM predict l.json --frequencies "1 Hz : 1e308 Hz : 16"',
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
    Case("9", "an output of mode 600", private_output, "$TPM paper tables -o t.txt", "test_files: A file that is replaced",
         lambda folder: f"mode {os.stat(folder / 't.txt').st_mode & 0o777:o}"),
    Case("9", "an output that is a symbolic link", linked_output, "$TPM paper tables -o t.txt",
         "test_files: A file that is replaced",
         lambda folder: "still a link" if (folder / "t.txt").is_symlink() else "**the link is replaced**"),
    Case("9", "an output of 245 bytes of name", files(), "$TPM paper tables -o " + "n" * 245, "test_files: Names up to"),
    Case("9", "a seed of 2^63", files(organ__json={"organ": {"kind": "liver", "count": 60, "seed": 2**63}}),
         "$TPM network check organ.json", "test_errors: seeds"),
    Case("9", "a polygon of 600,000 corners", polygon, "$TPM network check s.json", "test_mesh"),
]

STAR = {"model": {"kind": "element", "scene": {
            "organ": {"kind": "star", "spacing": "30 mm"},
            "material": {"E1": "12 kPa", "E2": "12 kPa", "Eprime": "12 kPa", "eta1": "2.4e4 Pa s"}}},
        "indentations": {"depths": ["4 mm"], "rates": ["4 mm/s"], "hold": "1 s", "rest": "1 s"}}


def star(limits=None, modulus=None, **more) -> dict:
    session = json.loads(json.dumps({**STAR, **more}))
    if limits:
        session["limits"] = limits
    if modulus:
        session["model"]["scene"]["material"].update(E1=modulus, E2=modulus, Eprime=modulus)
    return session


# 2 mm above the surface, to 4 mm within 1.5 s, held, back.
HAND = "".join(f"place {end} {begin} {to} 0 0 0 0 0 0\n" for end, begin, to in [
    (0.5, -0.002, -0.002), (2.0, -0.002, 0.004), (3.0, 0.004, 0.004), (4.5, 0.004, -0.002), (1e9, -0.002, -0.002)])


def scripted(session: dict, *lines: str) -> Callable:
    """A session, and what the stand-in for the vendor's library is told."""
    def make(folder: Path) -> None:
        files(s__json=session)(folder)
        said = "\n".join(["operator FOLDER/hand", *lines])
        (folder / "script").write_text(said.replace("FOLDER", str(folder)) + "\n")
        (folder / "hand").write_text(HAND)
    return make


def recorded(folder: Path):
    """Columns of the recording, as the program that made it exports them; None if there is none."""
    import h5py
    if not (folder / "r.tpmrec").exists():
        return None
    done = subprocess.run([os.environ["TPM_LOOKED"], "hil", "export", "r.tpmrec", "-o", "looked.h5"], cwd=folder,
                          capture_output=True)
    if done.returncode not in (0, 1) or not (folder / "looked.h5").exists():
        return None
    with h5py.File(folder / "looked.h5") as file:
        return {name: file["rows"][name][()] for name in file["rows"]}


def force_and_motion(folder: Path) -> str:
    import numpy
    rows = recorded(folder)
    if rows is None or len(rows["time_s"]) < 3:
        return "nothing recorded"
    size = numpy.sqrt(sum(rows[f"commanded_{axis}_N"] ** 2 for axis in "xyz"))
    end = rows["tool_depth_m"][-1000:]
    return (f"largest force {size.max():.3g} N, largest jump {numpy.abs(numpy.diff(size[:-1])).max():.3g} N, "
            f"in its last second {1e3 * (end.max() - end.min()):.3g} mm from peak to peak, observer at worst "
            f"{1e3 * rows['observed_J'].min():.3g} mJ")


def lateness(folder: Path) -> str:
    rows = recorded(folder)
    return "nothing recorded" if rows is None or not len(rows["time_s"]) else f"latest {1e3 * rows['woke_late_s'].max():.3g} ms in the recording"


def last_row(folder: Path) -> str:
    rows = recorded(folder)
    if rows is None:
        return "nothing recorded"
    zero = all(float(values[-1]) == 0.0 for name, values in rows.items() if name not in ("stop", "time_s", "gripper_m"))
    return ("**the last row is all zeros**" if zero else "the last row holds what was known last") + (
        "" if "stop" in rows else ", no column of the stop")


def calls_of_library(folder: Path) -> str:
    events = (folder / "events").read_text().split() if (folder / "events").exists() else []
    return "stop calls: " + (", ".join(e for e in events[::2] if e in ("drd_stop", "stop", "forces_off")) or "**none**")


def rows_kept(folder: Path) -> str:
    rows = recorded(folder)
    return "no row is read back" if rows is None else f"{len(rows['time_s'])} rows are read back"


def stalled(command: str) -> str:
    """The command, whose process does not run for 13 ms, a second after its beginning."""
    return ("$TPM " + command + " > said & tpm=$!; $PYTHON -c 'import os, signal, sys, time\n"
            "pid = int(sys.argv[1])\ntime.sleep(1.0)\nos.kill(pid, signal.SIGSTOP)\ntime.sleep(0.013)\n"
            "os.kill(pid, signal.SIGCONT)' $tpm; wait $tpm")


def verdict(folder: Path) -> str:
    said = (folder / "said").read_text().splitlines()
    return "; ".join(line for line in said if line.startswith(("verdict", "at most")))


def said_first(folder: Path) -> str:
    said = (folder / "said").read_text().splitlines()
    return next((line for line in said if "missed" in line or "stop" in line), "nothing said")


RUN = "$TPM hil run s.json -o r.tpmrec"
STRICT = "TPM_STAND_IN_SCRIPT=script $TPM hil run s.json -o r.tpmrec --device omega7 --dhd-library $STRICT_STAND_IN "
LIBRARY = "TPM_STAND_IN_SCRIPT=script $TPM hil run s.json -o r.tpmrec --device omega7 --dhd-library $STAND_IN "
VIRTUAL = "--time virtual"
DEEP_SLIDE = {"model": {"kind": "surface", "tool_radius": "10 mm", "scene": {
                  "organ": {"kind": "liver", "count": 424, "layers": 2, "spacing": "20 mm", "seed": 1},
                  "material": {"E1": "12 kPa", "E2": "12 kPa", "Eprime": "12 kPa", "eta1": "2.4e5 Pa s"},
                  "anchors": [{"kind": "far_side", "fraction": 0.3}]}},
              "slides": {"depths": ["30 mm"], "press": "20 mm/s", "direction": [1, 0, 0], "distance": "10 mm",
                         "rate": "10 mm/s", "rest": "0.5 s"}}

SESSIONS = [
    Case("1", "an Omega.7 that is initialised, through the vendor's library",
         scripted(star(), "wait 250", "initialised 1"), STRICT + VIRTUAL, "test_vendor"),
    Case("1", "one that is not, with `--may-move`", scripted(star(), "wait 250", "initialised 0"),
         STRICT + VIRTUAL + " --may-move", "test_vendor: A device that is not initialised"),
    Case("2", "the hand hangs 8 mm below the surface", scripted(star()),
         "echo 'place 1e9 0.008 0.008 0 0 0 0 0 0' > hand; " + LIBRARY + VIRTUAL,
         "test_safety: A hand that rests in the tissue", force_and_motion),
    Case("3", "E1 = E2 = 1e6 kPa", files(s__json=star(modulus="1e6 kPa")), RUN, "test_safety: What would be unstable"),
    Case("3", "the same, accepted (earlier: no such option)", files(s__json=star(modulus="1e6 kPa")),
         RUN + " $ACCEPT", "test_safety: What is unstable and accepted", force_and_motion),
    Case("3", "5 periods of delay at 300 kPa, accepted",
         files(s__json=star(modulus="300 kPa", virtual_device={"delay_periods": 5})), RUN + " $ACCEPT",
         "test_safety: What is unstable and accepted", force_and_motion),
    Case("3", "50 periods of delay", files(s__json=star(virtual_device={"delay_periods": 50})), RUN,
         "test_safety: What would be unstable", force_and_motion),
    *[Case("4", f"1.4 MPa, two periods of delay, pressed at 0.3 m/s, rise limited to {slew} N/s, accepted",
           files(s__json=star(limits={"slew_N_per_s": slew}, modulus="1.4 MPa", virtual_device={"delay_periods": 2},
                              indentations={"depths": ["8 mm"], "rates": ["300 mm/s"], "hold": "1 s", "rest": "1 s"})),
           RUN + " $ACCEPT", "test_safety: A slip takes energy", force_and_motion) for slew in (2000, 400)],
    Case("5", "a ball 30 mm deep in the organ", files(s__json=DEEP_SLIDE), RUN, "test_safety: A force outside validity",
         force_and_motion),
    Case("6", "damping 1e4 N s/m", files(s__json=star(limits={"damping_N_s_per_m": 1e4})), RUN,
         "test_safety: Limits have ceilings"),
    Case("6", "rise 1e9 N/s", files(s__json=star(limits={"slew_N_per_s": 1e9})), RUN,
         "test_safety: Limits have ceilings"),
    Case("6", "ramp-in 0 s at 3 MPa", files(s__json=star(limits={"ramp_in": "0 s"}, modulus="3 MPa")), RUN,
         "test_safety: Limits have ceilings"),
    Case("6", "a depth of 10 m", files(s__json=star(indentations={"depths": ["10 m"], "rates": ["4 m/s"], "hold": "1 s"})),
         RUN, "test_safety: Limits have ceilings"),
    Case("6", "a surface 0.5 m away", files(s__json=star(surface=["0 m", "0 m", "-0.5 m"])), RUN,
         "test_safety: Limits have ceilings"),
    Case("6", "a session's limit of 3 N, as the device is told",
         scripted(star(limits={"force": "3 N"}), "wait 250", "events FOLDER/events"), LIBRARY + VIRTUAL,
         "test_vendor: The device is told",
         lambda folder: "told " + ", ".join(e[10:] + " mN" for e in ((folder / "events").read_text() if (folder / "events").exists() else "").split()
                                            if e.startswith("max_force")) or "told nothing"),
    Case("7", "Ctrl-C while the device initialises itself",
         scripted(star(), "initialised 0", "init_ms 20000", "events FOLDER/events"),
         "export TPM_STAND_IN_SCRIPT=script; timeout -s INT 2 $TPM hil run s.json -o r.tpmrec --device omega7 --dhd-library $STAND_IN "
         "--may-move; code=$?; test $code = 124 || exit $code; echo 'timeout: it was ended by the signal' >&2", "test_vendor: An initialisation that moves", calls_of_library),
    Case("8", "a stall of 29 ms at 1 kHz",
         scripted(star(limits={"cycle_timeout": "0.5 s"}), "wait 250", "period 0.001", "fault hang 1500 29"), LIBRARY + "--time real",
         "test_servo_threads", lateness),
    Case("9", "`hil check --rate '4 kHz'` on a machine that stands still for 13 ms (52 periods)", files(),
         stalled("hil check --rate '4 kHz' --duration '4 s'"), "test_servo_threads: The jitter check says no", verdict),
    Case("9", "the same stall in a session at 4 kHz, `hil run`", files(s__json=star(rate="4 kHz")),
         stalled("hil run s.json -o r.tpmrec --time real"), "test_servo_threads: The jitter check says no", said_first),
    Case("10", "a session that cannot be prepared, then one that can",
         scripted(star(), "wait 250", "initialised 0"),
         LIBRARY + VIRTUAL + " 2> first; sed -i 's/initialised 0/initialised 1/' script; " + LIBRARY + VIRTUAL,
         "test_vendor: A session that cannot be prepared"),
    Case("10", "the last row of a session that a fault stopped",
         scripted(star(), "wait 250", "fault unplugged 1500 1"), LIBRARY + VIRTUAL, "test_row_log", last_row),
    Case("10", "four corrupted bytes in the middle of a recording", files(s__json=star()),
         RUN + " >/dev/null 2>&1; printf 'XXXX' | dd of=r.tpmrec bs=1 seek=200000 conv=notrunc 2>/dev/null; "
         "$TPM hil export r.tpmrec -o e.h5", "test_row_log", rows_kept),
    Case("10", "a recording cut in the middle", files(s__json=star()),
         RUN + " >/dev/null 2>&1; truncate -s 200000 r.tpmrec; $TPM hil export r.tpmrec -o e.h5", "test_row_log", rows_kept),
    Case("11", "5 s of rest, relaxation time 10 s",
         files(s__json={**STAR, "model": {"kind": "element", "scene": {
             "organ": {"kind": "star", "spacing": "30 mm"},
             "material": {"E1": "12 kPa", "E2": "12 kPa", "Eprime": "12 kPa", "eta1": "2.4e5 Pa s"}}},
             "indentations": {"depths": ["4 mm"], "rates": ["1 mm/s", "4 mm/s"], "hold": "5 s", "rest": "5 s"}}),
         RUN, "test_hil: rests"),
]


def limits() -> None:
    import resource
    resource.setrlimit(resource.RLIMIT_AS, (BYTES * 1000, BYTES * 1000))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    os.setsid()


def answer(case: Case, tpm: Path) -> str:
    with tempfile.TemporaryDirectory(prefix="tpm-answer-") as name:
        folder = Path(name)
        case.make(folder)
        begun = time.monotonic()
        process = subprocess.Popen(["sh", "-c", case.line], cwd=folder, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                   stderr=subprocess.PIPE, preexec_fn=limits,
                                   env={**os.environ, "TPM": str(tpm), "PYTHON": sys.executable, "STAND_IN": str(tpm.parent / STAND_IN),
                                        "TPMKIT_SHARE": str(tpm.parents[2]),
                                        "ACCEPT": "--accept-unstable" if tpm == TPM_FOR_INPUTS_PATH else ""})
        patience = SECONDS if "<<" not in case.line else 40 * SECONDS
        try:
            _, said = process.communicate(timeout=patience)
            code = process.returncode
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.communicate()
            said, code = b"", None
        took = time.monotonic() - begun
        lines = [line for line in said.decode(errors="replace").replace(name, "").replace(str(tpm.parents[2]) + "/", "").splitlines() if line.strip()]
        if code is None:
            parts = [f"**still running after {patience} s**"]
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
            os.environ["TPM_LOOKED"] = str(tpm)
            parts.append(case.look(folder))
        return "; ".join(parts)


def kept_answers(table: Path) -> dict:
    """The earlier answers of a table that this program wrote, by item and input."""
    rows = [line.strip("|").split(" | ") for line in table.read_text().splitlines() if line.startswith("| ")]
    return {(row[0].strip(), row[1].strip()): row[2].strip() for row in rows[2:]}


def main() -> int:
    global TPM_FOR_INPUTS, TPM_FOR_INPUTS_PATH
    description = __doc__.split("\n\n")
    parser = argparse.ArgumentParser(description=description[0], formatter_class=argparse.RawDescriptionHelpFormatter,
                                     epilog="\n\n".join(description[1:]))
    parser.add_argument("cases", choices=["inputs", "sessions", "fits"])
    parser.add_argument("old", type=Path, help="the earlier program, or a table of its answers (.md), which are kept")
    parser.add_argument("new", type=Path)
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--only", help="cases whose text contains this")
    options = parser.parse_args()
    old, new = options.old.resolve(), options.new.resolve()
    kept = kept_answers(old) if old.suffix == ".md" else None
    os.environ["STRICT_STAND_IN"] = str(new.parent / STAND_IN)
    TPM_FOR_INPUTS = str(new)
    TPM_FOR_INPUTS_PATH = new
    os.environ["TPMKIT_SHARE"] = str(new.parents[2])
    title = {"inputs": "Hostile inputs", "sessions": "Sessions that go wrong", "fits": "What fits say"}[options.cases]
    lines = [f"# {title}", "",
             "Every row: an input, what version dfed67b answered, what this version answers, and the test that holds it.",
             f"Made by `python3 scripts/answer_table.py {options.cases} OLD NEW -o {options.output}`.", ""]
    if options.cases == "fits":
        lines += [f"{datetime.date.today()}. {answer_fits.INTRODUCTION}", ""]
    lines += [
             "| item | input | earlier answer | answer | test |", "| --- | --- | --- | --- | --- |"]
    for case in {"inputs": CASES, "sessions": SESSIONS, "fits": answer_fits.cases(Case)}[options.cases]:
        if options.only and options.only not in case.what:
            continue
        before = answer(case, old) if kept is None else kept.get((str(case.item), case.what), "not asked")
        row = f"| {case.item} | {case.what} | {before} | {answer(case, new)} | {case.test} |"
        print(row, file=sys.stderr, flush=True)
        lines.append(row)
    if options.cases == "fits":
        lines += ["", answer_fits.RELATIVES.rstrip()]
    options.output.write_text("\n".join(lines) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
