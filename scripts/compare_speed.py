#!/usr/bin/env python3
"""Compares two tpm programs by processor time, in alternation; see compare_speed.sh.

Each round runs every piece of work with A and then with B, so that what slows the machine down for a while
slows both. A piece of work is slower if the median over the rounds of B's time over A's is above 1.10.
Exit 0: nothing is slower; 1: something is, and it is named.
"""
import argparse
import csv
import json
import pathlib
import resource
import statistics
import subprocess
import sys
import tempfile

REGRESSION = 1.10

# Whole commands that every version knows; {out} is a name in a folder that is removed, new in every run.
COMMANDS = {
    "simulate liver_indentation": ["simulate", "{configs}/liver_indentation.json", "-o", "{out}.h5"],
    "simulate liver_poke": ["simulate", "{configs}/liver_poke.json", "-o", "{out}.h5"],
    "import 200,000 readings": ["data", "import", "{tmp}/readings.csv", "-o", "{out}"],
    "sweep 200,000 cells": ["sweep", "{tmp}/grid.json", "-o", "{out}"],
    "sweep x_depth": ["sweep", "{configs}/sweep_x_depth.json", "-o", "{out}"],
    "sweep organ": ["sweep", "{configs}/sweep_organ.json", "-o", "{out}"],
    "sweep creep_work": ["sweep", "{configs}/sweep_creep_work.json", "-o", "{out}"],
    "fit liver_relaxation": ["fit", "{configs}/liver_relaxation.json"],
    "network check liver_scene": ["network", "check", "{configs}/liver_scene.json"],
    "plan deep": ["plan", "{configs}/plan/deep.json"],
    "laws": ["laws"],
}


# Of the closed form over two axes.
GRID = {"title": "spacing by depth", "model": "single_contact",
        "material": {"E1": "12 kPa", "E2": "12 kPa", "Eprime": "12 kPa", "eta1": "5 Pa s", "A0": "12.56 mm^2",
                     "l0": "1 mm"},
        "indentation": {"kind": "step_hold"},
        "axes": [{"parameter": "depth", "from": "1 mm", "to": "8 mm", "count": 400},
                 {"parameter": "spacing", "from": "20 mm", "to": "35 mm", "count": 500}],
        "outputs": ["lambda1", "peak_force", "end_force"]}


def write_inputs(folder):
    """readings.csv, a ramp of 20 s and a hold of 180 s read every millisecond; grid.json."""
    with open(pathlib.Path(folder, "readings.csv"), "w", encoding="utf-8") as file:
        file.write("time (s),depth (mm),force (mN)\n")
        for i in range(200_000):
            depth = min(i / 20_000, 1.0) * 4.0
            file.write(f"{i / 1000:.3f},{depth:.5f},{12 * depth + 3 * depth**2 + (i * 7919 % 200 - 100) / 1000:.4f}\n")
    pathlib.Path(folder, "grid.json").write_text(json.dumps(GRID), encoding="utf-8")


def processor_seconds(command):
    """User and system time of a process and its children; None if it fails."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode != 0:
        return None, done.stderr.strip().splitlines()[-1:] or [f"exit {done.returncode}"]
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, None


def benchmark_command(program):
    """The command that records pieces of work: `tpm accuracy benchmark`, and `tpm benchmark` of older programs."""
    moved = subprocess.run([program, "accuracy", "benchmark", "--help"], capture_output=True).returncode == 0
    return [program, "accuracy", "benchmark"] if moved else [program, "benchmark"]


def recorded(program, names, repeats, folder):
    """Ratios to the calibration loop of the named works of `tpm accuracy benchmark --append-to`."""
    file = pathlib.Path(folder, "speed.csv")
    file.unlink(missing_ok=True)
    subprocess.run([*benchmark_command(program), "--append-to", str(file), "--repetitions", str(repeats), *names], check=True,
                   stdout=subprocess.DEVNULL)
    with file.open(newline="") as rows:
        return {row["work"]: float(row["ratio"]) for row in csv.DictReader(rows)}


def works(program):
    """Names of the works that a program can record; empty if it knows no --append-to."""
    done = subprocess.run([*benchmark_command(program), "--append-to", "x.csv", "--list"], capture_output=True, text=True)
    return [line.split()[0] for line in done.stdout.splitlines() if line.strip()] if done.returncode == 0 else []


def measure(programs, configs, rounds, repeats):
    taken = {}   # work -> list of (a, b)
    failed = {}
    common = [w for w in works(programs[0]) if w in set(works(programs[1]))]
    with tempfile.TemporaryDirectory() as folder:
        write_inputs(folder)
        runs = 0
        for _ in range(rounds):
            for name, words in COMMANDS.items():
                pair = []
                for program, config in zip(programs, configs):
                    runs += 1
                    out = pathlib.Path(folder, f"run{runs}")
                    command = [program] + [w.format(configs=config, tmp=folder, out=out) for w in words]
                    seconds, why = processor_seconds(command)
                    if why:
                        failed[name] = why[0]
                    pair.append(seconds)
                if None not in pair:
                    taken.setdefault(name, []).append(pair)
            if common:
                both = [recorded(program, common, repeats, folder) for program in programs]
                for name in common:
                    taken.setdefault(name, []).append([both[0][name], both[1][name]])
    return taken, failed, common


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("a")
    parser.add_argument("b")
    parser.add_argument("--names", nargs=2, default=["A", "B"])
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--repeats", type=int, default=3, help="of each recorded work within a round")
    parser.add_argument("--configs", nargs=2, help="folders of scenes; default: beside each program's sources")
    options = parser.parse_args()
    programs = [options.a, options.b]
    configs = options.configs or [pathlib.Path(p).resolve().parents[2] / "configs" for p in programs]
    taken, failed, common = measure(programs, configs, options.rounds, options.repeats)

    print(f"{'work':<30} {options.names[0]:>12} {options.names[1]:>12} {'B / A':>8}  over {options.rounds} rounds")
    slower = []
    for name, pairs in taken.items():
        ratio = statistics.median(b / a for a, b in pairs)
        a = statistics.median(a for a, _ in pairs)
        b = statistics.median(b for _, b in pairs)
        unit = "loops" if name in common else "s"
        spread = f"{min(b / a for a, b in pairs):.3f} to {max(b / a for a, b in pairs):.3f}"
        mark = "  SLOWER" if ratio > REGRESSION else ""
        print(f"{name:<30} {a:>12.4g} {b:>12.4g} {ratio:>8.3f}  {spread} ({unit}){mark}")
        if ratio > REGRESSION:
            slower.append(name)
    for name, why in failed.items():
        print(f"{name:<30} not compared: {why}")
    if not common:
        print("named pieces of work are not compared: one of the two has no tpm accuracy benchmark --append-to")
    if slower:
        print(f"slower by more than {100 * (REGRESSION - 1):.0f} %: {', '.join(slower)}")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
