#!/usr/bin/env python3
"""Runs every example that a help text shows, at all levels, in a folder with files of the names that it uses.

    help_examples.py ROOT TPM [--seconds N] [--only COMMAND] [--times]

An example may end with 0 or 1; with 5 if it asks for a device that the machine does not have. A process that takes more
than N seconds of the processor (default 1) is stopped and its example listed: the command line was understood, the end
was not seen. The processor's time decides, so a busy machine stops no others. Later examples of that command may then
miss a file (exit code 3) or meet half of one (2, with --overwrite), which is no fault. LEFT_OUT are those that need
something of the reader's own.
"""

import argparse
import os
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts"))
from command_help import commands  # noqa: E402
from fault_table import recording  # noqa: E402

DEVICES = ("--device omega7", "--device inverse3")
LEFT_OUT = {"tpm hil devices --plugin ./my_device.so": "a library of the reader's",
            "tpm hil serve configs/hil_omega7.json": "serves until Ctrl-C",
            "tpm accuracy benchmark --append-to speed.csv --commit $(git rev-parse --short HEAD)": "a checkout of git"}
PREPARED = """
tpm example recording
tpm fit recording.csv --laws linear-1 --starts 2 --folder fitted
tpm fit recording.csv --laws linear-fzener --starts 2 --folder fractional
tpm material fitted/law.json configs/liver_scene.json recording.csv --folder on_liver
tpm hil run configs/hil_omega7.json -o session.tpmrec
"""
COPIES = {"recording.csv": ("meat.csv", "slow.csv", "fast.csv", "liver.csv", "export.csv", "mine/one.csv",
                            "folder_of_recordings/a.csv", "folder_of_recordings/b.csv", "healthy/a.csv", "healthy/b.csv",
                            "healthy/c.csv", "fibrotic/a.csv", "fibrotic/b.csv", "fibrotic/c.csv"),
          "fitted/law.json": ("law.json",), "fractional/law.json": ("fractional.json",),
          "configs/hil_omega7.json": ("session.json",), "configs/devices/inverse3.json": ("inverse.json",)}
FIXTURES = {"tests/fixtures/wpd_project_v3.json": "fig7.json", "tests/fuzz/corpus/jpk/shared.jpk-force": "cell.jpk-force",
            "data/paper_claims.json": "my_claims.json"}
READ_SESSION = ("tpm hil verify", "tpm hil report", "tpm hil export")  # others write session.tpmrec
# Run before an example: files that an earlier one would have written with a device, or another command.
BEFORE = {"tpm hil run configs/hil_omega7.json --device omega7 --device-file device.json":
          "tpm hil identify --device virtual --duration '5 s' -o device.json && sed -i 's/\"virtual\"/\"omega7\"/' device.json",
          "tpm sweep show sweep.h5": "tpm sweep configs/sweep_x_depth_100.json -o sweep.h5"}
WALL_S = 1200  # a process that waits for ever ends then, which is a fault


def examples(program):
    """[(line, command)] of all help texts, continued lines joined."""
    found = []
    for command in commands(program):
        joined = ""
        for line in command.footer:
            joined = (joined.rstrip("\\") + line.strip()) if joined else line.strip()
            if joined.endswith("\\"):
                continue
            if joined.startswith("tpm "):
                found.append((joined, " ".join(["tpm", *command.words])))
            joined = ""
    return found


def run(line, folder, environment, seconds):
    """(exit code, what went to stderr, seconds of the processor); the code is None if it was stopped."""
    limit = f"ulimit -t {max(1, round(seconds))}; " if seconds else ""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    process = subprocess.Popen(limit + line, shell=True, cwd=folder, env=environment, stdin=subprocess.DEVNULL,
                               stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, start_new_session=True)
    try:
        said = process.communicate(timeout=WALL_S)[1]
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
        return -1, f"has not ended after {WALL_S} s", 0.0
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    took = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    stopped = process.returncode in (-signal.SIGXCPU, 128 + signal.SIGXCPU, -signal.SIGKILL, 128 + signal.SIGKILL)
    stopped = stopped or "ended with status 137" in said or "ended with status 152" in said  # its drawing script was
    return None if stopped else process.returncode, said, took


def prepare(folder, environment):
    """The files that examples read."""
    for name in ("configs", "data"):
        (folder / name).symlink_to(ROOT / name)
    for line in PREPARED.strip().splitlines():
        code, said, _ = run(line, folder, environment, None)
        if code != 0:
            raise SystemExit(f"{line}: ended with {code}: {said}")
    for source, names in COPIES.items():
        for name in names:
            (folder / name).parent.mkdir(exist_ok=True)
            shutil.copy(folder / source, folder / name)
    for name in COPIES["recording.csv"]:  # each another specimen: by one sample fewer
        lines = (folder / name).read_text(encoding="utf-8").splitlines(keepends=True)
        (folder / name).write_text("".join(lines[: -1 - COPIES["recording.csv"].index(name)]), encoding="utf-8")
    for source, name in FIXTURES.items():
        shutil.copy(ROOT / source, folder / name)
    (folder / "other.csv").write_text(recording(), encoding="utf-8")  # a copy of recording.csv is refused


def fault_of(line, code, said, stopped):
    """What is wrong with the end of an example; empty if nothing. `stopped`: one before it did not get to its end."""
    if code in (None, 0, 1) or (code == 5 and any(device in line for device in DEVICES)):
        return ""
    missing = re.search(r"no such file|\.tpmrec|\.h5", said)
    if stopped and ((code == 3 and missing) or (code == 2 and said.strip().endswith("--overwrite"))):
        return ""
    return f"ended with {code}: {said.strip().splitlines()[-1] if said.strip() else ''}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("root")
    parser.add_argument("tpm")
    parser.add_argument("--seconds", type=int, default=1, help="of the processor, a process")
    parser.add_argument("--only", default="", help="only those of commands that contain this")
    parser.add_argument("--times", action="store_true", help="what each took")
    options = parser.parse_args()
    faults, ended, stopped = [], 0, []
    with tempfile.TemporaryDirectory() as scratch:
        prepared = Path(scratch) / "prepared"
        prepared.mkdir()
        (Path(scratch) / "bin").mkdir()
        (Path(scratch) / "bin/tpm").symlink_to(Path(options.tpm).resolve())
        environment = {**os.environ, "PATH": f"{scratch}/bin:{os.environ['PATH']}"}
        prepare(prepared, environment)
        found = examples(options.tpm)
        for line, command in found:
            if line in LEFT_OUT or options.only not in command:
                continue
            folder = Path(scratch) / command.replace(" ", "-")
            if not folder.exists():
                shutil.copytree(prepared, folder, symlinks=True)
                if command not in READ_SESSION:
                    (folder / "session.tpmrec").unlink()
            if line in BEFORE:
                run(BEFORE[line], folder, environment, None)
            cut, fault = command in [c for c, _ in stopped], ""
            # Each command has time of its own: one that is stopped must not hide what is wrong with the next.
            for part in line.split(" && "):
                code, said, took = run(part, folder, environment, options.seconds)
                if options.times:
                    print(f"{took:6.2f} s  {part}")
                fault = fault or fault_of(part, code, said, cut)
                cut = cut or code is None
            if fault:
                faults.append(f"{command} --help: {line}: {fault}")
            elif cut and command not in [c for c, _ in stopped]:
                stopped.append((command, line))
            else:
                ended += 1
    faults += [f"no help text has '{line}'" for line in [*LEFT_OUT, *BEFORE] if line not in [one for one, _ in found]]
    for command, line in stopped:
        print(f"command line only: {line}")
    for fault in faults:
        print(fault)
    print(f"{len(found)} examples: {ended} ended, {len(stopped)} stopped, {len(LEFT_OUT)} left out; {len(faults)} faults")
    return 1 if faults or len(found) < 60 else 0


if __name__ == "__main__":
    sys.exit(main())
