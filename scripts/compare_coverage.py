#!/usr/bin/env python3
"""Which lines of the library the tests of one build covered, and those of another build no longer do.

Both builds are made with g++ and `--coverage`, and their tests were run. A line that moved is found again by its
text (difflib); a line that was changed or removed is not counted.

    scripts/compare_coverage.py SOURCE_BEFORE BUILD_BEFORE SOURCE_AFTER BUILD_AFTER
"""
import difflib
import gzip
import json
import subprocess
import sys
import tempfile
from collections import defaultdict
from pathlib import Path


def covered_lines(source, build):
    """{file relative to the source: ({line covered}, {line with code})} of src/ and apps/."""
    run, code = defaultdict(set), defaultdict(set)
    notes = [p.resolve() for p in Path(build).rglob("*.gcda")]
    with tempfile.TemporaryDirectory() as folder:
        for start in range(0, len(notes), 8):
            for old in Path(folder).glob("*.gz"):
                old.unlink()
            subprocess.run(["gcov", "--json-format", "--preserve-paths", *map(str, notes[start:start + 8])],
                           cwd=folder, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            for written in Path(folder).glob("*.gz"):
                with gzip.open(written) as stream:
                    for entry in json.load(stream)["files"]:
                        name = entry["file"]
                        for part in ("/src/tpm/", "/apps/tpm/"):
                            if part in name:
                                name = part[1:] + name.split(part)[-1]
                                break
                        else:
                            continue
                        for line in entry["lines"]:
                            code[name].add(line["line_number"])
                            if line["count"] > 0:
                                run[name].add(line["line_number"])
    return run, code


def texts(source, name):
    path = Path(source) / name
    return path.read_text(encoding="utf-8").splitlines() if path.exists() else None


def main():
    if len(sys.argv) != 5:
        sys.exit(__doc__)
    source_before, build_before, source_after, build_after = sys.argv[1:]
    before, code_before = covered_lines(source_before, build_before)
    after, code_after = covered_lines(source_after, build_after)
    for words, run, code in (("before", before, code_before), ("after", after, code_after)):
        lines, all_lines = sum(map(len, run.values())), sum(map(len, code.values()))
        print(f"{words}: {lines} of {all_lines} lines of {len(code)} files covered ({100 * lines / all_lines:.2f} %)")
    lost = 0
    for name in sorted(before):
        old, new = texts(source_before, name), texts(source_after, name)
        if old is None or new is None:
            continue
        matcher = difflib.SequenceMatcher(None, old, new, autojunk=False)
        for block in matcher.get_matching_blocks():
            for k in range(block.size):
                was, now = block.a + k + 1, block.b + k + 1
                if was in before[name] and now in code_after[name] and now not in after[name]:
                    lost += 1
                    print(f"no longer covered: {name}:{now}: {new[now - 1].strip()}")
    print(f"{lost} lines that were covered are covered no longer")
    sys.exit(1 if lost else 0)


if __name__ == "__main__":
    main()
