#!/usr/bin/env python3
"""Runs the commands of pages and compares what they print with what the page shows.

    page_commands.py ROOT TPM [PAGE ...]

The pages are those of PAGES, or those named. In an indented block a line `$ COMMAND` is run, in a folder of the page's own with the
project's configs beside it; the lines up to the next command have to be printed, in this order: `...` stands for any
lines, and at the end of a line for its rest. `# not run: REASON` behind a command leaves it out. A block "```LANGUAGE NAME"
becomes the file NAME. What a table quotes in its column "message" is printed on this page, or stands in the
sources or in docs/errors.md, which tests write.
"""

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

PAGES = ("docs/which_command.md", "docs/troubleshooting.md", "docs/site/start_recording.md", "docs/site/start_organ.md",
         "docs/site/start_device.md", "docs/site/start_paper.md", "docs/budget.md", "docs/simulate.md")


def files_of(text):
    return re.findall(r"^```\w+ (\S+)\n(.*?)^```", text, re.M | re.S)


def calls_of(text):
    """[(command, lines it prints)]"""
    calls = []
    for block in re.findall(r"(?:^    .*\n|^\n(?=    ))+", re.sub(r"^```.*?^```", "", text, flags=re.M | re.S), re.M):
        own = False  # a block that does not begin with a command shows something else
        for line in (b[4:] for b in block.splitlines() if b.strip()):
            if line.startswith("$ "):
                calls.append((line[2:], []))
                own = True
            elif own:
                calls[-1][1].append(line)
    return calls


def missing_line(shown, printed):
    """The first line that is shown and not printed in its place."""
    at, free = 0, True  # the first line may stand anywhere: a command prints what comes before
    for line in shown:
        if line == "...":
            free = True
            continue
        begins = line[:-3].rstrip() if line.endswith("...") else None
        fits = [i for i in range(at, len(printed))
                if (printed[i].startswith(begins) if begins is not None else printed[i].rstrip() == line.rstrip())]
        if not fits or (not free and fits[0] != at):
            return line
        at, free = fits[0] + 1, False
    return None


def faults_of(root, name, program):
    text = (root / name).read_text(encoding="utf-8")
    printed = []
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "configs").symlink_to(root / "configs")
        for file, content in files_of(text):
            (Path(folder) / file).write_text(content, encoding="utf-8")
        path = os.pathsep.join([str(Path(program).resolve().parent), os.environ["PATH"]])
        calls = calls_of(text)
        if not calls:
            yield f"{name}: no command"
        for command, shown in calls:
            if re.search(r"# not run: \S", command):
                continue
            run = subprocess.run(command, shell=True, cwd=folder, capture_output=True, text=True, check=False, timeout=300,
                                 env={**os.environ, "PATH": path, "MPLBACKEND": "Agg"})
            lines = [line for line in (run.stdout + run.stderr).splitlines() if line.strip()]  # as calls_of()
            printed += lines
            refused = any(line.startswith("tpm: ") for line in shown)
            if (run.returncode != 0) != refused:
                yield f"{name}: {command}: ends with {run.returncode}: {run.stderr.strip()[-300:]}"
            missing = missing_line(shown, lines)
            if missing is not None:
                yield f"{name}: {command}: does not print in its place: {missing}"
    known = "\n".join(printed) + sources_of(root) + (root / "docs/errors.md").read_text(encoding="utf-8")
    for table in re.findall(r"^\| (?:message|cause) \|.*\n(?:\|.*\n)+", text, re.M):
        column = [c.strip() for c in table.splitlines()[0].strip("|").split("|")]
        at = column.index("message") if "message" in column else column.index("how you see it")
        for row in table.splitlines()[2:]:
            for quoted in re.findall(r"`([^`]+)`", row.strip("|").split("|")[at]):
                if not all(part in known for part in re.split(r"'[^']*'|\d[\d.]*", quoted) if part.strip()):
                    yield f"{name}: quotes '{quoted}', which is not printed here and stands in no source"


def sources_of(root):
    """All texts of src and apps; pieces of a literal that goes over lines are joined."""
    text = "".join(f.read_text(encoding="utf-8") for folder in ("src", "apps") for f in sorted((root / folder).rglob("*.[ch]pp")))
    return re.sub(r'"\s*\n\s*"', "", text)


def main():
    root, program = Path(sys.argv[1]).resolve(), sys.argv[2]
    faults = [fault for name in sys.argv[3:] or PAGES for fault in faults_of(root, name, program)]
    for fault in faults:
        print(fault)
    print(f"{len(faults)} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
