"""Contacts stepped from Python, sessions run and opened."""

import json
import tempfile
import unittest
from pathlib import Path

import numpy as np

import tpmkit

MATERIAL = {"E1": "12 kPa", "E2": "12 kPa", "Eprime": "12 kPa", "eta1": "2.4e4 Pa s"}
SESSION = {
    "title": "short",
    "model": {"kind": "element", "scene": {"organ": {"kind": "star", "spacing": "30 mm"}, "material": MATERIAL}},
    "indentations": {"depths": ["4 mm"], "rates": ["4 mm/s"], "hold": "2 s", "rest": "1 s"},
}


class Contacts(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.file = Path(self.folder.name) / "session.json"
        self.file.write_text(json.dumps(SESSION))

    def tearDown(self):
        self.folder.cleanup()

    def test_a_push_is_that_of_the_element(self):
        contact = tpmkit.Contact(self.file, start_gate=False, device="virtual")
        contact.push(np.zeros(601))  # forces have grown to their limit
        depths = 4e-6 * np.minimum(np.arange(1, 2001), 1000)
        forces = contact.push(depths)
        element = tpmkit.Element(eta1_Pa_s=2.4e4)
        exact = element.respond(tpmkit.Protocol.ramp_and_hold(4e-3, 4e-3, 1.0), 1e-3 * np.arange(1, 2001))
        np.testing.assert_allclose(forces, exact, atol=1e-10)
        self.assertTrue(contact.state["touching"])
        self.assertEqual(contact.info["period_s"], 1e-3)
        self.assertIn("element", repr(contact))
        self.assertEqual(contact.adequacy["verdict"], "adequate")
        self.assertIn(contact.adequacy["summary"], repr(contact))
        for words in contact.warnings:
            self.assertIn(words, repr(contact))

    def test_single_steps_and_many_agree(self):
        one, many = (tpmkit.Contact(self.file, start_gate=False, device="virtual") for _ in range(2))
        positions = np.zeros((1500, 3))
        positions[:, 2] = 1e-3 - 2e-6 * np.arange(1500)
        forces = many.steps(positions)
        self.assertTrue(np.array_equal(np.array([one.step(p) for p in positions]), forces))
        self.assertGreater(forces[:, 2].max(), 0.1)
        self.assertTrue(many.state["valid"])

    def test_a_loop_by_the_clock_has_the_forces_of_its_time(self):
        by_periods, by_clock = (tpmkit.Contact(self.file, start_gate=False, device="virtual") for _ in range(2))
        depths = np.concatenate([np.zeros(600), 4e-6 * np.arange(500)])
        right = by_periods.push(depths)
        forces = [by_clock.step_at(100.0 + i / 4000, [0.0, 0.0, -depths[i // 4]])[2] for i in range(4 * len(depths))]
        # A force is that of the call nearest to the end of a period.
        np.testing.assert_allclose(forces[-1], right[-1], rtol=5e-3)
        self.assertAlmostEqual(by_clock.state["time_s"], len(depths) * 1e-3, delta=2e-3)
        slow = tpmkit.Contact(self.file, device="virtual")
        with self.assertRaisesRegex(tpmkit.Error, "overrun storm"):
            for i in range(1000):
                slow.step_at(i / 100, [0.0, 0.0, 2e-3])
        self.assertLess(i, 150)

    def test_arguments_are_refused_in_a_sentence(self):
        contact = tpmkit.Contact(self.file, start_gate=False, device="virtual")
        here = [0.0, 0.0, 1e-3]
        contact.step_at(1.0, here)
        refused = [
            (lambda: contact.step(here, missed=-1), "missed is -1"),
            (lambda: contact.step(here, missed=1.5), "missed is 1.5"),
            (lambda: contact.step(here, missed=True), "missed is True"),
            (lambda: contact.step([0.0, 0.0]), "three numbers"),
            (lambda: contact.step("here"), "three numbers"),
            (lambda: contact.step(None), "three numbers"),
            (lambda: contact.step([[0.0, 0.0, 0.0]]), "three numbers"),
            (lambda: contact.step_at("now", here), "t_s is 'now'"),
            (lambda: contact.step_at(10**400, here), "t_s is 1000"),
            (lambda: contact.step_at(2.0, [0.0]), "three numbers"),
            (lambda: contact.steps([1.0, 2.0]), "three columns"),
            (lambda: contact.push([[1.0], [2.0]]), "a list of numbers"),
            (lambda: tpmkit.Contact(self.file, rate_Hz=100.0, device="virtual"), "rate_Hz: 100; expected 500 to 4000 Hz"),
            (lambda: tpmkit.Contact(self.file, rate_Hz="fast", device="virtual"), "rate_Hz is 'fast'"),
            (lambda: tpmkit.Contact(self.file, longest_s=-1.0, device="virtual"), "longest_s: -1"),
            (lambda: tpmkit.Contact(self.file, device="gloves"), "^device: 'gloves'"),
            (lambda: tpmkit.Contact(self.file, device="replay"), "^device: 'replay'"),
            (lambda: tpmkit.Contact(self.file, start_gate="no"), "wrong kind"),
        ]
        refused += [(lambda t=t: contact.step_at(t, here), "rise with the calls")
                    for t in (0.5, float("nan"), float("inf"), -float("inf"), 1e15)]
        for call, words in refused:
            with self.subTest(words):
                with self.assertRaisesRegex(ValueError, words) as caught:
                    call()
                self.assertIsInstance(caught.exception, tpmkit.Error)
                self.assertEqual(caught.exception.code, 2)
                self.assertNotIn("\n", str(caught.exception))
                self.assertNotIn("--", str(caught.exception))
        # None of them was a step.
        self.assertEqual(contact.state["time_s"], 1e-3)
        self.assertEqual(contact.step_at(1.001, here).tolist(), [0.0, 0.0, 0.0])

    def test_what_is_unstable_is_refused_by_its_argument(self):
        late = json.loads(self.file.read_text())
        late["virtual_device"] = {"delay_periods": 50}
        self.file.write_text(json.dumps(late))
        output = Path(self.folder.name) / "s.tpmrec"
        with self.assertRaisesRegex(tpmkit.Error, "unstable.* accept_unstable$"):
            tpmkit.run_session(self.file, output)
        tpmkit.run_session(self.file, output, accept_unstable=True)
        self.assertTrue(output.exists())

    def test_it_waits_for_the_tool_and_stops_at_a_jump(self):
        contact = tpmkit.Contact(self.file, device="virtual")
        contact.step([0.0, 0.0, 5e-3])
        self.assertTrue(contact.state["waiting"])
        contact = tpmkit.Contact(self.file, start_gate=False, device="virtual")
        contact.push(np.zeros(10))
        with self.assertRaisesRegex(tpmkit.Error, "position jumped"):
            contact.step([0.0, 0.0, -0.05])
        with self.assertRaises(tpmkit.Error):
            contact.step([0.0, 0.0, 0.0])
        self.assertTrue(any("position jumped" in w for w in contact.warnings))
        contact.reset()
        self.assertFalse(any("has stopped" in w for w in contact.warnings))
        self.assertEqual(contact.step([0.0, 0.0, 0.0]).tolist(), [0.0, 0.0, 0.0])
        with self.assertRaisesRegex(tpmkit.Error, "three columns"):
            contact.steps([1.0, 2.0])

    def test_a_law_file_is_felt(self):
        law = tpmkit.Law("linear", {"k_inf_N_per_m": 60.0}, reference=3e-3)
        law.write(Path(self.folder.name) / "law.json")
        contact = tpmkit.Contact(Path(self.folder.name) / "law.json", start_gate=False, device="virtual")
        contact.push(np.zeros(600))
        np.testing.assert_allclose(contact.push(1e-6 * np.arange(2000)), 60e-6 * np.arange(2000), atol=1e-12)

    def test_a_session_is_run_and_opened(self):
        output, told = Path(self.folder.name) / "s.tpmrec", []
        self.assertEqual(tpmkit.run_session(self.file, output, progress=lambda *t: told.append(t)), "finished")
        self.assertTrue(told)
        data = tpmkit.open(output)
        self.assertEqual(data.attrs["simulated_device"], 1)
        self.assertIn("SIMULATED DEVICE", data.attrs["device"])
        self.assertIn("tpm hil verify", data.attrs["adequacy"])
        rendering = json.loads(data.attrs["header"])["rendering"]
        self.assertEqual(data.attrs["warnings"], [remark["text"] for remark in rendering["remarks"]])
        cut = Path(self.folder.name) / "cut.tpmrec"
        cut.write_bytes(output.read_bytes()[:-3000])
        self.assertRegex(" ".join(tpmkit.open(cut).attrs["warnings"]), "cut off at .* s of 6.5 s: no closing record")
        self.assertGreater(float(data.commanded_N.max()), 0.3)
        deepest = float(data.tool_depth_m.max())
        self.assertAlmostEqual(deepest, 4e-3, delta=2e-4)
        self.assertEqual(data.sizes["phase_number"], len(data.phase_name))
        # What was sent again, asked of a contact that is stepped along the same motion.
        contact = tpmkit.Contact(self.file, start_gate=False, device="virtual")
        positions = np.column_stack([data.position_x_m, data.position_y_m, data.position_z_m])[:-1]
        sent = np.column_stack([data.commanded_x_N, data.commanded_y_N, data.commanded_z_N])[:-1]
        self.assertTrue(np.array_equal(contact.steps(positions), sent))

    def test_a_device_file_brings_limits_and_the_measured_delay(self):
        file = Path(self.folder.name) / "device.json"
        file.write_text(json.dumps({"device": "omega7", "delay": {"provenance": "measured", "largest_s": 0.002}}))
        tpmkit.Contact(self.file, device_file=file)
        file.write_text(json.dumps({"device": "omega7", "delay": {"provenance": "measured", "largest_s": 0.02}}))
        with self.assertRaisesRegex(tpmkit.Error, "keep six hands below 5 mJ"):
            tpmkit.Contact(self.file, device_file=file)
        with self.assertRaisesRegex(tpmkit.Error, "is of 'omega7', not of 'falcon'"):
            tpmkit.Contact(self.file, device="falcon", device_file=file)

    def test_hardware_that_nobody_measured_counts_as_late_and_free_of_friction(self):
        with self.assertRaisesRegex(tpmkit.Error, "not measured on this device: 20 ms and no friction count"):
            tpmkit.Contact(self.file, device="omega7")

    def test_a_contact_without_a_device_is_opened_and_says_that_no_limit_of_a_device_was_checked(self):
        contact, virtual = tpmkit.Contact(self.file), tpmkit.Contact(self.file, device="virtual")
        self.assertEqual(contact.warnings, [tpmkit._contact.NO_DEVICE, *virtual.warnings])
        self.assertEqual(contact.info["warnings"], contact.warnings)
        self.assertIn("no limit of a device was checked", repr(contact))
        self.assertNotIn("no limit of a device", repr(virtual))
        self.assertEqual(contact.info["verdict"], virtual.info["verdict"])
        with self.assertRaisesRegex(tpmkit.Error, "accept_unstable: is not for the device 'omega7'"):
            tpmkit.Contact(self.file, accept_unstable=True)

    def test_errors(self):
        with self.assertRaisesRegex(tpmkit.Error, "none.json"):
            tpmkit.Contact("none.json")
        with self.assertRaisesRegex(tpmkit.Error, "gloves"):
            tpmkit.Contact(self.file, device="gloves")


if __name__ == "__main__":
    unittest.main()
