#!/usr/bin/env python3
"""Fails the n-th system call of every command that writes, for each kind of call, and makes one table.

    python3 scripts/fault_table.py build/release/tpm build/release/tests/libfault_at.so -o out/faults.md

After each fault the answer has to be one line that begins with "tpm: ", exit code 5 (environment), no file
besides those of an undisturbed run, and each of those either as it was or as an undisturbed run writes it. A
command may also get by without the call; then its files are those of an undisturbed run. Exit code 1 if any
run did otherwise. --first and --spread say how many n are tried: 1 to FIRST, then SPREAD evenly up to the
last call. A command that takes long gets fewer (its weight), unless --all is given. With --keep FILE what is
done is kept there, and the same command goes on from it.
"""
import argparse
import concurrent.futures
import json
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

OLD = b"what was there before\n"

# kind of call, how it fails
FAULTS = [("write", "ENOSPC"), ("write", "short"), ("sync", "EIO"), ("rename", "EIO"), ("open", "EMFILE"),
          ("open_read", "EMFILE"), ("close", "EIO"), ("truncate", "ENOSPC"), ("folder", "ENOSPC"),
          ("thread", "EAGAIN"), ("process", "EAGAIN"), ("memory", "ENOMEM")]

LIVER = {"organ": {"kind": "liver", "count": 60}, "material": {"eta1": "16800 Pa s"}}
INDENTED = {**LIVER, "anchors": [{"kind": "far_side", "fraction": 0.3}],
            "protocol": {"kind": "ramp_hold", "depth": "2 mm", "rate": "4 mm/s", "hold": "0.2 s"},
            "outputs": {"spacing": "0.3 s"}}
SWEEP = {"model": "single_contact", "indentation": {"kind": "step_hold"}, "block": 2,
         "axes": [{"parameter": "depth", "values": ["2 mm", "4 mm", "6 mm"]},
                  {"parameter": "spacing", "values": ["20 mm", "30 mm"]}],
         "outputs": ["peak_force", "end_force"]}
SESSION = {"model": {"kind": "condensed", "scene": {**LIVER, "anchors": [{"kind": "far_side", "fraction": 0.3}]}},
           "indentations": {"depths": ["1 mm"], "rates": ["8 mm/s"], "hold": "0.1 s", "rest": "0.1 s"}}
LAW = {"law": "linear-1", "drive": "indentation_depth", "response": "contact_force", "reference_m": 0.001,
       "provenance": "assumed", "parameters": {"k_inf_N_per_m": 20.0, "k1_N_per_m": 30.0, "tau1_s": 1.5}}
DESIGN = {"title": "t", "law": {"name": "linear-1", "reference": "1 mm"},
          "parameters": {"k_inf": {"start": "100 N/m", "lower": "1 N/m", "upper": "1000 N/m"},
                         "k1": {"start": "100 N/m", "lower": "1 N/m", "upper": "1000 N/m"},
                         "tau1": {"start": "2 s", "lower": "0.1 s", "upper": "100 s"}},
          "noise": {"force": {"absolute": "0.01 N"}},
          "candidates": [{"kind": "ramp_hold", "rate": ["4 mm/s"], "depth": ["8 mm"], "hold": ["9 s"],
                          "interval": ["1 s"]}]}
EXPERIMENTS = {"title": "t", "tissues": [{"name": "star"}],
               "parameters": {"E": {"start": "12 kPa", "lower": "1 kPa", "upper": "100 kPa", "scale": "log",
                                    "sets": ["E1", "E2", "Eprime"]}},
               "fixed": {"A0": "12.56 mm^2", "l0": "1 mm", "eta1": "1e5 Pa s", "spacing": "30 mm"},
               "data": {"static": {"dataset": "evren_static", "protocol": {"kind": "static"},
                                   "noise": {"kind": "relative_to_datum", "relative": 0.1}}},
               "fits": {"static": ["static"]}, "starts": {"count": 2, "seed": 0}, "profile": {"level": 0.95},
               "materials": [{"name": "E free", "fit": "static"}],
               "conditions": {"static": {"depth": "8 mm", "readings": ["4 mm", "8 mm"]}}}


def recording(stiffer: float = 1.0) -> str:
    rows = ["time [s],depth [mm],force [N]"]
    for i in range(60):
        depth = min(0.2 * i, 3.0)
        relaxed = 0.05 * depth * (1.0 + 0.6 * 2.718 ** (-max(0.0, 0.1 * i - 1.5) / 1.2))
        rows.append(f"{0.1 * i:.2f},{depth:.3f},{stiffer * relaxed + 0.001 * ((i * 7919) % 5 - 2):.5f}")
    return "\n".join(rows) + "\n"


@dataclass
class Command:
    """One line of the table. `varies`: files that differ from run to run; `kept`: files that a command
    which goes on after a stop leaves; `weight`: how many times fewer n are tried."""
    name: str
    arguments: list
    outputs: list
    varies: list = field(default_factory=list)
    kept: list = field(default_factory=list)
    weight: int = 1
    old: bool = True  # files of that name are there before
    code: int = 0


COMMANDS = [
    Command("network build", "network build in/liver.json -o net.h5", ["net.h5", "net.xdmf"]),
    Command("network show", "network show in/liver.json -o net", ["net.png", "net.svg"], weight=20),
    Command("simulate", "simulate in/indented.json -o sim.h5", ["sim.h5", "sim.xdmf"],
            kept=["sim.h5.checkpoint", "sim.checkpoint"], weight=4),
    Command("sweep", "sweep in/sweep.json -o sweep.h5 --workers 1", ["sweep.h5", "sweep.csv", "sweep.run.json"],
            varies=["sweep.run.json"], kept=["sweep.h5.blocks"]),
    Command("paper tables", "paper tables -o tables.txt", ["tables.txt"]),
    Command("paper tables, to the terminal", "paper tables", []),
    Command("paper audit", "paper audit -o audit.txt", ["audit.txt"]),
    Command("fit FILE", "fit in/fit.json --starts 2 -o fit.txt", ["fit.txt"], weight=4),
    Command("fit RECORDING", "fit in/folder/a1.csv --laws linear-1 --starts 2 --no-draw -o fit.txt", ["fit.txt"],
            weight=4),
    Command("fit FOLDER", "fit in/folder --laws linear-1 --starts 2 --no-draw -o fit.txt", ["fit.txt"], weight=4),
    Command("fit --verbose", "fit in/folder/a1.csv --laws linear-1 --no-held-out --no-profiles --no-draw --verbose -o fit.txt",
            ["fit.txt"], weight=4),
    Command("data import", "data import in/folder/a1.csv -o c --overwrite", ["c.csv", "c.json"]),
    Command("data pack", "data pack evren_static -o p.h5 --overwrite", ["p.h5"]),
    Command("predict LAW --frequencies", "predict in/law.json --frequencies 1Hz:100Hz:16 -o spectrum.txt", ["spectrum.txt"]),
    Command("export", "export in/law.json --to febio -o law.feb", ["law.feb"]),
    Command("design", "design in/design.json --repetitions 0 -o design.txt", ["design.txt"]),
    Command("design --laws", "design --laws linear-1 --repetitions 1 -o recovery.txt", ["recovery.txt"]),
    Command("predict", "predict in/fitted/law.json in/indented.json -o predict.txt", ["predict.txt"]),
    Command("predict FOLDER", "predict in/fitted/law.json in/folder/a2.csv --folder predicted", [], weight=20),
    Command("identify", "identify in/folder/a1.csv --laws linear-1 --format json -o identify.json",
            ["identify.json", "identify.csv"]),
    Command("material", "material in/fitted/law.json in/indented.json -o material.json", ["material.json"], weight=4),
    Command("budget", "budget in/fitted/law.json in/folder/a1.csv --draws 100 --format json -o budget.json",
            ["budget.json", "budget.csv"]),
    Command("view", "view in/s.tpmrec -o view.html", ["view.html"], weight=4),
    Command("design CONFIG", "design in/fit.json --repetitions 10 --format json -o coverage.json", ["coverage.json", "coverage.csv"]),
    Command("paper experiments", "paper experiments in/experiments.json --folder experiments", [],
            varies=["experiments/report.run.json"], weight=50),
    Command("plan", "plan in/indented.json --costs nominal --brief", [], weight=20),
    Command("plan, to a file", "plan in/indented.json --costs nominal --format json -o plan.json",
            ["plan.json", "plan.csv"], weight=20),
    Command("benchmark", "accuracy benchmark bond_paper --no-timing --folder bench", [], varies=["bench/report.run.json"],
            kept=["bench/benchmark.part.json"], weight=50),
    Command("hil run", "hil run in/session.json -o s.tpmrec --overwrite", ["s.tpmrec"], varies=["s.tpmrec"],  # ends early where the disk is full
            weight=4),
    Command("hil export", "hil export in/s.tpmrec -o s.h5", ["s.h5"]),
    Command("paper report", "paper report --folder paper", [], varies=["paper/report.run.json"], weight=100),
    Command("stability", "accuracy stability --points 2 --only maps --folder stability", [], varies=["stability/report.run.json"],
            weight=20),
]


def write_inputs(tpm: Path, folder: Path) -> None:
    (folder / "folder").mkdir(parents=True)
    for name, content in [("liver", LIVER), ("indented", INDENTED), ("sweep", SWEEP), ("session", SESSION),
                          ("law", LAW), ("design", DESIGN), ("experiments", EXPERIMENTS)]:
        (folder / f"{name}.json").write_text(json.dumps(content))
    (folder / "fit.json").write_text(json.dumps({
        "title": "t", "parameters": {"E": {"start": "12 kPa", "lower": "1 kPa", "upper": "100 kPa",
                                           "sets": ["E1", "E2"]}},
        "data": [{"dataset": "c.csv", "protocol": {"kind": "ramp_hold", "rate": "4 mm/s"},
                  "noise": {"kind": "relative_to_datum", "relative": 0.1}}]}))
    (folder / "c.json").write_text(json.dumps({
        "id": "c", "title": "t", "kind": "points", "observable": "contact_force", "time_origin": "end_of_ramp",
        "columns": {"depth_mm": {"quantity": "indentation_depth", "unit": "mm"},
                    "time_s": {"quantity": "time", "unit": "s"},
                    "force_N": {"quantity": "contact_force", "unit": "N"}}}))
    (folder / "c.csv").write_text("depth_mm,time_s,force_N,provenance\n2,0,0.32,table\n2,30,0.21,table\n")
    for name, stiffer in [("a1.csv", 1.0), ("a2.csv", 1.1)]:
        (folder / "folder" / name).write_text(recording(stiffer))
    subprocess.run([tpm, "hil", "run", folder / "session.json", "-o", folder / "s.tpmrec"], check=True,
                   capture_output=True)
    subprocess.run([tpm, "fit", folder / "folder" / "a1.csv", "--laws", "linear-1", "--starts", "2",
                    "--folder", folder / "fitted"], check=True, capture_output=True)


def files_in(folder: Path) -> dict:
    return {str(path.relative_to(folder)): path.read_bytes()
            for path in sorted(folder.rglob("*")) if path.is_file() and "in" not in path.relative_to(folder).parts[:1]}


@dataclass
class Run:
    code: int
    said: str
    files: dict
    fired: str
    calls: int


def run(tpm: Path, preload: Path, inputs: Path, command: Command, call: str, how: str, at: int) -> Run:
    with tempfile.TemporaryDirectory(prefix="tpm-fault-") as name:
        folder = Path(name) / "work"
        folder.mkdir()
        (folder / "in").symlink_to(inputs)
        for output in command.outputs if command.old else []:
            (folder / output).write_bytes(OLD)
        mark = Path(name) / "mark"
        environment = {**os.environ, "LD_PRELOAD": str(preload), "TPM_FAULT_CALL": call, "TPM_FAULT_HOW": how,
                       "TPM_FAULT_AT": str(at), "TPM_FAULT_PROGRAM": tpm.name, "TPM_FAULT_MARK": str(mark),
                       "XDG_CACHE_HOME": str(Path(name) / "cache")}
        try:
            done = subprocess.run([tpm, *command.arguments.split()], cwd=folder, env=environment,
                                  stdin=subprocess.DEVNULL, capture_output=True, timeout=1200)
            code, said = done.returncode, done.stderr.decode(errors="replace")
        except subprocess.TimeoutExpired:
            code, said = 1000, "no end within 1200 s"
        lines = mark.read_text().rstrip("\0").splitlines() if mark.exists() else []
        fired = next((line for line in lines if line.startswith("fired ")), "")
        calls = max((int(line.split()[1]) for line in lines if line.startswith("calls ")), default=0)
        return Run(code, said, files_in(folder), fired, calls)


def faults_of(command: Command, result: Run, plain: Run) -> list:
    """What a run did that it must not do."""
    if not result.fired:
        return []
    found = []
    if result.code not in (0, command.code):
        # What was assumed is no error: it is said beside the answer, before the last things are freed.
        lines = [line for line in result.said.split("\n") if line.startswith("tpm: ") and not line.startswith("tpm: assumed: ")]
        if result.code != 5:
            found.append(f"exit code {result.code}" if result.code >= 0 else f"signal {-result.code}")
        if len(lines) != 1 or "internal error" in result.said:
            found.append(f"{len(lines)} lines" if "internal" not in result.said else "internal error")
    for name, content in result.files.items():
        if name not in plain.files and name not in command.kept:
            found.append(f"left over: {name}")
        elif name in plain.files and name not in command.varies and content not in (plain.files[name], OLD):
            found.append(f"not whole: {name}")
        elif result.code in (0, command.code) and name not in command.varies and content != plain.files.get(name):
            found.append(f"not written: {name}")
    return found


def numbers(calls: int, first: int, spread: int, weight: int) -> list:
    first, spread = max(4, first // weight), max(2, spread // weight)
    chosen = set(range(1, min(calls, first) + 1))
    if calls > first:
        chosen |= {first + 1 + (calls - first - 1) * i // max(1, spread - 1) for i in range(spread)}
    return sorted(chosen)


def arguments_of(description: str) -> argparse.ArgumentParser:
    """What both tables are asked for with."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tpm", type=Path)
    parser.add_argument("preload", type=Path)
    parser.add_argument("--first", type=int, default=300)
    parser.add_argument("--spread", type=int, default=100)
    parser.add_argument("--only", help="commands whose name begins so, separated by commas")
    parser.add_argument("--heaviest", type=int, default=1000, help="leave out commands of a larger weight")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("-o", "--output", type=Path)
    return parser


def kept_rows(file: Path | None) -> dict:
    """Rows of an earlier run, by command, call and fault."""
    lines = file.read_text().splitlines() if file and file.exists() else []
    return {tuple(done["row"][:3]): done for done in map(json.loads, lines)}


def is_wanted(command: Command, options: argparse.Namespace) -> bool:
    only = tuple(options.only.split(",")) if options.only else ("",)
    return command.name.startswith(only) and command.weight <= options.heaviest


def main() -> int:
    parser = arguments_of(__doc__)
    parser.add_argument("--calls", help="kinds of calls, separated by commas")
    parser.add_argument("--all", action="store_true", help="as many n of commands that take long")
    parser.add_argument("--keep", type=Path, help="file of rows that are done")
    options = parser.parse_args()
    kept = kept_rows(options.keep)
    tpm, preload = options.tpm.resolve(), options.preload.resolve()
    calls = options.calls.split(",") if options.calls else None
    rows, failures = [], []
    with tempfile.TemporaryDirectory(prefix="tpm-faults-") as work, \
            concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        inputs = Path(work) / "in"
        write_inputs(tpm, inputs)
        for command in COMMANDS:
            if not is_wanted(command, options):
                continue
            for call, how in FAULTS:
                if calls and call not in calls:
                    continue
                if (done := kept.get((command.name, call, how))) is not None:
                    rows.append(tuple(done["row"]))
                    failures += done["failures"]
                    continue
                plain = run(tpm, preload, inputs, command, call, how, 0)
                if plain.code != command.code:
                    raise SystemExit(f"fault_table.py: {command.name}: exit code {plain.code} without a fault: "
                                     f"{plain.said.strip()}")
                tried = numbers(plain.calls, options.first, options.spread, 1 if options.all else command.weight)
                results = list(pool.map(lambda n: run(tpm, preload, inputs, command, call, how, n), tried))
                fired = [result for result in results if result.fired]
                wrong = [(n, result, faults) for n, result in zip(tried, results)
                         if (faults := faults_of(command, result, plain))]
                survived = sum(result.code in (0, command.code) for result in fired)
                rows.append((command.name, call, how, plain.calls, len(fired), len(fired) - survived, survived,
                             len(wrong)))
                found = []
                for n, result, faults in wrong:
                    last = result.said.strip().split("\n")[-1][:160]
                    found.append(f"{command.name}: {call} {n} ({how}; {result.fired}): {', '.join(faults)}: {last}")
                    print(found[-1], file=sys.stderr)
                failures += found
                if options.keep:
                    with options.keep.open("a") as file:
                        file.write(json.dumps({"row": rows[-1], "failures": found}) + "\n")
                print(*rows[-1], sep="\t", flush=True)
    arguments = [a for a in sys.argv[1:] if a != "--keep" and a != str(options.keep)]
    text = (f"`python3 scripts/fault_table.py {' '.join(arguments)}`\n\n# Faults of the system, one at a time\n\n"
            "Every row: a command, the call that fails and how; calls in an undisturbed run, runs with a fault, how many\n"
            "ended in one line with exit code 5, how many got by with the same files, how many did otherwise.\n\n"
            "| command | call | fault | calls | runs | ended in one line | got by | otherwise |\n"
            "| --- | --- | --- | --- | --- | --- | --- | --- |\n")
    text += "".join("| " + " | ".join(str(cell) for cell in row) + " |\n" for row in rows if row[3] > 0)
    text += f"\n{sum(row[4] for row in rows)} runs, {len(failures)} otherwise.\n"
    if failures:
        text += "\n" + "".join(f"- {line}\n" for line in failures)
    if options.output:
        options.output.parent.mkdir(parents=True, exist_ok=True)
        options.output.write_text(text)
    print(f"{sum(row[4] for row in rows)} runs, {len(failures)} otherwise")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
