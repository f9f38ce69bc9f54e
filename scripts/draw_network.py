#!/usr/bin/env python3
"""Draws the network of spheres that `tpm network show` describes, as STEM.svg, STEM.png and STEM.pdf.

    draw_network.py PICTURE.json STEM

Two views, as an eye sees them: from the front (looking along +z) and from the side of large x (looking
along -x), so that x and z grow to the left. Of a liver that is the patient's front and right. What lies
nearer is drawn later and stronger. The same input gives the same bytes.
"""

import argparse
import json
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt  # noqa: E402  (the backend is chosen first)
import numpy as np  # noqa: E402
from drawing_files import literal, save_drawing, wrapped  # noqa: E402
from matplotlib.collections import EllipseCollection, LineCollection  # noqa: E402
from matplotlib.colors import to_rgb  # noqa: E402
from matplotlib.lines import Line2D  # noqa: E402

LAYER_COLOURS = ["#B4564A", "#E6A15C", "#7C6BB0", "#4F9D8C"]
ANCHOR, CONTACT = "#1F3D7A", "#D9007E"
ARROW = 7.0  # length of the probe, in radii
MOST_BONDS = 40_000  # more are a blot
# Axes across and up, axis towards the viewer and its sign; name and axis of a liver, and of anything else.
VIEWS = [
    (0, 1, 2, -1, "From the front", "to the patient's right, x", "Seen along +z", "x"),
    (2, 1, 0, 1, "From the patient's right", "front to back, z", "Seen along -x", "z"),
]
# Inches: one and a half columns of a journal (130 mm), at which the text is 8 pixels high where 400 pixels show it.
WIDTH, LEFT, RIGHT, ABOVE, BELOW, MOST_HIGH = 130 / 25.4, 0.52, 0.08, 0.56, 0.42, 4.0
TITLE_ROW, LEGEND_ROW, NOTE_ROW, EDGE = 0.18, 0.16, 0.15, 0.08
TITLE_SIZE, NOTE_SIZE = 10, 7.5  # points
LEGEND_COLUMNS = 2
SLABS = 16  # of the depth, drawn one after the other
STYLE = {"svg.fonttype": "none", "svg.hashsalt": "tpmkit", "font.family": "DejaVu Sans", "font.size": 8,
         "axes.titlesize": 9, "legend.handlelength": 1.2, "legend.columnspacing": 1.2, "axes.linewidth": 0.6, "axes.spines.top": False, "axes.spines.right": False}


def layer_colour(k):
    """The colours of inner layers repeat; the outermost keeps its own."""
    inner = LAYER_COLOURS[1:]
    return LAYER_COLOURS[0] if k == 0 else inner[(k - 1) % len(inner)]


def shaded(colours, depth):
    """Lighter with the distance from the viewer: depth 1 is nearest."""
    fade = 0.62 * (1.0 - depth)[:, None]
    return colours * (1.0 - fade) + fade


def slab_of(depth):
    return np.minimum((SLABS * depth).astype(int), SLABS - 1)


def draw_bonds(axes, at, bonds, depth, slab):
    near = 0.5 * (depth[bonds[:, 0]] + depth[bonds[:, 1]])
    ends = at[bonds[slab_of(near) == slab][:, :2]]
    strength = 0.85 - 0.65 * (slab + 0.5) / SLABS  # grey, darker where nearer
    axes.add_collection(LineCollection(ends, colors=str(round(strength, 3)), linewidths=0.35, zorder=2 + slab))


def draw_spheres(axes, at, depth, picture, face, anchored, slab, fade=True, share=0.5):
    """Circles from far to near; anchored ones with a dark rim. Colours that mean a number do not fade."""
    radius = 1e3 * picture["radius_m"] * share  # smaller than they are, so that bonds show
    order = np.argsort(depth, kind="stable")
    order = order[slab_of(depth[order]) == slab]
    size = np.full(len(order), 2 * radius)
    rim = np.where(anchored[order][:, None], to_rgb(ANCHOR), 0.45 * face[order])
    axes.add_collection(EllipseCollection(
        size, size, np.zeros(len(order)), units="xy", offsets=at[order], transOffset=axes.transData,
        facecolors=(shaded(face, depth) if fade else face)[order], edgecolors=rim,
        linewidths=np.where(anchored[order], 0.9, 0.25), zorder=2.5 + slab))


def draw_contact(axes, at, picture, view, arrow=ARROW, named=True):
    contact = picture["contact"]
    if contact is None:
        return
    across, up = view[:2]
    normal = np.array(picture["normal"][contact])
    here, size = at[contact], 1e3 * picture["radius_m"]
    axes.plot(*here, "o", ms=4.5, mfc=CONTACT, mec="white", mew=0.6, zorder=90)
    flat = np.array([normal[across], normal[up]])
    if np.linalg.norm(flat) < 0.5:  # the probe points into the page
        axes.plot(*here, "o", ms=10, mfc="none", mec=CONTACT, mew=1.2, zorder=90)
        text_at = here + np.array([0.0, 1.2 * size])
    else:
        start = here + arrow * size * flat
        axes.annotate("", here + 0.6 * size * flat, start, arrowprops={"arrowstyle": "-|>", "color": CONTACT, "lw": 1.4},
                      zorder=90)
        text_at = here + 0.6 * arrow * size * flat + np.array([0.0, 0.5 * size])
    if not named:
        return
    axes.annotate(f"probe on\nsphere {contact + 1}", text_at, ha="center", va="bottom", color=CONTACT, fontweight="bold",
                  zorder=91, bbox={"fc": "white", "ec": "none", "alpha": 0.85, "pad": 1})


def draw_view(axes, picture, position, view):
    across, up, towards, sign, name, across_words, plain_name, plain_words = view
    at = position[:, [across, up]]
    toward = sign * position[:, towards]
    span = np.ptp(toward)
    depth = (toward - toward.min()) / span if span > 0 else np.ones(len(toward))
    layer = np.array(picture["layer"])
    face = np.array([to_rgb(layer_colour(k)) for k in layer])
    anchored = np.zeros(len(at), bool)
    anchored[picture["anchors"]] = True
    face[anchored] = 0.55 * face[anchored] + 0.45 * np.array(to_rgb(ANCHOR))
    bonds = np.array(picture["bonds"], int).reshape(-1, 3)
    for slab in range(SLABS):
        if len(bonds) <= MOST_BONDS:
            draw_bonds(axes, at, bonds, depth, slab)
        draw_spheres(axes, at, depth, picture, face, anchored, slab)
    draw_contact(axes, at, picture, view)
    margin = 1e3 * picture["radius_m"]
    low, high = at.min(axis=0) - margin, at.max(axis=0) + margin
    if picture["contact"] is not None:  # room for the arrow and its words
        tip = at[picture["contact"]] + ARROW * margin * np.array(picture["normal"][picture["contact"]])[[across, up]]
        low, high = np.minimum(low, tip - margin), np.maximum(high, tip + margin)
    axes.set_xlim(high[0], low[0])  # grows to the left
    axes.set_ylim(low[1], high[1])
    axes.set_aspect("equal")
    liver = picture["liver"]
    axes.set_title(name if liver else plain_name, loc="left")
    axes.set_xlabel(f"{across_words if liver else plain_words} [mm]")
    axes.set_ylabel(f"{'up, y' if liver else 'y'} [mm]")
    return high - low


def layer_name(k, count):
    if k == 0:
        return "outer layer"
    return "inner layer" if count == 2 else f"layer {k + 1}"


def legend_handles(picture):
    handles = [Line2D([], [], ls="", marker="o", ms=6, mfc=layer_colour(k), mec="#553333",
                      label=layer_name(k, picture["layer_count"])) for k in range(min(picture["layer_count"], 4))]
    if picture["layer_count"] > 4:
        handles[-1].set_label("and deeper, the colours repeating")
    if picture["anchors"]:
        handles.append(Line2D([], [], ls="", marker="o", ms=6, mfc="#8890A8", mec=ANCHOR, mew=1.4,
                              label=f"anchored ({len(picture['anchors'])} spheres)"))
    if len(picture["bonds"]) <= MOST_BONDS:
        handles.append(Line2D([], [], color="#555555", lw=1.0, label=f"bonds ({len(picture['bonds'])})"))
    return handles


def title_of(picture):
    """Lines of the title, which is drawn in bold, and so wider than measured."""
    return wrapped(picture["title"].split(), 1.15 * TITLE_SIZE, WIDTH - 2 * EDGE)


def draw_words(page, height, title, words, handles, columns, notes):
    """Lines above the panels, the title in bold; the legend and the provenance below them."""
    for i, line in enumerate([*title, *words]):
        bold = i < len(title)
        page.text(EDGE / WIDTH, 1 - (0.2 + i * TITLE_ROW) / height, line, fontsize=TITLE_SIZE if bold else STYLE["font.size"],
                  fontweight="bold" if bold else "normal")
    for i, line in enumerate(reversed(notes)):
        page.text(EDGE / WIDTH, (0.06 + i * NOTE_ROW) / height, line, fontsize=NOTE_SIZE, color="#555555")
    if handles:
        page.legend(handles=handles, loc="lower center", ncol=columns, frameon=False, borderaxespad=0, borderpad=0,
                    labelspacing=0.4, bbox_to_anchor=(0.5, (0.1 + len(notes) * NOTE_ROW) / height))


def below_panels(handles, columns, notes):
    """Inches of the legend, of the provenance and of the axis above them."""
    return BELOW + LEGEND_ROW * -(-len(handles) // columns) + NOTE_ROW * len(notes) + 0.1


def notes_of(picture):
    return wrapped(picture["provenance"].split(), NOTE_SIZE, WIDTH - 2 * EDGE)


def draw(picture):
    position = 1e3 * np.array(picture["position_m"])
    page, axes = plt.subplots(1, 2)
    extents = [draw_view(one, picture, position, view) for one, view in zip(axes, VIEWS)]
    handles, notes = legend_handles(picture), notes_of(picture)
    below = below_panels(handles, LEGEND_COLUMNS, notes)
    # One scale for both views, mm to inches: what the width leaves, unless that gets too high.
    scale = min((WIDTH - 2 * LEFT - RIGHT) / sum(e[0] for e in extents), MOST_HIGH / max(e[1] for e in extents))
    title = title_of(picture)
    height = scale * max(e[1] for e in extents) + below + ABOVE + (len(title) - 1) * TITLE_ROW
    page.set_size_inches(WIDTH, height)
    left = LEFT
    for one, extent in zip(axes, extents):
        one.set_position([left / WIDTH, below / height, scale * extent[0] / WIDTH, scale * extent[1] / height])
        left += scale * extent[0] + LEFT
    letter(axes)
    draw_words(page, height, title, [], handles, LEGEND_COLUMNS, notes)
    return page


def save_all(page, stem, reads):
    save_drawing(page, f"{stem}.svg", reads=reads, metadata={"Date": None, "Creator": None})
    save_drawing(page, f"{stem}.png", reads=reads, dpi=300, metadata={"Software": None})
    save_drawing(page, f"{stem}.pdf", reads=reads, metadata={"CreationDate": None, "Creator": None, "Producer": None})


def letter(row):
    """Panels are called (a), (b), ... before what they show."""
    for k, axes in enumerate(row):
        axes.set_title(f"({chr(ord('a') + k)}) {axes.get_title(loc='left')}", loc="left")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("picture", type=Path, help="as written by tpm network show")
    parser.add_argument("stem", help="path of the drawings without an ending")
    arguments = parser.parse_args()
    try:
        picture = literal(json.loads(arguments.picture.read_text(encoding="utf-8")))
    except (OSError, ValueError) as error:
        sys.exit(f"draw_network.py: {arguments.picture}: {error}; expected a picture of tpm network show")
    matplotlib.rcdefaults()  # not what a matplotlibrc of this machine says
    matplotlib.rcParams.update(STYLE)
    page = draw(picture)
    save_all(page, arguments.stem, [arguments.picture])


if __name__ == "__main__":
    main()
