#!/usr/bin/env python3
"""Writes the bill of materials of a program, SPDX 2.3 in JSON, and the notices of what is compiled into it.

    make_sbom.py PROGRAM TPMKIT.SPDX.JSON THIRD_PARTY.TXT [--dynamic PACKAGE]...

Lists every shared library that `ldd PROGRAM` shows, and every part that docs/licences.md says is compiled in. Licences
are those of docs/licences.md, versions those of the installed Debian packages. --dynamic: this part is loaded in this
build, not compiled in. What cannot be found is NOASSERTION, and a line on standard error names it. With
SOURCE_DATE_EPOCH equal programs on equal machines give equal bytes.
"""

import argparse
import datetime
import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
UNKNOWN = "NOASSERTION"
# Texts of licences that SPDX has no name for: where the copyright file of a Debian package states them.
EXTRACTED = {"LicenseRef-fmt": "libfmt9", "LicenseRef-HDF5": "libhdf5-dev", "LicenseRef-public-domain": "liblzma5"}


def tables(page):
    """The rows of docs/licences.md by heading: {package: (licence, use, includes)}."""
    found = {}
    for heading, body in re.findall(r"^## ([^\n]+)\n(.*?)(?=^## |\Z)", page, re.M | re.S):
        rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in re.findall(r"^\|.*\|$", body, re.M)]
        found[heading] = {row[0]: (row[1], row[2], row[3] if len(row) > 3 else "") for row in rows[2:]}
    return found["Loaded by the program"], found["Compiled into the program"]


def output(*command):
    return subprocess.run(command, capture_output=True, text=True, check=False).stdout


def loaded_libraries(program):
    """{name: file} of what the program loads."""
    lines = subprocess.run(["ldd", program], capture_output=True, text=True, check=True).stdout.splitlines()
    found = {}
    for line in lines:
        match = re.match(r"\s*(\S+) => (/\S+) \(0x", line) or re.match(r"\s*(/\S+)()\s+\(0x", line)
        if match:
            found[Path(match[1]).name] = Path(match[2] or match[1])
        elif "not found" in line:
            sys.exit(f"make_sbom.py: {program}: {line.strip()}; expected a program whose libraries are installed")
    if not found:
        sys.exit(f"make_sbom.py: {program}: ldd shows no library; expected a dynamic program")
    return found


def packages_of(files):
    """{file: Debian package that has it}; dpkg may know a file by its path from before /usr was merged."""
    if not shutil.which("dpkg-query"):
        return {}
    paths = {path: file for file in files for path in (str(file.resolve()), str(file.resolve()).removeprefix("/usr"))}
    found = {}
    for line in output("dpkg-query", "-S", *paths).splitlines():
        owners, _, path = line.rpartition(": ")
        if path in paths:
            found[paths[path]] = re.match(r"[^:,]+", owners)[0]
    return found


def version_and_source(package):
    """Of an installed package."""
    if shutil.which("dpkg-query"):
        match = re.match(r"installed ([^ ]+) ([^ \n]+)",
                         output("dpkg-query", "-W", "-f=${db:Status-Status} ${Version} ${source:Package}\n", package))
        if match:
            return match[1], match[2]
    return None


def copyright_of(package):
    file = Path("/usr/share/doc") / package / "copyright"
    return file.read_text(encoding="utf-8", errors="replace") if file.exists() else None


def sha256(file):
    return hashlib.sha256(Path(file).read_bytes()).hexdigest()


def entry(name, package, licence, comment, file=None):
    known = version_and_source(package) if package else None
    made = {
        "name": name,
        "SPDXID": "SPDXRef-" + re.sub(r"[^A-Za-z0-9.]", "-", name),
        "downloadLocation": UNKNOWN,
        "filesAnalyzed": False,
        "licenseConcluded": licence,
        "licenseDeclared": licence,
        "copyrightText": UNKNOWN,
        "comment": comment,
    }
    if known:
        version, source = known
        made["versionInfo"] = version
        made["supplier"] = "Organization: Debian"
        made["sourceInfo"] = f"Debian package {package}, source package {source}"
        made["externalRefs"] = [{"referenceCategory": "PACKAGE-MANAGER", "referenceType": "purl",
                                 "referenceLocator": f"pkg:deb/debian/{package.replace('+', '%2B')}@{version.replace('+', '%2B')}"}]
    else:
        print(f"make_sbom.py: {name}: no installed Debian package has it; its version is not stated", file=sys.stderr)
    if file:
        made["packageFileName"] = file.name
        made["checksums"] = [{"algorithm": "SHA256", "checksumValue": sha256(file)}]
    return made


def licence_in(table, name, package):
    if package in table:
        return table[package][0], table[package][1]
    print(f"make_sbom.py: {name} of the package {package or 'unknown'}: docs/licences.md does not name it; its licence is {UNKNOWN}",
          file=sys.stderr)
    return UNKNOWN, "loaded"


def bill(program, dynamic, version):
    loaded, compiled = tables((ROOT / "docs/licences.md").read_text(encoding="utf-8"))
    digest = sha256(program)
    epoch = os.environ.get("SOURCE_DATE_EPOCH")
    created = datetime.datetime.fromtimestamp(int(epoch), datetime.timezone.utc) if epoch else datetime.datetime.now(datetime.timezone.utc)
    tpm = {
        "name": "tpm", "SPDXID": "SPDXRef-tpm", "versionInfo": version, "downloadLocation": UNKNOWN, "filesAnalyzed": False,
        "licenseConcluded": UNKNOWN, "licenseDeclared": "MIT", "copyrightText": "The tpmkit authors",
        "supplier": "Organization: The tpmkit authors", "primaryPackagePurpose": "APPLICATION",
        "checksums": [{"algorithm": "SHA256", "checksumValue": digest}],
        "comment": "The sources are MIT. What a binary falls under depends on what it loads: docs/licences.md.",
    }
    packages, relations = [tpm], [("SPDXRef-DOCUMENT", "DESCRIBES", "SPDXRef-tpm")]
    libraries = loaded_libraries(program)
    owners = packages_of(libraries.values())
    for name, file in sorted(libraries.items()):
        package = owners.get(file)
        licence, use = licence_in(loaded, name, package)
        packages.append(entry(name, package, licence, use, file.resolve()))
        relations.append(("SPDXRef-tpm", "DEPENDS_ON", packages[-1]["SPDXID"]))
    for package, (licence, use, _) in sorted(compiled.items()):
        if package in dynamic:
            continue
        packages.append(entry(package, package, licence, use))
        relations.append(("SPDXRef-tpm", "STATIC_LINK" if use.startswith("archive") else "CONTAINS", packages[-1]["SPDXID"]))
    used = {word for p in packages for word in re.findall(r"LicenseRef-[\w.-]+", p["licenseConcluded"])}
    extracted = []
    for name in sorted(used):
        text = copyright_of(EXTRACTED[name]) if name in EXTRACTED else None
        extracted.append({"licenseId": name, "name": name.removeprefix("LicenseRef-"), "extractedText": text or UNKNOWN,
                          "comment": f"The copyright file of the Debian package {EXTRACTED.get(name, 'unknown')}"})
    document = {
        "spdxVersion": "SPDX-2.3", "dataLicense": "CC0-1.0", "SPDXID": "SPDXRef-DOCUMENT", "name": f"tpmkit-{version}",
        "documentNamespace": f"https://tpmkit.invalid/spdx/tpmkit-{version}-{digest}",
        "creationInfo": {"created": created.strftime("%Y-%m-%dT%H:%M:%SZ"), "creators": ["Tool: make_sbom.py", "Organization: The tpmkit authors"]},
        "packages": packages,
        "relationships": [{"spdxElementId": a, "relationshipType": kind, "relatedSpdxElement": b} for a, kind, b in relations],
    }
    if extracted:
        document["hasExtractedLicensingInfos"] = extracted
    # The Boost licence asks for no notice beside object code.
    return document, [p for p in sorted(compiled) if p not in dynamic and compiled[p][0] != "BSL-1.0"]


def notices(parts):
    yield ("The program tpm contains parts of these Debian packages, as archives or as headers. What follows are the copyright\n"
           "files of the packages; tpm contains some of the files that they name. Parts under the Boost licence, which asks for\n"
           "no notice beside object code, are left out.\n")
    for package in parts:
        text = copyright_of(package)
        if text is None:
            print(f"make_sbom.py: {package}: has no copyright file here; its notices are missing", file=sys.stderr)
        yield f"\n{'=' * 100}\n{package}\n{'=' * 100}\n\n{text or 'Not found on the machine of the build.'}"


def write(path, text):
    path = Path(path)
    part = path.with_name(path.name + ".part")
    part.write_text(text, encoding="utf-8")
    part.replace(path)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("program")
    parser.add_argument("spdx")
    parser.add_argument("notices")
    parser.add_argument("--dynamic", action="append", default=[])
    a = parser.parse_args()
    version = re.search(r"^project\(tpmkit VERSION ([0-9.]+)", (ROOT / "CMakeLists.txt").read_text(encoding="utf-8"), re.M)[1]
    document, parts = bill(a.program, a.dynamic, version)
    write(a.notices, "".join(notices(parts)))
    write(a.spdx, json.dumps(document, indent=1, ensure_ascii=False) + "\n")


if __name__ == "__main__":
    main()
