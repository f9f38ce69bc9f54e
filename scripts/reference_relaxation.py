#!/usr/bin/env python3
"""An independent reference for `tpm fit configs/liver_relaxation.json`.

Writes the ramp-and-hold force of the paper's element down again from its differential equation's
solution, reads the shipped numbers and searches E, eta1 and x with scipy: differential evolution
over the whole box first, then bounded least squares from its best points. Shares no code with tpm.

usage: reference_relaxation.py data/evren_relaxation.csv [--rate 4] [--sigma 0.1]
Prints JSON: chi_square, E_Pa, eta1_Pa_s, spacing_m.
"""
import argparse
import csv
import json

import numpy as np
from scipy.optimize import differential_evolution, least_squares

AREA_PER_LENGTH = 12.56e-6 / 1e-3  # A0 / l0, m
BOUNDS = {"E": (100.0, 1e6), "eta1": (0.1, 1e9), "spacing": (2e-3, 1.0)}


def force(E, eta1, spacing, depth, rate, after_ramp):
    """Force at a time after the end of a ramp, all three moduli equal to E; SI."""
    tau = eta1 / (2.0 * E)
    ramp = depth / rate
    e1 = 0.5 * rate * (ramp - tau * -np.expm1(-ramp / tau))
    e1 = 0.5 * depth + (e1 - 0.5 * depth) * np.exp(-after_ramp / tau)
    tension = 2.0 * E * (1.0 - spacing / np.hypot(spacing, depth))
    return (E * (depth - e1) + tension * depth) * AREA_PER_LENGTH


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data")
    parser.add_argument("--rate", type=float, default=4.0, help="mm/s")
    parser.add_argument("--sigma", type=float, default=0.1, help="standard deviation over datum")
    options = parser.parse_args()
    with open(options.data, newline="", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    depth = np.array([float(r["depth_mm"]) for r in rows]) * 1e-3
    after = np.array([float(r["time_s"]) for r in rows])
    datum = np.array([float(r["force_N"]) for r in rows])

    low = BOUNDS["spacing"][0]

    def residuals(q):
        # q = (ln E, ln eta1, (2 mm / x)^2): forces depend on x through 1/x^2 when it is large
        model = force(np.exp(q[0]), np.exp(q[1]), low / np.sqrt(q[2]), depth,
                      options.rate * 1e-3, after)
        return (model - datum) / (options.sigma * datum)

    def from_logs(logs):
        return np.array([logs[0], logs[1], (low / np.exp(logs[2])) ** 2])

    logs = [tuple(np.log(BOUNDS[name])) for name in ("E", "eta1", "spacing")]
    box = np.array([logs[0], logs[1], ((low / BOUNDS["spacing"][1]) ** 2, 1.0)]).T
    best = None
    for seed in range(5):
        rough = differential_evolution(lambda q: np.sum(residuals(from_logs(q)) ** 2), logs,
                                       seed=seed, tol=1e-12, maxiter=3000, polish=False)
        start = np.clip(from_logs(rough.x), box[0], box[1])
        fine = least_squares(residuals, start, bounds=(box[0], box[1]),
                             xtol=1e-15, ftol=1e-15, gtol=1e-15, max_nfev=20000)
        for q in (start, fine.x):
            chi = float(np.sum(residuals(q) ** 2))
            if best is None or chi < best[0]:
                best = (chi, q)
    chi, q = best
    print(json.dumps({"chi_square": chi, "E_Pa": float(np.exp(q[0])),
                      "eta1_Pa_s": float(np.exp(q[1])),
                      "spacing_m": float(low / np.sqrt(q[2]))}, indent=2))


if __name__ == "__main__":
    main()
