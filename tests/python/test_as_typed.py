"""What users type: tables as they come out of pandas and xarray, numbers of numpy, arguments that are wrong."""

import copy
import html
import json
import pickle
import subprocess
import sys
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

    def test_a_unit_of_a_column_that_is_not_there_is_refused(self):
        plain = self.table.set_axis(["time", "depth", "force"], axis=1)
        with self.assertRaisesRegex(tpmkit.Error, "no column 'load'"):
            tpmkit.fit(plain, units={**UNITS, "load": "N"}, **QUICK)
        # By its whole title, which is the name of a column of a DataFrame.
        milli = tpmkit.fit(self.table, units={"force (N)": "mN"}, **QUICK).parameters.estimate
        self.assertAlmostEqual(1e3 * milli["k_inf"] / self.fit.parameters.estimate["k_inf"], 1.0, places=3)

    def test_what_follows_from_a_fit_shows_its_adequacy_and_warnings(self):
        protocol = tpmkit.Protocol.ramp_and_hold(9e-3, 1e-3, 10.0)  # deeper than what was fitted
        for table in (self.fit.predict(protocol, [0.0, 9.0]), self.fit.young_moduli(sphere_radius_m=1e-3)):
            self.assertEqual(table.adequacy, self.fit.adequacy)
            self.assertTrue(table.warnings)
            for words in (table.adequacy["summary"], *table.warnings):
                self.assertIn(words, repr(table))
        page = html.unescape(self.fit._repr_html_())
        for words in (self.fit.adequacy["summary"], *self.fit.warnings):
            self.assertIn(words, page)

    def test_attributes_of_a_dataset_tell_its_units(self):
        plain = self.table.set_axis(["time", "depth", "force"], axis=1).set_index("time").to_xarray()
        for name, unit in UNITS.items():
            plain[name].attrs["units"] = unit
        self.assertTrue(tpmkit.fit(plain, **QUICK).parameters.equals(self.fit.parameters))
        milli = plain.assign(force=(1e3 * plain.force).assign_attrs(units="mN"))
        by_milli = tpmkit.fit(milli, **QUICK).parameters.estimate
        for name, value in self.fit.parameters.estimate.items():
            self.assertAlmostEqual(by_milli[name] / value, 1.0, places=3)
        odd = plain.assign({"force (raw)": plain.force.copy().assign_attrs(units="V"), "depth (2)": plain.depth.copy()})
        self.assertTrue(tpmkit.fit(odd, columns={"drive": "depth", "response": "force"}, **QUICK)
                        .parameters.equals(self.fit.parameters))
        for data, units, words in (
            (milli, {"force": "N"}, "force is in mN by its attribute and units says N; expected the same"),
            (milli.rename(force="force (N)"), None, r"force \(N\) is in mN by its attribute and its name says N"),
            (milli.rename(force="force_N"), None, "force_N is in mN by its attribute and its name says N"),
        ):
            with self.subTest(words=words), self.assertRaisesRegex(tpmkit.ArgumentError, "^fit: " + words):
                tpmkit.fit(data, units=units, **QUICK)

    def test_what_is_wrong_in_a_table_is_told_by_its_rows_and_arguments(self):
        back = self.table.copy()
        back.loc[30, "time (s)"] = back.loc[28, "time (s)"]
        nameless = self.table.set_axis(["t", "z", "F"], axis=1)
        for call, words in (
            (lambda: tpmkit.fit(back, **QUICK), "^table: row 30: time "),
            (lambda: tpmkit.fit(nameless, **QUICK), r'expected units=\{"t": UNIT\} with a unit of time'),
            (lambda: tpmkit.fit(pd.DataFrame(self.table.to_numpy())), "a column of the table has the name 0; expected texts with units"),
            (lambda: tpmkit.fit(self.table.set_axis(["0", "1", "2"], axis=1)), "has the name '0'"),
            (lambda: tpmkit.fit(self.table + 0j), r"time \(s\) holds complex128; expected numbers"),
            (lambda: tpmkit.fit(self.table * np.nan), "the table has 501 rows and 3 columns, and no number"),
            (lambda: tpmkit.fit(self.table.to_xarray()["force (N)"].rename(None)), "^fit: a DataArray; expected a Dataset"),
            (lambda: tpmkit.fit(self.table, columns={"decimal": "comma"}), "columns names decimal, which says how a file is written"),
            (lambda: tpmkit.validate(self.fit, self.table, columns={"header_rows": 1}), "^validate: columns names header_rows"),
        ):
            with self.subTest(words=words), self.assertRaisesRegex(tpmkit.ArgumentError, words) as raised:
                call()
            self.assertNotIn("\n", str(raised.exception))

    def test_arrays_of_any_kind_of_number_are_fitted_alike(self):
        time, depth, force = (self.table[c].to_numpy() for c in self.table.columns)
        wide = np.column_stack([time, depth, force])
        fixed = [column.copy() for column in (time, depth, force)]
        for column in fixed:
            column.flags.writeable = False
        for arrays in ((time.tolist(), tuple(depth), pd.Series(force, index=range(7, 508))), wide.T, fixed,
                       (time.astype(">f8"), pd.array(depth), pd.Series(force, dtype="Float64"))):
            fit = tpmkit.fit(**dict(zip(UNITS, arrays)), units=UNITS, **QUICK)
            self.assertTrue(fit.parameters.equals(self.fit.parameters))
        missing = pd.Series(force, dtype="Float64")
        missing[3] = pd.NA
        for unit in (None, "", 3):
            with self.assertRaisesRegex(tpmkit.ArgumentError, "^fit: units has 'force': "):
                tpmkit.fit(time=time, depth=depth, force=force, units={**UNITS, "force": unit})
        with self.assertRaisesRegex(tpmkit.ArgumentError, "^fit: force is NaN at place 3; expected numbers$"):
            tpmkit.fit(time=time, depth=depth, force=missing, units=UNITS)

    def test_tables_that_follow_from_a_fit_are_pickled_and_copied(self):
        table = self.fit.predict(tpmkit.Protocol.ramp_and_hold(9e-3, 1e-3, 10.0), [0.0, 9.0])
        for again in (pickle.loads(pickle.dumps(table)), copy.copy(table), copy.deepcopy(table)):
            self.assertTrue(again.equals(table))
            self.assertEqual((again.warnings, again.adequacy, repr(again)), (table.warnings, table.adequacy, repr(table)))

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

    def test_what_reads_a_list_of_numbers_guesses_nothing(self):
        """A mask, a unit, a length of time or a text that carries more than its numbers is refused, not stripped."""
        law = tpmkit.Law("linear-1", {"k_inf": 60, "k1": 1, "tau1": 1})
        step = tpmkit.Protocol.ramp_and_hold(1e-3, 1e-3, 10.0)
        quantity = type("Quantity", (), {"magnitude": 1.0, "units": "mm", "__array__": lambda self, *a, **k: np.arange(3.0)})()
        t = np.arange(3.0)
        for values, words in (
            (np.ma.masked_array(t, [0, 1, 0]), "is masked at place 1"),
            (pd.to_timedelta(t, unit="s"), r"holds timedelta64\[ns\]; expected numbers, such as \(t - t\[0\]\)"),
            (quantity, "is a Quantity with a unit of its own"),
            (["0", "1", "2"], "holds <U1"),
            ([True, False, True], "holds bool"),
            ([0, 10**400, 2], r"is \[0, 1000.*; expected a list of numbers"),
            ([[1, 2], [3]], r"is \[\[1, 2\], \[3\]\]; expected a list of numbers"),
            ((x for x in t), "is a generator; expected a list of numbers"),
            (None, "is None; expected a list of numbers"),
        ):
            with self.subTest(words=words):
                with self.assertRaisesRegex(tpmkit.ArgumentError, "^times_s: " + words) as raised:
                    law.respond(step, values)
                self.assertNotIn("\n", str(raised.exception))
                if values is not None:
                    with self.assertRaisesRegex(tpmkit.ArgumentError, "^fit: depth " + words):
                        tpmkit.fit(time=t, depth=values, force=t, units=UNITS)
        read = tpmkit.read_recording(tpmkit.example("recording.csv"))
        with self.assertRaisesRegex(tpmkit.ArgumentError, "depth is in m and units says mm"):
            tpmkit.fit(time=read.time_s, depth=read.depth_m, force=read.force_N, units=UNITS)

    def test_arguments_that_the_program_or_the_library_refuses_are_value_errors(self):
        example, law = tpmkit.example("recording.csv"), tpmkit.Law("linear-1", {"k_inf": 60, "k1": 1, "tau1": 1})
        step, servo = tpmkit.Protocol.ramp_and_hold(1e-3, 1e-3, 10.0), tpmkit.example("configs/plan/servo.json")
        table = pd.DataFrame({"time (s)": [0.0, 1.0], "depth (mm)": [0.0, 1.0], "force (N)": [0.0, 1.0]})
        times = table.assign(**{"time (s)": pd.to_timedelta(table["time (s)"], unit="s")})
        for call, words in (
            (lambda: tpmkit.fit(example, law="linear-one"), "^law: unknown law 'linear-one'"),
            (lambda: tpmkit.Law("linear-one", {}), "^law: unknown law 'linear-one'"),
            (lambda: tpmkit.Law("linear-1", {"k_inf": 60}), "no parameter 'k1_N_per_m'"),
            (lambda: tpmkit.Law("linear-1", None), "parameters are None"),
            (lambda: tpmkit.Law.describe("x"), "unknown law 'x'"),
            (lambda: law.respond(step, [99.0]), "asked for t = 99 s; expected a time from 0 to 11 s"),
            (lambda: law.respond_spectrum([-1.0]), "expected a frequency above 0 Hz"),
            (lambda: step.scaled("2"), "^scaled: factor is '2'"),
            (lambda: step.scaled(float("nan")), "^scaled: factor is nan"),
            (lambda: step.value_at("now"), "^time_s: "),
            (lambda: tpmkit.Protocol(), "^Protocol: .*expected Protocol.step_and_hold"),
            (lambda: tpmkit.fit(example, columns={"nope": "x"}), "columns names 'nope'; expected keys of encoding"),
            (lambda: tpmkit.fit(example, columns={1: "x"}), "columns names 1"),
            (lambda: tpmkit.fit(example, columns={"units": "mm"}), "units is 'mm'; expected a dict"),
            (lambda: tpmkit.fit(example, columns={"units": {"force": 3}}), "units has 'force': 3"),
            (lambda: tpmkit.fit(example, columns={"segments": "load"}), "segments is 'load'; expected a list"),
            (lambda: tpmkit.fit(example, columns={"time": None}), "time is None"),
            (lambda: tpmkit.read_recording(example, columns=["x"]), r"columns is \['x'\]; expected a dict"),
            (lambda: tpmkit.validate(law, example, columns={"nope": 1}), "columns names 'nope'"),
            (lambda: tpmkit.validate(law, {"time": [1]}), "recordings is {'time'"),
            (lambda: tpmkit.validate(law, example, require="10"), "'10' has no unit"),
            (lambda: tpmkit.fit(""), "files holds ''"),
            (lambda: tpmkit.fit([3]), "files holds 3"),
            (lambda: tpmkit.fit([example.parent, example]), "is a folder among files"),
            (lambda: tpmkit.fit(table[:0]), "the table has 0 rows"),
            (lambda: tpmkit.fit(times), r"time \(s\) holds timedelta64\[ns\]"),
            (lambda: tpmkit.plan(servo, outputs="x"), "outputs is 'x'"),
            (lambda: tpmkit.plan(servo, rate_Hz=float("nan")), "rate_Hz is nan"),
            (lambda: tpmkit.design({}, repetitions=1.5), "'1.5'; expected a whole number"),
            (lambda: tpmkit.view(table, "page.html"), r"^view\(a DataFrame, 'page.html'\)"),
        ):
            with self.subTest(words=words), self.assertRaisesRegex(tpmkit.ArgumentError, words) as raised:
                call()
            self.assertNotIn("\n", str(raised.exception))
            self.assertIsInstance(raised.exception, ValueError)

    def test_columns_are_the_options_that_the_library_reads(self):
        from tpmkit._tables import KEYS

        with self.assertRaises(tpmkit.Error) as raised:
            tpmkit._core.read_recording(str(tpmkit.example("recording.csv")), {"nope": "x"})
        told = str(raised.exception).partition("one of ")[2].split(", ")
        self.assertEqual(set(KEYS), {*told, "provenance"})

    def test_nothing_of_the_user_is_overwritten_by_a_page(self):
        with tempfile.TemporaryDirectory() as folder:
            law, file, page = Path(folder) / "law.json", Path(folder) / "data.csv", Path(folder) / "page.html"
            tpmkit.Law("linear-1", {"k_inf": 60, "k1": 1, "tau1": 1}).write(law)
            file.write_text("precious")
            with self.assertRaisesRegex(tpmkit.ArgumentError, "data.csv is there already and is no page"):
                tpmkit.view(law, file)
            self.assertEqual(file.read_text(), "precious")
            tpmkit.view(law, page)
            tpmkit.view(law, page)  # a page is replaced

    def test_no_example_lies_outside_of_what_is_installed(self):
        for name in ("../../etc/passwd", "/etc/passwd"):
            with self.assertRaisesRegex(tpmkit.Error, "^example: "):
                tpmkit.example(name)

    def test_a_module_that_is_missing_is_told_in_a_sentence(self):
        code = ("import sys, tpmkit; sys.modules['h5py'] = sys.modules['h5netcdf'] = None\n"
                "try: tpmkit.open(sys.argv[1])\nexcept tpmkit.Error as error: print(error.code, error)")
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "result.h5"
            with h5py.File(file, "w") as made_file:
                made_file.create_group("x")
            told = subprocess.run([sys.executable, "-c", code, file], capture_output=True, text=True, check=True).stdout
        self.assertRegex(told, "^5 open: Python cannot import h5py .*; expected it installed")

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
