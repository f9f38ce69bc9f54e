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
GRADIENTS = "implicit Euler, gradients to 1e-10"


def main(source, target):
    import matplotlib.pyplot as plt
    plt.rcParams.update(draw_figures.STYLE)
    beam = json.loads(pathlib.Path(source).read_text())
    methods = {m["name"]: m for m in beam["methods"]}
    figure, (course, cost) = plt.subplots(2, 1, figsize=(draw_figures.SINGLE_PAGE_WIDTH, 6.2))

    for name, style in ((SOFA, "C1--"), (BEST, "C0-")):
        errors = methods[name]["errors"]
        course.semilogy([beam["step_s"] * i for i in range(1, len(errors))], errors[1:], style, label=name)
    course.set(xlabel="time [s]", ylabel="error [of the displacement]", ylim=(1e-8, 1))
    course.legend(loc="lower right")

    for name, method in methods.items():
        mark = "C1s" if name == SOFA else "C0o" if "Verlet" in name else "C7^"
        error = max(method["errors"])
        cost.loglog(method["step_ms"], error, mark)
        left = "Verlet" not in name
        below = name == GRADIENTS
        cost.annotate(name, (method["step_ms"], error), xytext=(-6 if left else 6, -9 if below else 5),
                      textcoords="offset points", fontsize=draw_figures.NOTE_SIZE, ha="right" if left else "left")
    cost.set(xlabel="processor time of a step of 10 ms [ms]", ylabel="largest error [of the displacement]",
             xlim=(0.5, 100), ylim=(1e-5, 30))
    for letter, axes in ("a", course), ("b", cost):
        axes.set_title(f"({letter})", loc="left")
    figure.text(0.01, 0.005, "simulated: SOFA's benchmark MeshSpringForceField_beam10x10x40 rebuilt by\n"
                "tpmkit (tests/measure/spring_beam.cpp); nothing measured on tissue", fontsize=draw_figures.NOTE_SIZE)
    figure.tight_layout(rect=(0, 0.055, 1, 1))
    save_drawing(figure, target, metadata={"Date": None, "Creator": None})


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
