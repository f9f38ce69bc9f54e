"""What users type: tables as they come out of pandas and xarray, numbers of numpy, arguments that are wrong."""

import json
import tempfile
import unittest
from pathlib import Path

import h5py
import made
import numpy as np
import pandas as pd

import tpmkit

QUICK = {"law": "linear-1", "starts": 2}
UNITS = {"time": "s", "depth": "mm", "force": "N"}


class Tables(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = Path(cls.temporary.name)
        cls.file = made.recording(cls.folder)
        cls.table = pd.read_csv(cls.file)
        cls.fit = tpmkit.fit(cls.file, **QUICK)

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def test_units_of_a_table_are_told_by_column(self):
        plain = self.table.set_axis(["time", "depth", "force"], axis=1)
        self.assertTrue(tpmkit.fit(plain, units=UNITS, **QUICK).parameters.equals(self.fit.parameters))

    def test_a_filtered_table_is_fitted(self):
        rows = self.table[self.table["time (s)"] < 10.0]
        filtered = rows[rows.index % 2 == 0]
        self.assertIsNone(filtered.index.name)
        parameters = tpmkit.fit(filtered, **QUICK).parameters
        self.assertTrue(parameters.equals(tpmkit.fit(filtered.reset_index(drop=True), **QUICK).parameters))
        with self.assertRaisesRegex(tpmkit.ArgumentError, "index has no name"):
            tpmkit.fit(self.table.set_index(self.table["time (s)"].rename(None)), **QUICK)

    def test_a_read_recording_is_fitted_with_its_provenance(self):
        read = tpmkit.read_recording(self.file, columns={"provenance": "assumed"})
        fit = tpmkit.fit(read, **QUICK)
        self.assertEqual(fit.data[0].attrs["provenance"], "assumed")
        for name, value in self.fit.parameters.estimate.items():
            self.assertAlmostEqual(fit.parameters.estimate[name] / value, 1.0, places=6)
        with self.assertRaisesRegex(tpmkit.ArgumentError, "a Dataset over x, time_s"):
            tpmkit.fit(read.expand_dims(x=2), **QUICK)

    def test_no_answer_names_the_file_that_a_table_was_for_a_while(self):
        fit = tpmkit.fit(self.table, **QUICK)
        everything = fit.details() + json.dumps(fit.to_dict()) + str(fit) + repr(fit)
        self.assertIn("table: 501 of 501 samples fitted", everything)
        self.assertNotIn("table.csv", everything)
        self.assertEqual(set(fit.residuals.dataset), {"table"})

    def test_rows_that_are_left_out_are_a_warning(self):
        gaps = self.table.copy()
        gaps.loc[[100, 200], "force (N)"] = np.nan
        fit = tpmkit.fit(gaps, **QUICK)
        said = [w for w in fit.warnings if "2 of 501 rows have an empty cell or NaN" in w]
        self.assertEqual(len(said), 1, fit.warnings)
        self.assertIn({"code": "rows_left_out", "text": said[0]}, fit.remarks)
        self.assertIn(said[0], repr(fit))
        self.assertIn("left out", str(fit))
        gaps.to_csv(self.folder / "gaps.csv", index=False)
        self.assertIn("2 of 501 rows", " ".join(tpmkit.fit(self.folder / "gaps.csv", **QUICK).warnings))
        self.assertNotIn("left out", " ".join(self.fit.warnings))

    def test_a_table_validates_and_a_fit_is_viewed(self):
        file = made.recording(self.folder, seed=5, name="other.csv")
        by_file = tpmkit.validate(self.fit, file, require="5%")
        by_table = tpmkit.validate(self.fit, pd.read_csv(file), require=0.05)
        self.assertEqual(by_table.verdict, by_file.verdict)
        columns = ["quantity", "S", "D", "U"]
        self.assertTrue(by_table.quantities[columns].equals(by_file.quantities[columns]))
        self.assertEqual(set(by_table.quantities.recording), {"table"})
        for shown, inside in ((self.fit, "tau1"), (self.fit.law, "linear-1")):
            page = tpmkit.view(shown, self.folder / "page.html")
            self.assertIn(inside, page.read_text(encoding="utf-8"))

    def test_what_is_no_recording_is_refused_in_a_sentence(self):
        t = np.arange(5.0)
        for files, words in (
            (self.table.to_numpy(), "files is a ndarray"),
            ({"time": t}, "files is a dict"),
            (self.table["force (N)"], "a Series; expected a DataFrame"),
            ([self.table, self.table], "files holds tables; expected one table"),
        ):
            with self.subTest(words=words), self.assertRaisesRegex(tpmkit.ArgumentError, words):
                tpmkit.fit(files)
        for times, words in ((pd.to_datetime(t, unit="s"), r"time holds datetime64\[ns\]"), (t * 1j, "time holds complex128"),
                             (list("01234"), "time holds <U1")):
            with self.subTest(words=words), self.assertRaisesRegex(tpmkit.ArgumentError, words):
                tpmkit.fit(time=times, depth=t, force=t, units=UNITS)


class Arguments(unittest.TestCase):
    def test_each_is_refused_in_one_sentence(self):
        example, law = tpmkit.example("recording.csv"), {"k_inf": 60, "k1": 1, "tau1": 1}
        history, poke = tpmkit.Protocol.history, tpmkit.example("liver_poke.json")
        for call, words in (
            (lambda: tpmkit.fit(example, starts=10**12), "starts is 1000000000000; expected a whole number from 1 to 1000000000"),
            (lambda: tpmkit.fit(example, starts=0), "starts is 0"),
            (lambda: tpmkit.fit(example, seed=2**64), "seed is 18446744073709551616"),
            (lambda: tpmkit.fit(example, reference=True), "reference is True; expected a number, in m"),
            (lambda: tpmkit.fit(example, reference=-1.0), "fit: reference is -1.0; expected a depth above 0, in m"),
            (lambda: tpmkit.fit(example, zero=float("nan")), "fit: zero is nan; expected a finite number, in N"),
            (lambda: tpmkit.fit(example, columns=["a"]), r"columns is \['a'\]; expected a dict"),
            (lambda: tpmkit.fit(example, law=3), "law is 3; expected its name"),
            (lambda: history([[0, 1, 2]], [[0, 1, 2]]), r"times_s: has the shape \(1, 3\)"),
            (lambda: history([0, 1, 2], [0, float("nan"), 2]), "values: is NaN at place 1"),
            (lambda: tpmkit.Protocol.ramp_and_hold("1 mm", 1e-3, 1), r"Protocol.ramp_and_hold\('1 mm', 0.001, 1\): an argument"),
            (lambda: tpmkit.Protocol.step_and_hold(1e-3), "an argument is missing"),
            (lambda: tpmkit.Protocol.ramp_and_hold(-1e-3, 1e-3, 1), "protocol: depth = -0.001 m; expected"),
            (lambda: history([0, 1], [0, 1e-3], drive="weight"), "drive: 'weight'; expected displacement or force"),
            (lambda: tpmkit.Law("linear-1", {**law, "k1": float("nan")}), "k1 is nan; expected a finite number"),
            (lambda: tpmkit.Law("linear-1", {**law, "drift": 0.1}), "drift belongs to a recording"),
            (lambda: tpmkit.Law("linear-1", law, reference="1 mm"), "reference is '1 mm'"),
            (lambda: tpmkit.Law(3, law), r"^Law\(3, "),
            (lambda: tpmkit.Element(E1_Pa="12 kPa"), "E1_Pa is '12 kPa'"),
            (lambda: tpmkit.Element(E2_Pa=0), "E2_Pa is 0; expected a number above 0"),
            (lambda: tpmkit.Element(formulation="exact"), "formulation is 'exact'"),
            (lambda: tpmkit.plan(poke, tolerance=1), "tolerance is 1;"),
            (lambda: tpmkit.simulate({"organ": float("nan")}), "scene: holds NaN"),
            (lambda: tpmkit.simulate({"organ": {1, 2}}), "scene: holds a set"),
            (lambda: tpmkit.validate(tpmkit.Law("linear-1", law), []), "recordings holds no file"),
            (lambda: tpmkit.validate(tpmkit.Law("linear-1", law), example, require=1), "require is 1; expected"),
        ):
            with self.subTest(words=words), self.assertRaisesRegex(tpmkit.ArgumentError, words) as raised:
                call()
            self.assertNotIn("\n", str(raised.exception))
            self.assertIsInstance(raised.exception, ValueError)

    def test_numbers_of_numpy_and_paths_are_taken(self):
        law = tpmkit.Law("linear-1", {"k_inf": np.float32(60), "k1": np.int64(45), "tau1": 2.0})
        self.assertEqual(list(law.parameters.values())[:3], [60.0, 45.0, 2.0])
        scene = json.loads(tpmkit.example("liver_poke.json").read_text())
        scene["protocol"] = {"kind": "ramp_hold", "depth": "1 mm"}  # refused after its numbers were read
        scene["outputs"] = {"count": np.int64(3)}
        with self.assertRaisesRegex(tpmkit.Error, "^scene: key /protocol"):
            tpmkit.simulate(scene)

    def test_files_of_another_kind_are_refused_in_a_sentence(self):
        with tempfile.TemporaryDirectory() as folder:
            text, other = Path(folder) / "text.h5", Path(folder) / "other.h5"
            text.write_text("no HDF5")
            with h5py.File(other, "w") as file:
                file.create_group("x")
            for path, words in ((text, "is no HDF5 file that can be read"), (other, "is an HDF5 file of another kind")):
                with self.subTest(words=words), self.assertRaisesRegex(tpmkit.Error, f"{path.name}: {words}"):
                    tpmkit.open(path)


if __name__ == "__main__":
    unittest.main()
