#!/usr/bin/env python3
"""Checks the public headers, include/tpmkit: at most 30, each includes only other public headers, the standard library,
Eigen and fmt, and CMakeLists.txt installs no other folder of headers.

    python3 tests/programs/public_headers.py ROOT
"""
import re
import sys
from pathlib import Path

MOST = 30
STANDARD = re.compile(r"<[a-z_0-9]+(\.h)?>$")
OTHERS = re.compile(r"<(Eigen|fmt)/[\w.]+>$")


def faults_of(root):
    headers = sorted((root / "include").rglob("*.h*"))
    names = {str(h.relative_to(root / "include")) for h in headers}
    if not headers:
        yield "include: no header"
    if len(headers) > MOST:
        yield f"include: {len(headers)} headers, at most {MOST} are public"
    for header in headers:
        for included in re.findall(r"^ *# *include +(\S+)", header.read_text(encoding="utf-8"), re.M):
            if included.strip('"') in names or STANDARD.match(included) or OTHERS.match(included):
                continue
            yield f"{header.relative_to(root)}: includes {included}, which is not public"
    for folder in re.findall(r"install\(DIRECTORY ([^)]*?)DESTINATION \$\{CMAKE_INSTALL_INCLUDEDIR\}",
                             (root / "CMakeLists.txt").read_text(encoding="utf-8")):
        if folder.split() != ["include/tpmkit"]:
            yield f"CMakeLists.txt: installs headers of {folder.strip()}"


def main():
    faults = list(faults_of(Path(sys.argv[1])))
    for fault in faults:
        print(fault)
    print(f"{len(faults)} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
