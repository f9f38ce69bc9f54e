#!/usr/bin/env python3
"""Answers in JSON: every command with --format json prints one envelope, and docs/json.md lists the members.

    answers.py ROOT TPM            compares
    answers.py ROOT TPM --write    writes the table of docs/json.md

Runs each command once, and then each command that an answer names as the next. SLOW are those that take minutes, wait for a client or measure the machine.
"""

import hashlib
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ENVELOPE = ["tpm", "command", "version", "inputs", "verdicts", "remarks"]
FORMER = ("warnings", "flags", "notes")  # what remarks were called in some results
PRESS = '--depth "2 mm" --rate "2 mm/s" --hold "3 s"'
RUNS = f"""
example recording
example
data list
data show evren_relaxation
data check recording.csv
data import recording.csv
data import recording.csv -o imported --overwrite
data pack evren_static -o packed.h5 --overwrite
fit recording.csv --laws linear-1 --starts 2 --folder fitted
fit CONFIGS/liver_relaxation.json --starts 2
fit "my recording.csv" --laws linear-1 --starts 2 --folder "my fit"
predict fitted/law.json {PRESS}
predict fitted/law.json --frequencies "1 Hz, 10 Hz"
validate fitted/law.json recording.csv --require 10%
identify recording.csv --laws linear-1 --no-loop
identify "my recording.csv" --laws linear-1 --no-loop -o answer.json --folder "it's identified"
laws
laws power-2
design CONFIGS/design_liver.json --repetitions 0
design CONFIGS/coverage_absolute.json --repetitions 2
design --laws linear --repetitions 1
network build --spheres 60 -o net.h5
network check CONFIGS/liver_inner_fixed_scene.json
material fitted/law.json CONFIGS/liver_scene.json recording.csv --folder on_liver
simulate small.json -o small.h5
view small.h5 -o small.html
plan CONFIGS/plan/star.json --costs nominal
plan CONFIGS/plan/star.json --costs nominal --estimate
sweep CONFIGS/sweep_x_depth_100.json -o sweep.h5
sweep CONFIGS/sweep_x_depth_100.json -o sweep.h5
sweep CONFIGS/sweep_x_depth_100.json -o parts.h5 --shard 1/1
sweep merge CONFIGS/sweep_x_depth_100.json -o parts.h5
sweep show sweep.h5
sweep best sweep.h5 --objective peak_force
sweep CONFIGS/sweep_convergence_step.json -o step.h5
sweep convergence step.h5 --axis step
hil devices
hil check --duration "0.2 s"
hil run session.json -o session.tpmrec
hil verify session.tpmrec
hil report session.tpmrec
hil export session.tpmrec -o rows.h5
budget fitted/law.json {PRESS} --draws 100
budget "my fit/law.json" "my recording.csv" --draws 100
budget fitted/law.json recording.csv --draws 100 --folder budget
paper tables
paper audit
accuracy verify closed-forms
accuracy verify --list
accuracy benchmark --list
version
"""
SLOW = {"hil serve", "hil identify", "hil stability", "paper experiments", "accuracy benchmark", "accuracy stability",
        "sweep sensitivity"}
BEGIN, END = "<!-- members: written by tests/programs/answers.py -->", "<!-- end of members -->"


# Every answer has `files` and `next`, but these, after which nothing is to be typed.
UNENDED = ("data show", "data check", "laws power-2", "design --laws", "hil devices", "accuracy verify --list",
           "accuracy benchmark --list", "version")
# Of the quick ones the text is compared, too: it ends with the same command.
QUICK = ("example", "data ", "fit recording.csv", 'fit "my', "predict", "validate ", "budget ", "design CONFIGS/design_liver.json",
         "laws", "network", "paper", "sweep", "view", "plan CONFIGS/plan/star.json --costs nominal --estimate")
WRITTEN = ("-o", "--output", "--folder")
# Commands to type next that take minutes: read, not run; their files must be there.
LONG = ("tpm paper report", "tpm plan configs/", "tpm accuracy", "tpm fit ")


def with_format(command, path=""):
    if any("--format" in o["names"] for o in command["options"]) and path:
        yield path
    for below in command.get("commands", []):
        yield from with_format(below, f"{path} {below['name']}".strip())


def faults_of_remarks(part, place=""):
    """Of the key `remarks` wherever it stands: a list of {code, text}, and no list of texts by another name."""
    faults = []
    if isinstance(part, list):
        return [fault for one in part for fault in faults_of_remarks(one, place + "/-")]
    if not isinstance(part, dict):
        return faults
    for key, value in part.items():
        here = f"{place}/{key}"
        if key == "remarks":
            of_code = lambda one: re.fullmatch("[a-z][a-z0-9_]*", one["code"]) and one["text"]
            if not isinstance(value, list) or not all(
                isinstance(one, dict) and set(one) == {"code", "text"} and of_code(one) for one in value
            ):
                faults.append(f"{here} is no list of {{code, text}}: {value}")
        elif key in FORMER and isinstance(value, list) and all(isinstance(one, str) for one in value):
            faults.append(f"{here} is a list of texts: is it remarks?")
        else:
            faults += faults_of_remarks(value, here)
    return faults


def faults_of(answer, words, folder, exit_code):
    """What is wrong with the envelope of an answer."""
    if not isinstance(answer, dict):
        return ["is no object"]
    faults = []
    if list(answer)[: len(ENVELOPE)] != ENVELOPE:
        faults.append(f"begins with {list(answer)[:len(ENVELOPE)]}")
        return faults
    if not " ".join(words).startswith(answer["command"]) or answer["tpm"] != 1:
        faults.append(f"command '{answer['command']}', shape {answer['tpm']}")
    for one in answer["inputs"]:
        digest = hashlib.sha256((folder / one["file"]).read_bytes()).hexdigest()
        if digest != one["sha256"]:
            faults.append(f"SHA-256 of {one['file']} is not that of the file")
    places = [(folder / one["file"]).parts for one in answer["inputs"]]
    if places != sorted(places):
        faults.append("inputs are not sorted by their whole paths")
    read = {Path(one["file"]).resolve() for one in answer["inputs"]} | {(folder / one["file"]).resolve() for one in answer["inputs"]}
    for word in words[1:]:
        given = folder / word
        if given.is_file() and given.resolve() not in read and words[words.index(word) - 1] not in ("-o", "--output"):
            faults.append(f"{word} was given and is no input")
    faults += faults_of_remarks(answer)
    if any(set(one) != {"code", "holds"} for one in answer["verdicts"]):
        faults.append("a verdict without code or holds")
    if exit_code == 1 and all(one["holds"] for one in answer["verdicts"]):
        faults.append("exit code 1, and no verdict says no")
    if exit_code == 0 and any(not one["holds"] for one in answer["verdicts"]):
        faults.append("exit code 0, and a verdict says no")
    return faults


def faults_of_end(answer, text):
    """Where text and JSON of an answer end otherwise."""
    if not isinstance(answer.get("files"), list) or "next" not in answer:
        return ["files or next are missing"]
    said = re.findall(r"(?:^|; )next: (.*)$", text, re.M)
    wanted = [] if answer["next"] is None else [answer["next"]]
    return [f"next is {answer['next']}, the text says {said}"] if said != wanted else []


def faults_of_line(line, usage):
    """What keeps a command to type next from being one that tpm takes: its words, names of options, number of arguments."""
    words = shlex.split(line)
    if words[:1] != ["tpm"]:
        return [f"'{line}' is no command"]
    command, rest = usage, words[1:]
    while rest and rest[0] in [below["name"] for below in command.get("commands", [])]:
        command = next(below for below in command["commands"] if below["name"] == rest[0])
        rest = rest[1:]
    names = {name: option for option in command["options"] for name in option["names"]}
    faults, given = [], []
    while rest:
        word = rest.pop(0)
        if not word.startswith("-"):
            given.append(word)
        elif word not in names:
            faults.append(f"'{line}': no option {word}")
        elif not names[word].get("flag", False) and rest:
            rest.pop(0)
    if any(re.search("[A-Z]{4}", word) and not Path(word).is_absolute() for word in given):
        faults.append(f"'{line}' has a name to be replaced")
    return faults


def faults_of_files(line, root, folder):
    """Files that a command to type next reads and that are neither beside the answer's files nor shipped."""
    words = shlex.split(line)
    read = [word for before, word in zip(words, words[1:]) if before not in WRITTEN and re.search(r"[.](csv|h5|json|tpmrec)$", word)]
    shipped = [root / word for word in read if word.startswith("configs/")]
    beside = [folder / word for word in read if not word.startswith("configs/")]
    return [f"'{line}': {file} does not exist" for file in shipped + beside if not file.is_file()]


def faults_of_next(line, usage, program, root, folder):
    """Types a command that an answer names, beside the files of that answer."""
    faults = faults_of_line(line, usage)
    if faults or line.startswith(LONG):
        return faults + faults_of_files(line, root, folder)
    with tempfile.TemporaryDirectory() as name:
        there = Path(name) / "typed"
        shutil.copytree(folder, there)
        words = shlex.split(line)
        for before, word in zip(words, words[1:]):
            if before == "-o":  # a name that is free
                (there / word).unlink(missing_ok=True)
        path = f"{program.parent}:{os.environ['PATH']}"
        try:
            done = subprocess.run(["sh", "-c", line], cwd=there, env=dict(os.environ, PATH=path), capture_output=True,
                                  text=True, timeout=1200)
        except subprocess.TimeoutExpired:
            return [f"next: {line}: has not ended after 1200 s"]
    return [f"next: {line}: ends with {done.returncode}: {done.stderr.strip()}"] if done.returncode > 1 else []


def orders_of_shards(program, sweep, folder):
    """Orders of shards in which `sweep merge` writes another result or another answer."""
    names = [f"ordered.h5.shard-{k}-of-3" for k in (1, 2, 3)]
    for k in (1, 2, 3):
        subprocess.run([program, "sweep", sweep, "--shard", f"{k}/3", "-o", "ordered.h5"], cwd=folder, check=True, capture_output=True)

    def merged(shards):
        command = [program, "sweep", "merge", sweep, *shards, "-o", "ordered.h5", "--format", "json"]
        answer = subprocess.run(command, cwd=folder, check=True, capture_output=True).stdout
        return answer, (folder / "ordered.h5").read_bytes()

    usual = merged(names)
    orders = [[names[k] for k in order] for order in ((2, 1, 0), (1, 2, 0), (2, 0, 1))]
    return [f"tpm sweep merge {' '.join(o)}: not the bytes of the usual order" for o in orders + [[]] if merged(o) != usual]


def main():
    root, program = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve()
    sys.path.insert(0, str(root / "scripts"))
    from fault_table import INDENTED, SESSION  # noqa: E402

    usage = json.loads(subprocess.run([program, "--json-usage"], capture_output=True, text=True, check=True).stdout)
    wanted = set(with_format(usage))
    members, faults, met, typed = {}, 0, set(), set()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "small.json").write_text(json.dumps(INDENTED))
        (folder / "session.json").write_text(json.dumps(SESSION))
        for line in RUNS.strip().splitlines():
            words = [w.replace("CONFIGS", str(root / "configs")) for w in shlex.split(line)]
            done = subprocess.run([program, *words, "--format", "json"], cwd=folder, capture_output=True, text=True, timeout=1200)
            if done.returncode > 1:
                faults += 1
                print(f"tpm {line}: exit code {done.returncode}: {done.stderr.strip()}")
                continue
            try:
                # Beside a file for the answer there is none on the terminal.
                answer = json.loads((folder / "answer.json").read_text() if "answer.json" in words else done.stdout)
            except ValueError:
                faults += 1
                print(f"tpm {line}: exit code {done.returncode}, and no JSON: '{done.stdout}'")
                continue
            if line == "example recording":
                shutil.copy(folder / "recording.csv", folder / "my recording.csv")
            wrong = faults_of(answer, words, folder, done.returncode)
            if line.startswith(QUICK) and not line.startswith(UNENDED):
                done = subprocess.run([program, *words], cwd=folder, capture_output=True, text=True, timeout=1200)
                wrong += faults_of_end(answer, done.stdout)
            elif not line.startswith(UNENDED) and not {"files", "next"} <= answer.keys():
                wrong.append("files or next are missing")
            if answer.get("next") and answer["next"] not in typed:
                typed.add(answer["next"])
                wrong += faults_of_next(answer["next"], usage, program, root, folder)
            faults += len(wrong)
            for fault in wrong:
                print(f"tpm {line}: {fault}")
            if wrong:
                continue
            met.add(answer["command"])
            of_command = members.setdefault(answer["command"], ([], []))
            of_command[0].extend(v["code"] for v in answer["verdicts"] if v["code"] not in of_command[0])
            of_command[1].extend(m for m in answer if m not in ENVELOPE and m not in of_command[1])
        for fault in orders_of_shards(program, root / "configs/sweep_x_depth_100.json", folder):
            faults += 1
            print(fault)
    for missing in sorted(wanted - met - SLOW):
        faults += 1
        print(f"tpm {missing} --format json is not asked")
    for unknown in sorted(SLOW - wanted):
        faults += 1
        print(f"tpm {unknown} has no --format")
    rows = ["| command | verdicts | members of the result |", "| --- | --- | --- |"]
    ticked = lambda words: ", ".join(f"`{w}`" for w in words)
    rows += [f"| `{c}` | {ticked(v)} | {ticked(m)} |" for c, (v, m) in sorted(members.items())]
    page = root / "docs/json.md"
    text = page.read_text(encoding="utf-8")
    before, rest = text.split(BEGIN)
    after = rest.split(END)[1]
    new = before + BEGIN + "\n\n" + "\n".join(rows) + "\n\n" + END + after
    if "--write" in sys.argv:
        page.write_text(new, encoding="utf-8")
    elif new != text:
        faults += 1
        print("docs/json.md is not what the commands print; answers.py ROOT TPM --write")
    print(f"{len(met)} commands asked, {len(SLOW)} left out, {faults} faults")
    sys.exit(bool(faults))


if __name__ == "__main__":
    main()
