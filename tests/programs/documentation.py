#!/usr/bin/env python3
"""Checks that the pages hold together.

    documentation.py ROOT TPM

- every relative link in a Markdown page leads to a file, and its anchor to a heading;
- every docs/PAGE.md named in a source, a script or a page exists;
- every command of tpm in a page is one, and has the options that stand behind it, in a table or a sentence too;
- every script, configuration, test and example that a page names is there, and every program of the tests that it runs
  is made. The commands of reports are not run: they measure;
- docs/README.md links every page of docs, docs/site and reports, and the site's start lists every page of docs once;
- docs has at most 36 pages beside those of docs/site, and reports at most 16, one in each folder: MOST;
- three questions, as a new user types them, are answered two links from README.md at most: QUESTIONS;
- paper/paper.md shows every figure of paper/figures, cites every entry of paper/paper.bib and nothing else, and names
  only files that exist;
- the groups of `tpm --help` and of docs/commands.md hold the same commands, each once;
- the help of every command ends with an example that calls it, and the manual page of every command has the sections of
  MANUAL and every variable of the environment that the program reads;
- every page of docs, docs/site and reports is at most two steps from the README;
- the excerpt of `tpm fit` in the README is what the program prints of the shipped example, with every warning.
"""

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

# Pages that scripts/make_site.py makes for the site, which checks its links itself (site_pages.py).
MADE = "docs/site/reference/"


# Written by `tpm paper report` beside tables.csv; the page is report.md.
TABLES = "reports/paper/tables.md"
MOST = {"docs": 36, "docs/site": 6, "reports": 16}
# What is typed; a pattern for the link in docs/README.md; one for what stands below the heading that it leads to.
QUESTIONS = {
    "my fit says flat": (r"fit says flat", r"`flat`.*`tpm design`"),
    "which command": (r"Which command", r"`tpm fit recording\.csv`.*`tpm hil run session\.json`"),
    "why is my session refused": (r"session refused", r"tpm hil identify.*--device virtual"),
}


def tracked(root, *suffixes):
    skipped = {"build", "out", ".git", "__pycache__"}
    for folder, inner, names in os.walk(root):
        inner[:] = sorted(d for d in inner if d not in skipped and not d.startswith("build"))
        yield from (Path(folder) / n for n in sorted(names) if n.endswith(suffixes))


def anchors(page):
    """The anchors of a page's headings, as GitHub makes them."""
    found, code = set(), False
    for line in page.read_text(encoding="utf-8").splitlines():
        if line.startswith("```"):
            code = not code
        match = None if code else re.match(r"#+ +(.*)", line)
        if match:
            text = re.sub(r"[^\w\- ]", "", re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", match[1]).lower())
            found.add(text.strip().replace(" ", "-"))
    return found


def broken_links(root):
    for page in tracked(root, ".md"):
        text = page.read_text(encoding="utf-8")
        for target in re.findall(r"\]\(([^)\s]+)\)", text) + re.findall(r'<img src="([^"]+)"', text):
            if re.match(r"[a-z]+:", target):
                continue
            name, _, anchor = target.partition("#")
            file = (page.parent / name).resolve() if name else page
            if file.is_relative_to(root / MADE):
                continue
            if not file.exists():
                yield f"{page.relative_to(root)}: link to {target}: no such file"
            elif anchor and file.suffix == ".md" and anchor not in anchors(file):
                yield f"{page.relative_to(root)}: link to {target}: no such heading"


def lost_pages(root):
    sources = (".md", ".cpp", ".hpp", ".sh", ".py", ".cmake", ".txt", ".json", ".html")
    for file in tracked(root, *sources):
        if file.name == "documentation.py":
            continue
        for name in set(re.findall(r"\bdocs/[\w/]+\.md\b", file.read_text(encoding="utf-8"))):
            if not (root / name).exists() and not name.startswith(MADE):
                yield f"{file.relative_to(root)}: names {name}: no such page"


# A path in a page; `git show COMMIT:configs/OLD.json` is of another day. Words in capitals stand for names.
PATH = re.compile(r"(?<![\w/.:-])(?:scripts|configs|tests|data|schemas|examples|packaging|apps)/[\w./-]*\w")


def lost_files(root):
    for page in tracked(root, ".md"):
        for line in page.read_text(encoding="utf-8").splitlines():
            for name in PATH.findall(line):
                known = (root / name).exists() or next(root.glob(f"{name}*"), None)  # a pattern: tests/ROOM/test_NAME*
                if not known and not re.search(r"NAME|ROOM", name) and "git show" not in line:
                    yield f"{page.relative_to(root)}: names {name}: no such file"


def unlisted_pages(root):
    index = (root / "docs/README.md").read_text(encoding="utf-8")
    for page in sorted((root / "docs").glob("*.md")):
        if page.name != "README.md" and not re.search(rf"\({re.escape(page.name)}[)#]", index):
            yield f"docs/README.md: does not list {page.name}"
    for page in sorted((root / "docs/site").glob("*.md")):
        if not re.search(rf"\(site/{re.escape(page.name)}[)#]", index):
            yield f"docs/README.md: does not list site/{page.name}"
    for page in report_pages(root):
        if not re.search(rf"\(\.\./{re.escape(str(page))}[)#]", index):
            yield f"docs/README.md: does not list {page}"
    start = (root / "docs/site/index.md").read_text(encoding="utf-8").split("## ")[0]
    for page in sorted((root / "docs").glob("*.md")):
        if start.split().count(f"../{page.stem}") != 1:
            yield f"docs/site/index.md: does not list {page.name} once"
    if "../../reports/*/*" not in start.split():
        yield "docs/site/index.md: does not list the pages of reports"


def report_pages(root):
    return [page.relative_to(root) for page in sorted((root / "reports").rglob("*.md")) if page != root / TABLES]


def too_many_pages(root):
    counts = {folder: len(list((root / folder).glob("*.md"))) for folder in ("docs", "docs/site")}
    reports = report_pages(root)
    counts["reports"] = len(reports)
    for folder, count in counts.items():
        if count > MOST[folder]:
            yield f"{folder}: has {count} pages; expected at most {MOST[folder]}: join two that are read together"
    folders = [page.parent for page in reports]
    for folder in sorted({f for f in folders if folders.count(f) > 1}):
        yield f"{folder}: has several pages; expected one a subject"
    for page in reports:
        if len(page.parts) != 3:
            yield f"{page}: expected reports/SUBJECT/PAGE.md"


def unanswered(root):
    if "](docs/README.md)" not in (root / "README.md").read_text(encoding="utf-8"):
        yield "README.md: does not link docs/README.md"
    links = re.findall(r"\[([^]]+)\]\(([^)#\s]+)(?:#([\w-]+))?\)", (root / "docs/README.md").read_text(encoding="utf-8"))
    for question, (words, answer) in QUESTIONS.items():
        target = next((t for t in links if re.search(words, " ".join(t[0].split()))), None)
        if not target:
            yield f"docs/README.md: no link for '{question}'"
            continue
        text = (root / "docs" / target[1]).read_text(encoding="utf-8")
        if target[2]:
            parts = re.split(r"^## +(.*)$", text, flags=re.M)
            heading = {re.sub(r"[^\w\- ]", "", h.lower()).replace(" ", "-"): body for h, body in zip(parts[1::2], parts[2::2])}
            text = heading.get(target[2], "")
        if not re.search(answer, text, re.S):
            yield f"{target[1]}: does not answer '{question}'"


def faults_of_paper(root):
    page = (root / "paper/paper.md").read_text(encoding="utf-8")
    body = re.sub(r"\A---\n.*?\n---\n", "", page, flags=re.S)
    shown = re.findall(r"\]\(figures/([^)\s]+)\)", body)  # that each exists: broken_links()
    for file in sorted((root / "paper/figures").iterdir()):
        if file.name not in shown:
            yield f"paper/figures/{file.name}: not shown in paper.md"
    for name in sorted(set(re.findall(r"`((?:configs|reports|scripts)/[\w./-]+)`", body))):
        if not (root / name).exists():
            yield f"paper/paper.md: names {name}: no such file"
    labels = set(re.findall(r"\\label\{([^}]+)\}", body))
    for label in sorted(labels ^ set(re.findall(r"\\autoref\{([^}]+)\}", body))):
        yield f"paper/paper.md: {label} is not both a label and a reference"
    cited = set(re.findall(r"(?<![\w.])@(\w+)", re.sub(r"`[^`]*`", "", body)))
    entries = re.findall(r"^@\w+\{(\w+),", (root / "paper/paper.bib").read_text(encoding="utf-8"), re.M)
    for key in sorted(cited - set(entries)):
        yield f"paper/paper.md: cites {key}, which is not in paper.bib"
    for key in sorted(set(entries) - cited):
        yield f"paper/paper.bib: {key} is not cited in paper.md"
    for key in sorted({key for key in entries if entries.count(key) > 1}):
        yield f"paper/paper.bib: {key} is there twice"


def differing_groups(root, program):
    text = subprocess.run([program, "--help"], capture_output=True, text=True, check=True).stdout
    shown = {}
    for group, rows in re.findall(r"^(Data|Tissue|Hand|Evidence)\b[^\n]*:\n((?:  .*\n)+)", text, re.M):
        shown[group] = re.findall(r"^  (\S+)", rows, re.M)
    if list(shown) != ["Data", "Tissue", "Hand", "Evidence"]:
        yield f"tpm --help: has the groups {list(shown)}; expected Data, Tissue, Hand, Evidence"
    readme = (root / "docs/commands.md").read_text(encoding="utf-8")
    for group, commands in shown.items():
        row = re.search(rf"^\| \*\*{group}\*\* \|.*$", readme, re.M)
        named = re.findall(r"`tpm ([a-z-]+)`", row[0]) if row else []
        if named != commands:
            yield f"docs/commands.md: group {group} lists {named}; tpm --help lists {commands}"


def without_example(root, program):
    sys.path.insert(0, str(root / "scripts"))
    from command_help import commands

    for command in commands(program):
        call = " ".join(["tpm", *command.words])
        if not any(f"  {call} " in line + " " for line in command.footer):
            yield f"{call} --help: has no example that calls it"


# Pages whose commands are looked at: these and all of docs and reports.
OTHERS = ("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "SECURITY.md", "paper/paper.md")
CALLED = re.compile(r"(?:^\s*(?:\$ )?(?:time )?(?:build/release/)?|`|&& |\| )tpm ([a-z][^`#|&>]*)")


def lines_of(text):
    """The lines of a page, those of prose behind a dot; a command that goes over lines, in backticks or behind a backslash,
    is one."""
    text = re.sub(r" *\\\n *", " ", text)
    parts = re.split(r"(^ *```[^\n]*\n.*?^ *```|(?:^    [^\n]*\n)+|\n\s*\n)", text, flags=re.M | re.S)
    for n, part in enumerate(parts):
        joined = part if n % 2 else re.sub(r"`[^`]+`", lambda match: re.sub(r"\s*\n\s*", " ", match[0]), part)
        yield from (line if n % 2 else f".{line}" for line in joined.splitlines())


def faults_of_calls(name, text, options):
    for line in lines_of(text):
        for call in CALLED.findall(re.sub(r"\$\([^)]*\)", "", line)):
            words, command = call.split(), ()
            while len(words) > len(command) and (*command, words[len(command)]) in options:
                command = (*command, words[len(command)])
            if not command and "completion" not in line:  # an argument of a script
                yield f"{name}: tpm {call.strip()}: no such command"
            for option in re.findall(r"(?<!\S)(--?[A-Za-z][\w-]*)", call) if command else ():
                if option not in options[command]:
                    yield f"{name}: tpm {' '.join(command)} has no option {option}"


def false_commands(root, program):
    from command_help import commands

    options = {tuple(c.words): {name for _, rows in c.sections for item, _ in rows for name in re.findall(r"(?<![\w-])--?[A-Za-z][\w-]*", item)}
               for c in commands(program)}
    for page in [*(root / name for name in OTHERS), *tracked(root / "docs", ".md"), *tracked(root / "reports", ".md")]:
        yield from faults_of_calls(page.relative_to(root), page.read_text(encoding="utf-8"), options)
    # The check itself: an option behind the end of a line is looked at.
    for false in ("a `tpm fit r.csv\n--false` b", "    $ tpm fit r.csv \\\n      --false\n", "```sh\ntpm fit r.csv --false\n```\n"):
        if len(list(faults_of_calls("", false, {("fit",): set()}))) != 1:
            yield f"documentation.py: does not notice {false!r}"


def lost_programs(root):
    """A program of the tests that a page runs is made: measure_NAME, a room's, or a file's of its own."""
    rooms = {f.parent.name for f in (root / "tests").glob("*/test_*.cpp")}
    made = {f"measure_{f.stem}" for f in (root / "tests/measure").glob("*.cpp")}
    made |= {f"test_{room}{label}" for room in rooms for label in ("", "_slow", "_threads")}
    made |= {f.stem for f in (root / "tests").glob("*/test_*.cpp")
             if f.stem.endswith("_dummy") or re.search(r'include "(?:counted_allocations|formulation_suite)\.hpp"', f.read_text(encoding="utf-8"))}
    for page in tracked(root, ".md"):
        text = page.read_text(encoding="utf-8")
        for name in sorted(set(re.findall(r"build/\w+/tests/((?:test|measure)_\w+)|(?:ninja -C \S+|--target) ((?:test|measure)_\w+)", text))):
            if (name[0] or name[1]) not in made:
                yield f"{page.relative_to(root)}: runs {name[0] or name[1]}: no such program"


MANUAL = ("NAME", "SYNOPSIS", "OPTIONS", "EXAMPLES", "EXIT STATUS", "ENVIRONMENT", "FILES", "SEE ALSO")


def short_manuals(root, program):
    from command_help import ENVIRONMENT, commands, man_page

    found = commands(program)
    for command in found:
        page = man_page(command, "0", ["tpm"])
        headings = re.findall(r"^\.SH \"?([^\"\n]+)", page, re.M)
        for section in MANUAL:
            if section not in headings:
                yield f"{' '.join(['tpm', *command.words])}: its manual page has no section {section}"
    named = {name for name, _ in ENVIRONMENT}
    read = set()
    for folder in ("apps/tpm", "src"):
        for source in tracked(root / folder, ".cpp", ".hpp"):
            read |= set(re.findall(r'getenv\("(\w+)"\)', source.read_text(encoding="utf-8")))
    for name in sorted(read - named - PLATFORM):
        yield f"the manual pages do not name the environment's {name}"


# Variables that the system or mpirun sets.
PLATFORM = {"HOME", "PATH", "OMPI_COMM_WORLD_SIZE", "PMI_SIZE"}


def linked(page):
    for target in re.findall(r"\]\(([^)\s#]+)", page.read_text(encoding="utf-8")):
        if not re.match(r"[a-z]+:", target):
            yield (page.parent / target).resolve()


def far_pages(root):
    near = set(linked(root / "README.md"))
    near |= {far for page in list(near) if page.suffix == ".md" and page.exists() for far in linked(page)}
    pages = [*(root / "docs").glob("*.md"), *(root / "docs/site").glob("*.md"), *(root / page for page in report_pages(root))]
    for page in sorted(pages):
        if page not in near:
            yield f"{page.relative_to(root)}: more than two steps from README.md"


def excerpt_faults(page, command, printed):
    """The lines between `$ COMMAND` and the end of its block, in the order of the output; "..." stands for others."""
    block = re.search(rf"^    \$ {re.escape(command)}\n((?:    (?!\$).*\n)+)", page, re.M)
    if not block:
        yield f"no excerpt of {command}"
        return
    shown = [line[4:].rstrip() for line in block[1].splitlines()]
    rest = iter(line.rstrip() for line in printed.splitlines())
    for line in shown:
        if line != "..." and line not in rest:
            yield f"{command}: does not print, or not in this order: {line}"
            return
    for line in printed.splitlines():
        if line.startswith("!") and line.rstrip() not in shown:
            yield f"{command}: the excerpt leaves out the warning: {line}"


def false_excerpts(root, program):
    with tempfile.TemporaryDirectory() as folder:
        for words in (["example", "recording"], ["fit", "recording.csv", "--no-draw"]):
            done = subprocess.run([Path(program).resolve(), *words], cwd=folder, capture_output=True, text=True, check=True)
    page = (root / "README.md").read_text(encoding="utf-8")
    for fault in excerpt_faults(page, "tpm fit recording.csv", done.stdout):
        yield f"README.md: {fault}"
    # The check itself: without its warning, and with another number, the excerpt is refused.
    lines = page.splitlines(keepends=True)
    for change in (lambda line: "" if line.startswith("    !") else line, lambda line: line.replace("k_inf  ", "k_inf 9")):
        if page == (changed := "".join(map(change, lines))) or not list(excerpt_faults(changed, "tpm fit recording.csv", done.stdout)):
            yield "README.md: a false excerpt is not noticed"


def main():
    root, program = Path(sys.argv[1]).resolve(), sys.argv[2]
    faults = [*broken_links(root), *lost_pages(root), *lost_files(root), *unlisted_pages(root), *too_many_pages(root), *unanswered(root), *faults_of_paper(root),
              *differing_groups(root, program), *without_example(root, program), *false_commands(root, program), *lost_programs(root), *short_manuals(root, program), *far_pages(root),
              *false_excerpts(root, program)]
    for fault in faults:
        print(fault)
    print(f"{len(faults)} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
