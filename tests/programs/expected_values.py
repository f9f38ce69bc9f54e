#!/usr/bin/env python3
"""Checks tests/expected_values.json against the tests: every entry is used, every name in a test is an entry, and
entries are whole and in order.

    python3 tests/programs/expected_values.py ROOT
"""
import json
import re
import sys
from pathlib import Path

SECTIONS = {"values": "expected", "allowed_errors": "allowed_error", "allowed_costs": "allowed_cost"}
CALL = re.compile(r'\b(expected|allowed_error|allowed_cost)\(\s*"([^"]*)"\s*\)')
# A name that is computed cannot be found in the file: only test::NAME("...") is a call.
COMPUTED = re.compile(r'\btest::(expected|allowed_error|allowed_cost)\(\s*[^"\s]')


def faults_of_entry(section, entry):
    known = {"value", "unit", "source"} if section == "values" else {"at_most", "of"}
    for key in sorted(known - set(entry)):
        yield f"has no '{key}'"
    tolerances = {"tolerance", "relative_tolerance"} & set(entry) if section == "values" else set()
    if section == "values" and len(tolerances) != 1:
        yield "expected one of 'tolerance' and 'relative_tolerance'"
    for key in sorted(set(entry) - known - tolerances - {"source"}):
        yield f"key '{key}' is not known"


def no_double_keys(pairs):
    names = [name for name, _ in pairs]
    for name in sorted({n for n in names if names.count(n) > 1}):
        raise SystemExit(f"expected_values.json: '{name}' stands twice")
    return dict(pairs)


def faults(root):
    text = (root / "tests/expected_values.json").read_text(encoding="utf-8")
    file = json.loads(text, object_pairs_hook=no_double_keys)
    used = {section: set() for section in SECTIONS}
    for source in sorted([*root.glob("tests/**/*.cpp"), *root.glob("tests/**/*.hpp")]):
        where = source.relative_to(root)
        if source.name.startswith("expected_values."):
            continue
        code = source.read_text(encoding="utf-8")
        for call, name in CALL.findall(code):
            section = next(s for s, function in SECTIONS.items() if function == call)
            used[section].add(name)
            if name not in file[section]:
                yield f"{where}: '{name}' is not in '{section}' of expected_values.json"
        if COMPUTED.search(code):
            yield f"{where}: a name of expected_values.json is computed; expected a string"
    for section in SECTIONS:
        names = list(file[section])
        if names != sorted(names):
            yield f"expected_values.json: '{section}' is not in alphabetical order"
        for name in names:
            if name not in used[section]:
                yield f"expected_values.json: no test uses '{name}' of '{section}'"
            for fault in faults_of_entry(section, file[section][name]):
                yield f"expected_values.json: '{name}' {fault}"


found = list(faults(Path(sys.argv[1]).resolve()))
for line in found:
    print(line)
sys.exit(1 if found else 0)
