#!/usr/bin/env python3
"""Brute force for `tpm budget`: reruns public commands with one stage changed and compares.

One contact: `tpm predict` answers with the exact law along changed motions (late, in steps of the
encoder) and beside the recording; the budget's own stages come from the model that the loop steps.
An organ: `tpm simulate` of the scene with masses and without, at another tolerance, at a finer
spacing and with the planned model. A line below 1e-3 of the peak is named and not compared; the
others have to agree within a factor of 1.5.

usage: budget_brute_force.py TPM LAW [RECORDING] [--depth MM --rate MM_S --hold S] [--scene SCENE] [--finer SCENE]
"""
import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

LEAST, FACTOR = 1e-3, 1.5
PERIOD_S, ENCODER_M, DELAY = 1e-3, 1e-5, 1  # the defaults of tpm budget


def tpm_json(program, *arguments):
    done = subprocess.run([program, *map(str, arguments), "--format", "json"], capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"budget_brute_force.py: tpm {' '.join(map(str, arguments))}: {done.stderr.strip()}")
    return json.loads(done.stdout)


def interpolated(knots, t):
    """Depth at a time of a polyline."""
    if t <= knots[0][0]:
        return knots[0][1]
    for (t0, d0), (t1, d1) in zip(knots, knots[1:]):
        if t <= t1:
            return d1 if t1 == t0 else d0 + (d1 - d0) * (t - t0) / (t1 - t0)
    return knots[-1][1]


def forces(program, law, knots, times, folder):
    """The exact law along a motion."""
    document = {"protocol": {"kind": "knots", "knots": [{"time": f"{t!r} s", "depth": f"{d!r} m"} for t, d in knots]},
                "outputs": {"times": [f"{min(t, knots[-1][0])!r} s" for t in times]}}
    path = Path(folder) / "motion.json"
    path.write_text(json.dumps(document), encoding="utf-8")
    answer = tpm_json(program, "predict", law, path)
    assert len(answer["mean_N"]) == len(times), "times that are not rising"
    return answer["mean_N"]


def in_steps(knots, start, end):
    """The motion read by the encoder once a period, linear in between."""
    count = round((end - start) / PERIOD_S)
    rows = [(start + k * PERIOD_S, ENCODER_M * round(interpolated(knots, start + k * PERIOD_S) / ENCODER_M))
            for k in range(count + 1)]
    kept = [rows[0]]
    for before, here, after in zip(rows, rows[1:], rows[2:]):
        if before[1] != here[1] or here[1] != after[1]:
            kept.append(here)
    return kept + [rows[-1]]


def largest(a, b):
    return max(abs(x - y) for x, y in zip(a, b))


def motion_of(options, arguments):
    """The motion from the surface, and the budget's law line beside a recording."""
    if not options.recording:
        ramp, end = options.depth / options.rate, options.depth / options.rate + options.hold
        return [(0.0, 0.0), (ramp, options.depth * 1e-3), (end, options.depth * 1e-3)], None
    prediction = tpm_json(options.tpm, "predict", *arguments)
    depth = [d - prediction["contact_m"] for d in prediction["depth_m"]]
    # Long held at the first depth: the fit takes a recording as relaxed when it begins.
    knots = [(prediction["time_s"][0] - 1e4, depth[0]), *zip(prediction["time_s"], depth)]
    parts = [prediction["recording"][which] for which in ("fitted", "not_fitted")]
    return knots, max(part.get("largest_N", 0.0) for part in parts)


def contact(options, folder):
    arguments = [options.law]
    if options.recording:
        arguments.append(options.recording)
    else:
        arguments += ["--depth", f"{options.depth} mm", "--rate", f"{options.rate} mm/s", "--hold", f"{options.hold} s"]
    budget = tpm_json(options.tpm, "budget", *arguments)
    knots, law_line = motion_of(options, arguments)
    start = knots[1 if options.recording else 0][0]
    times = [t for t in budget["time_s"] if t >= start + (DELAY + 1) * PERIOD_S]
    steps = ([knots[0]] if options.recording else []) + in_steps(knots, start, times[-1] + PERIOD_S)
    exact = forces(options.tpm, options.law, knots, times, folder)
    # In the order of the budget: the encoder's steps, then late, then kept for a period.
    stages = [forces(options.tpm, options.law, steps, [t - k * PERIOD_S for t in times], folder)
              for k in (0, DELAY, DELAY + 1)]
    found = {"quantisation": largest(exact, stages[0]), "delay": largest(stages[0], stages[1]),
             "period": largest(stages[1], stages[2])}
    if law_line is not None:
        found["law"] = law_line
    return budget, {name: value / budget["peak_N"] for name, value in found.items()}


def simulated(options, scene, folder, name, *more):
    import h5py
    path = Path(folder) / f"{name}.json"
    path.write_text(json.dumps(scene), encoding="utf-8")
    out = Path(folder) / f"{name}.h5"
    subprocess.run([options.tpm, "simulate", str(path), "-o", str(out), *more], check=True, capture_output=True)
    with h5py.File(out, "r") as f:
        return list(zip(f["curve/time_s"][:], f["curve/force_N"][:]))


def organ(options, folder):
    arguments = ["budget", options.law, "--scene", options.scene] + (["--finer", options.finer] if options.finer else [])
    budget = tpm_json(options.tpm, *arguments)
    scene = json.loads(Path(options.scene).read_text(encoding="utf-8"))
    scene["sliders"] = sorted({*scene.get("sliders", []), *(c["number"] for c in scene["contacts"] if "number" in c)})
    scene["outputs"] = {"times": [f"{t!r} s" for t in budget["time_s"]], "fields": ["force"]}
    plain = simulated(options, scene, folder, "plain")
    masses = simulated(options, {**scene, "formulation": {"kind": "inertial"}}, folder, "masses")
    tight = simulated(options, {**scene, "tolerance": 1e-8}, folder, "tight")
    planned = simulated(options, scene, folder, "planned", "--planned", "--tolerance", "1%", "--loop-rate", "1 kHz")
    times = budget["time_s"]
    (Path(folder) / "asked.json").write_text(json.dumps({"protocol": scene["protocol"],
                                                         "outputs": {"times": [f"{t!r} s" for t in times]}}))
    law = tpm_json(options.tpm, "predict", options.law, Path(folder) / "asked.json")["mean_N"]
    at = {name: [interpolated(curve, t) for t in times]
          for name, curve in (("plain", plain), ("masses", masses), ("tight", tight), ("planned", planned))}
    found = {"organ": largest(law, at["masses"]), "masses": largest(at["masses"], at["tight"]),
             "tolerance": largest(at["plain"], at["tight"]), "reduction": largest(at["planned"], at["plain"])}
    return budget, {name: value / budget["peak_N"] for name, value in found.items()}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("tpm")
    parser.add_argument("law")
    parser.add_argument("recording", nargs="?")
    for name, value in (("depth", 4.0), ("rate", 4.0), ("hold", 10.0)):
        parser.add_argument(f"--{name}", type=float, default=value)
    parser.add_argument("--scene")
    parser.add_argument("--finer")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        budget, found = organ(options, folder) if options.scene else contact(options, folder)
    print("| line | budget, of the peak | brute force | |\n| --- | --- | --- | --- |")
    failed = 0
    for line in budget["lines"]:
        mine, other = line["largest"], found.get(line["name"])
        if other is None:
            verdict, shown = "not rerun here", "-"
        elif max(mine, other) < LEAST:
            verdict, shown = "below 1e-3: not compared", f"{100 * other:.3g} %"
        else:
            agrees = mine / FACTOR <= other <= mine * FACTOR
            failed += not agrees
            verdict, shown = f"factor {max(mine, other) / min(mine, other):.2f}", f"{100 * other:.3g} %"
        print(f"| {line['name']} | {100 * mine:.3g} % | {shown} | {verdict} |")
    print(f"\nsums close to {budget['not_closed']:.1e} of the peak; {failed} lines differ by more than a factor of {FACTOR}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
