#!/usr/bin/env python3
"""Compares two tpm programs by processor time, in alternation; see compare_speed.sh.

Each round runs every piece of work with A and then with B, so that what slows the machine down for a while
slows both. A piece of work is slower if the median over the rounds of B's time over A's is above 1.10.
Exit 0: nothing is slower; 1: something is, and it is named.
"""
import argparse
import csv
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile

REGRESSION = 1.10

# Whole commands that every version knows; files are written into a folder that is removed.
COMMANDS = {
    "simulate liver_indentation": ["simulate", "{configs}/liver_indentation.json", "-o", "{tmp}/a.h5"],
    "simulate liver_poke": ["simulate", "{configs}/liver_poke.json", "-o", "{tmp}/b.h5"],
    "fit liver_relaxation": ["fit", "{configs}/liver_relaxation.json"],
    "network check liver_scene": ["network", "check", "{configs}/liver_scene.json"],
    "plan deep": ["plan", "{configs}/plan/deep.json"],
    "tables": ["tables"],
}


def processor_seconds(command):
    """User and system time of a process and its children; None if it fails."""
    before = os.times()
    done = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    after = os.times()
    if done.returncode != 0:
        return None, done.stderr.strip().splitlines()[-1:] or [f"exit {done.returncode}"]
    return (after.children_user + after.children_system
            - before.children_user - before.children_system), None


def recorded(program, names, repeats, folder):
    """Ratios to the calibration loop of the named works of `tpm benchmark --record`."""
    file = pathlib.Path(folder, "speed.csv")
    file.unlink(missing_ok=True)
    subprocess.run([program, "benchmark", "--record", str(file), "--repeats", str(repeats), *names], check=True,
                   stdout=subprocess.DEVNULL)
    with file.open(newline="") as rows:
        return {row["work"]: float(row["ratio"]) for row in csv.DictReader(rows)}


def works(program):
    """Names of the works that a program can record; empty if it knows no --record."""
    done = subprocess.run([program, "benchmark", "--record", "x.csv", "--list"], capture_output=True, text=True)
    return [line.split()[0] for line in done.stdout.splitlines() if line.strip()] if done.returncode == 0 else []


def measure(programs, configs, rounds, repeats):
    taken = {}   # work -> list of (a, b)
    failed = {}
    common = [w for w in works(programs[0]) if w in set(works(programs[1]))]
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(rounds):
            for name, words in COMMANDS.items():
                pair = []
                for program, config in zip(programs, configs):
                    command = [program] + [w.format(configs=config, tmp=folder) for w in words]
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
        print("named pieces of work are not compared: one of the two has no tpm benchmark --record")
    if slower:
        print(f"slower by more than {100 * (REGRESSION - 1):.0f} %: {', '.join(slower)}")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
