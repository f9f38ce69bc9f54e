#!/usr/bin/env python3
"""Checks the bill of materials that scripts/make_sbom.py writes for the program.

    bill_of_materials.py ROOT TPM

- it has the form of SPDX 2.3 (fields, identifiers, relationships, licence expressions);
- it lists the libraries that ldd shows, and those that the loader opens when the program runs, each once, with the
  version of the installed package;
- docs/licences.md has a licence for each, which the package's own copyright file states, and no row is out of date;
- every header of another project that src or apps/tpm includes belongs to a part that is listed.
"""

import copy
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

# How Debian's copyright files state each licence of docs/licences.md.
STATED = {
    "Apache-2.0": r"Apache", "BSD-2-Clause": r"BSD-2-?clause|Redistributions in binary form must reproduce",
    "BSD-3-Clause": r"BSD-3-clause", "BSL-1.0": r"BSL-1\.0|Boost", "GPL-2.0-or-later": r"GPL-2\+",
    "GPL-3.0-or-later": r"GNU General Public License.*version 3", "LGPL-2.0-or-later": r"Library General Public",
    "LGPL-2.1-or-later": r"LGPL-2\.1\+|Lesser General Public", "LicenseRef-HDF5": r"License Terms for\s+HDF5",
    "LicenseRef-fmt": r"Expat with embedded exception", "LicenseRef-public-domain": r"License: PD",
    "MIT": r"Expat|MIT", "MPL-2.0": r"MPL-2", "Zlib": r"[Zz]lib",
}
EXCEPTIONS = {"GCC-exception-3.1": r"GCC Runtime\s+Library\s+Exception"}
IDENTIFIER = re.compile(r"SPDXRef-[A-Za-z0-9.\-]+")
KINDS = {"DESCRIBES", "DEPENDS_ON", "STATIC_LINK", "CONTAINS"}


def faults_of_licence(expression):
    """The grammar of expressions without parentheses: A [WITH E] {AND|OR A [WITH E]}."""
    words = expression.split(" ")
    want = "licence"
    for word in words:
        if want == "licence":
            if word not in STATED:
                yield f"{expression}: {word} is no licence that is known here"
            want = "operator"
        elif want == "exception":
            if word not in EXCEPTIONS:
                yield f"{expression}: {word} is no exception that is known here"
            want = "and"
        elif word == "WITH" and want == "operator":
            want = "exception"
        elif word in ("AND", "OR"):
            want = "licence"
        else:
            yield f"{expression}: '{word}' stands where an operator has to"
            return
    if want in ("licence", "exception"):
        yield f"{expression}: ends too early"


def faults_of_form(d):
    for key, value in (("spdxVersion", "SPDX-2.3"), ("dataLicense", "CC0-1.0"), ("SPDXID", "SPDXRef-DOCUMENT")):
        if d.get(key) != value:
            yield f"{key} is {d.get(key)!r}; expected {value!r}"
    if not d.get("name"):
        yield "name is missing"
    if not re.fullmatch(r"https://[^#\s]+", d.get("documentNamespace", "")):
        yield f"documentNamespace: {d.get('documentNamespace')!r} is no address without '#'"
    creation = d.get("creationInfo", {})
    if not re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ", creation.get("created", "")):
        yield f"creationInfo: created is {creation.get('created')!r}"
    if not creation.get("creators") or not all(re.match(r"(Tool|Organization|Person): \S", c) for c in creation["creators"]):
        yield f"creationInfo: creators are {creation.get('creators')!r}"
    names, licences = ["SPDXRef-DOCUMENT"], set()
    for p in d.get("packages", []):
        names.append(p.get("SPDXID", ""))
        for key in ("name", "SPDXID", "downloadLocation", "licenseConcluded", "licenseDeclared", "copyrightText"):
            if not p.get(key):
                yield f"package {p.get('name')!r}: {key} is missing"
        if not IDENTIFIER.fullmatch(p.get("SPDXID", "")):
            yield f"package {p.get('name')!r}: SPDXID {p.get('SPDXID')!r}"
        if p.get("filesAnalyzed") is not False:
            yield f"package {p.get('name')!r}: filesAnalyzed without files"
        for c in p.get("checksums", []):
            if c.get("algorithm") != "SHA256" or not re.fullmatch(r"[0-9a-f]{64}", c.get("checksumValue", "")):
                yield f"package {p.get('name')!r}: check sum {c}"
        for key in ("licenseConcluded", "licenseDeclared"):
            if p.get(key, "NOASSERTION") != "NOASSERTION":
                yield from faults_of_licence(p[key])
                licences.update(re.findall(r"LicenseRef-[\w.\-]+", p[key]))
    for name in sorted({n for n in names if names.count(n) > 1}):
        yield f"SPDXID {name} is there twice"
    texts = {e.get("licenseId"): e.get("extractedText", "") for e in d.get("hasExtractedLicensingInfos", [])}
    for name in sorted(licences ^ set(texts)):
        yield f"{name} is used and not stated, or stated and not used"
    for name, text in sorted(texts.items()):
        if len(text) < 100:
            yield f"{name} has no text"
    related = set()
    for r in d.get("relationships", []):
        if r.get("relationshipType") not in KINDS:
            yield f"relationship {r.get('relationshipType')!r}"
        for end in (r.get("spdxElementId"), r.get("relatedSpdxElement")):
            if end not in names:
                yield f"relationship of {end}, which is not there"
        related.add(r.get("relatedSpdxElement"))
    for name in names[1:]:
        if name not in related:
            yield f"{name} is related to nothing"


def run(*command, **more):
    return subprocess.run(command, capture_output=True, text=True, check=False, **more)


def loaded_when_run(program):
    """Names of the libraries that the loader initialises, from its own trace."""
    with tempfile.TemporaryDirectory() as folder:
        run(program, "version", env={**os.environ, "LD_DEBUG": "files", "LD_DEBUG_OUTPUT": folder + "/trace"})
        trace = "".join(p.read_text() for p in Path(folder).iterdir())
    return {Path(p).name for p in re.findall(r"file=(\S+) \[0\];  generating link map", trace)}


def shown_by_ldd(program):
    found = set()
    for line in run("ldd", program).stdout.splitlines():
        if "linux-vdso" not in line:
            found.add(Path(line.split()[0]).name)
    return found


def version_of(package):
    return run("dpkg-query", "-W", "-f=${Version}", package).stdout


def faults_of_list(d, program, loaded, compiled):
    depends = {r["relatedSpdxElement"] for r in d["relationships"] if r["relationshipType"] == "DEPENDS_ON"}
    libraries = {p["name"]: p for p in d["packages"] if p["SPDXID"] in depends}
    for what, expected in (("ldd shows", shown_by_ldd(program)), ("the loader opens", loaded_when_run(program))):
        # The loader does not open itself.
        for name in sorted((libraries.keys() ^ expected) - ({"ld-linux-x86-64.so.2"} if "loader" in what else set())):
            yield f"{name}: is listed, or {what} it, not both"
    packages = set()
    for p in d["packages"][1:]:
        match = re.match(r"Debian package (\S+), source package (\S+)", p.get("sourceInfo", ""))
        if not match:
            yield f"{p['name']}: of no Debian package"
            continue
        packages.add(match[1])
        known = version_of(match[1])
        if known and known != p["versionInfo"]:
            yield f"{p['name']}: version {p['versionInfo']}; installed is {known}"
        if p["licenseConcluded"] == "NOASSERTION":
            yield f"{p['name']}: docs/licences.md does not name the package {match[1]}"
    for name, (_, use, _) in loaded.items():
        if name not in packages and "where" not in use:
            yield f"docs/licences.md: {name} is not loaded"
    if packages & compiled.keys() != compiled.keys():
        yield f"not listed: {sorted(compiled.keys() - packages)}"


def faults_of_page(loaded, compiled, sbom):
    for package, (licence, _, _) in {**loaded, **compiled}.items():
        yield from faults_of_licence(licence)
        text = sbom.copyright_of(package)
        if text is None:
            continue  # an alternative that is not installed here
        text = " ".join(text.split())
        for word in re.findall(r"[\w.+\-]+", licence):
            pattern = {**STATED, **EXCEPTIONS}.get(word)
            if pattern and not re.search(pattern, text, re.I if word.startswith("BSD") else 0):
                yield f"docs/licences.md: {package}: its copyright file does not state {word}"


def owners_of_headers(root, program, sbom):
    """Faults for headers of others, included by src or apps/tpm, whose project is not listed."""
    loaded, compiled = sbom.tables((root / "docs/licences.md").read_text(encoding="utf-8"))
    sources = {s for s in (source_of(p) for p in set(sbom.packages_of(sbom.loaded_libraries(program).values()).values())) if s}
    prefixes = [i.strip("` ") for _, _, includes in compiled.values() for i in includes.split(",") if i]
    expected = {"glibc", "linux", "gcc-12", "gcc-defaults"}  # the compiler's, the C library's and the kernel's
    seen = {}
    for folder in ("src", "apps/tpm", "include"):
        for file in sorted((root / folder).rglob("*.[ch]pp")):
            for name in re.findall(r"^ *# *include <([^>]+)>", file.read_text(encoding="utf-8"), re.M):
                seen.setdefault(name, file)
    used = set()
    for name, file in sorted(seen.items()):
        fitting = [p for p in prefixes if name == p or (p.endswith("/") and name.startswith(p))]
        if fitting:
            used.update(fitting)
            continue
        if "/" not in name and "." not in name or name == "mpi.h":
            continue  # the C++ library; what only TPM_MPI reads
        places = [Path("/usr/include") / name, Path("/usr/include/x86_64-linux-gnu") / name,
                  *Path("/usr/lib/gcc").glob(f"*/*/include/{name}")]
        place = next((p for p in places if p.exists()), None)
        if place is None:
            yield f"{file.relative_to(root)}: <{name}> is not in /usr/include, nor named in docs/licences.md"
            continue
        owner = sbom.packages_of([place]).get(place)
        if source_of(owner) not in sources | expected:
            yield f"{file.relative_to(root)}: <{name}> is of the package {owner}, of which nothing is listed in docs/licences.md"
    for prefix in prefixes:
        if prefix not in used:
            yield f"docs/licences.md: nothing includes <{prefix}>"


def source_of(package):
    return run("dpkg-query", "-W", "-f=${source:Package}", package).stdout if package else None


def faults_of_check(d):
    """Each damage must be found."""
    def damaged(change):
        other = copy.deepcopy(d)
        change(other)
        return list(faults_of_form(other))

    damages = {
        "another version": lambda o: o.update(spdxVersion="SPDX-2.2"),
        "no namespace": lambda o: o.pop("documentNamespace"),
        "a package without licence": lambda o: o["packages"][3].pop("licenseConcluded"),
        "an unknown licence": lambda o: o["packages"][3].update(licenseConcluded="GPL"),
        "a half expression": lambda o: o["packages"][3].update(licenseConcluded="MIT AND"),
        "a package twice": lambda o: o["packages"].append(o["packages"][3]),
        "a relation to nothing": lambda o: o["packages"].pop(3),
        "no text of a licence": lambda o: o["hasExtractedLicensingInfos"].pop(),
    }
    for name, change in damages.items():
        if not damaged(change):
            yield f"this test does not notice {name}"


def main():
    root, program = Path(sys.argv[1]).resolve(), sys.argv[2]
    if not shutil.which("dpkg-query"):
        print("SKIPPED: there is no dpkg here, and the page is about Debian's packages")
        return 77
    sys.path.insert(0, str(root / "scripts"))
    import make_sbom as sbom

    with tempfile.TemporaryDirectory() as folder:
        files = [Path(folder) / "tpmkit.spdx.json", Path(folder) / "third_party.txt"]
        command = [sys.executable, root / "scripts/make_sbom.py", program, *files]
        made = run(*command, env={**os.environ, "SOURCE_DATE_EPOCH": "1764288000"})
        first = files[0].read_bytes() if files[0].exists() else b""
        again = run(*command, env={**os.environ, "SOURCE_DATE_EPOCH": "1764288000"})
        faults = [f"make_sbom.py: {m.returncode}: {m.stderr.strip()}" for m in (made, again) if m.returncode or m.stderr]
        if not first:
            print("\n".join(faults))
            return 1
        if first != files[0].read_bytes():
            faults.append("the same program gives another list")
        d = json.loads(first)
        text = files[1].read_text(encoding="utf-8")
    loaded, compiled = sbom.tables((root / "docs/licences.md").read_text(encoding="utf-8"))
    faults += [*faults_of_form(d), *faults_of_list(d, program, loaded, compiled), *faults_of_page(loaded, compiled, sbom),
               *owners_of_headers(root, program, sbom), *faults_of_check(d)]
    for package, (licence, _, _) in compiled.items():
        if licence != "BSL-1.0" and not re.search(rf"^{re.escape(package)}$", text, re.M):
            faults.append(f"third_party.txt: has no notices of {package}")
    for fault in faults:
        print(fault)
    print(f"{len(d['packages'])} parts, {len(faults)} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
