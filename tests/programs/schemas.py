#!/usr/bin/env python3
"""Checks that what is written by the declaration of keys is what the program says: schemas/NAME.schema.json is
`tpm schema NAME`, docs/keys.md is `tpm schema --keys`. With --write it writes them.

    python3 tests/programs/schemas.py ROOT TPM [--write]
"""
import subprocess
import sys
from pathlib import Path

root, tpm = Path(sys.argv[1]).resolve(), sys.argv[2]
write = "--write" in sys.argv[3:]


def said(*words):
    return subprocess.run([tpm, "schema", *words], capture_output=True, text=True, check=True).stdout


files = {root / "docs/keys.md": said("--keys")}
for line in said().splitlines():
    name = line.split()[0]
    files[root / f"schemas/{name}.schema.json"] = said(name)
faults = 0
for file, text in files.items():
    if file.exists() and file.read_text(encoding="utf-8") == text:
        continue
    if write:
        file.write_text(text, encoding="utf-8")
        print(f"written: {file.relative_to(root)}")
    else:
        print(f"{file.relative_to(root)}: is not what tpm schema prints; run {sys.argv[0]} ROOT TPM --write")
        faults += 1
print(f"{len(files)} files compared")
sys.exit(1 if faults or len(files) < 15 else 0)
