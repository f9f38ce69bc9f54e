#!/usr/bin/env python3
"""Options of all commands, after `tpm --json-usage`: one name has one meaning and one kind of values.

    options.py ROOT TPM            compares with the table of docs/commands.md, too
    options.py ROOT TPM --write    writes that table

A help text begins with the meaning, up to the first of , ; : ( -- what follows is the command's own. A name may have
only one meaning, one kind, and a kind that is shown unless it is a flag. A meaning may have only one name. It can be read
alone, as docs/commands.md lists it: it is not a value of the option, and does not refer to what was said before.
"""

import collections
import json
import re
import subprocess
import sys
from pathlib import Path


def meaning(text):
    return re.split(r"[,;:(]", text)[0].strip()


REFERS = re.compile(r"(?:With|Of|Its|Such|Instead|Else|And|\w+ of (?:its|that))\b")


def all_options(command, path=""):
    for option in command["options"]:
        yield path or "tpm", option
    for below in command.get("commands", []):
        yield from all_options(below, f"{path} {below['name']}".strip())


def faults_of(usage):
    """Sentences, one for each name that has two meanings, and each meaning that has two names."""
    by_name, by_meaning = collections.defaultdict(list), collections.defaultdict(set)
    for path, option in all_options(usage):
        by_name[option["names"][-1]].append((path, option))
    faults = []
    for name, uses in by_name.items():
        meanings = {meaning(o["text"]): p for p, o in uses}
        kinds = {"FLAG" if o.get("flag") else o.get("kind", ""): p for p, o in uses}
        if len(meanings) > 1:
            faults.append(f"{name} means " + " | ".join(f"'{m}' ({p})" for m, p in meanings.items()))
        if len(kinds) > 1:
            faults.append(f"{name} takes " + " | ".join(f"{k or 'nothing said'} ({p})" for k, p in kinds.items()))
        if "" in kinds:
            faults.append(f"{name} ({kinds['']}): the help does not say of which kind its values are")
        for m in meanings:
            by_meaning[m].add(name)
            if REFERS.match(m) or m in next(iter(kinds)).split(",") or re.fullmatch(r"[a-z]\w*", m):
                faults.append(f"{name} means '{m}', which cannot be read alone")
    faults += [f"{' and '.join(sorted(names))} are called '{m}'" for m, names in by_meaning.items() if len(names) > 1]
    return faults


def self_test():
    """The check itself: it has to find what it is for."""
    option = lambda name, text, **more: {"names": [name], "text": text, **more}
    command = lambda name, *options: {"name": name, "options": list(options)}
    usage = {"options": [], "commands": [
        command("a", option("--rate", "Speed, of a ramp", kind="SPEED"), option("--force", "Replace", flag=True),
                option("--samples", "Laws drawn", kind="COUNT"), option("--plain", "Said nowhere")),
        command("b", option("--rate", "Servo rate", kind="FREQUENCY"), option("--force", "Replace (files)", flag=True),
                option("--draws", "Laws drawn: here", kind="COUNT"),
                option("--intervals", "law: or readings", kind="WORD"), option("--width", "Such as 4 mm", kind="LENGTH"))]}
    found = faults_of(usage)
    for expected in ("--rate means", "--rate takes", "--plain", "--draws and --samples", "--intervals means 'law'", "--width means 'Such"):
        if not any(expected in fault for fault in found):
            sys.exit(f"this test does not find '{expected}'")
    if any("--force" in fault for fault in found) or len(found) != 6:
        sys.exit(f"this test finds what is no fault: {found}")


BEGIN, END = "<!-- options: written by tests/programs/options.py -->", "<!-- end of options -->"


def table(usage):
    """Of all options: values, meaning, and the commands that have them."""
    by_name = collections.defaultdict(list)
    for path, option in all_options(usage):
        by_name[option["names"][-1]].append((path, option))
    rows = ["| option | values | meaning | commands |", "| --- | --- | --- | --- |"]
    for name, uses in sorted(by_name.items(), key=lambda item: item[0].lower()):
        option = uses[0][1]
        if name == "--help":
            continue
        values = "" if option.get("flag") else option.get("kind", "")
        where = f"{len(uses)} commands" if len(uses) > 8 else ", ".join(path for path, _ in uses)
        shown = "`, `".join(option["names"])
        rows.append(f"| `{shown}` | {values} | {meaning(option['text'])} | {where} |".replace("|  |", "| |"))
    return "\n".join(rows)


def main():
    self_test()
    usage = json.loads(subprocess.run([sys.argv[2], "--json-usage"], capture_output=True, text=True, check=True).stdout)
    faults = faults_of(usage)
    page = Path(sys.argv[1]) / "docs/commands.md"
    text = page.read_text(encoding="utf-8")
    before, rest = text.split(BEGIN)
    new = f"{before}{BEGIN}\n\n{table(usage)}\n\n{END}{rest.split(END)[1]}"
    if "--write" in sys.argv:
        page.write_text(new, encoding="utf-8")
    elif new != text:
        faults.append("docs/commands.md does not list these options; options.py ROOT TPM --write")
    print(*faults, sep="\n")
    count = len({option["names"][-1] for _, option in all_options(usage)})
    print(f"{count} names of options, {len(faults)} faults")
    sys.exit(bool(faults))


if __name__ == "__main__":
    main()
