#!/usr/bin/env python3
"""Counts how files are read: lines and functions that name a key by hand, keys that are declared, schemas written by hand.

    reading_counts.py COMMIT...
    reading_counts.py --walk TPM SESSION.json

A line names a key by hand if it asks a document for it by a text: at("depth"), contains("depth"), value("depth", ...),
quantity_at(j, "depth", ...). Left out are checks of a value that is there (require_number, require_valid, ...), headers of
HTTP, units searched for a word, the writer of schemas and sources that only show results. A function reads by hand if one of
its lines does, and none declares a key. A function that only names the place of a key for a message (place.key("depth")) is
counted apart: a check across keys has to. --walk needs the preset `work`, in which a room is
a shared library: the dynamic linker says which room calls which function of another first (LD_DEBUG=bindings). A climb
is a call of a room that stands later in docs/architecture.md.
"""

import os
import re
import subprocess
import sys
from collections import Counter
from pathlib import Path

BY_HAND = r'(\.at|\.contains|\.value|\.find|[a-z_]+_at|optional_[a-z]+|required_[a-z]+|require_[a-z]+|read_[a-z]+)\((.*, *)?"[A-Za-z_]+"'
PLACE = r'\.key\("'
DECLARED = r'(^|[^.a-z_])(key|unread|required_key|optional_key|required_text|optional_text)\("'
NO_READING = (r"optional_key|required_key|file\.|writer|attribute|require_(valid|number|cells|finite|limit)\("
              r"|unit\.find\(|(head|request)\.value\(")
SOURCES = ["src/tpm/*.cpp", "src/tpm/*.hpp", ":!src/tpm/*show*"]


def lines_with(pattern, commit):
    found = subprocess.run(["git", "grep", "-E", pattern, commit, "--", *SOURCES], capture_output=True, text=True, check=False)
    return [line.split(":", 2)[1:] for line in found.stdout.splitlines()]  # file, line


def by_hand_in(commit):
    return [(file, line) for file, line in lines_with(BY_HAND, commit)
            if not re.search(NO_READING, line) and not file.endswith("keys/json_schema.cpp")]


def functions_in(text):
    """Definitions of a formatted file, as lines: each ends with a bracket at the margin."""
    lines = []
    for line in text.splitlines():
        if line.startswith(("namespace", "using", "}  // namespace")) or not lines and line[:1] in ("", "#"):
            lines = []
            continue
        lines.append(line)
        if line in ("}", "};", "});"):
            yield lines
            lines = []


def reading_functions(commit):
    """Lines of the functions that read by hand, of those that only name a place, and of those that declare keys."""
    hand, placed = set(map(tuple, by_hand_in(commit))), set(map(tuple, lines_with(PLACE, commit)))
    declared = set(map(tuple, lines_with(DECLARED, commit)))
    by_hand, placing, declaring = 0, 0, 0
    for file in {file for file, _ in hand | placed | declared}:
        text = subprocess.run(["git", "show", f"{commit}:{file}"], capture_output=True, text=True, check=True).stdout
        for function in functions_in(text):
            if any((file, line) in declared for line in function):
                declaring += len(function)
            elif any((file, line) in hand for line in function):
                by_hand += len(function)
            elif any((file, line) in placed for line in function):
                placing += len(function)
    return by_hand, placing, declaring


def counts_of(commit):
    by_hand = by_hand_in(commit)
    schemas = subprocess.run(["git", "grep", "-hc", "", commit, "--", "schemas"], capture_output=True, text=True, check=True).stdout
    generated = bool(lines_with("json_schema", commit))
    return len(by_hand), *reading_functions(commit), len(lines_with(DECLARED, commit)), 0 if generated else sum(map(int, schemas.split()))


def rooms():
    root = Path(__file__).resolve().parents[1]
    page = (root / "docs/architecture.md").read_text(encoding="utf-8")
    return re.findall(r"^\| (\w+) \| .* \| .* \|$", page.split("| room | folders")[1].split("\n\n")[0], re.M)


def walk(tpm, session):
    order = rooms()
    run = subprocess.run([tpm, "hil", "run", session, "-o", "/dev/null"], capture_output=True, text=True, check=False,
                         env={**os.environ, "LD_DEBUG": "bindings"})
    said = run.stderr[run.stderr.index("transferring control"):]
    calls = re.findall(r"binding file \S*libtpmkit_([a-z]+)\S* \[0\] to \S*libtpmkit_([a-z]+)\S* \[0\]: normal symbol `(\S+?)'", said)
    names = subprocess.run(["c++filt"], input="\n".join(c[2] for c in calls), capture_output=True, text=True, check=True).stdout
    seen, climbs = set(), []
    for (caller, owner, _), name in zip(calls, names.splitlines()):
        if not name.startswith("tpm::") or "<" in name.split("(")[0]:
            continue
        room = re.match(r"tpm::(\w+)::", name)  # what is inline stands in several libraries
        callee = room[1] if room and room[1] in order else owner
        if caller == callee:
            continue
        seen |= {caller, callee}
        if order.index(callee) > order.index(caller):
            climbs.append(f"{caller} calls {name}")
    print(f"{len(seen)} rooms: {', '.join(sorted(seen, key=order.index))}; {len(climbs)} climbs{': ' if climbs else ''}{'; '.join(climbs)}")


def main():
    if sys.argv[1] == "--walk":
        walk(sys.argv[2], sys.argv[3])
        return
    print("| | " + " | ".join(sys.argv[1:]) + " |\n| --- |" + " ---: |" * len(sys.argv[1:]))
    rows = zip(("lines that name a key by hand", "lines of functions that do", "lines of functions that only name a place",
                "lines of functions that declare keys", "keys declared", "lines of schemas by hand"), zip(*map(counts_of, sys.argv[1:])))
    for name, numbers in rows:
        print(f"| {name} | " + " | ".join(map(str, numbers)) + " |")
    folders = Counter(str(Path(file).parent.relative_to("src/tpm")) for file, _ in by_hand_in(sys.argv[-1]))
    print(f"\nby hand in {sys.argv[-1]}: " + ", ".join(f"{folder} {count}" for folder, count in folders.most_common(8)))


if __name__ == "__main__":
    main()
