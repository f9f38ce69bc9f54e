#!/usr/bin/env python3
"""Counts the house: lines of code by folder, installed headers, names of each namespace, seconds of compilation.

    python3 scripts/house.py                     the committed sources
    python3 scripts/house.py v0.1.0 HEAD         two commits side by side
    python3 scripts/house.py --build build/release   seconds of compilation by folder as well, from ninja's log
    python3 scripts/house.py --header include tpmkit/model.hpp --header src tpm/model/model.hpp
                                                 what a program pays that includes one header: files read, processor time

A line of code is one that is neither blank nor only a comment. A name is a class, struct, enumeration, alias, concept,
constant or function that a header declares at namespace level. Installed headers are those below include/, and those
of src/tpm if CMakeLists.txt installs that folder.
"""
import argparse
import re
import resource
import subprocess
import sys
from collections import Counter
from pathlib import Path

CODE = (".cpp", ".hpp", ".h", ".c", ".inc")
DECLARATION = re.compile(r"(?:template <.*?> ?)?(?:class|struct|enum class|enum|using(?! namespace)|concept) (?:\[\[\w+\]\] )?(\w+)")
FUNCTION = re.compile(r"(?:inline |constexpr |\[\[nodiscard\]\] |static |extern )*[\w:<>,&*\s]+?[ &*](\w+)\(")
CONSTANT = re.compile(r"(?:inline )?constexpr [\w:<>, ]+ (\w+)(?:\[\d*\])? ?[={]")


def git(*arguments: str) -> str:
    done = subprocess.run(["git", *arguments], capture_output=True, text=True)
    if done.returncode != 0:
        raise SystemExit(f"house.py: git {arguments[0]}: {done.stderr.strip()}")
    return done.stdout


def sources(commit: str) -> dict:
    """The text of every C and C++ file of src, apps, include and bindings."""
    names = [name for name in git("ls-tree", "-r", "--name-only", commit, "src", "apps", "include", "bindings").split("\n")
             if name.endswith(CODE)]
    request = "".join(f"{commit}:{name}\n" for name in names).encode()
    answer = subprocess.run(["git", "cat-file", "--batch"], input=request, capture_output=True, check=True).stdout
    texts, at = {}, 0
    for name in names:
        end = answer.index(b"\n", at)
        size = int(answer[at:end].split()[2])
        texts[name] = answer[end + 1:end + 1 + size].decode()
        at = end + size + 2
    return texts


def without_comments(text: str) -> str:
    """The text without comments; strings are kept as they are."""
    pattern = re.compile(r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])\'', re.DOTALL)
    return pattern.sub(lambda match: match.group() if match.group()[0] in "\"'" else re.sub(r"[^\n]", "", match.group()),
                       text)


def lines_of_code(text: str) -> int:
    return sum(bool(line.strip()) for line in without_comments(text).split("\n"))


def folder_of(name: str) -> str:
    parts = name.split("/")
    return "/".join(parts[:3] if parts[0] == "src" and len(parts) > 3 else parts[:2] if len(parts) > 2 else parts[:1])


def names_declared(text: str) -> dict:
    """Names at namespace level, by namespace. Bodies are skipped by counting braces."""
    found: dict = {}
    stack, statement = [], ""
    for token in re.finditer(r'[{};]|[^{};]+', re.sub(r'#[^\n]*(?:\\\n[^\n]*)*', "", without_comments(text))):
        piece = token.group()
        if piece not in "{};":
            statement += piece
            continue
        words = " ".join(statement.split())
        at_namespace = all(level is not None for level in stack)
        if piece == "{":
            opened = re.match(r"(?:inline )?namespace ?([\w:]*)", words)
            if at_namespace and opened:
                stack.append(opened.group(1) or "(unnamed)")
                statement = ""
                continue
            if at_namespace and words:
                note(found, stack, words)
            stack.append(None)
        elif piece == "}":
            if stack:
                stack.pop()
        elif at_namespace and words:
            note(found, stack, words)
        statement = ""
    return found


def note(found: dict, stack: list, words: str) -> None:
    for pattern in (DECLARATION, CONSTANT, FUNCTION):
        if match := pattern.match(words):
            found.setdefault("::".join(stack), set()).add(match.group(1))
            return


def installed_headers(commit: str, texts: dict) -> int:
    rules = git("show", f"{commit}:CMakeLists.txt")
    places = ["include/"] + (["src/tpm/"] if re.search(r"install\(DIRECTORY src/tpm ", rules) else [])
    return sum(name.endswith((".hpp", ".h", ".inc")) and name.startswith(tuple(places)) for name in texts)


def seconds_by_folder(build: Path) -> Counter:
    """Seconds of the last compilation of each object, by folder of src/tpm; tests and all else apart."""
    last = {}
    for line in (build / ".ninja_log").read_text().split("\n"):
        fields = line.split("\t")
        if len(fields) == 5 and fields[3].endswith(".o"):
            last[fields[3]] = (int(fields[1]) - int(fields[0])) / 1000
    total: Counter = Counter()
    for name, took in last.items():
        folder = re.search(r"tpm_objects_(\w+?)\.dir|(tpm_commands)\.dir", name)
        total[folder.group(1) or "apps/tpm" if folder else "tests" if name.startswith("tests/") else "other"] += took
    return total


def cost_of_header(folder: str, header: str) -> str:
    """A row: files of this project that the header reads, and the processor time that g++ takes for it alone."""
    command = ["g++", "-std=c++20", "-x", "c++", "-", f"-I{folder}", "-Iinclude", "-isystem", "/usr/include/eigen3"]
    text = f'#include "{header}"\n'
    needs = subprocess.run([*command, "-MM"], input=text, capture_output=True, text=True, check=True).stdout
    files = [word for word in needs.split() if word.endswith((".hpp", ".h")) and not word.startswith("/usr")]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([*command, "-fsyntax-only"], input=text, text=True, check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return f"| {header} | {len(files)} | {after.ru_utime - before.ru_utime:.1f} |"


def count(commit: str) -> dict:
    texts = sources(commit)
    lines: Counter = Counter()
    names: dict = {}
    for name, text in texts.items():
        lines[folder_of(name)] += lines_of_code(text)
        if name.endswith((".hpp", ".h")):
            for namespace, declared in names_declared(text).items():
                names.setdefault(namespace, set()).update(declared)
    return {"lines": lines, "headers": installed_headers(commit, texts),
            "names": Counter({namespace: len(declared) for namespace, declared in names.items()})}


def table(title: str, columns: list, counters: list) -> str:
    keys = sorted(set().union(*counters))
    rows = [f"| {title} | {' | '.join(columns)} |", "| --- |" + " --- |" * len(columns)]
    rows += [f"| {key or '(global)'} | {' | '.join(str(counter[key]) for counter in counters)} |" for key in keys]
    rows.append(f"| **all** | {' | '.join(str(sum(counter.values())) for counter in counters)} |")
    return "\n".join(rows) + "\n"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("commits", nargs="*", default=["HEAD"])
    parser.add_argument("--build", type=Path, help="a build folder of ninja")
    parser.add_argument("--header", nargs=2, action="append", metavar=("FOLDER", "HEADER"), help="measure this header")
    options = parser.parse_args()
    if options.header:
        print("| header | files of the project | s of g++ |\n| --- | --- | --- |")
        print("\n".join(cost_of_header(folder, header) for folder, header in options.header))
        return 0
    counts = [count(commit) for commit in options.commits]
    print(table("lines of code", options.commits, [c["lines"] for c in counts]))
    print(table("names in headers", options.commits, [c["names"] for c in counts]))
    print(f"Installed headers: {', '.join(str(c['headers']) for c in counts)}")
    if options.build:
        seconds = seconds_by_folder(options.build)
        print("\n" + table("seconds of compilation", ["now"], [Counter({k: round(v, 1) for k, v in seconds.items()})]))
    return 0


if __name__ == "__main__":
    sys.exit(main())
