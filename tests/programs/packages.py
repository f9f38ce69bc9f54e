#!/usr/bin/env python3
"""Checks what packages tpmkit for others, without network and without building anything.

    packages.py ROOT TPM

- one version in CMake, the program, CITATION.cff, CHANGELOG.md, the Debian changelog and the recipes; one licence; one date of
  the release, or none;
- packaging/debian: copyright in the form of DEP-5 with the text of LICENSE and the parts of docs/licences.md, control,
  tests, of which the one for the README's commands is run with TPM;
- packaging/conda/recipe.yaml and packaging/spack: read as YAML and as Python; every dependency of
  cmake/TpmDependencies.cmake is named by both, from the same version, and a check sum stands where there is an address, and only there;
- Dockerfile: stages, a user, an entry point; every path that it copies or runs exists;
- what scripts, recipes and the Dockerfile build is made by CMake.
"""

import ast
import os
import re
import subprocess
import sys
import tempfile
from email.utils import parsedate_to_datetime
from pathlib import Path

import yaml

# What cmake/TpmDependencies.cmake looks for, by the names of conda-forge and Spack. None: built by the recipe itself.
NAMES = {
    "Eigen3": ("eigen", "eigen"), "fmt": ("fmt", "fmt"), "Ceres": ("ceres-solver", "ceres-solver"),
    "TPM_HTTPLIB_LIBRARY": (None, "cpp-httplib"), "SUNDIALS": ("sundials", "sundials"), "muparser": ("muparser", "muparser"),
    "OpenSSL": ("openssl", "openssl"), "TBB": ("tbb-devel", "intel-tbb"), "ZLIB": ("zlib", "zlib"), "HDF5": ("hdf5", "hdf5"),
    "TPM_CSV_LIBRARY": (None, "libcsv"), "TPM_DEFLATE_LIBRARY": ("libdeflate", "libdeflate"),
    "TPM_MINIZIP_LIBRARY": ("minizip", "minizip"), "TPM_METIS_LIBRARY": ("metis", "metis"),
    "nlohmann_json": ("nlohmann_json", "nlohmann-json"), "Boost": ("libboost-devel", "boost"), "utf8cpp": ("utfcpp", "utf8cpp"),
    "nanoflann": ("nanoflann", "nanoflann"), "CLI11": ("cli11", "cli11"),
}
NOT_NAMED = {"Threads", "PkgConfig", "MPI"}  # of the C library; a tool; an option
SHA256 = re.compile(r"[0-9a-f]{64}")


def text_of(root, name):
    return (root / name).read_text(encoding="utf-8")


def found(pattern, text):
    match = re.search(pattern, text, re.M)
    return match[1] if match else None


def spack_class(root, package):
    """The class of a recipe, and the arguments of its calls: {name: [(positional, keywords)]}."""
    tree = ast.parse(text_of(root, f"packaging/spack/packages/{package}/package.py"))
    made = next(node for node in tree.body if isinstance(node, ast.ClassDef))
    calls = {}
    for node in made.body:
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Call):
            call = node.value
            words = [a.value for a in call.args if isinstance(a, ast.Constant)]
            calls.setdefault(call.func.id, []).append((words, {k.arg: ast.unparse(k.value) for k in call.keywords}))
    return made, calls


def faults_of_versions(root, program):
    version = found(r"^project\(tpmkit VERSION ([0-9.]+)", text_of(root, "CMakeLists.txt"))
    recipe = yaml.safe_load(text_of(root, "packaging/conda/recipe.yaml"))
    _, calls = spack_class(root, "tpmkit")
    places = {
        "tpm version": found(r"^tpm ([0-9.]+)", subprocess.run([program, "version"], capture_output=True, text=True, check=True).stdout),
        "CITATION.cff": str(yaml.safe_load(text_of(root, "CITATION.cff"))["version"]),
        "CHANGELOG.md": found(r"^## \[([0-9.]+)\]", text_of(root, "CHANGELOG.md")),
        "packaging/debian/changelog": found(r"^tpmkit \(([0-9.]+)\)", text_of(root, "packaging/debian/changelog")),
        "packaging/conda/recipe.yaml": str(recipe["context"]["version"]),
        "packaging/spack": calls["version"][0][0][0],
        "the archive that packaging/spack names": found(r"tpmkit-([0-9.]+)\.tar\.gz", text_of(root, "packaging/spack/packages/tpmkit/package.py")),
    }
    for place, there in places.items():
        if there != version:
            yield f"{place}: version {there}; CMakeLists.txt states {version}"
    if 'file = "VERSION"' not in text_of(root, "bindings/python/pyproject.toml") or '"$stage/VERSION"' not in text_of(root, "scripts/wheel.sh"):
        yield "scripts/wheel.sh: the wheel does not take the version of the program"
    licences = {
        "CITATION.cff": yaml.safe_load(text_of(root, "CITATION.cff"))["license"], "packaging/conda/recipe.yaml": recipe["about"]["license"].removesuffix(" AND LGPL-2.1-or-later"),
        "packaging/spack": calls["license"][0][0][0], "bindings/python/pyproject.toml": found(r'^license = { text = "(MIT) \(sources\)', text_of(root, "bindings/python/pyproject.toml")),
    }
    for place, there in licences.items():
        if there != "MIT":
            yield f"{place}: licence {there}; LICENSE is MIT"
    if not text_of(root, "LICENSE").startswith("MIT License"):
        yield "LICENSE: is not the MIT licence"


def faults_of_dates(root):
    """A tag needs one date in three places. Until then the heading says `unreleased`."""
    said = found(r"^## \[[0-9.]+\] - (.*)$", text_of(root, "CHANGELOG.md"))
    cited = yaml.safe_load(text_of(root, "CITATION.cff")).get("date-released")
    if said == "unreleased":
        if cited:
            yield f"CITATION.cff: date-released {cited}; CHANGELOG.md says unreleased"
        return
    if not re.fullmatch(r"\d{4}-\d\d-\d\d", said or ""):
        yield f"CHANGELOG.md: {said!r} is neither unreleased nor a date such as 2026-12-24"
        return
    signed = found(r"^ -- .*>  (.*)$", text_of(root, "packaging/debian/changelog"))
    for place, date in (("CITATION.cff, date-released", str(cited)), ("packaging/debian/changelog", parsedate_to_datetime(signed).date().isoformat())):
        if date != said:
            yield f"{place}: {date}; CHANGELOG.md says {said}"


def paragraphs(text):
    """Those of a file in Debian's control format: lists of {field: value}, comments left out."""
    for block in re.split(r"\n\s*\n", re.sub(r"^#.*\n", "", text, flags=re.M).strip()):
        fields, last = {}, None
        for line in block.split("\n"):
            match = re.match(r"([A-Za-z0-9-]+):\s*(.*)", line)
            if match:
                last = match[1]
                if last in fields:
                    raise SystemExit(f"field {last} twice")
                fields[last] = match[2]
            elif line[:1] in " \t" and last:
                fields[last] += "\n" + line[1:]
            else:
                raise SystemExit(f"no field: {line!r}")
        yield fields


def faults_of_copyright(root):
    header, *rest = paragraphs(text_of(root, "packaging/debian/copyright"))
    if header.get("Format") != "https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/":
        yield f"debian/copyright: Format is {header.get('Format')}"
    files = [p for p in rest if "Files" in p]
    texts = {p["License"].split("\n")[0]: p["License"] for p in rest if "Files" not in p and "License" in p}
    if [p["Files"] for p in files][:1] != ["*"]:
        yield "debian/copyright: the first paragraph of files is not that of all files"
    for p in files:
        if not p.get("Copyright") or p.get("License", "").split("\n")[0] not in texts:
            yield f"debian/copyright: {p['Files']}: no copyright, or a licence whose text is not there"
    written = "\n".join("" if line == "." else line for line in texts.get("Expat", "").split("\n")[1:])
    if "\n\n".join(text_of(root, "LICENSE").split("\n\n")[2:]).strip() != written.strip():
        yield "debian/copyright: the text of Expat is not that of LICENSE"
    if found(r"^Copyright \(c\) (.*)", text_of(root, "LICENSE")) != files[0]["Copyright"]:
        yield "debian/copyright: another holder than LICENSE"
    sys.path.insert(0, str(root / "scripts"))
    import make_sbom
    _, compiled = make_sbom.tables(text_of(root, "docs/licences.md"))
    named = dict(re.findall(r"^(lib\S+-dev|\S+-dev) \(([^)]+)\)", header.get("Comment", ""), re.M))
    for package in sorted(named.keys() | compiled.keys()):
        if package not in named or package not in compiled or named[package] != compiled[package][0]:
            yield f"debian/copyright: {package}: {named.get(package)}; docs/licences.md states {compiled.get(package)}"


def faults_of_debian(root, program):
    yield from faults_of_copyright(root)
    source, *binaries = paragraphs(text_of(root, "packaging/debian/control"))
    if source.get("Source") != "tpmkit" or "tpmkit" not in [b.get("Package") for b in binaries]:
        yield "debian/control: no source or no package tpmkit"
    tests = [name for p in paragraphs(text_of(root, "packaging/debian/tests/control")) for name in p["Tests"].split()]
    there = sorted(f.name for f in (root / "packaging/debian/tests").iterdir() if f.name != "control")
    if sorted(tests) != there:
        yield f"debian/tests: control lists {sorted(tests)}; there are {there}"
    for name in there:
        if not os.access(root / "packaging/debian/tests" / name, os.X_OK):
            yield f"debian/tests/{name}: is not executable"
    script = text_of(root, "packaging/debian/tests/readme-example")
    readme = text_of(root, "README.md")
    for command in ("tpm example recording", "tpm fit recording.csv"):
        if f"$ {command}\n" not in readme or not re.search(rf"^{command} ", script, re.M):
            yield f"'{command}' is not in the README and in debian/tests/readme-example"
    with tempfile.TemporaryDirectory() as folder:
        path = os.pathsep.join([str(Path(program).resolve().parent), os.environ["PATH"]])
        run = subprocess.run(["sh", root / "packaging/debian/tests/readme-example"], capture_output=True, text=True, check=False,
                             env={**os.environ, "PATH": path, "AUTOPKGTEST_TMP": folder, "MPLBACKEND": "Agg"})
    if run.returncode or "as the README says" not in run.stdout:
        yield f"debian/tests/readme-example: ends with {run.returncode}: {run.stdout[-500:]} {run.stderr[-500:]}"


def dependencies(root):
    """What cmake/TpmDependencies.cmake looks for."""
    text = re.sub(r"#.*", "", text_of(root, "cmake/TpmDependencies.cmake"))
    text = re.sub(r"macro\(tpm_find\).*?endmacro\(\)", "", text, flags=re.S)
    names = set(re.findall(r"(?:tpm_find|find_package)\((\w+)", text)) | set(re.findall(r"find_library\((TPM_[A-Z]+_LIBRARY)", text))
    return names - NOT_NAMED


def least_versions(root):
    """The least version of what cmake/TpmDependencies.cmake looks for: {name: version}."""
    text = re.sub(r"#.*", "", text_of(root, "cmake/TpmDependencies.cmake"))
    return {name: version for name, version in re.findall(r"(?:tpm_find|find_package)\((\w+) ([0-9.]+)", text) if name not in NOT_NAMED}


def faults_of_least_versions(root):
    """Both recipes ask for the least version that the build asks for."""
    host = yaml.safe_load(text_of(root, "packaging/conda/recipe.yaml"))["requirements"]["host"]
    conda = {str(r).split()[0]: found(r">=([0-9.]+)", str(r)) for r in host}
    _, calls = spack_class(root, "tpmkit")
    spack = {re.split(r"[@ ~+]", words[0])[0]: found(r"@([0-9.]+)", words[0]) for words, _ in calls["depends_on"]}
    least = least_versions(root)
    for name, version in least.items():
        for recipe, there in (("conda", conda.get(NAMES[name][0])), ("spack", spack.get(NAMES[name][1]))):
            if there != version:
                yield f"{recipe}: {name} from {there}; cmake/TpmDependencies.cmake asks for {version}"
    if len(least) < 10:
        yield f"this test found {len(least)} least versions; expected 10 or more"


def faults_of_recipes(root):
    yield from faults_of_least_versions(root)
    for name in sorted(dependencies(root) ^ NAMES.keys()):
        yield f"{name}: is in cmake/TpmDependencies.cmake or in this test, not in both"
    recipe = yaml.safe_load(text_of(root, "packaging/conda/recipe.yaml"))
    host = {str(r).split()[0] for r in recipe["requirements"]["host"]}
    for name, (conda, _) in NAMES.items():
        if conda and conda not in host:
            yield f"conda: {conda} for {name} is missing"
    for name in sorted(host - {c for c, _ in NAMES.values()} - {"brotli"}):
        yield f"conda: {name} is nothing that the build looks for"
    built = {s["target_directory"] for s in recipe["source"] if "target_directory" in s}
    if built != {"libcsv", "cpp-httplib"}:
        yield f"conda: builds {sorted(built)} itself"
    files = recipe["about"]["license_file"]
    for name in built:
        if not any(file.startswith(f"{name}/") for file in files):
            yield f"conda: the licence of {name}, which the package holds, is not in license_file"
    script = text_of(root, "packaging/conda/build.sh")
    for name in built:
        if not re.search(rf"(cmake -S|cd) {name}\b", script):
            yield f"conda: build.sh does not build {name}"
    for source in recipe["source"]:
        if ("url" in source) != bool(SHA256.fullmatch(source.get("sha256", ""))):
            yield f"conda: {source}: a check sum where there is no address, or none where there is one"
    if "no checksum" not in text_of(root, "packaging/conda/recipe.yaml"):
        yield "conda: does not say why the sources of tpmkit have no check sum"

    made, calls = spack_class(root, "tpmkit")
    sundials = next(words[0] for words, _ in calls["depends_on"] if words[0].startswith("sundials"))
    components = found(r"tpm_find\(SUNDIALS [0-9.]+ COMPONENTS ((?:\w|\s)+)\)", text_of(root, "cmake/TpmDependencies.cmake")).split()
    for name in {"cvode", "cvodes", "ida", "idas", "arkode", "kinsol"} & set(components):
        if f"+{name.upper()}" not in sundials.split():  # Spack writes the solvers in capitals
            yield f"spack: {sundials}: without +{name.upper()}"
    if re.search(r"[+~](cvodes?|idas?|arkode|kinsol)\b", sundials):
        yield f"spack: {sundials}: Spack writes the solvers in capitals"
    needed = {re.split(r"[@ ~+]", words[0])[0] for words, _ in calls["depends_on"]}
    for name, (_, spack) in NAMES.items():
        if spack not in needed:
            yield f"spack: {spack} for {name} is missing"
    for name in sorted(needed - {s for _, s in NAMES.values()} - {"c", "cxx", "cmake", "ninja", "pkgconfig", "python", "mpi"}):
        yield f"spack: {name} is nothing that the build looks for"
    if not ast.get_docstring(made) or any("sha256" in keywords for _, keywords in calls["version"]):
        yield "spack: no description, or a check sum of an archive that is not published"
    for folder in sorted((root / "packaging/spack/packages").iterdir()):
        made, calls = spack_class(root, folder.name)
        if made.name != "".join(part.capitalize() for part in folder.name.split("-")):
            yield f"spack: {folder.name}: class {made.name}"
        for _, keywords in calls["version"]:
            if folder.name != "tpmkit" and not SHA256.fullmatch(keywords.get("sha256", "").strip("'")):
                yield f"spack: {folder.name}: no check sum"
    sums = {s.get("sha256") for s in recipe["source"]}
    for package in ("libcsv", "cpp-httplib"):
        if not any(s and s in text_of(root, f"packaging/spack/packages/{package}/package.py") for s in sums):
            yield f"spack: {package}: another check sum than that of conda"


def faults_of_docker(root):
    text = re.sub(r"\\\n", " ", re.sub(r"^\s*#.*\n", "", text_of(root, "Dockerfile"), flags=re.M))
    steps = [line.split(None, 1) for line in text.splitlines() if line.strip()]
    ignored = {line.strip().strip("/") for line in text_of(root, ".dockerignore").splitlines()}
    stages = [rest for word, rest in steps if word == "FROM"]
    if len(stages) < 2:
        yield "Dockerfile: one stage only"
    last = max(i for i, (word, _) in enumerate(steps) if word == "FROM")
    words = {word: rest for word, rest in steps[last:]}
    if words.get("USER", "root").split(":")[0] in ("root", "0"):
        yield "Dockerfile: the last stage runs as root"
    elif not re.search(rf"useradd [^&]*\b{words['USER']}\b", text):
        yield f"Dockerfile: nobody makes the user {words['USER']}"
    if words.get("ENTRYPOINT") != '["tpm"]':
        yield f"Dockerfile: entry point {words.get('ENTRYPOINT')}; expected [\"tpm\"]"
    names = {found(r" AS (\S+)", stage) for stage in stages}
    for word, rest in steps:
        parts = rest.split()
        if word == "COPY":
            stage = found(r"--from=(\S+)", rest)
            if stage and stage not in names:
                yield f"Dockerfile: copies from {stage}, which is no stage"
            for path in [] if stage else [p for p in parts[:-1] if not p.startswith("--")]:
                if not (root / path).exists() or path.strip("/") in ignored:
                    yield f"Dockerfile: copies {path}, which does not exist or is ignored"
        for path in re.findall(r"(?<![\w/.])((?:scripts|packaging|configs|data)/[\w./-]+)", rest):
            if not (root / path).exists():
                yield f"Dockerfile: names {path}, which does not exist"
    for package in re.findall(r"/debs/([a-z0-9-]+)_\*\.deb", text):
        if not re.search(rf"^tpm_package\(\w+ {package} ", text_of(root, "cmake/TpmPackages.cmake"), re.M):
            yield f"Dockerfile: installs {package}, which is none of the packages"


def faults_of_targets(root):
    """Targets that are built by name, by `build PRESET TARGET...` or `cmake --build FOLDER --target TARGET...`."""
    made = {"install"}
    for file in [root / "CMakeLists.txt", *root.glob("cmake/*.cmake"), *root.glob("bindings/*/CMakeLists.txt"),
                 root / "tests/CMakeLists.txt"]:
        made.update(re.findall(r"(?:add_executable|add_library|add_custom_target|pybind11_add_module)\((\w+)", file.read_text(encoding="utf-8")))
    scripts = [*sorted((root / "scripts").glob("*.sh")), root / "packaging/conda/build.sh"]
    count = 0
    for file in scripts:
        text = re.sub(r"\\\n", " ", file.read_text(encoding="utf-8"))
        for names in re.findall(r"^ *build [\w\"$-]+ ([\w ]+)$|cmake --build \S+ --target ([\w ]+)$", text, re.M):
            for name in " ".join(names).split():
                count += 1
                if name not in made:
                    yield f"{file.relative_to(root)}: builds {name}, which CMake does not make"
    if count < 8:
        yield f"this test found {count} targets in the scripts; expected 8 or more"


def faults_of_machines(root):
    """A bare machine has what a script installs: without the tests' packages it configures without tests."""
    count = 0
    for script in sorted((root / "scripts").glob("*.sh")):
        text = re.sub(r"\\\n", " ", script.read_text(encoding="utf-8"))
        first = re.search(r"\bconfigure release\b.*", text)
        if first is None or script.name == "install_packages.sh":
            continue
        count += 1
        if "packages_test[@]" not in text and "TPM_BUILD_TESTS=OFF" not in first[0]:
            yield f"scripts/{script.name}: configures the tests without installing packages_test; expected -DTPM_BUILD_TESTS=OFF"
    if count < 6:
        yield f"this test found {count} scripts that configure; expected 6 or more"


def main():
    root, program = Path(sys.argv[1]).resolve(), sys.argv[2]
    faults = [*faults_of_versions(root, program), *faults_of_dates(root), *faults_of_debian(root, program), *faults_of_recipes(root), *faults_of_docker(root),
              *faults_of_targets(root), *faults_of_machines(root)]
    for fault in faults:
        print(fault)
    print(f"{len(faults)} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
