#!/usr/bin/env python3
"""Draws the figure of README.md: the shipped recording and the law fitted to it, legible at a width of 400 pixels.

    tpm example recording && tpm fit recording.csv
    python3 scripts/draw_first_fit.py recording_fit/figures.json docs/figures/first_fit.png
"""
import json
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
from drawing_files import save_drawing  # noqa: E402
from matplotlib.ticker import MultipleLocator  # noqa: E402


def first_of(panel, kind):
    """The fitted readings are the first points of a fit's first panel, the law in the fitted window its first line."""
    return next(s for s in panel["series"] if s["kind"] == kind)


def main():
    with open(sys.argv[1], encoding="utf-8") as file:
        panel = json.load(file)["figures"][0]["panels"][0]
    readings, law = (first_of(panel, kind) for kind in ("points", "line"))
    plt.rcParams.update({"font.size": 14, "axes.spines.top": False, "axes.spines.right": False})
    page, axes = plt.subplots(figsize=(6, 3.6), layout="constrained")
    axes.plot(readings["x"], readings["y"], "o", markersize=7, color="#B5B5B5", label="1,001 readings (synthetic)")
    axes.plot(law["x"], law["y"], color="#0072B2", linewidth=2, label="law found: linear-1")
    if len(readings["x"]) != 1001:
        sys.exit(f"{len(readings['x'])} readings; expected 1001: the legend says so")
    axes.set_xlabel("time [s]")
    axes.set_ylabel("contact force [N]")
    axes.set_ylim(0, 0.4)
    axes.xaxis.set_major_locator(MultipleLocator(5))
    axes.legend(frameon=False, loc="lower right")
    save_drawing(page, sys.argv[2], dpi=200, metadata={"Software": None})


if __name__ == "__main__":
    main()
