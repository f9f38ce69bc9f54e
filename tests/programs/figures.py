#!/usr/bin/env python3
"""What scripts/draw_figures.py makes of a small figures.json: text that is text, letters, limits, provenance, files,
names beside levels; and what the views of scripts/draw_deformation.py hold.

    figures.py TPM (not used)
"""
import json
import re
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as tree
from pathlib import Path

SCRIPT = Path(__file__).resolve().parents[2] / "scripts/draw_figures.py"


def series(label, provenance, y):
    return {"kind": "points", "label": label, "provenance": provenance, "x": list(range(1, len(y) + 1)), "y": y}


def panel(title, y_axis, all_series):
    return {"title": title, "x": {"quantity": "n", "unit": "", "logarithmic": False}, "y": y_axis, "series": all_series}


def faults_of_views():
    """A sphere that sags below the organ at rest is within the frame; only outermost spheres have the first colour."""
    sys.path.insert(0, str(SCRIPT.parent))
    import draw_deformation
    import draw_network
    rest, sagged = [[0, 0, 0], [0, 0.01, 0]], [[0, -0.03, 0], [0, 0.01, 0]]
    picture = {"position_m": rest, "radius_m": 0.005, "contact": 1, "normal": [[0, 0, -1]] * 2,
               "states": [{"position_m": sagged}]}
    faults = []
    for view in draw_network.VIEWS:
        low, high = draw_deformation.frame_of(picture, view)
        if low[1] > -32.5 or high[1] != 15:
            faults.append(f"the frame of '{view[4]}' is {low} to {high} mm; a sphere of half its 5 mm is at -30 mm")
    plate = {"kind": "punch", "direction": [-1, 0, 0]}
    for tools, towards in (([], 0), ([{**plate, "direction": [0, 0, 1]}], 0), ([{**plate, "kind": "ball"}], 0), ([plate], 1)):
        if draw_deformation.views_of({"tools": tools})[1][2] != towards:
            faults.append(f"tools {tools}: the second view is not along axis {towards}")
    for size in (draw_network.STYLE["font.size"], draw_network.NOTE_SIZE):
        if size / 72 / draw_network.WIDTH * 400 < 8:
            faults.append(f"text of {size} points is {size / 72 / draw_network.WIDTH * 400:.1f} pixels high in a picture of 400; expected 8")
    if [k for k in range(20) if draw_network.layer_colour(k) == draw_network.layer_colour(0)] != [0]:
        faults.append("an inner layer has the colour of the outermost")
    return faults


def faults_of_first_fit():
    """The picture of the README takes readings and law by what they are: their labels have changed."""
    sys.path.insert(0, str(SCRIPT.parent))
    import draw_first_fit
    fitted, law = series("readings, fitted", "measured", [1.0]), {"label": "fitted law", "kind": "line"}
    drawn = {"series": [fitted, series("readings, not fitted", "measured", [0.0]), {"label": "band", "kind": "band"}, law]}
    if draw_first_fit.first_of(drawn, "points") is not fitted or draw_first_fit.first_of(drawn, "line") is not law:
        return ["draw_first_fit.py does not find the fitted readings and the law"]
    return []


def faults_of_verdicts():
    """A verdict has one look in every map of steps, however many runs have it; names that do not fit are counted."""
    sys.path.insert(0, str(SCRIPT.parent))
    import draw_figures
    import work_precision
    holds, diverged = series("holds", "model", [1.0] * 200), series("diverged", "model", [1.0] * 150)
    faults = []
    maps = [draw_figures.looks({"panels": [panel("", {}, part)]}) for part in ([holds, diverged], [diverged])]
    if maps[0]["diverged"] != maps[1]["diverged"] or maps[0]["diverged"] == maps[0]["holds"] or draw_figures.is_dense(diverged):
        faults.append(f"verdicts look different from map to map, or alike: {maps}")
    for names, wanted in ((["rk4", "ida"], "rk4, ida"), (["a long name of a method"] * 4, "a long name of a method and 3 more")):
        if work_precision.fitting_names(names, 2.0) != wanted:
            faults.append(f"names beside a band: {work_precision.fitting_names(names, 2.0)}; expected {wanted}")
    return faults


def faults_of_trails(folder):
    """The name of a level leaves the points free; a measured cost is said to be measured; no two methods look alike."""
    sys.path.insert(0, str(SCRIPT.parent))
    import work_precision
    faults = []
    places = [(0.1, 0.22), (0.9, 0.5)]
    for height, wanted in ((0.2, "right"), (0.48, "left"), (0.7, "left")):
        if work_precision.freer_side(places, height) != wanted:
            faults.append(f"the name of a level at {height} does not stand at the {wanted} of points at {places}")
    for shares, wanted in (([], (0.0, 1.0)), ([0.75, 0.5], (0.0, 0.5)), ([0.25], (0.25, 0.75))):
        if work_precision.widest_gap(shares) != wanted:
            faults.append(f"the widest gap between {shares} is {work_precision.widest_gap(shares)}; expected {wanted}")
    for name, (colour, marker) in work_precision.LOOKS.items():
        blues = {work_precision.BLUE, work_precision.SKY}
        like = [n for n, (c, m) in work_precision.LOOKS.items() if n != name and m == marker and {c, colour} == blues]
        if like:
            faults.append(f"'{name}' looks like {like}: one marker in two blues")
    axes = {"y": {"quantity": "error", "unit": "", "logarithmic": True}}
    trail = {"kind": "trail", "label": "rk4", "provenance": "model", "x": [1e-3, 1e-1], "y": [2e-6, 1e-3]}
    level = {"kind": "level", "label": "", "provenance": "model", "y": [1e-6], "text": "reference known to"}
    figures = [{"id": id, "title": "", "caption": "", "panels": [
        {"title": "", "x": {"quantity": quantity, "unit": "s", "logarithmic": True}, **axes, "series": [trail, level]}]}
        for id, quantity in (("wall", "wall time of a step"), ("counts", "evaluations"))]
    (folder / "trails.json").write_text(json.dumps({"figures": figures}))
    subprocess.run([sys.executable, SCRIPT, folder / "trails.json", folder / "trails"], check=True)
    for id, wanted in (("wall", "wall times measured on one machine"), ("counts", "work counted")):
        words = {e.text: e for e in tree.parse(folder / f"trails/{id}.svg").iter() if e.tag.endswith("}text")}
        if not any((text or "").endswith(wanted) for text in words):
            faults.append(f"{id}: no note '{wanted}': {list(words)}")
        if "end" not in words["reference known to"].get("style", ""):
            faults.append(f"{id}: the name of the level stands over a point at its left end")
    return faults


def faults_of_layout(drawing):
    """On a screen three panels stand below each other, and no text leaves the page, whose text is read at 400 pixels."""
    root = drawing.getroot()
    width = float(root.get("viewBox").split()[2])
    faults = [] if abs(width - 130 / 25.4 * 72) < 0.1 else [f"a figure of three panels is {width} points wide"]
    panels = {}
    for group in root.iter("{http://www.w3.org/2000/svg}g"):
        if "axes_" in group.get("id", ""):
            numbers = group.find(".//{http://www.w3.org/2000/svg}path").get("d").split()
            panels[group.get("id")] = round(float(numbers[1]))
    if len(panels) != 3 or len(set(panels.values())) != 1:
        faults.append(f"three panels do not stand below each other: left edges {panels}")
    from drawing_files import text_width
    for line in (e for e in root.iter() if e.tag.endswith("}text") and "title of a panel" in (e.text or "")):
        end = float(re.search(r"[(=] ?([0-9.]+)", line.get("transform") or f"={line.get('x')}")[1]) + 72 * text_width(line.text, 9.5)
        if end > width:
            faults.append(f"a title ends at {end:.0f} points, the page at {width:.0f}: {line.text}")
    words = [e.text for e in root.iter() if e.tag.endswith("}text")]
    if any(len(w or "") > 110 for w in words) or any("A title" in (w or "") and len(w) > 75 for w in words):
        faults.append(f"a text is not wrapped: {words}")
    return faults


def main():
    axis = {"quantity": "BIC", "unit": "", "logarithmic": False}
    figure = {"id": "a", "title": "", "caption": "", "panels": [
        panel("one", {**axis, "lower": 0, "upper": 30}, [series('mine id="x"', "derived", [0, 5, 31, 4000])]),
        panel("(b) two", axis, [series("readings", "measured", [float(i % 7) for i in range(200)])])]}
    band = {"kind": "band", "label": "requirement", "provenance": "assumed", "x": [0.6, 1.4], "lower": [-10, -10], "upper": [10, 10]}
    of_names = panel("", {**axis, "names": ["linear", "power-1"]}, [band, series("E", "derived", [1.0, 2.0])])
    of_names["x"]["names"] = ["peak force", "half time"]
    numbered = panel("", axis, of_names["series"])
    long = {**panel("A title of a panel that is far too long for one line above half of a page", axis,
                    [series("a label that is far too long to stand beside another one below a figure " * 2, "measured", [1.0])])}
    figures = [figure, {"id": "d", "title": "", "caption": "", "panels": [long, long, long]}] + [{"id": id, "title": "", "caption": "", "panels": [p]} for id, p in (("b", of_names), ("c", numbered))]
    faults = faults_of_views() + faults_of_first_fit() + faults_of_verdicts()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "figures.json").write_text(json.dumps({"figures": figures}))
        for run in ("x", "y"):
            subprocess.run([sys.executable, SCRIPT, folder / "figures.json", folder / run, "--print"], check=True)
        for ending in ("svg", "png", "pdf"):
            if (folder / f"x/a.{ending}").read_bytes() != (folder / f"y/a.{ending}").read_bytes():
                faults.append(f"two drawings differ: {ending}")
        words = [e.text for e in tree.parse(folder / "x/a.svg").iter() if e.tag.endswith("}text")]
        for wanted in ("(a) one", "(b) two", "▲ 2 above 30", 'mine id="x" [derived]'):
            if wanted not in words:
                faults.append(f"no text '{wanted}' in the SVG: {words}")
        if not any("[derived] computed from the data" in (w or "") for w in words) or any("printed" in (w or "") for w in words):
            faults.append(f"provenance is not that of the data: {words}")
        words = [e.text for e in tree.parse(folder / "x/b.svg").iter() if e.tag.endswith("}text")]
        for wanted in ("linear", "power-1", "peak force", "half time"):
            if wanted not in words:
                faults.append(f"no name '{wanted}' at an axis: {words}")
        if "<pattern" in (folder / "x/b.svg").read_text(encoding="utf-8"):
            faults.append("a band is hatched: what is drawn over it cannot be read")
        heights = [tree.parse(folder / f"x/{id}.svg").getroot().get("height") for id in "bc"]
        if heights[0] != heights[1]:
            faults.append(f"names that stand upright take room below as if they stood aslant: {heights}")
        png = (folder / "x/a.png").read_bytes()
        if int.from_bytes(png[16:20], "big") != int(180 / 25.4 * 300):
            faults.append("the PNG has not 300 dpi, or is not as wide as two columns of a journal (180 mm)")
        sizes = [[int.from_bytes((folder / f"x/{id}.png").read_bytes()[at:at + 4], "big") for at in (16, 20)] for id in "ad"]
        if sizes[0][0] != sizes[1][0] or not sizes[0][1] < sizes[1][1] < 2.5 * sizes[0][1]:
            faults.append(f"in print three panels do not stand in two rows: pictures of {sizes} pixels")
        subprocess.run([sys.executable, SCRIPT, folder / "figures.json", folder / "pdf", "--pdf"], check=True)
        if {f.name for f in (folder / "pdf").iterdir()} != {f"{id}.{ending}" for id in "abcd" for ending in ("svg", "pdf")}:
            faults.append(f"--pdf wrote {sorted(f.name for f in (folder / 'pdf').iterdir())}")
        faults += faults_of_layout(tree.parse(folder / "x/d.svg")) + faults_of_trails(folder)
    for fault in faults:
        print(fault)
    print(f"{len(faults)} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
