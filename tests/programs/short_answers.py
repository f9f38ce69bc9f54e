#!/usr/bin/env python3
"""Runs shipped examples: an answer has at most 25 lines, none of them of JSON, says every warning that the JSON has, and
names the next command; `--verbose` says more.

    short_answers.py ROOT TPM
"""

import json
import math
import re
import subprocess
import sys
import tempfile
from pathlib import Path

MOST = 25
PLANS = (("shallow.json", "--tolerance", "1%", "--loop-rate", "1 kHz"), ("servo.json",), ("star.json",), ("creep.json",), ("deep.json",),
         ("servo.json", "--wall", "1e-9 s per s"), ("tool.json", "--brief"), ("patch_field.json", "--outputs", "field", "--brief"))
SCENES = ("liver_poke.json", "grasp.json", "sagging_liver.json", "two_indenters.json", "plan/fast_poke.json")

LONG_PLANNED = ("hil_fine.json", "hil_network.json", "hil_planned.json", "hil_surface.json")  # the gate plans: minutes


class Checks:
    def __init__(self, program, folder):
        self.program, self.folder, self.faults, self.answers = program, folder, [], 0
        self.verbose = set()  # commands whose longer answer was looked at: once each

    def run(self, *words):
        return subprocess.run([self.program, *map(str, words)], cwd=self.folder, capture_output=True, text=True, check=False,
                              timeout=1200)

    def check_next(self, words, command, codes=(0,)):
        """An answer that is short anyhow: at most 25 lines, the last of them the next command."""
        said = self.run(*words)
        name = " ".join(map(str, words))
        self.answers += 1
        lines = said.stdout.splitlines()
        if said.returncode not in codes:
            self.faults.append(f"{name}: ends with {said.returncode}: {said.stderr[-300:]}")
        elif len(lines) > MOST or lines[-1] != f"next: {command}":
            self.faults.append(f"{name}: {len(lines)} lines, ends with '{lines[-1]}'")

    def check(self, words, warnings, codes=(0,), timed=False):
        """@param warnings  of the JSON: a function of the document
        @param timed  whether each run measures the machine: its numbers are not compared"""
        shown = (lambda text: re.sub(r"[0-9.]+(e[+-]?[0-9]+)?", "#", text)) if timed else (lambda text: text)

        def left_out(said, told):
            """What the JSON warns of, and the text of another run does not."""
            return [one for one in warnings(json.loads(told.stdout)) if shown(one) not in shown(said.stdout + said.stderr)]

        # The machine may stall in one of two runs that measure it: a text is looked for that found it as a JSON did.
        texts, answers, alike = [], [], False
        for _ in range(20 if timed else 1):
            texts.append(self.run(*words))
            answers.append(self.run(*words, "--format", "json"))
            pairs = [(said, told) for said in texts for told in answers
                     if said.returncode == told.returncode and said.returncode in codes]
            alike = bool(pairs)
            whole = next((pair for pair in pairs if not left_out(*pair)), None)
            said, told = whole or (pairs[-1] if pairs else (texts[-1], answers[-1]))
            if whole or any(one.returncode not in codes for one in (texts[-1], answers[-1])):
                break
        name = " ".join(map(str, words))
        if not alike:
            self.faults.append(f"{name}: ends with {said.returncode} and {told.returncode}: {said.stderr[-300:]}")
            return
        self.answers += 1
        lines = said.stdout.splitlines()
        if len(lines) > MOST:
            self.faults.append(f"{name}: {len(lines)} lines")
        if any(line.startswith(("{", "}")) for line in lines):
            self.faults.append(f"{name}: prints JSON")
        if "more: --verbose" not in lines[-1]:
            self.faults.append(f"{name}: ends with '{lines[-1]}'")
        self.faults += [f"{name}: leaves out the warning '{one}'" for one in left_out(said, told)]
        command = tuple(words[:2] if words[0] in ("hil", "paper", "sweep", "accuracy") else words[:1])
        if command not in self.verbose and len(self.run(*words, "--verbose").stdout) <= 0.5 * len(said.stdout):
            self.faults.append(f"{name}: says less with --verbose")
        self.verbose.add(command)


def remarks(document):
    return [one["text"] for one in document["remarks"]]


def failed_claims(document):
    """The claims that do not stand: each is named."""
    return [f["id"] for f in document["findings"] if f["verdict"] not in ("holds", "holds by truncation")]


def make_group(folder, factors):
    folder.mkdir()
    for number, factor in enumerate(factors):
        lines = ["time [s],depth [mm],force [N]"]
        for i in range(440):
            t = max(0.05 * i - 2.0, 0.0)
            ramp = min(t, 2.0)
            force = 0.12 * ramp + 0.18 * (math.exp((ramp - t) / 2.0) - math.exp(-t / 2.0))
            noise = 2e-4 * math.sin(7919.0 * (i + 1) * (number + 2))
            lines.append(f"{0.05 * i:.2f},{2.0 * ramp:.5f},{factor * force + noise:.7f}")
        (folder / f"liver{number + 1}.csv").write_text("\n".join(lines) + "\n")


def main():
    root, program = Path(sys.argv[1]).resolve(), str(Path(sys.argv[2]).resolve())
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        checks = Checks(program, folder)
        checks.check(["paper", "audit"], failed_claims)
        checks.check(["paper", "tables"], lambda d: [])
        checks.check(["paper", "tables", "--consistent", "--depths", "1,2,3,4,5,6,7,8 mm"], lambda d: [])
        for plan, *options in PLANS:
            checks.check(["plan", root / "configs/plan" / plan, "--costs", "nominal", *options], remarks, (0, 1))
        for scene in SCENES:
            checks.check(["simulate", root / "configs" / scene, "-o", "run.h5"], remarks)
        for plan in ("servo.json", "creep.json"):
            checks.check(["simulate", root / "configs/plan" / plan, "--planned", "--costs", "nominal", "-o", "planned.h5"],
                         remarks)
        told = checks.run("hil", "run", root / "configs/hil_liver.json", "-o", "session.tpmrec").stdout.splitlines()
        if len(told) > MOST or told[-1:] != ["next: tpm hil verify session.tpmrec"]:
            checks.faults.append(f"hil run: {len(told)} lines, ends with {told[-1:]}")
        checks.check(["hil", "verify", "session.tpmrec"], remarks)
        checks.check(["hil", "check", "--duration", "0.2 s"], lambda d: [d["timing"], d["advice"]], (0, 1), True)
        for session in sorted((root / "configs").glob("hil_*.json")):
            if session.name in LONG_PLANNED:
                continue
            checks.check(["hil", "check", session, "--duration", "0.2 s"], lambda d: [d["session"]["title"]], (0, 1), True)
        for design in ("design_liver.json", "design_meat.json"):
            checks.check(["design", root / "configs" / design, "--repetitions", "10"],
                         lambda d: d["summary"] + remarks(d["check"]))
        for more in ([], ["--verbose"]):
            told = checks.run("hil", "report", "session.tpmrec", "--folder", "page", "--overwrite", *more).stdout
            line = next((one for one in told.splitlines() if one.startswith("written to page: ")), ": ")
            if set(line.split(": ")[1].split(", ")) != {one.name for one in (Path(folder) / "page").iterdir()}:
                checks.faults.append(f"hil report: '{line}' is not what stands in the folder")
        make_group(folder / "healthy", (0.9, 1.0, 1.1))
        make_group(folder / "fibrotic", (1.8, 2.0, 2.2))
        checks.check(["fit", "healthy", "fibrotic", "--compare", "--laws", "linear-1", "--no-draw", "--punch-radius", "2 mm"],
                     lambda d: [])
        checks.check(["fit", "healthy/liver1.csv", "--laws", "linear-1", "--folder", "fitted"], remarks)
        checks.check(["fit", "fitted/config.json"], remarks)
        checks.check(["identify", "healthy/liver1.csv", "--laws", "linear-1"], remarks)
        checks.check(["identify", "healthy/liver1.csv", "--laws", "linear-1", "--folder", "identified"], remarks)
        law = "fitted/law.json"
        checks.check_next(["predict", law, "--depth", "4 mm", "--rate", "2 mm/s", "--hold", "5 s"],
                          f"tpm hil run configs/hil_law.json --law {law} -o session.tpmrec")
        checks.check_next(["predict", law, "healthy/liver2.csv"], f"tpm validate {law} healthy/liver2.csv")
        checks.check_next(["validate", law, "healthy/liver1.csv"],
                          f"tpm budget {law} healthy/liver1.csv")
        checks.check_next(["validate", law, "healthy/liver2.csv"], f"tpm validate {law} healthy/liver2.csv --require 10%")
        checks.check_next(["validate", law, "healthy/liver2.csv", "--require", "50%", "--folder", "validated"],
                          f"tpm budget {law} healthy/liver2.csv")
        checks.check_next(["validate", law, "fibrotic/liver3.csv", "--require", "1%"], "tpm fit fibrotic/liver3.csv", (1,))
        sweep = root / "configs/sweep_x_depth.json"
        for _ in ("computed", "found there"):
            checks.check_next(["sweep", sweep, "-o", "sweep.h5"], "tpm sweep plot sweep.h5")
        checks.check_next(["sweep", sweep, "--shard", "1/2", "-o", "parts.h5"], f"tpm sweep {sweep} --shard 2/2 -o parts.h5")
        checks.check_next(["sweep", sweep, "--shard", "2/2", "-o", "parts.h5"], f"tpm sweep merge {sweep} -o parts.h5")
        checks.run("sweep", root / "configs/sweep_sensitivity.json", "-o", "samples.h5")
        checks.check(["sweep", "sensitivity", "samples.h5"], remarks)
        checks.run("sweep", root / "configs/sweep_convergence_step.json", "-o", "step.h5")
        checks.check(["sweep", "convergence", "step.h5", "--axis", "step"], remarks, (0, 1))
        checks.check(["accuracy", "verify", "closed-forms", "energy"], remarks)
        checks.check(["accuracy", "verify", "--flaw", "1%"], remarks, (1,))
        checks.check(["hil", "stability", "--folder", "borders", "--overwrite"], remarks)
        starts = json.loads(checks.run("fit", "fitted/config.json", "--no-draw", "--format", "json").stdout)["starts"]
        count = f"{starts['agreeing_to_5_digits']} of {starts['run']}"
        if (f"{count} followed starts" not in checks.run("fit", "fitted/config.json", "--no-draw").stdout
                or f"{count} starts end at the best minimum" not in starts["summary"]):
            checks.faults.append(f"fit: screen, figure and JSON count starts differently: {starts}")
        checks.check(["budget", "fitted/law.json", "healthy/liver1.csv", "--folder", "budget"], remarks)
        checks.check(["budget", "fitted/law.json", "--depth", "4 mm", "--rate", "2 mm/s", "--hold", "5 s", "--scene",
                      root / "configs/budget_liver.json"], remarks)
    for fault in checks.faults:
        print(fault)
    print(f"{checks.answers} answers, {len(checks.faults)} faults")
    return 1 if checks.faults else 0


if __name__ == "__main__":
    sys.exit(main())
