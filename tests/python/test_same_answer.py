"""Python and the program answer alike, to the last printed digit."""

import contextlib
import csv
import io
import json
import math
import os
import re
import subprocess
import tempfile
import unittest
from pathlib import Path

import made
import tpmkit

PROGRAM = Path(tpmkit.__file__).resolve().parents[2] / "tpm"  # of the same build


@unittest.skipUnless(PROGRAM.is_file(), "the program is not built beside the module")
class SameAnswer(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = Path(temporary.name)
        self.file = made.recording(self.folder)

    def compare(self, options, **asked):
        told = subprocess.run([PROGRAM, "fit", self.file, "--format", "json", *options], cwd=self.folder,
                              capture_output=True, text=True, check=True).stdout
        here = tpmkit.fit(self.file, **asked).to_dict()
        answer = json.loads(told)
        self.assertGreater(len(here), 5)
        self.assertEqual(here, {name: answer[name] for name in here})
        # Beside it stands what the answers of all commands have (docs/json.md).
        shared = {"tpm", "command", "version", "inputs", "verdicts", "remarks", "files", "next"}
        self.assertEqual(set(answer) - set(here), shared - set(here))
        return here

    def test_of_a_recording(self):
        self.compare([])

    def test_of_a_prediction(self):
        fit = tpmkit.fit(self.file, law="linear-1")
        fit.law.write(self.folder / "law.json")
        protocol = tpmkit.Protocol.ramp_and_hold(2e-3, 1e-3, 10.0)
        for placement, options in (("surface", []), ("fitted", ["--placement", "fitted"])):
            told = subprocess.run([PROGRAM, "predict", "law.json", "--depth", "2 mm", "--rate", "1 mm/s", "--hold", "10 s",
                                   "--format", "json", *options], cwd=self.folder, capture_output=True, text=True, check=True)
            answer = json.loads(told.stdout)
            self.assertEqual(answer["placement"], placement)
            here = fit.predict(protocol, answer["time_s"], placement=placement)
            for name, key in (("value", "mean_N"), ("standard_error", "standard_error_N")):
                difference = max(abs(a - b) for a, b in zip(here[name], answer[key]))
                self.assertLess(difference, 1e-4 * max(answer[key]), f"{placement}: {name}")
            self.assertEqual(here.warnings, [remark["text"] for remark in answer["remarks"]])
        self.assertEqual(fit.predict(protocol, [0.0])["value"].iloc[0], 0.0)
        # Deeper and longer than what was fitted: the same words, which the table shows and keeps.
        told = subprocess.run([PROGRAM, "predict", "law.json", "--depth", "9 mm", "--rate", "3 mm/s", "--hold", "500 s",
                               "--format", "json"], cwd=self.folder, capture_output=True, text=True, check=True)
        answer = json.loads(told.stdout)
        beyond = fit.predict(tpmkit.Protocol.ramp_and_hold(9e-3, 3e-3, 500.0), answer["time_s"])
        self.assertEqual(beyond.warnings, [remark["text"] for remark in answer["remarks"]])
        self.assertEqual(sum(w.startswith("extrapolates: ") for w in beyond.warnings), 2)
        for words in beyond.warnings:
            adequacy = words == beyond.adequacy["summary"]
            self.assertIn(("adequacy: " if adequacy else "warning: ") + words, repr(beyond))
        self.assertEqual(beyond.iloc[:3].warnings, beyond.warnings)
        # The motion before the first time that is asked for counts, too.
        late = fit.predict(tpmkit.Protocol.ramp_and_hold(9e-3, 3e-3, 500.0), [503.0])
        self.assertEqual(late.warnings, beyond.warnings)

    def test_of_the_configuration_that_a_fit_writes(self):
        fit = tpmkit.fit(tpmkit.example("recording.csv"), law="linear-1", starts=5)
        fit.save(self.folder / "saved")
        self.assertTrue(any("shorter than the shortest ramp" in w for w in fit.warnings), fit.warnings)
        self.assertEqual(tpmkit.fit(self.folder / "saved" / "config.json").warnings, fit.warnings)

    def test_of_a_strip_whose_length_area_and_sign_are_told(self):
        with self.file.open(newline="") as file:
            rows = list(csv.reader(file))
        with self.file.open("w", newline="") as file:
            csv.writer(file).writerows([rows[0]] + [[t, f"-{d}", f] for t, d, f in rows[1:]])
        here = self.compare(["--laws", "linear-1", "--negate-drive", "--rest-length", "30 mm", "--area", "20 mm2"],
                            law="linear-1", columns={"negate_drive": True, "rest_length": "30 mm", "area": "20 mm2"})
        # k = 60 N/m of a strip of 30 mm and 20 mm2 is a modulus of k L / A
        modulus = {p["name"]: p for p in here["fit"]["parameters"]}
        self.assertAlmostEqual(modulus["k_inf"]["estimate_SI"] / (60.0 * 30e-3 / 20e-6), 1.0, delta=0.02)


def same(shown, printed):
    """Is a word of the page the printed one; a number to 0.1 %."""
    try:
        return math.isclose(float(shown), float(printed), rel_tol=1e-3, abs_tol=1e-6)
    except ValueError:
        return shown == printed


class Page(unittest.TestCase):
    def test_the_example_of_the_page_prints_what_the_page_shows(self):
        page = (Path(__file__).resolve().parents[2] / "docs/python.md").read_text(encoding="utf-8")
        code, shown = re.search(r"## Example\n.*?```python\n(.*?)```.*?\n((?:    [^\n]*\n)+)", page, re.S).groups()
        printed, here = io.StringIO(), os.getcwd()
        with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(printed):
            os.chdir(folder)
            try:
                exec(compile(code, "docs/python.md", "exec"), {})
            finally:
                os.chdir(here)
        words, there = shown.split(), printed.getvalue().split()
        self.assertEqual(len(words), len(there), printed.getvalue())
        for word, other in zip(words, there):
            self.assertTrue(same(word, other), f"the page shows {word}; printed is {other}")


if __name__ == "__main__":
    unittest.main()
