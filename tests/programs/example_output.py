#!/usr/bin/env python3
"""Runs an example and compares what it prints with what its opening comment says it prints, to the digits printed.

    python3 tests/programs/example_output.py SOURCE PROGRAM [ARGUMENTS]

The comment's line "Prints:" is followed by the output, indented by four. An example has less than 80 lines.
"""
import subprocess
import sys
import tempfile
from itertools import takewhile
from pathlib import Path

MARK, INDENT, MOST_LINES = "// Prints:", "//     ", 79


def promised(lines):
    if MARK not in lines:
        raise SystemExit(f"no line '{MARK}'")
    return [line[len(INDENT):] for line in takewhile(lambda line: line.startswith(INDENT), lines[lines.index(MARK) + 1:])]


def main():
    source, *command = sys.argv[1:]
    lines = Path(source).read_text(encoding="utf-8").splitlines()
    with tempfile.TemporaryDirectory() as folder:
        run = subprocess.run([Path(command[0]).absolute(), *command[1:]], cwd=folder, capture_output=True, text=True,
                             check=False)
    printed = run.stdout.splitlines()
    faults = []
    if len(lines) > MOST_LINES:
        faults.append(f"{len(lines)} lines, at most {MOST_LINES}")
    if run.returncode != 0:
        faults.append(f"ended with {run.returncode}: {run.stderr}")
    if not printed or printed != promised(lines):
        faults.append("prints\n" + "\n".join(INDENT + line for line in printed))
    for fault in faults:
        print(f"{source}: {fault}")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
