"""fit() of synthetic recordings."""

import copy
import os
import pickle
import signal
import subprocess
import sys
import tempfile
import textwrap
import threading
import time
import unittest
from pathlib import Path

import numpy as np

import made
import tpmkit


class Fits(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.file = made.recording(cls.folder.name)
        cls.fit = tpmkit.fit(cls.file)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def test_the_same_file_twice_is_refused_as_by_the_command(self):
        with self.assertRaisesRegex(tpmkit.ArgumentError, "is given twice; expected each recording once"):
            tpmkit.fit([self.file, self.file])

    def test_the_law_that_made_the_recording_is_found(self):
        self.assertEqual(self.fit.law.name, "linear-1")
        table = self.fit.parameters
        for name, key in (("k_inf", "k_inf_N_per_m"), ("k1", "k1_N_per_m"), ("tau1", "tau1_s")):
            row = table.loc[name]
            self.assertLess(row.lower, made.LAW[key])
            self.assertGreater(row.upper, made.LAW[key])
            self.assertAlmostEqual(row.estimate / made.LAW[key], 1.0, delta=0.02)
            # Nothing rests before contact: a slow drift of the force cell would look like k_inf.
            drift = "not identified: drift or a slow branch: not separable"
            self.assertEqual(self.fit.verdicts[name], drift if name == "k_inf" else "identified")
        self.assertEqual(table.loc["tau1", "unit"], "s")
        self.assertIn("linear-1", self.fit.laws.index)
        self.assertTrue(self.fit.summary)

    def test_the_second_answer_with_a_drift(self):
        table = self.fit.parameters
        for name in ("k1", "tau1"):
            row = table.loc[name]
            self.assertFalse(np.isnan(row.with_drift))
            self.assertLessEqual(row.lower, row.with_drift_lower)
            self.assertGreaterEqual(row.upper, row.with_drift_upper)
        self.assertEqual(table.loc["k_inf", "not_separable"], "drift or a slow branch")
        self.assertEqual(set(table.unconfirmed), {""})
        self.assertTrue(np.isnan(table.loc["offset", "with_drift"]))

    def test_placement_can_be_held(self):
        fit = tpmkit.fit(self.file, law="linear-1", starts=3, contact=0.0, zero=0.0, columns={"until": "10 s"})
        self.assertEqual(list(fit.parameters.index), ["k_inf", "k1", "tau1"])
        by_force = tpmkit.fit(self.file, law="linear-1", starts=3, contact_force=0.01)
        self.assertNotIn("contact", by_force.parameters.index)
        with self.assertRaisesRegex(tpmkit.Error, "beside contact_force"):
            tpmkit.fit(self.file, law="linear-1", contact=0.0, contact_force=0.01)

    def test_predictions_are_those_of_the_fitted_law(self):
        protocol = tpmkit.Protocol.ramp_and_hold(2e-3, 1e-3, 10.0)
        times = np.linspace(0.0, 12.0, 25)
        placed = self.fit.predict(protocol, times, placement="fitted")
        np.testing.assert_allclose(placed["value"], self.fit.law.respond(protocol, times), rtol=1e-12)
        predicted = self.fit.predict(protocol, times)
        self.assertEqual((predicted["value"].iloc[0], predicted["standard_error"].iloc[0]), (0.0, 0.0))  # at the surface
        self.assertGreater(placed["standard_error"].iloc[0], 0.0)
        with self.assertRaisesRegex(tpmkit.ArgumentError, "placement is 'own'; expected 'surface' or 'fitted'"):
            self.fit.predict(protocol, times, placement="own")
        with self.assertRaisesRegex(tpmkit.ArgumentError, "dataset is 1; expected a whole number from 0 to 0"):
            self.fit.predict(protocol, times, dataset=1)
        truth = tpmkit.Law("linear-1", made.LAW).respond(protocol, times)
        off = np.abs(predicted["value"] - truth)[1:] / predicted["standard_error"][1:]
        self.assertLess(off.max(), 4.0)  # standard errors

    def test_the_data_and_their_band(self):
        frame = self.fit.data[0]
        self.assertEqual(frame.attrs["response_key"], "force_N")
        self.assertEqual(len(frame), 501)
        inside = (frame.lower_force_N < frame.observed_force_N) & (frame.observed_force_N < frame.upper_force_N)
        self.assertGreater(inside[frame.fitted].mean(), 0.9)
        self.assertLess(abs(self.fit.correlation.loc["k1", "tau1"]), 1.0)

    def test_it_is_drawn(self):
        axes = self.fit.plot()
        self.assertEqual(axes.get_xlabel(), "time (s)")
        self.assertEqual(axes.get_ylabel(), "force (N)")
        self.assertGreaterEqual(len(axes.lines), 3)
        page = self.fit._repr_html_()
        estimate = self.fit.parameters.loc["tau1", "estimate"]
        self.assertIn(f"<td>{estimate:.5g}</td>", page)  # the digits that tpm fit prints
        self.assertIn(f" {estimate:.5g} (", repr(self.fit))

    def test_equal_seeds_give_equal_answers_and_a_law_can_be_asked_for(self):
        one, two = (tpmkit.fit(self.file, law="power-1", starts=5, seed=0) for _ in range(2))
        self.assertTrue(one.parameters.equals(two.parameters))
        self.assertEqual(one.law.name, "power-1")

    def test_a_configuration(self):
        fit = tpmkit.fit(tpmkit.example("configs/liver_relaxation.json"), starts=3)
        self.assertIn("verdict", fit.parameters)
        self.assertEqual(fit.laws.size, 0)
        with self.assertRaisesRegex(tpmkit.Error, "is not of a law"):
            fit.law

    def test_columns_can_be_named(self):
        path = Path(self.folder.name) / "other.csv"
        rows = self.file.read_text().splitlines()
        path.write_text("\n".join(["a,b,c", *rows[1:]]))
        with self.assertRaises(tpmkit.Error) as raised:
            tpmkit.fit(path)
        self.assertIn(str(path), str(raised.exception))
        self.assertEqual(raised.exception.code, 3)
        columns = {"time": "a", "drive": "b", "response": "c", "drive_quantity": "indentation_depth",
                   "response_quantity": "contact_force", "units": {"a": "s", "b": "mm", "c": "N"}}
        fit = tpmkit.fit(path, law="linear-1", starts=3, columns=columns)
        self.assertAlmostEqual(fit.parameters.estimate["k1"], self.fit.parameters.estimate["k1"], delta=0.01)
        with self.assertRaisesRegex(tpmkit.ArgumentError, "columns names 'tiem'; expected keys of "):
            tpmkit.fit(path, columns={"tiem": "a"})

    def test_a_table_and_arrays_are_fitted_as_the_file_is(self):
        import pandas as pd

        table = pd.read_csv(self.file)
        by_table = tpmkit.fit(table)
        arrays = [table[c].to_numpy() for c in table.columns]
        by_arrays = tpmkit.fit(time=arrays[0], depth=arrays[1], force=arrays[2], units={"time": "s", "depth": "mm", "force": "N"})
        for fit in (by_table, by_arrays, tpmkit.fit(table.set_index("time (s)"))):
            self.assertTrue(fit.parameters.equals(self.fit.parameters))
        saved = Path(self.folder.name) / "saved"
        self.assertIn("law.json", by_table.save(saved))
        self.assertTrue(pd.read_csv(saved / "recording.csv").equals(table))
        self.assertEqual(tpmkit.Law.read(saved / "law.json").parameters, self.fit.law.parameters)
        (saved / "recording.csv").write_text("another\n")
        with self.assertRaisesRegex(tpmkit.Error, "recording.csv: exists and holds another recording"):
            by_table.save(saved)

    def test_a_law_takes_the_parameters_of_a_fit_by_their_names(self):
        of_material = self.fit.parameters.estimate[["k_inf", "k1", "tau1"]]
        law = tpmkit.Law("linear-1", of_material)
        for name, value in of_material.items():
            self.assertEqual([v for k, v in law.parameters.items() if k.startswith(f"{name}_")], [value])
        with self.assertRaisesRegex(tpmkit.Error, "k1_N_per_m stands twice"):
            tpmkit.Law("linear-1", {"k_inf": 1.0, "k1": 1.0, "k1_N_per_m": 1.0, "tau1": 1.0})
        with self.assertRaisesRegex(tpmkit.Error, "expected them by name"):
            tpmkit.Law("linear-1", [1.0, 2.0])

    def test_tables_and_arrays_that_say_too_little_are_refused_in_a_sentence(self):
        import pandas as pd

        t, units = np.arange(5.0), {"time": "s", "depth": "mm", "force": "N"}
        for said, words in (
            ({"time": t, "depth": t, "force": t}, "units are not guessed"),
            ({"time": t, "depth": t, "units": units}, "force missing"),
            ({"time": t, "depth": t[:4], "force": t, "units": units}, "depth has 4 values and time 5"),
            ({"time": t.reshape(1, 5), "depth": t, "force": t, "units": units}, r"time has the shape \(1, 5\)"),
            ({"time": t, "depth": t, "force": [1, 2, None, 4, 5], "units": units}, "force is NaN at place 2"),
            ({"time": t, "depth": t, "force": list("abcde"), "units": units}, "expected numbers"),
            ({"files": pd.DataFrame({"a": t, "b": t, "c": t})}, "^table: "),
            ({"files": self.file, "starts": 0.5}, "starts is 0.5"),
            ({"files": self.file, "contact": "1 mm"}, "contact is '1 mm'; expected a number, in m"),
            ({}, "one of them"),
            ({"files": self.file, "time": t}, "one of them"),
        ):
            with self.subTest(words=words), self.assertRaisesRegex(tpmkit.Error, words):
                tpmkit.fit(**said)
        with self.assertRaisesRegex(tpmkit.Error, "times_s: is NaN at place 1"):
            self.fit.predict(tpmkit.Protocol.step_and_hold(1e-3, 5.0), [0.0, np.nan])

    def test_covariance_criteria_and_residuals(self):
        covariance, table = self.fit.covariance, self.fit.parameters
        for name in covariance.index:
            self.assertAlmostEqual(covariance.loc[name, name] ** 0.5 / table.loc[name, "standard_error"], 1.0)
        count = len(covariance)
        self.assertAlmostEqual(self.fit.bic - self.fit.aic, (np.log(501) - 2) * (count + 1), delta=0.1 * count)
        residuals = self.fit.residuals
        frame = self.fit.data[0]
        np.testing.assert_array_equal(residuals.residual, frame.observed_force_N - frame.predicted_force_N)
        self.assertAlmostEqual(residuals.residual[residuals.fitted].std() / 2e-4, 1.0, delta=0.15)

    def test_young_moduli_are_those_of_the_probe(self):
        moduli = self.fit.young_moduli(punch_radius_m=2e-3, poisson_ratio=0.5)
        for modulus, parameter in (("E_inf", "k_inf"), ("E1", "k1")):  # F = 2 E/(1 - nu^2) r u
            stiffness = self.fit.parameters.loc[parameter, "estimate"]
            self.assertAlmostEqual(moduli.loc[modulus, "estimate"] / (stiffness * 0.75 / 4e-3), 1.0, places=4)
        self.assertEqual(moduli.loc["E1", "unit"], "Pa")
        self.assertEqual(moduli.attrs["poisson_ratio"], 0.5)
        for size, words in ((-2e-3, "punch_radius_m is -0.002; expected a number above 0"), ("2 mm", "punch_radius_m is '2 mm'")):
            with self.assertRaisesRegex(tpmkit.ArgumentError, "^young_moduli: " + words):
                self.fit.young_moduli(punch_radius_m=size)
        for wrong in ({}, {"punch_radius_m": 2e-3, "sphere_radius_m": 1e-3}, {"punch_radius_m": "2 mm"}):
            with self.assertRaises(tpmkit.Error):
                self.fit.young_moduli(**wrong)

    def test_its_repr_says_verdicts_and_adequacy_and_what_to_know(self):
        text = repr(self.fit)
        self.assertTrue(text.startswith("<tpmkit.Fit linear-1"))
        self.assertIn(self.fit.adequacy["summary"], text)
        for words in (*self.fit.verdicts, *self.fit.warnings):
            self.assertIn(words, text)

    def test_its_str_is_the_short_answer(self):
        text = str(self.fit)
        self.assertLessEqual(text.count("\n"), 25)
        for words in (self.fit.adequacy["summary"], *self.fit.warnings):
            self.assertIn(words, text)
        self.assertGreater(self.fit.details().count("\n"), text.count("\n"))

    def test_a_fit_is_copied_as_itself_and_pickled_with_its_inputs(self):
        self.assertIs(copy.copy(self.fit), self.fit)
        self.assertIs(copy.deepcopy([self.fit])[0], self.fit)
        again = pickle.loads(pickle.dumps(self.fit))
        self.assertEqual((repr(again), str(again), again.details()), (repr(self.fit), str(self.fit), self.fit.details()))
        self.assertEqual(again.to_dict(), self.fit.to_dict())
        self.assertEqual(again.law, self.fit.law)
        for ours, theirs in zip(again.data, self.fit.data):
            self.assertTrue(ours.equals(theirs))
        self.assertTrue(again.covariance.equals(self.fit.covariance))
        protocol = tpmkit.Protocol.ramp_and_hold(2e-3, 1e-3, 10.0)
        times = np.linspace(0.0, 12.0, 25)
        self.assertTrue(again.predict(protocol, times).equals(self.fit.predict(protocol, times)))  # fits again
        twice = pickle.loads(pickle.dumps(again))
        self.assertEqual(repr(twice), repr(self.fit))

    def test_an_unpickled_fit_refuses_inputs_that_have_changed(self):
        with tempfile.TemporaryDirectory() as folder:
            file = made.recording(folder)
            pickled = pickle.dumps(tpmkit.fit(file, law="linear-1", starts=2))
            protocol = tpmkit.Protocol.ramp_and_hold(2e-3, 1e-3, 10.0)
            made.recording(folder, seed=7)
            with self.assertRaisesRegex(tpmkit.Error, "gives other parameters than the fit that was pickled"):
                pickle.loads(pickled).predict(protocol, [1.0])
            os.remove(file)
            again = pickle.loads(pickled)
            with self.assertRaises(tpmkit.Error):
                again.predict(protocol, [1.0])
            self.assertEqual(again.law.name, "linear-1")

    def test_parts_of_a_fit_are_pickled(self):
        self.assertEqual(pickle.loads(pickle.dumps(self.fit.law)), self.fit.law)
        self.assertTrue(pickle.loads(pickle.dumps(self.fit.parameters)).equals(self.fit.parameters))

    def test_errors(self):
        for files, words in (([], "no file"), ("none.csv", "none.csv"), ("", "files holds ''; expected the paths of recordings")):
            with self.assertRaisesRegex(tpmkit.Error, words):
                tpmkit.fit(files)

    def test_other_threads_run_meanwhile(self):
        counted, over = 0, False

        def count():
            nonlocal counted
            while not over:
                counted += 1
                time.sleep(0.001)

        thread = threading.Thread(target=count)
        thread.start()
        try:
            tpmkit.fit(self.file, law="linear-2", starts=20)
        finally:
            over = True
            thread.join()
        self.assertGreater(counted, 10)


class Interruptions(unittest.TestCase):
    def test_ctrl_c_ends_a_fit(self):
        with tempfile.TemporaryDirectory() as folder:
            file = made.recording(folder)
            program = textwrap.dedent(f"""
                import tpmkit
                try:
                    print("begun", flush=True)
                    tpmkit.fit({str(file)!r}, law="power-3", starts=100000)
                except KeyboardInterrupt:
                    print("interrupted", flush=True)
            """)
            with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True) as child:
                self.assertEqual(child.stdout.readline(), "begun\n")
                time.sleep(1.0)
                os.kill(child.pid, signal.SIGINT)
                self.assertEqual(child.communicate(timeout=600)[0], "interrupted\n")
                self.assertEqual(child.returncode, 0)


if __name__ == "__main__":
    unittest.main()
