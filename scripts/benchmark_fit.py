#!/usr/bin/env python3
"""Times `tpm fit` against scipy doing the same fit, in one run, and prints the ratio.

    scripts/benchmark_fit.py PATH_TO_TPM [--repetitions 5] [--large]

A synthetic ramp-and-hold recording of 500 samples (law linear-1: k_inf, k1, tau1 and an offset;
1 % noise, fixed seed) is fitted with profile likelihoods by both. The scipy script uses the same
exact update of the relaxing branch (as a digital filter, which is the fast way in Python), the
same number of starts and the same profile thresholds; its derivatives are those that least_squares
takes unless told otherwise, finite differences, where tpm has exact ones. Process time is user +
system of the whole process; the interpreter's start and imports are also reported apart, and left
out of the second ratio. --large adds a recording of 1,000,000 samples (tpm only). Medians and
spreads of the repeats.
"""
import argparse
import json
import os
import pathlib
import platform
import resource
import statistics
import subprocess
import sys
import tempfile
import time


def simulate(samples, seed):
    import numpy as np

    duration, ramp_s, depth = 25.0, 1.0, 5e-3
    t = np.linspace(0.0, duration, samples)
    u = np.minimum(t / ramp_s, 1.0) * depth
    k_inf, k1, tau, offset = 60.0, 80.0, 3.0, 0.004
    force = response(t, u, k_inf, k1, tau, offset)
    noise = np.random.default_rng(seed).normal(0.0, 0.01 * force.max(), samples)
    return t, u, force + noise


def response(t, u, k_inf, k1, tau, offset):
    """F = offset + k_inf u + k1 (u - w), w relaxing towards u; u linear between samples."""
    import numpy as np
    from scipy.signal import lfilter

    z = (t[1] - t[0]) / tau
    r = np.exp(-z)
    mean = -np.expm1(-z) / z
    w0, w1 = mean - r, 1.0 - mean
    drive = np.zeros_like(u)
    drive[1:] = w0 * u[:-1] + w1 * u[1:]
    w = lfilter([1.0], [1.0, -r], drive)
    return offset + k_inf * u + k1 * (u - w)


def fit_with_scipy(path):
    import numpy as np
    from scipy.optimize import brentq, least_squares
    from scipy.stats import f as f_distribution

    begin = time.process_time()
    t, u, force = np.loadtxt(path, delimiter=",", skiprows=1, unpack=True)
    u *= 1e-3
    low = np.array([0.0, 0.0, np.log(0.02), -1.0])
    high = np.array([1e6, 1e6, np.log(300.0), 1.0])
    scale = np.array([100.0, 100.0, 1.0, 0.1])

    def residual(p):
        return response(t, u, p[0], p[1], np.exp(p[2]), p[3]) - force

    def solve(start, fixed=None, value=None):
        free = [i for i in range(4) if i != fixed]

        def part(q):
            p = np.array(start, dtype=float)
            p[free] = q
            if fixed is not None:
                p[fixed] = value
            return residual(p)

        answer = least_squares(part, np.array(start)[free], bounds=(low[free], high[free]),
                               x_scale=scale[free], xtol=1e-12, ftol=1e-14, gtol=1e-14)
        full = np.array(start, dtype=float)
        full[free] = answer.x
        if fixed is not None:
            full[fixed] = value
        return full, 2.0 * answer.cost

    rng = np.random.default_rng(0)
    starts = [np.array([50.0, 50.0, np.log(2.0), 0.0])]
    for _ in range(4):
        starts.append(np.array([rng.uniform(1, 200), rng.uniform(1, 200),
                                rng.uniform(np.log(0.05), np.log(100)), 0.0]))
    best, rss = min((solve(s) for s in starts), key=lambda a: a[1])
    n, k = len(t), 4
    rise = rss / (n - k) * f_distribution.ppf(0.95, 1, n - k)
    j = least_squares(residual, best).jac
    sd = np.sqrt(np.diag(np.linalg.inv(j.T @ j)) * rss / (n - k))
    intervals = []
    for i in range(4):
        ends = []
        for sign in (-1.0, 1.0):
            def excess(d):
                return solve(best, i, best[i] + sign * d)[1] - rss - rise
            ends.append(best[i] + sign * brentq(excess, 0.0, 6.0 * sd[i], rtol=1e-6))
        intervals.append(ends)
    best[2] = np.exp(best[2])
    intervals[2] = [float(np.exp(e)) for e in intervals[2]]
    print(json.dumps({"rss": rss, "estimates": list(best), "intervals": intervals,
                      "fit_s": time.process_time() - begin}))


CONFIG = {
    "title": "Synthetic benchmark: one branch",
    "law": {"name": "linear-1", "reference": "5 mm"},
    "parameters": {
        "k_inf": {"start": "50 N/m", "lower": "0 N/m", "upper": "1e6 N/m", "scale": "linear"},
        "k1": {"start": "50 N/m", "lower": "0 N/m", "upper": "1e6 N/m", "scale": "linear"},
        "tau1": {"start": "2 s", "lower": "0.02 s", "upper": "300 s", "scale": "log"},
        "offset": {"start": "0 N", "lower": "-1 N", "upper": "1 N", "scale": "linear"},
    },
    "correlation": "ignore",
    "starts": {"count": 10, "seed": 0},
}


def write_problem(folder, samples):
    t, u, force = simulate(samples, 1)
    csv = folder / f"recording_{samples}.csv"
    with open(csv, "w", encoding="ascii") as out:
        out.write("time,depth,force\n")
        out.writelines(f"{a:.9g},{1e3 * b:.9g},{c:.9g}\n" for a, b, c in zip(t, u, force))
    column = {"time": ("time", "s"), "depth": ("indentation_depth", "mm"),
              "force": ("contact_force", "N")}
    description = {
        "id": csv.stem, "title": "Synthetic ramp and hold", "kind": "recording",
        "observable": "contact_force", "provenance": "assumed",
        "citation": "simulated by scripts/benchmark_fit.py",
        "columns": {name: {"quantity": q, "unit": unit} for name, (q, unit) in column.items()},
    }
    csv.with_suffix(".json").write_text(json.dumps(description), encoding="ascii")
    config = dict(CONFIG)
    config["data"] = [{"dataset": csv.name, "protocol": {"kind": "measured"},
                       "noise": {"kind": "absolute", "absolute": "0.01 N", "scale": "estimated"}}]
    path = folder / f"config_{samples}.json"
    path.write_text(json.dumps(config), encoding="ascii")
    return csv, path


def process_time(command):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    answer = subprocess.run(command, check=True, capture_output=True, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return spent, json.loads(answer.stdout) if answer.stdout.startswith("{") else answer.stdout


def shown(times):
    return f"{1e3 * statistics.median(times):.1f} ms ({1e3 * min(times):.1f}-{1e3 * max(times):.1f})"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("tpm", nargs="?")
    parser.add_argument("--repetitions", type=int, default=5)
    parser.add_argument("--large", action="store_true")
    parser.add_argument("--scipy", metavar="CSV", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.scipy:
        fit_with_scipy(arguments.scipy)
        return 0
    if not arguments.tpm:
        parser.error("the path of tpm is missing")
    print(f"machine: {platform.machine()}, {os.cpu_count()} processors, Python "
          f"{platform.python_version()}; {arguments.repetitions} repeats, median (range)")
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        csv, config = write_problem(folder, 500)
        ours, theirs, theirs_fit = [], [], []
        for _ in range(arguments.repetitions):
            spent, fitted = process_time([arguments.tpm, "fit", str(config), "--format", "json"])
            ours.append(spent)
            spent, reference = process_time([sys.executable, __file__, "--scipy", str(csv)])
            theirs.append(spent)
            theirs_fit.append(reference["fit_s"])
        estimates = [p["estimate_SI"] for p in fitted["parameters"]]
        difference = max(abs(a / b - 1.0) for a, b in zip(estimates, reference["estimates"]))
        ends = [p["interval_SI"] for p in fitted["parameters"]]
        widths = max(abs((a[1] - a[0]) / (b[1] - b[0]) - 1.0)
                     for a, b in zip(ends, reference["intervals"]))
        print(f"500 samples, one branch, profiles: tpm {shown(ours)}, scipy {shown(theirs)}, of which "
              f"fit {shown(theirs_fit)}")
        print(f"  estimates agree to {difference:.1e}, widths of the intervals to {widths:.1e}")
        print(f"  ratio of process times {statistics.median(theirs) / statistics.median(ours):.0f}, "
              f"of scipy's fit alone to tpm's whole process "
              f"{statistics.median(theirs_fit) / statistics.median(ours):.0f}")
        if arguments.large:
            _, config = write_problem(folder, 1_000_000)
            times = []
            for _ in range(arguments.repetitions):
                spent, _ = process_time([arguments.tpm, "fit", str(config), "--format", "json"])
                times.append(spent)
            print(f"1,000,000 samples, one branch: tpm {shown(times)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
