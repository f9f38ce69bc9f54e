#!/usr/bin/env python3
"""Writes the ten recordings of the worked example into the current folder: five of a material of
60 + 45 exp(-t / 2 s) N/m, and five of one that is 4 % stiffer, which is the model error to be found.

    python3 make_recordings.py
"""
import math
import random

K_INF, K1, TAU = 60.0, 45.0, 2.0  # N/m, N/m, s
NOISE, ZERO = 2e-3, 4e-3  # N
STEP, REST = 0.1, 2.0  # s


def force(t, depth, rate):
    """Of a ramp from t = 0 and a hold, a linear kernel: in closed form."""
    ramp = depth / rate
    if t <= 0.0:
        return 0.0
    branch = K1 * rate * TAU * (1.0 - math.exp(-min(t, ramp) / TAU)) * math.exp(-max(t - ramp, 0.0) / TAU)
    return K_INF * min(rate * t, depth) + branch


def write(name, depth, rate, hold, factor, noise):
    with open(name, "w", encoding="utf-8") as file:
        file.write("time [s],depth [mm],force [N]\n")
        count = round((REST + depth / rate + hold) / STEP)
        for i in range(count + 1):
            t = i * STEP - REST
            imposed = min(max(rate * t, 0.0), depth)
            reading = factor * force(t, depth, rate) + ZERO + noise.gauss(0.0, NOISE)
            file.write(f"{i * STEP:.1f},{imposed * 1e3:.4f},{reading:.6f}\n")


generator = random.Random(51)
for k in range(1, 6):
    write(f"calibration_{k}.csv", 4e-3, 1e-3, 20.0, 1.0, generator)
for k in range(1, 6):
    write(f"validation_{k}.csv", 3e-3, 2e-3, 15.0, 1.04, generator)
