#!/usr/bin/env python3
"""Checks the examples of docs/adding.md, its blocks of "```diff".

    adding.py ROOT               each applies to a copy of the sources (lines may have moved, those next to a change may not
                                 differ) and changes at most three files, none of them a header that is already there
    adding.py ROOT BUILD TPM     builds a tpm with all of them: compiles the changed files with the commands of BUILD (static,
                                 Ninja), links them in place of the old ones, and runs what the examples add
"""
import csv
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

MOST = 3  # files of an example
NONE = "/dev/null"
WANTED = ("An importer", "A figure", "A scene key")


def examples(page):
    """[(heading, text of the diff, [(old file, new file)])]"""
    found = []
    for part in re.split(r"^## ", page, flags=re.M)[1:]:
        for block in re.findall(r"^```diff\n(.*?)^```$", part, re.M | re.S):
            found.append((part.splitlines()[0], block, re.findall(r"^--- (?:a/)?(\S+)\n\+\+\+ (?:b/)?(\S+)$", block, re.M)))
    return found


def applied(root, folder, heading, text, files):
    """Applies an example to copies in `folder`; yields what is wrong with it."""
    if not 0 < len(files) <= MOST:
        yield f"{heading}: changes {len(files)} files; expected 1 to {MOST}"
    for old, new in files:
        if old == NONE and (root / new).exists():
            yield f"{heading}: {new} is already there"
        if old != NONE and old.endswith(".hpp"):
            yield f"{heading}: changes the header {old}, whose users this test does not build"
        if old != NONE and not (folder / old).exists():
            (folder / old).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(root / old, folder / old)
    done = subprocess.run(["patch", "-p1", "--forward", "--fuzz=1", "--batch", "--no-backup-if-mismatch", "-d", folder],
                          input=text, capture_output=True, text=True)
    if done.returncode != 0:
        yield f"{heading}: does not apply: {' '.join((done.stdout + done.stderr).split())}"


def command_of(file, root, build):
    """The command that compiles a source, or its unity batch; of a new source, that of a neighbour."""
    commands = json.loads((build / "compile_commands.json").read_text(encoding="utf-8"))
    near = None
    for entry in commands:
        if "-fsanitize" in entry["command"]:  # copies for tests of threads
            continue
        source = Path(entry["file"])
        names = [source]
        if "Unity" in source.parts:
            names = [source.parent / n for n in re.findall(r'#include "([^"]+)"', source.read_text(encoding="utf-8"))]
        names = [os.path.normpath(n) for n in names]
        if str(root / file) in names:
            return entry
        if str((root / file).parent) in map(os.path.dirname, names):
            near = entry
    return near


def built(root, build, folder, sources, out):
    objects = []
    for source in sources:
        entry = command_of(source, root, build)
        words = shlex.split(entry["command"])
        words = [w for n, w in enumerate(words) if w not in ("-c", "-o", entry["file"]) and words[n - 1] != "-o"]
        objects.append(str(folder / source) + ".o")
        subprocess.run([words[0], f"-I{folder}/src", *words[1:], "-c", folder / source, "-o", objects[-1]],
                       cwd=entry["directory"], check=True)
    listed = subprocess.run(["ninja", "-C", build, "-t", "commands", "tpm"], capture_output=True, text=True, check=True).stdout
    link = shlex.split(next(line for line in reversed(listed.splitlines()) if " -o tpm " in line))
    link = link[link.index("&&") + 1:] if link[0] == ":" else link
    link = link[:link.index("&&")] if "&&" in link else link
    link[link.index("-o") + 1] = str(out)
    # Before the program's own objects and the libraries: the first definition is taken.
    first = next(n for n, word in enumerate(link) if word.endswith(".o"))
    link[first:first] = ["-Wl,--allow-multiple-definition", *objects]
    subprocess.run(link, cwd=build, check=True)


TRIOS = """Filename\tgel.tri
Instrument name\tDiscovery HR-3

[step]
Frequency sweep - 1
Angular frequency\tStorage modulus\tLoss modulus\tTemperature
rad/s\tPa\tPa\t°C
1\t820.5\t61.2\t25
10\t874.1\t80.4\t25
100\t951.3\t143.9\t25

[step]
Stress relaxation - 2
Step time\tStrain\tStress
s\t%\tPa
0.1\t1\t9.1
1\t1\t8.4
10\t1\t8.2

[step]
Conditioning End - 3
"""
KNOTS = [{"time": "0 s", "depth": "0 mm"}, {"after": "1 s", "depth": "4 mm"}, {"after": "2 s", "depth": "4 mm"}]


def run(*words, cwd, code=0):
    done = subprocess.run(words, cwd=cwd, capture_output=True, text=True, check=False)
    assert done.returncode == code, f"{words}: ends with {done.returncode}: {done.stdout}{done.stderr}"
    return done.stdout + done.stderr


def values(file):
    with open(file, encoding="utf-8", newline="") as text:
        return [[float(value) for value in row] for row in list(csv.reader(text))[1:]]


def importer_reads(tpm, folder):
    (folder / "gel.txt").write_text(TRIOS, encoding="utf-8")
    assert "format: trios" in run(tpm, "data", "import", "gel.txt", "--folder", "steps", cwd=folder)
    sweep, relaxation = sorted((folder / "steps").glob("*.csv"))  # the third step has no samples
    assert values(sweep) == [[1, 820.5, 61.2], [10, 874.1, 80.4], [100, 951.3, 143.9]], values(sweep)
    # A strain that is kept: the stress is divided by it.
    assert values(relaxation) == [[0.1, 910], [1, 840], [10, 820]], values(relaxation)
    run(tpm, "data", "import", "gel.txt", "--dataset", "Stress relaxation - 2", "-o", "one.csv", cwd=folder)
    assert values(folder / "one.csv") == values(relaxation)
    assert "no step has samples" in run(tpm, "data", "import", "gel.txt", "--dataset", "Conditioning End - 3", cwd=folder, code=3)


def figure_is_drawn(tpm, folder):
    run(tpm, "example", "recording", cwd=folder)
    run(tpm, "fit", "recording.csv", cwd=folder)
    figures = json.loads((folder / "recording_fit/figures.json").read_text(encoding="utf-8"))["figures"]
    series = next(f for f in figures if f["id"] == "residual_quantiles")["panels"][0]["series"]
    x, y = series[0]["x"], series[0]["y"]
    count = len(x)
    assert count > 100 and y == sorted(y) and max(abs(a + b) for a, b in zip(x, reversed(x))) < 1e-4
    # Noise of the example is normal, its size is not stated: residuals lie on a straight line but for their ends.
    slope = sum(a * b for a, b in zip(x, y)) / sum(a * a for a in x)
    assert max(abs(slope * a - b) for a, b in list(zip(x, y))[count // 10:-(count // 10)]) < 0.2 * slope
    assert (folder / "recording_fit/residual_quantiles.svg").stat().st_size > 1000


def key_is_read(tpm, folder):
    def scene(knots):
        text = {"organ": {"kind": "star"}, "protocol": {"kind": "knots", "knots": knots}, "outputs": {"times": ["1 s", "3 s"]}}
        (folder / "scene.json").write_text(json.dumps(text), encoding="utf-8")

    answers = []
    for knots in (KNOTS, [{"time": t, "depth": k["depth"]} for t, k in zip(("0 s", "1 s", "3 s"), KNOTS)]):
        scene(knots)
        answers.append(json.loads(run(tpm, "simulate", "scene.json", "--format", "json", cwd=folder)))
    assert answers[0]["last"]["time_s"] == 3.0 and answers[0]["last"] == answers[1]["last"], answers[0]["last"]
    scene([*KNOTS[:2], {"time": "3 s", "after": "2 s", "depth": "4 mm"}])
    assert "/knots/2: states both; expected time or after" in run(tpm, "simulate", "scene.json", cwd=folder, code=3)
    assert '"after"' in run(tpm, "schema", "scene", cwd=folder)


def device_runs(tpm, folder):
    run(tpm, "example", "session", cwd=folder)
    said = run(tpm, "hil", "run", "hil_liver.json", "--device", "virtual_falcon", "-o", "falcon.tpmrec", cwd=folder)
    assert "simulated Falcon (virtual_falcon" in said, said


def main():
    root = Path(sys.argv[1]).resolve()
    if shutil.which("patch") is None:
        print("SKIPPED: there is no program 'patch'")
        return 77
    found = examples((root / "docs/adding.md").read_text(encoding="utf-8"))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        faults = [f"docs/adding.md: has no example below '{h}'" for h in WANTED if h not in [heading for heading, _, _ in found]]
        for example in found:
            faults += applied(root, folder, *example)
        for fault in faults:
            print(fault)
        if faults or len(sys.argv) < 4:
            print(f"{len(faults)} faults")
            return 1 if faults else 0
        build, old = Path(sys.argv[2]).resolve(), Path(sys.argv[3]).resolve()
        if not (build / "build.ninja").exists():
            print("SKIPPED: the build is not one of Ninja")
            return 77
        sources = [new for _, _, files in found for _, new in files if new.endswith(".cpp")]
        built(root, build, folder, sources, folder / "tpm")
        os.environ.setdefault("TPMKIT_SHARE", str(root))
        for check in (importer_reads, figure_is_drawn, key_is_read, device_runs):
            for program, works in ((folder / "tpm", True), (old, False)):  # the program without the examples has none of it
                at = folder / f"{check.__name__}_{works}"
                at.mkdir()
                try:
                    check(str(program), at)
                except (AssertionError, StopIteration, ValueError) as error:
                    if works:
                        raise
                    print(f"{check.__name__}: passes with the examples, fails without: {str(error)[:100]}")
                    continue
                assert works, f"{check.__name__}: passes without the examples"
    return 0


if __name__ == "__main__":
    sys.exit(main())
