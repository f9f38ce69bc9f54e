#!/usr/bin/env python3
"""Checks the worked examples of docs/architecture.md, the diffs in docs/changes:

- each applies to the sources as they are, in a copy and with `patch`, so that no git is needed (lines may have moved,
  those next to a change may not differ);
- it changes at most three files outside tests/ and docs/, the number that the page states for it;
- the page names every diff of the folder and no other.

    python3 tests/programs/changes.py ROOT
"""
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

MOST = 3  # files outside tests/ and docs/


def files_of(diff):
    """The old and new names of the files of a diff, "/dev/null" for none."""
    text = diff.read_text(encoding="utf-8")
    return re.findall(r"^--- (?:a/)?(\S+)\n\+\+\+ (?:b/)?(\S+)$", text, re.M)


def what_patch_says(root, diff):
    """Applies a diff to copies of the files that it changes; empty if every hunk fits."""
    with tempfile.TemporaryDirectory() as folder:
        for old, new in files_of(diff):
            if old == "/dev/null":
                if (root / new).exists():
                    return f"{new} is already there"
                continue
            if not (root / old).is_file():
                return f"{old} is not there"
            copy = Path(folder) / old
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(root / old, copy)
        done = subprocess.run(["patch", "-p1", "--forward", "--fuzz=1", "--dry-run", "--batch", "-d", folder, "-i", str(diff)],
                              capture_output=True, text=True)
        return "" if done.returncode == 0 else " ".join((done.stdout + done.stderr).split())


def faults(root):
    page = (root / "docs/architecture.md").read_text(encoding="utf-8")
    stated = {name: int(count) for name, count in
              re.findall(r"^\| \[[^]]+\]\(changes/(\w+)\.diff\) \|.*\| (\d+) \|$", page, re.M)}
    diffs = sorted((root / "docs/changes").glob("*.diff"))
    for name in sorted(set(stated) ^ {diff.stem for diff in diffs}):
        yield f"{name}: stands in docs/changes or in the table of docs/architecture.md, not in both"
    for diff in diffs:
        files = files_of(diff)
        if not files:
            yield f"{diff.name}: changes no file"
            continue
        said = what_patch_says(root, diff)
        if said:
            yield f"{diff.name}: does not apply: {said}"
        names = [old if new == "/dev/null" else new for old, new in files]
        outside = [name for name in names if not name.startswith(("tests/", "docs/"))]
        if len(outside) > MOST:
            yield f"{diff.name}: changes {len(outside)} files besides tests and pages; expected at most {MOST}"
        if not any(name.startswith("tests/") for name in names):
            yield f"{diff.name}: has no test"
        if len(outside) != stated.get(diff.stem, len(outside)):
            yield f"{diff.name}: changes {len(outside)} files besides tests and pages; docs/architecture.md states {stated[diff.stem]}"


def main():
    root = Path(sys.argv[1]).resolve()
    if shutil.which("patch") is None:
        print("SKIPPED: there is no program 'patch'")
        return 77
    found = list(faults(root))
    for fault in found:
        print(fault)
    print(f"{len(found)} faults")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
