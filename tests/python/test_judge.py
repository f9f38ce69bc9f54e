"""Folders, validation, designs and pages: what the program does for Python. What is imported."""

import copy
import json
import pickle
import resource
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import made
import tpmkit


def alike(one, other):
    return (repr(one), one.to_dict(), one.warnings, one.adequacy) == (repr(other), other.to_dict(), other.warnings, other.adequacy)


class Judgements(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = Path(cls.temporary.name)
        for seed in (1, 2, 3):
            made.recording(cls.folder, seed=seed, name=f"liver_{seed}.csv")

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def test_a_folder_is_pooled(self):
        pooled = tpmkit.fit(self.folder, law="linear-1", starts=3)
        self.assertEqual(pooled.law, "linear-1")
        self.assertEqual(len(pooled.recordings), 3)
        row = pooled.pooled.loc["tau1"]
        self.assertLess(row.lower, made.LAW["tau1_s"])
        self.assertGreater(row.upper, made.LAW["tau1_s"])
        self.assertEqual(row.unit, "s")
        self.assertIn(row.summary, repr(pooled))
        self.assertIn(f"tau1 {row.typical:.5g} ({row.lower:.4g} .. {row.upper:.4g}) s: ", repr(pooled))
        # The table says what the JSON says of each parameter.
        for p in pooled.to_dict()["pooled"]:
            row = pooled.pooled.loc[p["name"]]
            self.assertEqual(row.identified, p["identified"])
            self.assertEqual(row.only_if_described, p.get("only_if_described", False))
            self.assertEqual(row.only_without, p.get("only_without", {}).get("text", ""))
        self.assertEqual(pooled.pooled.loc["k_inf", "only_without"], "drift or a slow branch")
        for again in (pickle.loads(pickle.dumps(pooled)), copy.deepcopy(pooled)):
            self.assertTrue(alike(again, pooled))
        spoilt = pooled.to_dict()
        spoilt["pooled"][0].update({"identified": False, "only_if_described": True})
        self.assertTrue(type(pooled)(spoilt).pooled.iloc[0].only_if_described)
        self.assertEqual(pooled.adequacy["verdict"], "not_judged")  # nothing rests before contact
        self.assertEqual(len(pooled.adequacy["not_judged"]), 3)
        for words in (pooled.adequacy["summary"], *pooled.warnings):
            self.assertIn(words, repr(pooled))
        self.assertTrue(any("liver_1.csv: " in w for w in pooled.warnings), pooled.warnings)

    def test_a_law_is_validated_by_a_recording_that_it_has_not_seen(self):
        saved = self.folder / "saved"
        fit = tpmkit.fit(self.folder / "liver_1.csv", law="linear-1", starts=3)
        fit.save(saved)
        judged = tpmkit.validate(saved / "law.json", self.folder / "liver_2.csv", require="5%")
        self.assertEqual(judged.verdict, "adequate")
        table = judged.quantities
        self.assertTrue((table.verdict == "adequate").all())
        self.assertTrue({"quantity", "S", "D", "E", "U"} <= set(table.columns))
        self.assertIn(judged.summary, repr(judged))
        for warning in judged.warnings:
            self.assertIn(warning, repr(judged))
        for again in (pickle.loads(pickle.dumps(judged)), copy.deepcopy(judged)):
            self.assertTrue(alike(again, judged))
        seen = tpmkit.validate(saved / "law.json", self.folder / "liver_1.csv", require="5%")
        self.assertEqual(seen.verdict, "calibration_residual")
        with self.assertRaisesRegex(tpmkit.Error, "new_specimen: the law was fitted to 1 recording"):
            tpmkit.validate(saved / "law.json", self.folder / "liver_2.csv", new_specimen=True)
        for law in (fit, fit.law):
            same = tpmkit.validate(law, self.folder / "liver_2.csv", require="5%")
            self.assertTrue(same.quantities.equals(table))
        page = tpmkit.view(saved / "law.json", self.folder / "page.html")
        self.assertIn("<html", page.read_text()[:500])
        with self.assertRaisesRegex(tpmkit.Error, "none.h5"):
            tpmkit.view(self.folder / "none.h5", self.folder / "page.html")

    def test_a_design(self):
        problem = json.loads(tpmkit.example("configs/design_liver.json").read_text())
        found = tpmkit.design(problem, repetitions=0)
        self.assertEqual(len(found.ranked), 10)
        self.assertIn("experiment", found.ranked)
        self.assertEqual(found.adequacy["verdict"], "not_judged")
        self.assertTrue(found.summary)
        for words in (found.adequacy["summary"], *found.warnings):
            self.assertIn(words, repr(found))
        for again in (pickle.loads(pickle.dumps(found)), copy.deepcopy(found)):
            self.assertTrue(alike(again, found))
        with self.assertRaisesRegex(tpmkit.Error, "expected"):
            tpmkit.design({**problem, "critreion": "D"}, repetitions=0)

    def test_little_is_imported_before_it_is_used(self):
        code = "import sys, tpmkit; print(*sorted({m.partition('.')[0] for m in sys.modules}))"
        loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
        for module in ("pandas", "xarray", "matplotlib", "scipy", "h5py"):
            self.assertNotIn(module, loaded)

    def test_an_import_takes_less_than_300_ms_of_processor_time(self):
        times = []
        for _ in range(5):
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            subprocess.run([sys.executable, "-c", "import tpmkit"], check=True)
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            times.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
        self.assertLess(min(times), 0.3)


if __name__ == "__main__":
    unittest.main()
