#!/usr/bin/env python3
"""Draws the organ that `tpm simulate --folder FOLDER` describes, as SVG, PNG and PDF.

    draw_deformation.py PICTURES.json FOLDER

undeformed, deformed, displacement, force, validity: from the front, from the side (from above where a punch would
hide the organ), and below them a slice through the contact, enlarged; side_by_side if there are two states (TPM and
MSM). Displacements are never magnified.
The same input gives the same bytes.
"""

import argparse
import json
import re
import sys
from pathlib import Path

import draw_network as net
import matplotlib
import matplotlib.pyplot as plt
import numpy as np
from drawing_files import literal, text_width, wrapped
from matplotlib.cm import ScalarMappable
from matplotlib.collections import EllipseCollection, LineCollection
from matplotlib.colors import LinearSegmentedColormap, Normalize, to_rgb
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Polygon

# Inches; the width is that of net.
LEFT, GAP, BAR, BETWEEN, BELOW_AXIS = 0.52, 0.52, 0.62, 0.24, 0.42
MOST_HIGH = 2.6  # a row of panels
PROFILE_HIGH = 1.5
LEGEND_COLUMNS = 2
ARROW = 3.5  # length of the probe, in radii
PROFILE = 10.0  # radii from the contact
FORCE_MAP = LinearSegmentedColormap.from_list("force", ["#08306B", "#4292C6", "#DADADA", "#EF6548", "#7F0000"])
DEFORMED_MARGIN = 0.6  # radii around deformed spheres, which are drawn at half their size
SLICE_HALF_WIDTH = 9.0  # radii to each side of the contact
SLICE_THICKNESS = 1.1  # spheres nearer to the plane than this many radii are in it
FROM_ABOVE = (0, 2, 1, 1, "From above", "to the patient's right, x", "Seen along -y", "x")  # as net.VIEWS
REST, INSIDE = "#9A9A9A", "#D9D9D9"
FLAGS = [(1, "#F0A83C", "indented by more than 10 mm (paper's validity)"),
         (2, "#C8321E", "by more than 12 mm (damage)"),
         (4, "#6A3D9A", "at a lateral bond turned by more than 30°")]


class Colouring:
    """Faces of the spheres, and of the bonds if they carry a number; what a colour means."""

    def __init__(self, face, title, bar=None, bonds=None, flags=None, share=0.5):
        self.face, self.title, self.bar, self.bonds, self.flags = face, title, bar, bonds, flags
        self.share = share  # of their radius that spheres are drawn with


def by_layer(picture, title):
    face = np.array([to_rgb(net.layer_colour(k)) for k in picture["layer"]])
    anchors = picture["anchors"]
    face[anchors] = 0.55 * face[anchors] + 0.45 * np.array(to_rgb(net.ANCHOR))
    return Colouring(face, title)


def by_number(values, label, title, scale=None):
    bar = ScalarMappable(Normalize(0.0, scale or max(values.max(), 1e-12)), "viridis")
    return Colouring(bar.to_rgba(values)[:, :3], title, (bar, label))


def by_force(state):
    """Bonds by their force: blue pushes, red pulls; spheres by the largest force at them."""
    force = np.array(state["bond_force_mN"])
    largest = np.array(state["largest_bond_force_mN"])
    scale = max(np.abs(force).max(), 1e-12)
    bar = ScalarMappable(Normalize(-scale, scale), FORCE_MAP)
    spheres = plt.get_cmap("Greys")(0.1 + 0.7 * largest / scale)[:, :3]
    strength = np.abs(force) / scale
    return Colouring(spheres, "Force in the bonds (spheres: darker where the largest at them is larger)",
                     (bar, "force of a bond, pulling > 0 [mN]"), (bar.to_rgba(force), 0.3 + 1.6 * strength), share=0.25)


def by_validity(state):
    flags = np.array(state["validity"])
    face = np.tile(to_rgb(INSIDE), (len(flags), 1))
    for bit, colour, _ in (FLAGS[2], FLAGS[0], FLAGS[1]):  # the worst last
        face[(flags & bit) > 0] = to_rgb(colour)
    counts = [(colour, f"{words}: {np.count_nonzero(flags & bit)} spheres") for bit, colour, words in FLAGS]
    return Colouring(face, "Limits of validity at this time", flags=[(INSIDE, "within all limits"), *counts])


def draw_bonds(axes, at, bonds, depth, slab, colouring):
    if colouring.bonds is None:
        net.draw_bonds(axes, at, bonds, depth, slab)
        return
    near = 0.5 * (depth[bonds[:, 0]] + depth[bonds[:, 1]])
    chosen = net.slab_of(near) == slab
    colours, widths = colouring.bonds
    axes.add_collection(LineCollection(at[bonds[chosen][:, :2]], colors=colours[chosen], linewidths=widths[chosen],
                                       zorder=2 + slab))


def scale_bar(axes, low, high):
    """A round length at the lower end; x grows to the left."""
    room = 0.4 * (high[0] - low[0])
    decade = 10.0 ** np.floor(np.log10(room))
    length = max(k * decade for k in (1, 2, 5) if k * decade <= room)
    x, y = high[0] - 0.04 * (high[0] - low[0]), low[1] + 0.04 * (high[1] - low[1])
    axes.plot([x, x - length], [y, y], color="black", lw=1.6, solid_capstyle="butt", zorder=95)
    axes.annotate(f"{length:g} mm", (x - 0.5 * length, y), xytext=(0, 3), textcoords="offset points",
                  ha="center", va="bottom", zorder=95, bbox={"fc": "white", "ec": "none", "alpha": 0.8, "pad": 1})


def finish_axes(axes, low, high, view, liver, title):
    _, _, _, _, name, across_words, plain_name, plain_words = view
    axes.set_xlim(high[0], low[0])  # grows to the left
    axes.set_ylim(low[1], high[1])
    axes.set_aspect("equal")
    axes.set_title(title or (name if liver else plain_name), loc="left")
    axes.set_xlabel(f"{across_words if liver else plain_words} [mm]")
    up = "xyz"[view[1]]
    axes.set_ylabel(f"{'up, y' if liver and up == 'y' else up} [mm]")


def frame_of(picture, view):
    """Lower and upper corner of a view: the organ at rest and deformed, and the arrow of the probe."""
    across, up = view[:2]
    rest = 1e3 * np.array(picture["position_m"])[:, [across, up]]
    margin = 1e3 * picture["radius_m"]
    tip = rest[picture["contact"]] + ARROW * margin * np.array(picture["normal"][picture["contact"]])[[across, up]]
    least, most = np.minimum(rest.min(axis=0), tip) - margin, np.maximum(rest.max(axis=0), tip) + margin
    for state in picture["states"]:
        at = 1e3 * np.array(state["position_m"])[:, [across, up]]
        beside = DEFORMED_MARGIN * margin
        least, most = np.minimum(least, at.min(axis=0) - beside), np.maximum(most, at.max(axis=0) + beside)
    return least, most


def draw_tools(axes, tools, view):
    """Outlines of balls, and of punches from the side; the far ends of punches are left open."""
    across, up = view[:2]
    style = {"fc": "#B0B0B0", "ec": net.CONTACT, "alpha": 0.55, "lw": 1.2, "zorder": 92}
    for tool in tools:
        at, radius = 1e3 * np.array(tool["position_m"])[[across, up]], 1e3 * tool["radius_m"]
        if tool["kind"] == "ball":
            axes.add_patch(Circle(at, radius, **style))
            continue
        along = np.array(tool["direction"])[[across, up]]
        seen = np.linalg.norm(along)
        if seen < 0.2:  # from behind: its face
            axes.add_patch(Circle(at, radius, **style))
            continue
        back, beside = -2 * radius * along / seen, radius * np.array([-along[1], along[0]]) / seen
        axes.add_patch(Polygon([at + beside + back, at + beside, at - beside, at - beside + back], closed=False, **style))


def draw_view(axes, picture, position_m, tools, colouring, view, title=None):
    across, up, towards, sign = view[:4]
    position = 1e3 * np.array(position_m)
    at = position[:, [across, up]]
    toward = sign * position[:, towards]
    span = np.ptp(toward)
    depth = (toward - toward.min()) / span if span > 0 else np.ones(len(toward))
    anchored = np.zeros(len(at), bool)
    anchored[picture["anchors"]] = True
    bonds = np.array(picture["bonds"], int).reshape(-1, 3)
    for slab in range(net.SLABS):
        if len(bonds) <= net.MOST_BONDS:
            draw_bonds(axes, at, bonds, depth, slab, colouring)
        net.draw_spheres(axes, at, depth, picture, colouring.face, anchored, slab, colouring.bar is None,
                         colouring.share)
    draw_tools(axes, tools, view)
    net.draw_contact(axes, at, picture, view, ARROW, named=False)
    low, high = frame_of(picture, view)
    scale_bar(axes, low, high)
    finish_axes(axes, low, high, view, picture["liver"], title)


def views_of(picture):
    """From the front and from the side; from above where a punch seen from the side would hide what it presses."""
    front, side = net.VIEWS
    covered = any(tool["kind"] == "punch" and abs(tool["direction"][side[2]]) > 0.8 for tool in picture["tools"])
    return front, FROM_ABOVE if covered else side


def slice_view(picture):
    """Along the axis that the probe moves least along: seen from the side, or from the front."""
    direction = np.abs(picture["direction"])
    return net.VIEWS[0] if direction[0] > direction[2] else net.VIEWS[1]


def slice_frame(picture, view):
    """Around the contact, mostly below it; no wider than the organ and the probe need."""
    across, up = view[:2]
    rest, radius = 1e3 * np.array(picture["position_m"])[:, [across, up]], 1e3 * picture["radius_m"]
    into = np.array(picture["direction"])[[across, up]]
    width = SLICE_HALF_WIDTH * radius
    centre = rest[picture["contact"]] + 0.45 * width * into
    least, most = frame_of(picture, view)
    return (np.maximum(centre - [0.75 * width, width], least), np.minimum(centre + [0.75 * width, width], most))


def draw_slice(axes, picture, position_m, tools, colouring, view, title=None):
    """The spheres that the plane through the contact meets at rest: where they are, and dashed where they were."""
    across, up, towards = view[:3]
    rest, position = 1e3 * np.array(picture["position_m"]), 1e3 * np.array(position_m)
    radius = 1e3 * picture["radius_m"]
    inside = np.abs(rest[:, towards] - rest[picture["contact"], towards]) < SLICE_THICKNESS * radius
    at, before = position[:, [across, up]], rest[:, [across, up]]
    bonds = np.array(picture["bonds"], int).reshape(-1, 3)
    chosen = inside[bonds[:, 0]] & inside[bonds[:, 1]]
    colours, widths = colouring.bonds if colouring.bonds is not None else (np.array([to_rgb("#777777")] * len(bonds)),
                                                                          np.full(len(bonds), 0.6))
    axes.add_collection(LineCollection(at[bonds[chosen][:, :2]], colors=colours[chosen], linewidths=widths[chosen],
                                       zorder=3))
    size = np.full(np.count_nonzero(inside), 2 * colouring.share * radius)
    common = {"units": "xy", "transOffset": axes.transData}
    axes.add_collection(EllipseCollection(size, size, 0 * size, offsets=before[inside], facecolors="none",
                                          edgecolors=REST, linestyles="--", linewidths=0.5, zorder=2, **common))
    anchored = np.isin(np.flatnonzero(inside), picture["anchors"])
    axes.add_collection(EllipseCollection(
        size, size, 0 * size, offsets=at[inside], facecolors=colouring.face[inside], zorder=4,
        edgecolors=[net.ANCHOR if a else "#333333" for a in anchored], linewidths=np.where(anchored, 1.1, 0.4), **common))
    cut = 1e3 * picture["position_m"][picture["contact"]][towards]
    draw_tools(axes, [t for t in tools if abs(1e3 * t["position_m"][towards] - cut) < 1e3 * t["radius_m"]], view)
    contact = picture["contact"]
    into = np.array(picture["direction"])[[across, up]]
    axes.annotate("", at[contact] - 0.55 * radius * into, at[contact] - 2.6 * radius * into, zorder=90,
                  arrowprops={"arrowstyle": "-|>", "color": net.CONTACT, "lw": 1.4})
    low, high = slice_frame(picture, view)
    scale_bar(axes, low, high)
    finish_axes(axes, low, high, view, picture["liver"], title)


def legend_of(picture, colouring):
    def dot(label, size=6, **style):
        return Line2D([], [], ls="", marker="o", ms=size, label=label, **style)

    handles = [dot(text, mfc=colour, mec="#444444") for colour, text in colouring.flags or []]
    return [*handles, dot(f"probe on sphere {picture['contact'] + 1}", 6, mfc=net.CONTACT, mec="white"),
            dot(f"anchored ({len(picture['anchors'])} spheres)", mfc="white", mec=net.ANCHOR, mew=1.8),
            dot("slice: where it was at rest", mfc="none", mec=REST, mew=0.9),
            *([dot(f"tool, at its size (spheres at {colouring.share:.0%} of theirs)", 10, mfc="#B0B0B0",
                   mec=net.CONTACT)] if picture["tools"] else [])]


def place(page, rows, sizes, above, below):
    """Rows of panels on one scale each, mm to inches; a panel without a size takes its row. Returns the page's height."""
    heights, scales = [], []
    for row, extents in zip(rows, sizes):
        room = net.WIDTH - LEFT - GAP * (len(row) - 1) - (BAR if row is rows[-1] else net.RIGHT)
        scale = extents and min(room / sum(e[0] for e in extents), MOST_HIGH / max(e[1] for e in extents))
        scales.append(scale)
        heights.append(scale * max(e[1] for e in extents) if extents else PROFILE_HIGH)
    height = above + sum(heights) + (len(rows) - 1) * (BELOW_AXIS + BETWEEN) + below
    page.set_size_inches(net.WIDTH, height)
    top = height - above
    for row, extents, scale, high in zip(rows, sizes, scales, heights):
        left = LEFT
        for axes, size in zip(row, extents or [None]):
            wide, tall = scale * np.array(size) if extents else (net.WIDTH - LEFT - BAR, high)
            axes.set_position([left / net.WIDTH, (top - tall) / height, wide / net.WIDTH, tall / height])
            left += wide + GAP
        top -= high + BELOW_AXIS + BETWEEN
    return height


def decorate(page, rows, sizes, picture, colouring, words):
    """Places the axes and writes around them."""
    handles, notes = legend_of(picture, colouring), net.notes_of(picture)
    longest = max(text_width(handle.get_label(), net.STYLE["font.size"]) for handle in handles)
    columns = LEGEND_COLUMNS if longest < net.WIDTH / LEGEND_COLUMNS - 0.4 else 1
    room = net.WIDTH - 2 * net.EDGE
    title = net.title_of(picture)
    words = [line for part in words for line in wrapped(re.split(r"(?<=[,;]) ", part), net.STYLE["font.size"], room)]
    net.letter([axes for row in rows for axes in row])
    height = place(page, rows, sizes, 0.48 + (len(title) + len(words)) * net.TITLE_ROW, net.below_panels(handles, columns, notes))
    if colouring.bar is not None:
        mappable, label = colouring.bar
        box = rows[-1][-1].get_position()
        bar = page.add_axes([box.x1 + 0.1 / net.WIDTH, box.y0, 0.12 / net.WIDTH, box.height])
        page.colorbar(mappable, cax=bar).set_label(label)
    net.draw_words(page, height, title, words, handles, columns, notes)


def size_of(frame):
    return frame[1] - frame[0]


def new_page(*row_lengths):
    """A page with so many axes in each row."""
    page = plt.figure()
    return page, [[page.add_subplot() for _ in range(count)] for count in row_lengths]


def draw_one(picture, position_m, tools, colouring, words):
    page, rows = new_page(2, 1)
    views = views_of(picture)
    for axes, view in zip(rows[0], views):
        draw_view(axes, picture, position_m, tools, colouring, view)
    cut = slice_view(picture)
    draw_slice(rows[1][0], picture, position_m, tools, colouring, cut, "Slice through the contact")
    sizes = [[size_of(frame_of(picture, view)) for view in views], [size_of(slice_frame(picture, cut))]]
    decorate(page, rows, sizes, picture, colouring, [f"{colouring.title}; {words}"])
    return page


def draw_profile(axes, picture, colours):
    """How far the contact's layer yields along the probe, over the distance from the contact."""
    rest = 1e3 * np.array(picture["position_m"])
    layer, contact, direction = np.array(picture["layer"]), picture["contact"], np.array(picture["direction"])
    away = np.linalg.norm(rest - rest[contact], axis=1)
    chosen = (layer == layer[contact]) & (away < PROFILE * 1e3 * picture["radius_m"])
    for state, colour, marker in zip(picture["states"], colours, "o^"):
        yielded = (1e3 * np.array(state["position_m"]) - rest) @ direction
        axes.plot(away[chosen], yielded[chosen], marker, ms=3.5, mfc=colour, mec="white", mew=0.3, label=state["name"])
    axes.axhline(0.0, color="#888888", lw=0.6)
    axes.invert_yaxis()  # into the organ is down
    axes.set_title("Displacement in the layer of the contact", loc="left")
    axes.set_xlabel("distance from the contact at rest [mm]")
    axes.set_ylabel("along the probe [mm]")
    axes.legend(frameon=False, loc="lower right")


def draw_two(picture):
    """Both states: what the layer of the contact does, and slices coloured by displacement on one scale."""
    states = picture["states"]
    values = [np.array(s["displacement_mm"]) for s in states]
    scale = max(v.max() for v in values)
    cut = slice_view(picture)
    page, rows = new_page(1, 2)
    draw_profile(rows[0][0], picture, ["#0072B2", "#D55E00"])
    sizes = [None, [size_of(slice_frame(picture, cut))] * 2]
    for axes, state, value in zip(rows[1], states, values):
        colouring = by_number(value, "displacement [mm]", "", scale)
        draw_slice(axes, picture, state["position_m"], state["tools"], colouring, cut, f"{state['name']}, slice")
    rows[1][1].set_ylabel("")
    decorate(page, rows, sizes, picture, colouring, [f"{s['name']}: {s['summary']}; {s['roughness']}" for s in states])
    return page


def pages(picture):
    state = picture["states"][0]
    words = f"{state['name']} at the end of the run, {state['summary']}"
    yield "undeformed", draw_one(picture, picture["position_m"], picture["tools"], by_layer(picture, "Undeformed"), "at rest")
    for name, colouring in [
            ("deformed", by_layer(picture, "Deformed, not magnified")),
            ("displacement", by_number(np.array(state["displacement_mm"]), "displacement [mm]", "Displacement")),
            ("force", by_force(state)), ("validity", by_validity(state))]:
        yield name, draw_one(picture, state["position_m"], state["tools"], colouring, words)
    if len(picture["states"]) > 1:
        yield "side_by_side", draw_two(picture)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("pictures", type=Path, help="as written by tpm simulate --folder")
    parser.add_argument("folder", type=Path, help="where the drawings go")
    arguments = parser.parse_args()
    try:
        picture = literal(json.loads(arguments.pictures.read_text(encoding="utf-8")))
    except (OSError, ValueError) as error:
        sys.exit(f"draw_deformation.py: {arguments.pictures}: {error}; expected pictures of tpm simulate")
    matplotlib.rcdefaults()  # not what a matplotlibrc of this machine says
    matplotlib.rcParams.update(net.STYLE)
    picture["normal"][picture["contact"]] = [-d for d in picture["direction"]]  # the arrow comes along the push
    for name, page in pages(picture):
        net.save_all(page, arguments.folder / name, [arguments.pictures])
        plt.close(page)


if __name__ == "__main__":
    main()
