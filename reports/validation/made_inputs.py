#!/usr/bin/env python3
"""Writes recordings that are hard to validate with into the current folder, of a material of
60 + 45 exp(-t / 2 s) N/m, with 2 mN of noise: calibration_1.csv, calibration_2.csv; jump.csv, whose
depth changes between two samples (noise of 0.3 mN); clipped.csv, whose force cell ends at 0.25 N;
zeroed.csv, a copy of calibration_1.csv with other zeros; stiffer.csv and creep.csv, 15 % stiffer.

    python3 made_inputs.py
"""
import math
import random

K_INF, K1, TAU = 60.0, 45.0, 2.0  # N/m, N/m, s
EVERY, REST = 0.05, 5.0  # s


def force(t, depth, ramp):
    """Of a ramp that begins at t = 0 and a hold, in closed form."""
    if t <= 0.0:
        return 0.0
    memory = TAU * (1.0 - math.exp(-min(t, ramp) / TAU)) * math.exp(-max(t - ramp, 0.0) / TAU) / ramp
    return depth * (K_INF * min(t / ramp, 1.0) + K1 * memory)


def rows(depth, ramp, until, noise, starts=REST, factor=1.0):
    """Time in s, depth in m, force in N."""
    for i in range(round(until / EVERY) + 1):
        t = i * EVERY
        pressed = min(max((t - starts) / ramp, 0.0), 1.0)
        yield t, depth * pressed, factor * force(t - starts, depth, ramp) + noise * random.gauss(0.0, 1.0)


def creep_rows(load, ramp, until, noise, factor):
    """Depth under a force: the compliance 1/60 - (1/60 - 1/105) exp(-t / tau_c), tau_c = 2 s 105/60."""
    tau = TAU * (K_INF + K1) / K_INF
    at_once, in_the_end = 1.0 / (K_INF + K1), 1.0 / K_INF
    for i in range(round(until / EVERY) + 1):
        t = i * EVERY
        since = max(t - REST, 0.0)
        up = min(since, ramp)
        memory = tau * (1.0 - math.exp(-up / tau)) * math.exp(-(since - up) / tau)
        depth = load / ramp * (in_the_end * up - (in_the_end - at_once) * memory) / factor
        yield t, depth + noise * random.gauss(0.0, 1.0), load * up / ramp


def write(name, samples):
    with open(name, "w", encoding="utf-8") as file:
        file.write("time [s],depth [mm],force [N]\n")
        for t, depth, newton in samples:
            file.write(f"{t:.9g},{1e3 * depth:.9g},{newton:.9g}\n")


random.seed(51)
first = list(rows(4e-3, 4.0, 40.0, 2e-3))
write("calibration_1.csv", first)
write("calibration_2.csv", rows(4e-3, 4.0, 40.0, 2e-3))
write("jump.csv", rows(3e-3, 1e-4, 30.0, 3e-4, starts=REST + 0.002))
write("clipped.csv", ((t, d, min(f, 0.25)) for t, d, f in rows(3e-3, 1.5, 30.0, 2e-3)))
write("zeroed.csv", ((t + 100.0, d + 1e-3, f + 0.5) for t, d, f in first))
write("stiffer.csv", rows(3e-3, 1.5, 30.0, 2e-3, factor=1.15))
write("creep.csv", creep_rows(0.2, 0.5, 40.0, 3e-6, 1.15))
