#!/usr/bin/env python3
"""Runs the commands of pages and compares what they print with what the page shows.

    page_commands.py ROOT TPM [PAGE ...]    runs the commands of docs, docs/site and README.md, or of the pages named
    page_commands.py ROOT marked            each command of these pages, and of the other pages outside of reports, is one that
                                            is run, or is marked (runs nothing)

In an indented block a line `$ COMMAND` is run, in a folder of the page's own with the project's configs beside it; the
lines up to the next command have to be printed, in this order: `...` stands for any lines, and at the end of a line for
its rest. `# not run: REASON` behind a command leaves it out; `<!-- not run: REASON -->` above a block leaves out the
block. A block "```LANGUAGE NAME" becomes the file NAME. What a table quotes in its column "message" is printed on this
page, or stands in the sources or in docs/errors.md, which tests write.
"""

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

CALL = re.compile(r"(?:time |sudo |nice |env |[A-Z_]+=\S+ )*(?:tpm|scripts/\S+|build/\S+|ENV/\S+|\./[\w/-]+(?:\.\w+)?|python3?|pip3?|cmake|ctest|ninja|make|cc|gcc|g\+\+|git|"
                  r"patch|apt|apt-get|docker|podman|spack|conda|rattler-build|sbatch|srun|mpirun|snakemake|curl|wget|chromium|export)(?: |$)")
# Pages whose commands are marked or absent; nothing is run here. Those of reports: documentation.py.
NOT_OF_DOCS = ["CONTRIBUTING.md", "CHANGELOG.md", "SECURITY.md", "paper/paper.md", "tests/fixtures/README.md"]
NOT_RUN = re.compile(r"<!-- not run: \S.*-->\s*\Z")


def pages_of(root):
    return [str(page.relative_to(root)) for page in [root / "README.md", *sorted((root / "docs").glob("*.md")),
                                                      *sorted((root / "docs/site").glob("*.md"))]]


def files_of(text):
    return re.findall(r"^```\w+ (\S+)\n(.*?)^```", text, re.M | re.S)


def blocks_of(text):
    """[(lines of an indented block, is it marked as not run)]"""
    text = re.sub(r"^```.*?^```", "", text, flags=re.M | re.S)
    for match in re.finditer(r"(?:^    .*\n|^\n(?=    ))+", text, re.M):
        yield [line[4:] for line in match[0].splitlines() if line.strip()], bool(NOT_RUN.search(text[: match.start()]))


def calls_of(text):
    """[(command, lines it prints)]"""
    calls = []
    for lines, left_out in blocks_of(text):
        own = False  # a block that does not begin with a command shows something else
        for line in lines:
            if line.startswith("$ "):
                own = not left_out
                if own:
                    calls.append((line[2:], []))
            elif own:
                calls[-1][1].append(line)
    return calls


def unmarked(name, text):
    for lines, left_out in blocks_of(text):
        for line in lines:
            if CALL.match(line) and not left_out:
                yield f"{name}: {line}: is not run; expected '$ ' before it, or <!-- not run: REASON --> above"
    prose = list(text)
    for match in re.finditer(r"^( *)```([^\n]*)\n(.*?)^\1```", text, re.M | re.S):
        prose[match.start():match.end()] = "\n" * (match.end() - match.start())
        calls = [line.strip() for line in match[3].splitlines() if CALL.match(line.strip().removeprefix("$ "))]
        if (calls or match[2] in ("sh", "bash", "shell", "console")) and not NOT_RUN.search(text[: match.start()]):
            yield f"{name}: a block of a shell is not run ({(calls or [''])[0]}); expected <!-- not run: REASON --> above it"
    for line in re.findall(r"^ {1,3}\$ .*|^\$ .*|^\t+\$ .*", "".join(prose), re.M):
        yield f"{name}: {line.strip()}: is not run; expected an indentation by four blanks"


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
        for command, shown in calls:
            if re.search(r"# not run: \S", command):
                continue
            run = subprocess.run(command, shell=True, cwd=folder, capture_output=True, text=True, check=False, timeout=1200,
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
    if program == "marked":
        faults = [fault for name in [*pages_of(root), *NOT_OF_DOCS]
                  for fault in unmarked(name, (root / name).read_text(encoding="utf-8"))]
        # The check itself: a command without its sign is noticed.
        assert list(unmarked("", "\n    tpm fit a.csv\n")) and not list(unmarked("", "\n    $ tpm fit a.csv\n"))
        assert not list(unmarked("", "\n<!-- not run: why -->\n\n    tpm fit a.csv\n"))
        for escaped in ("    time pip install a\n", "```\n$ tpm fit a.csv\n```\n", "- a list\n\n  $ tpm fit a.csv\n", "  ```text\n  mpirun -n 2 tpm\n  ```\n"):
            assert list(unmarked("", "\n" + escaped)), escaped
        assert not list(unmarked("", "\n```python\nfor i in a:\n    $ no\n```\n"))
    else:
        faults = [fault for name in sys.argv[3:] or pages_of(root) for fault in faults_of(root, name, program)]
    for fault in faults:
        print(fault)
    print(f"{len(faults)} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
