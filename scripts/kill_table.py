#!/usr/bin/env python3
"""Kills each command at the calls that change a file, runs it again and makes one table.

    python3 scripts/kill_table.py build/release/tpm build/release/tests/libfault_at.so -o out/kills.md

SIGKILL comes at the n-th call that opens a file for writing, writes (before it and half-way), syncs, renames, cuts
or removes: every n to --first, then --spread more. Before the second run, a file of a wanted name is either as it
was before the command or whole; a recording of a session may also end early, and then `tpm hil export` has to read
every whole row of it. The second run (with --overwrite where an early recording stands) has to end as an undisturbed
one does, write the same bytes and leave nothing else behind. Exit code 1 if any
did otherwise.
"""
import concurrent.futures
import json
import os
import shlex
import signal
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from fault_table import OLD, Command, arguments_of, files_in, is_wanted, numbers, write_inputs

COMMANDS = [
    Command("sweep", "sweep in/sweep.json -o sweep.h5 --workers 2", ["sweep.h5", "sweep.csv", "sweep.run.json"],
            varies=["sweep.run.json"]),
    Command("simulate", "simulate in/indented.json -o sim.h5 --checkpoint-every '50 ms'",
            ["sim.h5", "sim.xdmf"], weight=4),
    Command("fit FOLDER", "fit in/folder --laws linear-1 --starts 2 --no-draw -o fit.txt", ["fit.txt"], weight=4),
    Command("hil run", "hil run in/session.json -o s.tpmrec", ["s.tpmrec"], old=False),
    Command("paper report", "paper report --folder paper", [], varies=["paper/report.run.json"], weight=100),
    # Programs of Python: a drawing script, and the module (where it is on PYTHONPATH) that has figures drawn.
    Command("draw_figures.py", "draw_figures.py in/fitted/figures.json . --print", [], weight=4),
    Command("draw_network.py", "draw_network.py in/net.json net", ["net.png", "net.svg"], weight=4),
    Command("Python: fit", "-c \"import tpmkit; tpmkit.fit('in/folder/a1.csv', law='linear-1', starts=2).save('fitted')\"",
            [], weight=4),
    Command("Python: sweep", "-c \"import tpmkit; tpmkit.sweep('in/sweep.json', 'sweep.h5', workers=1)\"",
            ["sweep.h5"], weight=4),
]
SCRIPTS = Path(__file__).resolve().parent
PYTHON = os.environ.get("TPMKIT_PYTHON", "/usr/bin/python3")
RECORDING = ".tpmrec"


def is_python(arguments: list) -> bool:
    return arguments[0] == "-c" or arguments[0].endswith(".py")


def program_name(tpm: Path, command: Command) -> str:
    return Path(PYTHON).name if is_python(shlex.split(command.arguments)) else tpm.name


def drawings_of(command: Command, plain: dict) -> list:
    return list(plain) if shlex.split(command.arguments)[0].endswith(".py") else []


def tpm_in(folder: Path, tpm: Path, arguments: list, **environment) -> subprocess.CompletedProcess:
    """Runs tpm, or Python on a script or a text."""
    program = [tpm, *arguments]
    if is_python(arguments):
        program = [PYTHON, *(arguments if arguments[0] == "-c" else [SCRIPTS / arguments[0], *arguments[1:]])]
        environment = {"PYTHONDONTWRITEBYTECODE": "1", "MPLCONFIGDIR": str(Path(tempfile.gettempdir()) / "tpm-kill-matplotlib"),
                       **environment}
    return subprocess.run(program, cwd=folder, stdin=subprocess.DEVNULL, capture_output=True, timeout=1200,
                          env={**os.environ, "XDG_CACHE_HOME": str(folder.parent / "cache"), **environment})


def rows_in(tpm: Path, content: bytes) -> int:
    """Rows that tpm reads from a recording; -1 if it refuses it."""
    with tempfile.TemporaryDirectory(prefix="tpm-rows-") as name:
        folder = Path(name) / "work"
        folder.mkdir()
        (folder / "r.tpmrec").write_bytes(content)
        done = tpm_in(folder, tpm, ["hil", "export", "r.tpmrec", "-o", "r.h5", "--format", "json"])
        cut_off = 1  # its rows are exported all the same
        return json.loads(done.stdout)["rows"] if done.returncode in (0, cut_off) else -1


def end_of_row(tpm: Path, recording: bytes, row: int) -> int:
    """How much of a recording has to be there for tpm to read so many rows."""
    none, enough = 0, len(recording)
    while enough - none > 1:
        middle = (none + enough) // 2
        if rows_in(tpm, recording[:middle]) >= row:
            enough = middle
        else:
            none = middle
    return enough


@dataclass
class RowPlaces:
    """Where the rows of a recording stand in its file."""
    first: int
    length: int
    count: int

    def whole(self, size: int) -> int:
        return max(0, min(self.count, (size - self.first) // self.length))


def places_in(tpm: Path, recording: bytes) -> RowPlaces:
    one, two = (end_of_row(tpm, recording, row) for row in (1, 2))
    return RowPlaces(2 * one - two, two - one, rows_in(tpm, recording))


def killed(tpm: Path, preload: Path, inputs: Path, command: Command, at: int, plain: dict,
           places: "RowPlaces | None") -> tuple:
    """Whether the signal came, and what went wrong."""
    with tempfile.TemporaryDirectory(prefix="tpm-kill-") as name:
        folder = Path(name) / "work"
        folder.mkdir()
        (folder / "in").symlink_to(inputs)
        for output in command.outputs or drawings_of(command, plain) if command.old else []:
            (folder / output).write_bytes(OLD)
        first = tpm_in(folder, tpm, shlex.split(command.arguments), LD_PRELOAD=str(preload), TPM_FAULT_CALL="change",
                       TPM_FAULT_HOW="kill", TPM_FAULT_AT=str(at), TPM_FAULT_PROGRAM=program_name(tpm, command))
        if first.returncode != -signal.SIGKILL:
            return False, []
        found, again = [], shlex.split(command.arguments)
        for output, content in files_in(folder).items():
            if output not in plain or content == OLD:
                continue
            if output.endswith(RECORDING):
                read = rows_in(tpm, content)
                if not plain[output].startswith(content):
                    found.append(f"{output}: its bytes are not those of an undisturbed run's beginning")
                if read != places.whole(len(content)):
                    found.append(f"{output}: {read} rows are read of {places.whole(len(content))} whole ones")
                again.append("--overwrite")
            elif output not in command.varies and content != plain[output]:
                found.append(f"{output} is not whole after the signal")
        second = tpm_in(folder, tpm, again)
        if second.returncode != command.code:
            found.append(f"second run: exit code {second.returncode}: {second.stderr.decode(errors='replace')[-160:]}")
        files = files_in(folder)
        for output, content in plain.items():
            if output not in command.varies and files.get(output) != content:
                found.append(f"{output} differs from an undisturbed run's")
        found += [f"left over: {output}" for output in files if output not in plain]
        return True, found


def can_run(command: Command) -> bool:
    """The module of Python need not be there."""
    if not shlex.split(command.arguments)[0] == "-c":
        return True
    return subprocess.run([PYTHON, "-c", "import tpmkit"], capture_output=True).returncode == 0


def main() -> int:
    options = arguments_of(__doc__).parse_args()
    tpm, preload = options.tpm.resolve(), options.preload.resolve()
    rows, failures = [], []
    with tempfile.TemporaryDirectory(prefix="tpm-kills-") as work, \
            concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        inputs = Path(work) / "in"
        write_inputs(tpm, inputs)
        subprocess.run([tpm, "network", "show", inputs / "liver.json", "-o", inputs / "net"], check=True, capture_output=True)
        for command in COMMANDS:
            if not is_wanted(command, options) or not can_run(command):
                continue
            folder, mark = Path(work) / command.name.replace(" ", "_") / "work", Path(work) / "mark"
            folder.mkdir(parents=True)
            (folder / "in").symlink_to(inputs)
            mark.unlink(missing_ok=True)
            done = tpm_in(folder, tpm, shlex.split(command.arguments), LD_PRELOAD=str(preload), TPM_FAULT_CALL="change",
                          TPM_FAULT_HOW="kill", TPM_FAULT_AT="0", TPM_FAULT_PROGRAM=program_name(tpm, command), TPM_FAULT_MARK=str(mark))
            if done.returncode != command.code:
                raise SystemExit(f"kill_table.py: {command.name}: exit code {done.returncode} undisturbed: "
                                 f"{done.stderr.decode(errors='replace').strip()}")
            calls = max(int(line.split()[1]) for line in mark.read_text().rstrip("\0").splitlines() if line.startswith("calls "))
            plain = files_in(folder)
            recording = next((content for output, content in plain.items() if output.endswith(RECORDING)), None)
            places = places_in(tpm, recording) if recording else None
            tried = numbers(calls, options.first, options.spread, command.weight)
            results = list(pool.map(lambda n: killed(tpm, preload, inputs, command, n, plain, places), tried))
            wrong = [(n, found) for n, (came, found) in zip(tried, results) if found]
            rows.append((command.name, calls, sum(came for came, _ in results), len(wrong)))
            for n, found in wrong:
                failures.append(f"{command.name}: killed at {n}: {'; '.join(found)}")
                print(failures[-1], file=sys.stderr)
            print(*rows[-1], sep="\t", flush=True)
    text = (f"`python3 scripts/kill_table.py {' '.join(sys.argv[1:])}`\n\n# Killed at every call that changes a file\n\n"
            "Every row: a command, the calls that change a file in an undisturbed run, how many runs were killed at one of\n"
            "them, and after how many of these the second run did not end with the files of an undisturbed run.\n\n"
            "| command | calls | killed | otherwise |\n| --- | --- | --- | --- |\n")
    text += "".join("| " + " | ".join(str(cell) for cell in row) + " |\n" for row in rows)
    text += "".join(f"\n- {line}" for line in failures)
    if options.output:
        options.output.parent.mkdir(parents=True, exist_ok=True)
        options.output.write_text(text)
    print(f"{sum(row[2] for row in rows)} runs, {len(failures)} otherwise")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
