#!/usr/bin/env python3
"""Recordings as an owner has them, with values that are known: writes them, fits each without options, and compares.

    relatives.py TPM FOLDER [--seed N] [--only BEGINNING] [--no-fit]

The material is 60 N/m beside a branch of 45 N/m and 2 s, pressed by a ramp of 2 mm/s to 4 mm that begins at 3 s and held until
24 s, a sample every 0.05 s, noise of 0.4 mN, where the name of a recording says nothing else. The response is integrated in steps
of 5 ms in which the drive is a straight line, so that each step is exact. FOLDER gets NAME.csv and values.json with what is true
and what is wanted of the answer: `described`, `not described` or `refused`. Printed is a table of the answers and of the intervals
that are identified without a condition. Exit code 1 if an answer is another than the wanted one.
"""

import argparse
import json
import math
import random
import subprocess
import sys
from pathlib import Path

STEP_S, EVERY = 0.005, 10
TRUE = {"k_inf": 60.0, "k1": 45.0, "tau1": 2.0}


def ramp(t, begin=3.0, rate=2e-3, depth=4e-3, start=0.0):
    return start + min(max(0.0, (t - begin) * rate), depth)


def response(drive, branches=((45.0, 2.0),), k_inf=60.0, exponent=1.0, reference=4e-3):
    """Force of the law on a grid of STEP_S: k_inf V + branches, V = reference (u/reference)^exponent."""
    v = [reference * max(u / reference, 0.0) ** exponent for u in drive]
    states, force = [0.0] * len(branches), [k_inf * v[0]]
    for before, now in zip(v, v[1:]):
        for i, (k, tau) in enumerate(branches):
            decay = math.exp(-STEP_S / tau)
            states[i] = states[i] * decay + k * (now - before) * tau / STEP_S * (1.0 - decay)
        force.append(k_inf * now + sum(states))
    return force


def creep(stress, g_inf=2000.0, g1=3000.0, tau=5.0):
    """Strain of G(t) = g_inf + g1 exp(-t/tau) under a stress that is a straight line in each step."""
    j_now, j_late = 1.0 / (g_inf + g1), 1.0 / g_inf
    late = tau * (g_inf + g1) / g_inf
    decay, state, strain = math.exp(-STEP_S / late), 0.0, [stress[0] * j_now]
    for before, now in zip(stress, stress[1:]):
        rise = (now - before) / STEP_S
        # state' = ((j_late - j_now) s - state) / late
        gain = j_late - j_now
        state = state * decay + gain * (before * (1 - decay) + rise * (STEP_S - late * (1 - decay)))
        strain.append(now * j_now + state)
    return strain


class Noise:
    def __init__(self, seed, name):
        self.random = random.Random(f"{seed} {name}")

    def white(self, count, sd):
        return [self.random.gauss(0.0, sd) for _ in range(count)]

    def correlated(self, count, sd, phi):
        all_, last = [], self.random.gauss(0.0, sd)
        for _ in range(count):
            all_.append(last)
            last = phi * last + math.sqrt(1 - phi * phi) * self.random.gauss(0.0, sd)
        return all_


def sampled(until=24.0, drive=ramp, every=EVERY, **law):
    times = [i * STEP_S for i in range(round(until / STEP_S) + 1)]
    depth = [drive(t) for t in times]
    force = response(depth, **law)
    return times[::every], depth[::every], force[::every]


def table(t, u, f, heads=("time [s]", "depth [mm]", "force [N]"), scales=(1.0, 1e3, 1.0), digits=9):
    rows = [",".join(heads)]
    rows += [",".join(f"{x * s:.{digits}g}" for x, s in zip(row, scales)) for row in zip(t, u, f)]
    return "\n".join(rows) + "\n"


def relatives(seed):
    """Yields name, text of the file, true values, wanted answer."""
    def noisy(name, sd=4e-4, phi=0.0, change=lambda t, f: f, **setup):
        t, u, f = sampled(**setup)
        noise = Noise(seed, name)
        errors = noise.correlated(len(f), sd, phi) if phi else noise.white(len(f), sd)
        return t, u, [change(a, b) + e for a, b, e in zip(t, f, errors)]

    def one(name, wanted="described", true=TRUE, **setup):
        return name, table(*noisy(name, **setup)), true, wanted

    yield one("plain")
    for rate in (1e-4, 2e-2, 2e-1):
        yield one(f"ramp of {4e-3 / rate:g} s", until=3 + 4e-3 / rate + 20,
                  drive=lambda t, rate=rate: ramp(t, rate=rate), every=EVERY if rate < 1e-2 else 4)
    for sd in (4e-5, 4e-3, 4e-2):
        yield one(f"noise of {sd * 1e3:g} mN", sd=sd)
    yield one("noise correlated by 0.9", phi=0.9)
    for drift in (1e-3, 2e-3, -2e-3):
        yield one(f"drift of {drift * 1e3:g} mN per s", change=lambda t, f, drift=drift: f + drift * t)
    yield one("drift, no rest", drive=lambda t: ramp(t, begin=0.0), change=lambda t, f: f + 1e-3 * t)
    yield one("no rest", drive=lambda t: ramp(t, begin=0.0))
    yield one("contact 2 mm after the start, zero of 10 mN", drive=lambda t: ramp(t, depth=6e-3) - 2e-3,
              until=25.0, change=lambda t, f: f + 0.01)
    for share in (0.6, 0.8, 0.95):
        name = f"clipped at {100 * share:.0f} percent"
        t, u, f = noisy(name)
        peak = max(f)
        yield name, table(t, u, [min(x, share * peak) for x in f]), TRUE, "described"
    yield one("two branches", true={"k_inf": 60.0, "k1": 45.0, "tau1": 0.5, "k2": 30.0, "tau2": 6.0}, until=60.0,
              branches=((45.0, 0.5), (30.0, 6.0)))
    yield one("Hertz", true={"tau1": 2.0}, exponent=1.5)
    yield one("two steps", drive=lambda t: ramp(t, depth=2e-3) + ramp(t, begin=13.0, depth=2e-3), until=34.0)
    yield one("sine about a hold", drive=lambda t: ramp(t) + (3e-4 * math.sin(0.4 * math.pi * (t - 10)) if t > 10 else 0.0),
              until=34.0)
    yield one("jump of the zero", wanted="not described", change=lambda t, f: f + (0.01 if t > 14 else 0.0))
    yield one("signal lost for 1.5 s", wanted="not described", change=lambda t, f: 0.0 if 12 < t < 13.5 else f)
    yield one("ringing after the ramp", wanted="not described",
              change=lambda t, f: f + (0.01 * math.exp(-(t - 5)) * math.sin(12 * (t - 5)) if t > 5 else 0.0))
    yield one("zero that warms up", wanted="not described", change=lambda t, f: f + 0.02 * math.exp(-t / 8))

    name = "force delayed by 50 ms"
    t, u, f = noisy(name)
    yield name, table(t[1:], u[1:], f[:-1]), TRUE, "not described"
    name = "rounded to 4 noises"
    t, u, f = noisy(name)
    yield name, table(t, u, [1.6e-3 * round(x / 1.6e-3) for x in f]), TRUE, "described"
    name = "one in a hundred 20 sigma off"
    t, u, f = noisy(name)
    off = random.Random(f"{seed} outliers")
    yield name, table(t, u, [x + (8e-3 if off.random() < 0.01 else 0.0) for x in f]), TRUE, "described"
    name = "a twentieth of the forces is NaN"
    t, u, f = noisy(name)
    yield name, table(t, u, [x if off.random() > 0.05 else math.nan for x in f]), TRUE, "described"
    name = "every second row has the time of the row before"
    t, u, f = noisy(name)
    yield name, table([a if i % 2 == 0 else t[i - 1] for i, a in enumerate(t)], u, f), TRUE, "described"
    name = "the signal stands still for 2 s"
    t, u, f = noisy(name)
    first = round(8 / (t[1] - t[0]))
    f[first:first + 41] = [f[first]] * 41
    yield name, table(t, u, f), TRUE, "not described"
    name = "both negative"
    t, u, f = noisy(name)
    yield name, table(t, [-x for x in u], [-x for x in f]), TRUE, "refused"
    name = "decimal commas"
    yield name, table(*noisy(name)).replace(",", ";").replace(".", ","), TRUE, "described"
    name = "um and nN of a small contact"
    t, u, f = noisy(name)
    yield name, table(t, [x * 1e-6 for x in u], [x * 1e-9 for x in f], ("time [ms]", "depth [nm]", "force [nN]"),
                      (1e3, 1e9, 1e9)), {"k_inf": 0.06, "k1": 0.045, "tau1": 2.0}, "described"
    name = "times go back"
    t, u, f = noisy(name)
    yield name, table([a if a < 10 else a - 5 for a in t], u, f), TRUE, "refused"
    name = "creep of a stress ramped in 2 s"
    times = [i * STEP_S for i in range(8001)]
    stress = [200.0 * min(max(t - 3, 0.0) / 2, 1.0) for t in times]
    strain = creep(stress)
    noise = Noise(seed, name).white(len(times[::20]), 4e-4)
    yield name, table(times[::20], [x + e for x, e in zip(strain[::20], noise)], stress[::20],
                      ("time [s]", "strain [-]", "stress [Pa]"), (1, 1, 1)), \
        {"k_inf": 2000.0, "k1": 3000.0, "tau1": 5.0}, "described"


def answer_of(tpm, file):
    done = subprocess.run([tpm, "fit", file.name, "--no-draw", "--format", "json"], cwd=file.parent, capture_output=True,
                          text=True, check=False)
    if done.returncode == 3:
        return {"verdict": "refused", "words": done.stderr.strip()}
    if done.returncode != 0:
        raise SystemExit(f"relatives.py: {file.name}: exit code {done.returncode}: {done.stderr}")
    document = json.loads(done.stdout)
    verdict = document["adequacy"]["verdict"]
    return {"verdict": {"not_described": "not described"}.get(verdict, "described"), "judged": verdict,
            "law": document["recommended"], "parameters": document.get("fit", {}).get("parameters", [])}


def compared(true, answer):
    """Intervals that are identified without a condition, and those of them that exclude the true value."""
    held, missed = [], []
    for p in answer.get("parameters", []):
        if p["name"] not in true or p["verdict"] != "identified" or answer["verdict"] != "described":
            continue
        low, high = p["interval_SI"]
        (held if low <= true[p["name"]] <= high else missed).append(f"{p['name']} {low:.4g} to {high:.4g}")
    return held, missed


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tpm", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seed", type=int, default=20261128)
    parser.add_argument("--only", default="", help="recordings whose name begins so")
    parser.add_argument("--no-fit", action="store_true")
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    values, intervals, misses, wrong = {}, 0, 0, 0
    print("| recording | wanted | answer | law | intervals that hold the true value | that do not |\n" + "| --- " * 6 + "|")
    for name, text, true, wanted in relatives(options.seed):
        if not name.startswith(options.only):
            continue
        file = options.folder / (name.replace(" ", "_").replace(",", "") + ".csv")
        file.write_text(text, encoding="utf-8")
        values[file.name] = {"true": true, "wanted": wanted}
        if options.no_fit:
            continue
        answer = answer_of(options.tpm.resolve(), file)
        held, missed = compared(true, answer)
        intervals, misses = intervals + len(held) + len(missed), misses + len(missed)
        wrong += answer["verdict"] != wanted
        print(f"| {name} | {wanted} | {answer['verdict']}{'' if answer.get('judged') != 'not_judged' else ' (not judged)'} | "
              f"{answer.get('law', '')} | {', '.join(held)} | {', '.join(missed)} |", flush=True)
    (options.folder / "values.json").write_text(json.dumps(values, indent=1) + "\n", encoding="utf-8")
    if options.no_fit:
        return 0
    print(f"\n{wrong} of {len(values)} answers are another than the wanted one; {misses} of {intervals} intervals exclude the true value")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
