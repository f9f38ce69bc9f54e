#!/usr/bin/env python3
"""Writes recording.csv, a SYNTHETIC recording of a ramp and hold: nothing in it was measured.

The law: a spring of 60 N/m in parallel with a branch of 45 N/m that relaxes in 2 s. The tool waits for 5 s before
contact, goes to 4 mm at 2 mm/s and holds. The noise: normal, 0.2 mN, independent from sample to sample, seed 3.

    python3 make_recording.py
"""
import math
import random

random.seed(3)
with open("recording.csv", "w", encoding="utf-8") as file:
    file.write("# SYNTHETIC, not measured; made by make_recording.py\n")
    file.write("# law: 60 N/m in parallel with 45 N/m that relax in 2 s; normal noise of 0.2 mN\n")
    file.write("time_s,depth_mm,force_N\n")
    for i in range(1251):
        t = 0.02 * i - 5.0  # s after contact
        pushed = max(t, 0.0)
        depth = min(2.0 * pushed, 4.0)  # mm
        ramp = min(pushed, 2.0)  # s
        force = 0.060 * depth + 0.045 * 4.0 * (math.exp((ramp - pushed) / 2.0) - math.exp(-pushed / 2.0))
        file.write(f"{t + 5.0:.2f},{depth:.3f},{force + random.gauss(0.0, 2e-4):.6f}\n")
