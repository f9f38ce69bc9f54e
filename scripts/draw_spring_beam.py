#!/usr/bin/env python3
"""Draws what build/release/tests/measure_spring_beam writes.

    python3 scripts/draw_spring_beam.py beam.json FIGURE.svg
"""
import json
import pathlib
import sys

import draw_figures
from drawing_files import save_drawing

SOFA = "implicit Euler, 20 gradients (SOFA's)"
BEST = "velocity Verlet, 6 a step"
# How much higher or lower than its mark a name stands [points]: names of neighbours would meet.
SHIFTS = {"implicit Euler, gradients to 1e-10": -11, "implicit Euler, factorised": 10, "velocity Verlet, 6 a step": 4}
BLUE, RED = draw_figures.MODEL_COLOURS[:2]
GREY = "#666666"


def main(source, target):
    import matplotlib.pyplot as plt
    plt.rcParams.update(draw_figures.STYLE)
    beam = json.loads(pathlib.Path(source).read_text())
    methods = {m["name"]: m for m in beam["methods"]}
    figure, (course, cost) = plt.subplots(2, 1, figsize=(draw_figures.SINGLE_PAGE_WIDTH, 6.2))

    for name, colour, style in ((SOFA, RED, "--"), (BEST, BLUE, "-")):
        errors = methods[name]["errors"]
        course.semilogy([beam["step_s"] * i for i in range(1, len(errors))], errors[1:], style, color=colour, linewidth=1.8, label=name)
    course.set(xlabel="time [s]", ylabel="error / largest displacement", ylim=(1e-8, 1))
    course.legend(loc="lower right")

    for name, method in methods.items():
        colour, mark = (RED, "s") if name == SOFA else (BLUE, "o") if "Verlet" in name else (GREY, "^")
        error = max(method["errors"])
        cost.loglog(method["step_ms"], error, mark, color=colour)
        left = "Verlet" not in name
        cost.annotate(name, (method["step_ms"], error), xytext=(-7 if left else 7, SHIFTS.get(name, 0)), va="center",
                      textcoords="offset points", fontsize=draw_figures.LEGEND_SIZE, ha="right" if left else "left")
    cost.set(xlabel="processor time of a step of 10 ms [ms]", ylabel="largest error / displacement",
             xlim=(0.3, 100), ylim=(1e-5, 30))
    course.set_title("(a) two methods over time", loc="left")
    cost.set_title("(b) all methods: error against cost", loc="left")
    figure.text(0.01, 0.005, "simulated: SOFA's benchmark MeshSpringForceField_beam10x10x40 rebuilt by\n"
                "tpmkit (tests/measure/spring_beam.cpp); nothing measured on tissue", fontsize=draw_figures.NOTE_SIZE)
    figure.tight_layout(rect=(0, 0.055, 1, 1))
    save_drawing(figure, target, metadata={"Date": None, "Creator": None})


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
