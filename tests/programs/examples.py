#!/usr/bin/env python3
"""The inputs that come with tpm, as an installed program finds, copies and reads them.

    examples.py ROOT BUILD

Installs the program's component of BUILD into a temporary folder and calls that tpm, from other folders and without
the sources: every example is copied and read by the command it is for; configs/... stands for the shipped file
where there is none; a file of the user's own is taken first and never written over.
"""
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

FAULTS = []


def check(true, what):
    if not true:
        FAULTS.append(what)


class Program:
    """The installed tpm, called from a folder."""

    def __init__(self, file, rooms):
        self.file = file
        self.environment = {k: v for k, v in os.environ.items() if not k.startswith("TPM")}
        self.environment["LD_LIBRARY_PATH"] = str(rooms)  # of builds whose rooms are shared libraries

    def __call__(self, folder, *words, code=0, user=None):
        run = subprocess.run([self.file, *words], cwd=folder, env=self.environment, capture_output=True, text=True,
                             user=user, check=False)
        check(run.returncode == code, f"tpm {list(map(str, words))}: ended with {run.returncode}, expected {code}: {run.stderr}")
        return run


def copies(tpm, work):
    """Each example is copied, and the command printed next reads the copy."""
    listed = json.loads(tpm(work, "example", "--format", "json").stdout)
    text = tpm(work, "example").stdout
    check(len(listed["examples"]) >= 8, "few examples")
    for source in listed["real_recordings"]:
        check(source["source"] in text, f"{source['source']} is not named in the text")
    for example in listed["examples"]:
        name = example["name"]
        check(name in text and example["about"] in text, f"{name} is not in the text")
        check(example["provenance"] in ("synthetic", "derived from the paper"), f"{name}: {example['provenance']}")
        folder = work / "copies of" / name
        copy = json.loads(tpm(work, "example", name, "--folder", folder, "--format", "json").stdout)
        check(sorted(p.name for p in folder.iterdir()) == sorted(example["files"]), f"{name}: copied {copy['files']}")
        check(copy["next"].startswith(example["command"] + " '"), f"{name}: next is {copy['next']}, a name with blanks unquoted")
        again = tpm(work, "example", name, "--folder", folder)  # what is there already is the same
        check(copy["next"] in again.stdout, f"{name}: text and JSON name different next commands")
        yield name, folder, copy["next"]


def read_by_their_commands(tpm, work):
    quick = {"fit": "--no-draw --starts 2", "paper": "", "design": "--repetitions 0", "simulate": "-o out.h5", "plan": "",
             "sweep": "-o out.h5", "hil": "-o out.tpmrec"}
    for name, folder, line in copies(tpm, work):
        more = quick[line.split()[1]]
        run = subprocess.run(["sh", "-c", f'{line.replace("tpm", str(tpm.file), 1)} {more}'], cwd=work,
                             env=tpm.environment, capture_output=True, text=True, check=False)
        # An audit that finds claims which differ says no.
        check(run.returncode == 0 or (name == "claims" and run.returncode == 1), f"{line}: {run.returncode}: {run.stderr}")
        check(run.stdout.strip(), f"{line}: printed nothing")


def recording_is_what_its_program_makes(work, tpm):
    folder = work / "made"
    tpm(work, "example", "recording", "--folder", folder)
    shipped = (folder / "recording.csv").read_bytes()
    (folder / "recording.csv").unlink()
    subprocess.run([sys.executable, "make_recording.py"], cwd=folder, check=True)
    check((folder / "recording.csv").read_bytes() == shipped, "make_recording.py does not make recording.csv")
    check(shipped.startswith(b"# SYNTHETIC"), "recording.csv does not say that it is synthetic")


def never_written_over(tpm, work):
    mine = work / "own"
    mine.mkdir()
    (mine / "recording.csv").write_text("mine\n")
    run = tpm(mine, "example", "recording", code=2)
    check((mine / "recording.csv").read_text() == "mine\n", "a file of the user's own was replaced")
    check(run.stderr.count("\n") == 1 and "expected another --folder, or --overwrite" in run.stderr, run.stderr)
    check(not (mine / "make_recording.py").exists(), "half an example was copied")
    tpm(mine, "example", "recording", "--overwrite")
    check((mine / "recording.csv").read_text().startswith("# SYNTHETIC"), "--overwrite did not replace")
    run = tpm(mine, "example", "nothing", code=2)
    misspelt = tpm(mine, "example", "recroding", code=2)
    check("no example 'recroding' (did you mean 'recording'?)" in misspelt.stderr, misspelt.stderr)
    check("no example 'nothing'; expected one of recording, " in run.stderr, run.stderr)
    tpm(mine, "example", "--folder", "x", code=2)


def without_permission(tpm, work):
    locked = work / "locked"
    locked.mkdir()
    locked.chmod(0o555)
    user = "nobody" if os.getuid() == 0 else None
    work.chmod(0o755)
    run = tpm(locked, "example", "recording", code=5, user=user)
    check(run.stderr.count("\n") == 1 and "cannot write" in run.stderr, run.stderr)
    check(not list(locked.iterdir()), "something was written into a folder without permission")
    # Reading needs no permission to write.
    run = tpm(locked, "network", "check", "configs/liver_scene.json", user=user)
    check("using the one that comes with tpm" in run.stderr, run.stderr)


def shipped_stand_in(tpm, work):
    """configs/... leads to the shipped file where there is none, and says so; a file of that name comes first."""
    empty = work / "empty"
    empty.mkdir()
    run = tpm(empty, "network", "check", "configs/liver_scene.json")
    share = tpm.file.parent.parent / "share/tpmkit/configs/liver_scene.json"
    line = f"tpm: configs/liver_scene.json is not here: using the one that comes with tpm, {share}\n"
    check(run.stderr == line, run.stderr)
    check("424 spheres" in run.stdout, run.stdout)
    tpm(empty, "data", "check", "data/evren_static.csv")
    run = tpm(empty, "network", "check", "configs/../../escape.json", code=3)
    check("using" not in run.stderr, run.stderr)
    run = tpm(empty, "network", "check", "configs/nothing.json", code=3)
    check("using" not in run.stderr and "configs/nothing.json" in run.stderr, run.stderr)
    # Files that options name, too.
    organ, recording = "configs/budget_liver.json", "configs/recording_example/recording.csv"
    for words, read in ((("budget", "none.json", "--scene", organ, "--finer"), organ),
                        (("validate", "none.json", recording, "--at-recording"), recording),
                        (("validate", "none.json", recording, "--calibration-instrument"), organ),
                        (("hil", "run", "none.json", "-o", "none.tpmrec", "--replay-motion"), recording)):
        run = tpm(empty, *words, read, code=3)
        files = [word for word in (*words, read) if word.startswith("configs/")]
        told = [line for line in run.stderr.splitlines() if "is not here: using" in line]
        check(sorted(told) == sorted(f"tpm: {file} is not here: using the one that comes with tpm, {share.parent.parent / file}"
                                     for file in files), run.stderr)
    # What is written stays where the user says.
    tpm(empty, "schema", "scene")
    tpm(empty, "paper", "audit", "-o", "configs/liver_scene.json", "--format", "json")
    check((empty / "configs/liver_scene.json").exists(), "an output was sent elsewhere")
    check(share.read_text() == (Path(sys.argv[1]) / "configs/liver_scene.json").read_text(), "a shipped file was changed")
    run = tpm(empty, "network", "check", "configs/liver_scene.json", code=3)  # it is now the user's, and no scene
    check("using" not in run.stderr, run.stderr)


def no_recording(tpm, work):
    """A shipped curve that is no recording cannot be fitted alone: the answer names what can."""
    configuration = "configs/liver_all.json"
    for curve in ("evren_relaxation", "evren_static", "amy_creep"):
        run = tpm(work, "fit", curve, code=3)
        check(run.stderr.count("\n") == 1 and run.stderr.endswith(f"tpm fit {configuration}\n"), run.stderr)
        check(f'"{curve}"' in (Path(sys.argv[1]) / configuration).read_text(), f"{configuration} does not read {curve}")
    run = tpm(work, "fit", "literature_values", code=3)
    check(run.stderr.endswith("tpm data show literature_values\n"), run.stderr)


def name_for_a_file(tpm, work):
    """An example's name where a file is expected: every command says how to come by the files."""
    empty = work / "names"
    empty.mkdir()
    press = ("--depth", "2 mm", "--rate", "2 mm/s", "--hold", "3 s")
    for name in [one["name"] for one in json.loads(tpm(empty, "example", "--format", "json").stdout)["examples"]]:
        for words in (("fit", name), ("predict", name, *press), ("validate", name, "data/evren_static.csv"), ("simulate", name), ("plan", name),
                      ("sweep", name), ("hil", "run", name, "-o", "s.tpmrec"), ("paper", "audit", name), ("design", name),
                      ("budget", name, *press), ("view", name), ("identify", name), ("network", "check", name)):
            run = tpm(empty, *words, code=3)
            told = f"tpm: {name}: is the name of an example, and no such file is here; expected its files: tpm example {name}, then tpm "
            check(run.stderr.splitlines()[-1].startswith(told), f"tpm {' '.join(words)}: {run.stderr}")
        check(not any(empty.iterdir()), f"something was left in {empty}")
    (empty / "organ").write_text("{}")  # a file of that name is the user's
    check("is the name of an example" not in tpm(empty, "simulate", "organ", code=3).stderr, "organ is a file")


def example_client(tpm, work):
    """The client of tpm hil serve is installed, too, and needs nothing but Python."""
    client = tpm.file.parent.parent / "share/tpmkit/examples/inverse_client.py"
    run = subprocess.run([sys.executable, client, "--help"], cwd=work, capture_output=True, text=True, check=False)
    check(run.returncode == 0 and "--messages" in run.stdout, run.stderr)


def main():
    program_build = Path(sys.argv[2])
    with tempfile.TemporaryDirectory() as name:
        work = Path(name).resolve()
        subprocess.run(["cmake", "--install", program_build, "--prefix", work / "installed", "--component", "program"],
                       check=True, capture_output=True)
        tpm = Program(work / "installed/bin/tpm", program_build.resolve())
        read_by_their_commands(tpm, work)
        recording_is_what_its_program_makes(work, tpm)
        never_written_over(tpm, work)
        without_permission(tpm, work)
        shipped_stand_in(tpm, work)
        no_recording(tpm, work)
        name_for_a_file(tpm, work)
        example_client(tpm, work)
    for fault in FAULTS:
        print(fault)
    print(f"{len(FAULTS)} faults")
    return 1 if FAULTS else 0


if __name__ == "__main__":
    sys.exit(main())
