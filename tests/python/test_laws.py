"""Laws, the element and protocols."""

import copy
import pickle
import tempfile
import unittest
from pathlib import Path

import numpy as np

import tpmkit
from made import LAW


class Laws(unittest.TestCase):
    def test_a_kept_step_relaxes_as_the_closed_form(self):
        law = tpmkit.Law("linear-1", LAW)
        times = np.linspace(0.0, 10.0, 201)
        force = law.respond(tpmkit.Protocol.step_and_hold(2e-3, np.inf), times)
        exact = 2e-3 * (LAW["k_inf_N_per_m"] + LAW["k1_N_per_m"] * np.exp(-times / LAW["tau1_s"]))
        np.testing.assert_allclose(force, exact, rtol=1e-12)

    def test_the_answer_is_handed_over_without_a_copy(self):
        law = tpmkit.Law("linear-1", LAW)
        force, by = law.respond(tpmkit.Protocol.step_and_hold(2e-3, 5.0), np.arange(5.0), sensitivity=True)
        for array in (force, by):
            self.assertFalse(array.flags.owndata)  # the memory is the library's
            self.assertTrue(array.flags.writeable)
        self.assertEqual(by.shape, (5, len(law.parameters)))

    def test_derivatives_are_those_of_finite_differences(self):
        protocol, times = tpmkit.Protocol.ramp_and_hold(2e-3, 4e-3, 5.0), np.linspace(0.1, 5.0, 40)
        values = tpmkit.Law("power-1", {**LAW, "exponent": 1.4}).parameters
        _, by = tpmkit.Law("power-1", values).respond(protocol, times, sensitivity=True)
        for column, name in enumerate(values):
            if name.startswith(("contact", "offset")):
                continue
            step = 1e-6 * values[name]
            ends = [
                tpmkit.Law("power-1", {**values, name: values[name] + sign * step}).respond(protocol, times)
                for sign in (1, -1)
            ]
            np.testing.assert_allclose(by[:, column], (ends[0] - ends[1]) / (2 * step), rtol=1e-5, atol=1e-12)

    def test_a_law_file_comes_back_as_it_was(self):
        law = tpmkit.Law("hertz-2", {"k_inf_N_per_m": 1, "k1_N_per_m": 2, "k2_N_per_m": 3, "tau1_s": 0.1, "tau2_s": 10},
                         reference=2e-3)
        with tempfile.TemporaryDirectory() as folder:
            law.write(Path(folder) / "law.json")
            again = tpmkit.Law.read(Path(folder) / "law.json")
        self.assertEqual((again.name, again.parameters, again.reference), (law.name, law.parameters, law.reference))
        self.assertEqual(law.provenance, "assumed")
        self.assertIn("tau2_s", tpmkit.Law.describe("hertz-2"))

    def test_a_spectrum_is_that_of_one_branch(self):
        law = tpmkit.Law("linear-1", LAW)
        frequency = np.geomspace(0.01, 10, 13)
        storage, loss = law.respond_spectrum(frequency)
        s = 2j * np.pi * frequency * LAW["tau1_s"]
        exact = LAW["k_inf_N_per_m"] + LAW["k1_N_per_m"] * s / (1 + s)
        np.testing.assert_allclose(storage + 1j * loss, exact, rtol=1e-12)

    def test_arguments_of_a_wrong_kind_are_told_in_a_sentence(self):
        law = tpmkit.Law("linear-1", LAW)
        for call in (lambda: law.respond(3, [1.0]), lambda: tpmkit.Law.describe(3),
                     lambda: tpmkit.Element().respond("step", [1.0]), lambda: law.write(3), lambda: tpmkit.Law.read(3),
                     lambda: tpmkit.simulate(3), lambda: tpmkit.plan(3),
                     lambda: tpmkit.sweep(3, "s.h5"), lambda: tpmkit.open(3), lambda: tpmkit.read_recording(3), lambda: tpmkit.view(3, "v.html"),
                     lambda: tpmkit.design(3), lambda: tpmkit.validate("law.json", 3), lambda: tpmkit.validate("law.json", "a.csv", instrument=3),
                     lambda: tpmkit.Contact(3), lambda: tpmkit.run_session(3, "s.tpmrec"), lambda: tpmkit.example(3)):
            with self.assertRaisesRegex(tpmkit.Error, r"an argument is missing or of a wrong kind; expected what help\(tpmkit\.") as raised:
                call()
            self.assertNotIn("std::", str(raised.exception))
        with self.assertRaisesRegex(tpmkit.Error, r"^simulate\(a Law\): an argument"):
            tpmkit.simulate(law)
        with self.assertRaisesRegex(tpmkit.Error, r"^Law.describe\(3\): an argument"):
            tpmkit.Law.describe(3)
        with self.assertRaisesRegex(tpmkit.Error, "times_s: is 'now'; expected a list of numbers"):
            law.respond(tpmkit.Protocol.step_and_hold(1e-3, 2.0), "now")

    def test_laws_protocols_and_elements_are_pickled_and_copied(self):
        times = np.linspace(0.0, 3.0, 7)
        law = tpmkit.Law("linear-1", LAW)
        element = tpmkit.Element(E1_Pa=9e3)
        for protocol in (
            tpmkit.Protocol.step_and_hold(2e-3, np.inf), tpmkit.Protocol.ramp_and_hold(2e-3, 1e-3, 5.0),
            tpmkit.Protocol.history([0.0, 1.0, 3.0], [1e-3, 1e-3, 2e-3], equilibrium_at_start=True),
        ):
            for again in (pickle.loads(pickle.dumps((law, protocol, element))), copy.deepcopy((law, protocol, element))):
                self.assertEqual(again[:2], (law, protocol))
                np.testing.assert_array_equal(again[0].respond(again[1], times), law.respond(protocol, times))
            self.assertEqual(again[2].parameters, element.parameters)
        creep = tpmkit.Protocol.creep(0.1, 4.0)
        self.assertEqual(pickle.loads(pickle.dumps(creep)), creep)
        self.assertNotEqual(creep, tpmkit.Protocol.creep(0.2, 4.0))

    def test_what_is_wrong_is_one_line_with_a_code(self):
        for make in (
            lambda: tpmkit.Law("lienar-1", LAW),
            lambda: tpmkit.Law("linear-1", {"k_inf_N_per_m": 60.0}),
            lambda: tpmkit.Law("linear-1", {**LAW, "tau1_s": -1.0}),
            lambda: tpmkit.Protocol.history([0.0, 1.0], [0.0], "displacement"),
            lambda: tpmkit.Protocol.history([0.0, 1.0], [0.0, 1.0], "sideways"),
            lambda: tpmkit.Law.read("none.json"),
        ):
            with self.assertRaises(tpmkit.Error) as raised:
                make()
            self.assertEqual(raised.exception.code, 3)
            self.assertNotIn("\n", str(raised.exception))


class Elements(unittest.TestCase):
    def test_the_closed_form_agrees_with_the_integrated_equation(self):
        protocol, times = tpmkit.Protocol.ramp_and_hold(4e-3, 4e-3, 60.0), np.linspace(0.0, 61.0, 62)
        exact = tpmkit.Element(eta1_Pa_s=2.4e5).respond(protocol, times)
        other = tpmkit.Element(eta1_Pa_s=2.4e5, formulation="cvodes").respond(protocol, times)
        self.assertGreater(exact.max(), 0.5)
        np.testing.assert_allclose(other, exact, rtol=1e-7, atol=1e-9)

    def test_the_printed_number_of_the_paper(self):
        force = tpmkit.Element().respond(tpmkit.Protocol.step_and_hold(4e-3, 30.0), [0.0])
        self.assertEqual(int(force[0] * 1e3), 613)  # Sec. 4.2; the paper cuts digits off


class Protocols(unittest.TestCase):
    def test_knots(self):
        protocol = tpmkit.Protocol.ramp_and_hold(2e-3, 1e-3, 3.0)
        np.testing.assert_allclose(protocol.knots, [[0, 0], [2, 2e-3], [5, 2e-3]])
        self.assertEqual((protocol.drive, protocol.start_s, protocol.end_s), ("displacement", 0.0, 5.0))
        self.assertAlmostEqual(protocol.scaled(0.5).value_at(1.0), 0.5e-3)
        self.assertIn("Protocol", repr(protocol))


if __name__ == "__main__":
    unittest.main()
