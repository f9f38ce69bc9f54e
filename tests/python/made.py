"""Synthetic recordings for the tests."""

import csv
from pathlib import Path

import numpy as np

import tpmkit

LAW = {"k_inf_N_per_m": 60.0, "k1_N_per_m": 45.0, "tau1_s": 2.0}


def recording(folder, noise_N=2e-4, seed=1, name="recording.csv"):
    """A ramp to 3 mm within 0.5 s, kept for 12 s, felt through a linear law with one branch; normal noise."""
    time_s = np.linspace(0.0, 12.5, 501)
    depth_m = np.minimum(6e-3 * time_s, 3e-3)
    law = tpmkit.Law("linear-1", LAW)
    force_N = law.respond(tpmkit.Protocol.history(time_s, depth_m), time_s)
    force_N = force_N + noise_N * np.random.default_rng(seed).standard_normal(time_s.size)
    path = Path(folder) / name
    with path.open("w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["time (s)", "depth (mm)", "force (N)"])
        rows.writerows([f"{t:.6f}", f"{1e3 * d:.9f}", f"{f:.9f}"] for t, d, f in zip(time_s, depth_m, force_N))
    return path
