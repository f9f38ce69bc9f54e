"""Scenes run, sweeps computed, results and recordings opened."""

import copy
import json
import os
import pickle
import signal
import subprocess
import sys
import tempfile
import textwrap
import time
import unittest
from pathlib import Path

import numpy as np

import made
import tpmkit

MATERIAL = {"E1": "12 kPa", "E2": "12 kPa", "Eprime": "12 kPa", "eta1": "2.4e4 Pa s"}
SCENE = {
    "organ": {"kind": "star", "spacing": "30 mm"},
    "material": MATERIAL,
    "contacts": [{"kind": "sphere"}],
    "protocol": {"kind": "ramp_hold", "depth": "4 mm", "rate": "4 mm/s", "hold": "1 s"},
    "outputs": {"times": ["0 s", "1 s", "2 s"]},
}
SWEEP = {
    "model": "single_contact",
    "material": {"E1": "12 kPa", "E2": "12 kPa", "Eprime": "12 kPa", "eta1": "5 Pa s"},
    "indentation": {"kind": "step_hold"},
    "axes": [
        {"parameter": "depth", "from": "1 mm", "to": "8 mm", "count": 8},
        {"parameter": "spacing", "name": "x", "from": "20 mm", "to": "40 mm", "count": 5},
    ],
    "outputs": ["peak_force"],
}


class Runs(unittest.TestCase):
    def test_a_star_answers_as_the_closed_form(self):
        told = []
        data = tpmkit.simulate(SCENE, progress=lambda done, total: told.append((done, total)))
        exact = tpmkit.Element(eta1_Pa_s=2.4e4).respond(
            tpmkit.Protocol.ramp_and_hold(4e-3, 4e-3, 1.0), data.time_s.to_numpy())
        np.testing.assert_allclose(data.force_N, exact, atol=1e-4 * exact.max())
        self.assertEqual(told[-1][0], told[-1][1])
        self.assertEqual(data.position_m.dims, ("output_s", "sphere", "axis"))
        self.assertAlmostEqual(float(abs(data.position_m[-1] - data.position_m[0]).max()), 4e-3, delta=1e-9)
        # the work of the tool is kept or became heat
        np.testing.assert_allclose(data.work_J, data.stored_J + data.dissipated_J, atol=1e-3 * float(data.work_J.max()))

    def test_a_result_that_was_written_is_opened_as_it_was(self):
        with tempfile.TemporaryDirectory() as folder:
            data = tpmkit.simulate(SCENE, output=Path(folder) / "run.h5")
            again = tpmkit.open(Path(folder) / "run.h5").load()
            self.assertEqual(sorted(os.listdir(folder)), ["run.h5", "run.xdmf"])
        np.testing.assert_allclose(again.force_N, data.force_N)
        np.testing.assert_allclose(again.position_m, data.position_m)
        np.testing.assert_allclose(again.output_s, data.output_s)
        self.assertEqual([data.attrs["warnings"], again.attrs["warnings"]], [[], []])
        for opened in (data, again):
            self.assertIn("adequacy", repr(opened))
        for opened in (data, again):
            self.assertEqual({k: v.attrs["units"] for k, v in opened.variables.items() if k not in ("sphere", "axis")},
                             {"time_s": "s", "output_s": "s", "depth_m": "m", "force_N": "N", "position_m": "m",
                              "work_J": "J", "dissipated_J": "J", "stored_J": "J"})

    def test_limits_that_a_run_passes_are_warnings_of_the_answer_and_of_the_file(self):
        deep = json.loads(json.dumps(SCENE))
        deep["organ"] = {"kind": "liver", "count": 60, "layers": 2, "spacing": "20 mm", "seed": 1}
        deep["contacts"] = [{"kind": "sphere", "number": 20}]
        deep["anchors"] = [{"kind": "far_side", "fraction": 0.3}]
        deep["protocol"]["depth"] = "11 mm"
        with tempfile.TemporaryDirectory() as folder:
            data = tpmkit.simulate(deep, output=Path(folder) / "run.h5")
            again = tpmkit.open(Path(folder) / "run.h5")
        for opened in (data, again):
            self.assertTrue(any("more than 30 degrees" in w for w in opened.attrs["warnings"]), opened.attrs["warnings"])
            self.assertIn("more than 30 degrees", repr(opened))

    def test_cells_without_an_answer_are_warned_of(self):
        holed = {**SWEEP, "skip": [{"when": "depth > 0.0075"}]}
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "sweep.json"
            file.write_text(json.dumps(holed))
            with tpmkit.sweep(file, Path(folder) / "sweep.h5", workers=1) as data:
                self.assertEqual(data.attrs["warnings"], ["5 of 40 cells have no answer; status and reason say why"])

    def test_units_are_those_that_keys_end_in(self):
        from tpmkit._data import unit_of
        for key, unit in (("k_inf_N_per_m", "N/m"), ("rate_m_per_s", "m/s"), ("eta_Pa_s", "Pa s"), ("tool_x_m", "m"),
                          ("phase", None), ("time_s", "s")):
            self.assertEqual(unit_of(key), unit)

    def test_an_input_is_never_written_over(self):
        with tempfile.TemporaryDirectory() as folder:
            scene = Path(folder) / "scene.json"
            scene.write_text(json.dumps(SCENE))
            link = Path(folder) / "link.h5"
            link.symlink_to(scene)
            for output in (scene, link):
                with self.assertRaisesRegex(tpmkit.Error, "would write over it; expected another name"):
                    tpmkit.simulate(scene, output=output)
                self.assertEqual(json.loads(scene.read_text()), SCENE)

    def test_what_a_progress_raises_ends_the_run(self):
        def refuse(done, total):
            raise ValueError("enough")

        with self.assertRaisesRegex(ValueError, "enough"):
            tpmkit.simulate(SCENE, progress=refuse)

    def test_a_sweep_is_computed_and_opened(self):
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "sweep.json"
            file.write_text(json.dumps(SWEEP))
            with tpmkit.sweep(file, Path(folder) / "sweep.h5", workers=1) as data:
                lambda1 = 2 * 12e3 * (1 - np.cos(np.arctan(data.depth / data.x)))  # Eqs. 2 and 15
                np.testing.assert_allclose(data.peak_force, (12e3 + lambda1) * data.depth * 12.56e-3, rtol=1e-12)
            with tpmkit.open(Path(folder) / "sweep.h5") as data:
                self.assertTrue(pickle.loads(pickle.dumps(data)).identical(data))
                self.assertTrue(copy.deepcopy(data).identical(data))
            told = []
            with tpmkit.sweep(file, Path(folder) / "sweep.h5", progress=lambda *t: told.append(t)):
                self.assertEqual(told, [])  # it was only opened

    def test_ctrl_c_ends_a_run(self):
        with tempfile.TemporaryDirectory() as folder:
            program = textwrap.dedent(f"""
                import json, tpmkit
                scene = json.loads(tpmkit.example("configs/liver_indentation.json").read_text())
                scene["formulation"] = {{"kind": "inertial"}}
                try:
                    print("begun", flush=True)
                    tpmkit.simulate(scene)
                except KeyboardInterrupt:
                    print("interrupted", flush=True)
            """)
            with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True, cwd=folder) as child:
                self.assertEqual(child.stdout.readline(), "begun\n")
                time.sleep(1.5)
                os.kill(child.pid, signal.SIGINT)
                self.assertEqual(child.communicate(timeout=600)[0], "interrupted\n")

    def test_errors(self):
        with self.assertRaisesRegex(tpmkit.Error, "organ"):
            tpmkit.simulate({**SCENE, "organ": {"kind": "kidney"}})
        with self.assertRaisesRegex(tpmkit.Error, "none.json"):
            tpmkit.simulate("none.json")
        with self.assertRaisesRegex(tpmkit.Error, "none.h5"):
            tpmkit.open("none.h5")
        for call in (tpmkit.open, tpmkit.simulate, tpmkit.example):
            with self.assertRaisesRegex(tpmkit.ArgumentError, rf"^{call.__name__}\(b'none.h5'\): "):
                call(b"none.h5")
        with self.assertRaisesRegex(tpmkit.Error, "expected one of .*liver_poke.json"):
            tpmkit.example("configs/none.json")
        with self.assertRaisesRegex(tpmkit.Error, "expected a file of configs/ or data/"):
            tpmkit.example("recording")
        with self.assertRaisesRegex(tpmkit.Error, "expected one of configs/[^,]*spectrum.csv, configs/[^,]*spectrum.csv"):
            tpmkit.example("spectrum.csv")

    def test_a_file_that_comes_with_tpmkit_by_its_name_alone(self):
        self.assertEqual(tpmkit.example("liver_poke.json"), tpmkit.example("configs/liver_poke.json"))
        self.assertTrue(tpmkit.example("recording.csv").is_file())
        for workers in (0.5, -1, "all"):
            with self.assertRaisesRegex(tpmkit.Error, "^sweep: workers is .*; expected a whole number"):
                tpmkit.sweep("sweep.json", "sweep.h5", workers=workers)
        for name in ("rate_Hz", "longest_s"):
            with self.assertRaisesRegex(tpmkit.Error, f"^contact: {name} is '1 k'; expected a number, in "):
                tpmkit.Contact("law.json", **{name: "1 k"})


class Plans(unittest.TestCase):
    def test_the_star_needs_no_network(self):
        plan = tpmkit.plan(SCENE, tolerance="1%")
        self.assertIsNotNone(plan.choice)
        chosen = plan.candidates.loc[plan.choice]
        self.assertIn(plan.adequacy["verdict"], ("adequate", "not_adequate"))
        self.assertLessEqual(str(plan).count("\n"), 25)
        self.assertEqual([remark["text"] for remark in plan.remarks], plan.warnings)
        for words in plan.warnings:
            self.assertIn(words, str(plan))
        for words in (plan.adequacy["summary"], *plan.warnings):
            self.assertIn(words, repr(plan))
        for again in (pickle.loads(pickle.dumps(plan)), copy.deepcopy(plan)):
            self.assertEqual((repr(again), str(again), again.to_dict()), (repr(plan), str(plan), plan.to_dict()))
        self.assertTrue(chosen.feasible)
        self.assertLess(chosen.verified_error, 0.01)
        self.assertEqual(plan.to_dict()["tolerance"], 0.01)
        with self.assertRaisesRegex(tpmkit.Error, "tolerance"):
            tpmkit.plan(SCENE, tolerance="much")
        self.assertEqual(tpmkit.plan(SCENE, tolerance=0.01).to_dict(), plan.to_dict())
        for wrong in ({"tolerance": [0.01]}, {"outputs": 1}, {"wall": 0.1}, {"rate_Hz": "1 kHz"}):
            with self.assertRaisesRegex(tpmkit.Error, f"^plan: {next(iter(wrong))} is .*; expected "):
                tpmkit.plan(SCENE, **wrong)

    def test_masses_that_are_left_out_are_stated_with_the_error(self):
        scene = {"organ": {"kind": "liver", "count": 60}, "contacts": [{"kind": "ball", "radius": "10 mm"}]}
        moved = {"protocol": {"kind": "ramp_hold", "depth": "2 mm", "rate": "20 mm/s", "hold": "0.5 s"}}
        plan = tpmkit.plan(scene | moved, tolerance="1%")
        self.assertEqual(plan.adequacy["verdict"], "not_adequate")
        self.assertIn("by masses, which the model leaves out", plan.adequacy["summary"])
        loaded = {"protocol": {"kind": "creep", "load": "0.05 N", "duration": "2 s"}}
        plan = tpmkit.plan(scene | loaded, tolerance="1%")
        self.assertIn("not known what masses would change", plan.adequacy["summary"])


class Recordings(unittest.TestCase):
    def test_a_recording_is_read(self):
        with tempfile.TemporaryDirectory() as folder:
            data = tpmkit.open(made.recording(folder))
        self.assertEqual(set(data.data_vars), {"force_N", "depth_m"})
        self.assertEqual(data.sizes["time_s"], 501)
        self.assertAlmostEqual(float(data.depth_m.max()), 3e-3)
        self.assertEqual({k: v.attrs["units"] for k, v in data.variables.items()},
                         {"time_s": "s", "force_N": "N", "depth_m": "m"})
        self.assertEqual(data.attrs["provenance"], "measured")
        self.assertIn("separator", data.attrs["findings"])


class Package(unittest.TestCase):
    def test_everything_public_says_what_it_is(self):
        for name in tpmkit.__all__:
            if name.startswith("__"):
                continue
            thing = getattr(tpmkit, name)
            self.assertTrue(thing.__doc__, name)
            if not isinstance(thing, type):
                continue
            for member in vars(thing):
                if member.startswith("_") or member in ("code",):
                    continue
                self.assertTrue(getattr(thing, member).__doc__, f"{name}.{member}")

    def test_the_stub_names_what_the_module_holds(self):
        stub = (Path(tpmkit.__file__).parent / "_core.pyi").read_text()
        from tpmkit import _core
        for name in vars(_core):
            if not name.startswith("_"):
                self.assertRegex(stub, rf"\b(class|def) {name}\b", name)
        self.assertTrue((Path(tpmkit.__file__).parent / "py.typed").exists())


if __name__ == "__main__":
    unittest.main()
