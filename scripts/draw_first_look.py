#!/usr/bin/env python3
"""Puts a photograph of a session's page beside error against cost of the contact models.

    draw_first_look.py PAGE.png SERVO.csv PICTURE.png
"""

import csv
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from drawing_files import save_drawing

NAMES = {"condensed": "condensed", "condensed_field": "condensed, all positions",
         "full_network": "full network of 424 spheres"}


def worst_of(file):
    """(method, variant) -> (largest error in parts of the peak, median of a step in s), over all relaxation times"""
    rows = {}
    with open(file, newline="", encoding="utf-8") as text:
        for row in csv.DictReader(text):
            if row["end"] != "completed" or not row["step_median_s"]:
                continue
            key = (row["method"], row["variant"])
            error, cost = float(row["error"]), float(row["step_median_s"])
            before = rows.get(key, (0.0, 0.0))
            rows[key] = (max(before[0], error), max(before[1], cost))
    return rows


def main():
    page, table, picture = sys.argv[1:4]
    figure = plt.figure(figsize=(14, 5.6), dpi=100)
    photograph = figure.add_axes((0.0, 0.0, 0.56, 0.93))
    photograph.imshow(plt.imread(page), interpolation="lanczos")
    photograph.axis("off")
    figure.text(0.28, 0.955, "A ball slides over a liver of 424 spheres: live page, SIMULATED device", ha="center", size=12,
                weight="bold")
    chart = figure.add_axes((0.635, 0.13, 0.35, 0.74))
    for number, ((method, variant), (error, cost)) in enumerate(sorted(worst_of(table).items())):
        chart.loglog(1e6 * cost, 100 * error, "o", ms=9, color=f"C{number % 10}")
        label = NAMES.get(method, method) + (f", {variant}" if variant else "")
        right = 1e6 * cost > 4
        chart.annotate(label, (1e6 * cost, 100 * error), textcoords="offset points", size=10,
                       xytext=(-8, 6) if right else (8, 6), ha="right" if right else "left")
    chart.axvline(1000, color="0.4", ls="--", lw=1)
    chart.annotate("period at 1 kHz", (1000, 1e-2), rotation=90, size=9, ha="right", va="center", color="0.3",
                   xytext=(-3, 0), textcoords="offset points")
    chart.set_xlim(0.1, 2000)
    chart.set_ylim(1e-3, 10)
    chart.set_xlabel("one step of the servo loop, µs (median)")
    chart.set_ylabel("largest force error, % of the peak force")
    chart.grid(True, which="major", color="0.9")
    error, cost = worst_of(table)[("condensed", "")]
    figure.text(0.635, 0.955, f"Error against cost: {100 * error:.2g} % in {1e6 * cost:.2g} µs a step",
                size=12, weight="bold")
    figure.text(0.635, 0.9, "largest over relaxation times of 0.2 ms to 100 s, against a converged reference", size=9,
                color="0.3")
    save_drawing(figure, picture)


if __name__ == "__main__":
    main()
