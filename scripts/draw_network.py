#!/usr/bin/env python3
"""Draws the network of spheres that `tpm network show` describes, as STEM.svg and STEM.png.

    draw_network.py PICTURE.json STEM

Two views: from the front, where the probe comes from (along +z), and from the side. What lies nearer to
the viewer is drawn later. The same input gives the same bytes.
"""

import argparse
import json
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt  # noqa: E402  (the backend is chosen first)
import numpy as np  # noqa: E402
from matplotlib.collections import EllipseCollection, LineCollection  # noqa: E402
from matplotlib.colors import to_rgb  # noqa: E402
from matplotlib.lines import Line2D  # noqa: E402

LAYER_COLOURS = ["#B4564A", "#E6A15C", "#7C6BB0", "#4F9D8C"]
ANCHOR, CONTACT = "#1F3D7A", "#D9007E"
MOST_BONDS = 40_000  # more are a blot
# Name, axes across and up, axis towards the viewer and its sign, words of the axes.
VIEWS = [
    ("From the front, as the probe sees it", 0, 1, 2, -1, "to the patient's right, x", "up, y"),
    ("From the side (the probe comes from the left)", 2, 1, 0, 1, "front to back, z", "up, y"),
]
STYLE = {"svg.fonttype": "path", "svg.hashsalt": "tpmkit", "font.family": "DejaVu Sans", "font.size": 8.5,
         "axes.titlesize": 9.5, "axes.spines.top": False, "axes.spines.right": False}


def shaded(colours, depth):
    """Lighter with the distance from the viewer: depth 1 is nearest."""
    fade = 0.62 * (1.0 - depth)[:, None]
    return colours * (1.0 - fade) + fade


def draw_bonds(axes, at, bonds, depth, visible):
    if len(bonds) > MOST_BONDS:
        return
    near = 0.5 * (depth[bonds[:, 0]] + depth[bonds[:, 1]])
    for kind, colour in ((0, "#777777"), (1, "#333333")):
        chosen = bonds[:, 2] == kind
        ends = at[bonds[chosen][:, :2]]
        rgba = np.tile([*to_rgb(colour), 1.0], (len(ends), 1))
        rgba[:, 3] = 0.06 + 0.34 * near[chosen] ** 2
        axes.add_collection(LineCollection(ends, colors=rgba, linewidths=0.35, zorder=1.5 if visible else 1))


def draw_spheres(axes, at, depth, picture, face, anchored):
    """Circles from far to near; anchored ones with a dark rim."""
    radius = 1e3 * picture["radius_m"] * 0.78  # a little smaller than they are, so that bonds show
    order = np.argsort(depth, kind="stable")
    size = np.full(len(order), 2 * radius)
    rim = np.where(anchored[order][:, None], to_rgb(ANCHOR), 0.55 * face[order])
    axes.add_collection(EllipseCollection(
        size, size, np.zeros(len(order)), units="xy", offsets=at[order], transOffset=axes.transData,
        facecolors=shaded(face, depth)[order], edgecolors=rim, linewidths=np.where(anchored[order], 1.6, 0.3), zorder=2))


def draw_contact(axes, at, picture, position, view):
    contact = picture["contact"]
    if contact is None:
        return
    _, across, up, towards, _, _, _ = view
    normal = np.array(picture["normal"][contact])
    here = at[contact]
    axes.plot(*here, "o", ms=6.5, mfc=CONTACT, mec="white", mew=0.8, zorder=6)
    flat = np.array([normal[across], normal[up]])
    if np.linalg.norm(flat) < 0.5:  # the probe points into the page
        axes.plot(*here, "o", ms=15, mfc="none", mec=CONTACT, mew=1.4, zorder=6)
        text_at = here + np.array([0.0, 16.0e3 * picture["radius_m"] / 10])
    else:
        start = here + 45e3 * picture["radius_m"] / 10 * flat
        axes.annotate("", here + 4e2 * picture["radius_m"] * flat, start,
                      arrowprops={"arrowstyle": "-|>", "color": CONTACT, "lw": 1.8}, zorder=6)
        text_at = start + np.array([0.0, 5e3 * picture["radius_m"] / 10])
    axes.annotate(f"probe: sphere {contact + 1}", text_at, ha="center", va="bottom", color=CONTACT, fontweight="bold",
                  fontsize=8.5, zorder=7, bbox={"fc": "white", "ec": "none", "alpha": 0.8, "pad": 1})


def draw_view(axes, picture, position, view):
    name, across, up, towards, sign, across_words, up_words = view
    at = position[:, [across, up]]
    toward = sign * position[:, towards]
    span = np.ptp(toward)
    depth = (toward - toward.min()) / span if span > 0 else np.ones(len(toward))
    layer = np.array(picture["layer"])
    face = np.array([to_rgb(LAYER_COLOURS[k % len(LAYER_COLOURS)]) for k in layer])
    anchored = np.zeros(len(at), bool)
    anchored[picture["anchors"]] = True
    face[anchored] = 0.55 * face[anchored] + 0.45 * np.array(to_rgb(ANCHOR))
    draw_spheres(axes, at, depth, picture, face, anchored)
    draw_bonds(axes, at, np.array(picture["bonds"], int).reshape(-1, 3), depth, True)
    draw_contact(axes, at, picture, position, view)
    margin = 1.6e3 * picture["radius_m"]
    low, high = at.min(axis=0) - margin, at.max(axis=0) + margin
    if towards != 2 and picture["contact"] is not None:  # room for the arrow
        low[0] -= 45e3 * picture["radius_m"] / 10
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1] + margin)
    axes.set_aspect("equal")
    axes.set_title(name, loc="left")
    axes.set_xlabel(f"{across_words} (mm)")
    axes.set_ylabel(f"{up_words} (mm)")


def legend(page, picture):
    handles = [Line2D([], [], ls="", marker="o", ms=8, mfc=LAYER_COLOURS[k % len(LAYER_COLOURS)], mec="#553333",
                      label="outer layer" if k == 0 else f"layer {k + 1}") for k in range(min(picture["layer_count"], 4))]
    if picture["layer_count"] > 4:
        handles[-1].set_label("and deeper, the colours repeating")
    if picture["anchors"]:
        handles.append(Line2D([], [], ls="", marker="o", ms=8, mfc="#8890A8", mec=ANCHOR, mew=1.8,
                              label=f"anchored ({len(picture['anchors'])} spheres)"))
    if picture["contact"] is not None:
        handles.append(Line2D([], [], ls="", marker="o", ms=6, mfc=CONTACT, mec="white", label="contact sphere"))
    if len(picture["bonds"]) <= MOST_BONDS:
        handles.append(Line2D([], [], color="#555555", lw=0.8, label=f"bonds ({len(picture['bonds'])})"))
    page.legend(handles=handles, loc="lower center", ncol=len(handles), frameon=False, bbox_to_anchor=(0.5, 0.045))


def draw(picture):
    position = 1e3 * np.array(picture["position_m"])
    extent = np.ptp(position, axis=0) + 3.2e3 * picture["radius_m"]
    room = 0.0 if picture["contact"] is None else 45e3 * picture["radius_m"] / 10
    page, axes = plt.subplots(1, 2, figsize=(11, 6.4), gridspec_kw={"width_ratios": [extent[0], extent[2] + room]})
    for one, view in zip(axes, VIEWS):
        draw_view(one, picture, position, view)
    page.suptitle(picture["title"], x=0.06, ha="left", fontsize=11, fontweight="bold")
    legend(page, picture)
    page.text(0.06, 0.015, picture["provenance"], fontsize=7, color="#555555")
    page.subplots_adjust(left=0.06, right=0.985, top=0.90, bottom=0.17, wspace=0.16)
    return page


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("picture", type=Path, help="as written by tpm network show")
    parser.add_argument("stem", help="path of the drawings without an ending")
    arguments = parser.parse_args()
    try:
        picture = json.loads(arguments.picture.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        sys.exit(f"draw_network.py: {arguments.picture}: {error}; expected a picture of tpm network show")
    matplotlib.rcdefaults()  # not what a matplotlibrc of this machine says
    matplotlib.rcParams.update(STYLE)
    page = draw(picture)
    page.savefig(f"{arguments.stem}.svg", metadata={"Date": None, "Creator": None})
    page.savefig(f"{arguments.stem}.png", dpi=130, metadata={"Software": None})


if __name__ == "__main__":
    main()
