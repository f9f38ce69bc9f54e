#!/usr/bin/env python3
"""Draws the figures described in a figures.json of `tpm`: one SVG each, and for print PDF and PNG.

    draw_figures.py FIGURES.json FOLDER [--pdf | --print]

Where a number comes from decides how it looks: what the model computes is a line; what was measured
or printed is filled; what is assumed is open, hatched or dashed, and the legend says so. The same
input gives the same bytes.
"""

import argparse
import json
import math
import re
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt  # noqa: E402  (the backend is chosen first)
from drawing_files import FONT, literal, save_drawing, text_width, wrapped  # noqa: E402
from matplotlib.colors import to_hex, to_rgba  # noqa: E402
from matplotlib.lines import Line2D  # noqa: E402
from matplotlib.patches import Patch, Rectangle  # noqa: E402
from matplotlib.patheffects import withStroke  # noqa: E402
from matplotlib.ticker import FixedLocator, FuncFormatter, MaxNLocator, NullLocator  # noqa: E402

# Lengths in inches, so that text keeps its size whatever the number of panels. Widths of journals: two columns
# (180 mm) in print, and one and a half (130 mm) for one panel and on screens, where panels stand one below the other:
# on a page of 400 pixels the text is then 9 pixels high.
PAGE_WIDTH, SINGLE_PAGE_WIDTH, PANEL_HEIGHT = 180 / 25.4, 130 / 25.4, 2.5
LEFT, RIGHT, TOP, GAP, BELOW_AXIS = 0.66, 0.12, 0.32, 0.72, 0.52
EDGE = 0.06  # between the title of an axis and what stands left of it
LEGEND_ROW, NOTE_ROW, TITLE_ROW = 0.178, 0.165, 0.17
HANDLE = 0.45  # of a legend's text, and the gap before the next
ACROSS_IN_PRINT = 2  # panels; more go on below
TITLE_SIZE, LEGEND_SIZE, NOTE_SIZE = 9.5, 8.5, 7.5  # points

# After Okabe and Ito, whose colours people with any of the usual deficiencies tell apart; darkened to a contrast of
# 3.9 or more on white, so that thin lines show.
MODEL_COLOURS = ["#0072B2", "#C75400", "#00805E", "#B0508A", "#9C6B00", "#3A86B8"]
# More curves than colours are the steps of one quantity: from dark to light, in order.
STEPS, LIGHTEST_STEP = "plasma", 0.68
DATA_COLOURS = ["#222222", "#8A5A00", "#5B2A86", "#666666"]
# More markers than colours, so that the fifth series does not look like the first.
DATA_MARKERS = ["o", "s", "D", "^", "v", "X", "P"]
# What a run came to: the same look in every map of steps, smaller than other readings, as hundreds stand side by side.
VERDICT_SIZE = 4.2
VERDICTS = {
    "holds": ("#8C8C8C", "."), "oscillates": ("#9C6B00", "s"), "wrong steady state": ("#5B2A86", "D"),
    "energy grew": ("#C75400", "^"), "diverged": ("#222222", "v"), "Newton failed": ("#0072B2", "X"),
    "buckled": ("#B0508A", "P"), "too much work": ("#3A86B8", "h"),
}
# Later lines are thinner: where curves coincide, all of them show.
LINE_WIDTHS = [2.8, 1.8, 1.1, 0.8]
THIN_LINE = 0.9
# More readings than this are drawn as a pale trace, wider than the lines over it.
DENSE, DENSE_SIZE = 100, 3.6
DENSE_COLOURS = ["#8C8C8C", "#A67C2D", "#8F6BB3"]
# Over a trace or a band, which they must not hide; still the later the thinner, since curves may coincide.
WIDTHS_OVER_OTHERS = [1.8, 1.0, 0.6]
PIXELS_PER_INCH = 300
SMALLEST_PLAIN = 1e-4  # of the numbers at an axis; smaller ones are written with a power of ten

PRINTED = {"eta": "η", "lambda": "λ", "tau": "τ"}

PROVENANCE = {
    "model": "computed by tpm",
    "table": "printed in a table of a paper",
    "text": "printed in the text of a paper",
    "abstract": "from the abstract of an experiment",
    "derived": "computed from the data",
    "assumed": "chosen, not measured: open, hatched or dashed",
    "digitized": "read off a figure",
    "measured": "raw recording",
    "simulated": "run on a simulated device",
}

STYLE = {
    "svg.fonttype": "none",  # text: it can be searched, copied and edited
    "pdf.fonttype": 42,
    "svg.hashsalt": "tpmkit",
    "font.family": [FONT],
    "font.size": 9,
    "axes.titlesize": TITLE_SIZE,
    "axes.labelsize": 9,
    "legend.fontsize": LEGEND_SIZE,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#DDDDDD",
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "axes.formatter.useoffset": False,  # whole numbers at the ticks, not a sum above the axis
    "hatch.linewidth": 0.7,
}


def is_assumed(series):
    """True if the value itself, or its place on the axis, is somebody's choice."""
    return series["provenance"] == "assumed" or "assumed" in series


def legend_text(series):
    """The label and, in brackets, where the numbers come from."""
    origin = series["provenance"]
    if "assumed" in series:
        origin += f"; {series['assumed']} assumed"
    return f"{series['label']} [{origin}]"


def is_dense(series):
    return series["kind"] == "points" and len(series["x"]) > DENSE and series["label"] not in VERDICTS


def looks(figure):
    """Colour, marker and width of each label: one look per label throughout the figure."""
    chosen = {}
    lines = data = dense = 0
    covers = any(is_dense(s) or s["kind"] == "band" for panel in figure["panels"] for s in panel["series"])
    widths = WIDTHS_OVER_OTHERS if covers else LINE_WIDTHS
    curves = len({s["label"] for panel in figure["panels"] for s in panel["series"] if s["kind"] == "line"})
    colours = MODEL_COLOURS
    if curves > len(colours):
        colours = [to_hex(matplotlib.colormaps[STEPS](LIGHTEST_STEP * i / (curves - 1))) for i in range(curves)]
    for series in (s for panel in figure["panels"] for s in panel["series"]):
        if series["label"] in chosen:
            continue
        if series["kind"] == "line":
            chosen[series["label"]] = {"color": colours[lines], "width": widths[min(lines, len(widths) - 1)]}
            lines += 1
        elif series["kind"] == "points" and series["label"] in VERDICTS:
            colour, marker = VERDICTS[series["label"]]
            chosen[series["label"]] = {"color": colour, "marker": marker, "size": VERDICT_SIZE}
        else:
            chosen[series["label"]] = {
                "color": DATA_COLOURS[data % len(DATA_COLOURS)],
                "marker": DATA_MARKERS[data % len(DATA_MARKERS)],
                "dense": DENSE_COLOURS[dense % len(DENSE_COLOURS)],
            }
            data += 1
            dense += is_dense(series)
    return chosen


def draw_line(axes, series, look, one_of_many=False):
    style = dict(color=look["color"], linewidth=look["width"], linestyle="--" if is_assumed(series) else "-")
    if one_of_many:
        style.update(linewidth=THIN_LINE, alpha=0.55)
    axes.plot(series["x"], series["y"], zorder=3, **style)
    return Line2D([], [], **{**style, "alpha": None})


def repeated_lines(panel):
    """Labels of recordings that are drawn as several lines: thin ones, which do not hide each other."""
    labels = [s["label"] for s in panel["series"] if s["kind"] == "line" and s["provenance"] == "measured"]
    return {label for label in labels if labels.count(label) > 1}


def inside(axes, series):
    """Its readings below the upper limit that was set for y; how many are above it is written at the top."""
    upper = getattr(axes, "upper_limit", None)
    x, y, sd = series["x"], series["y"], series.get("sd")
    kept = [i for i, value in enumerate(y) if upper is None or value <= upper]
    axes.beyond = getattr(axes, "beyond", 0) + len(y) - len(kept)
    return [x[i] for i in kept], [y[i] for i in kept], [sd[i] for i in kept] if sd else None


def draw_points(axes, series, look):
    dense = is_dense(series)
    colour = look["dense"] if dense else look["color"]
    face = "white" if is_assumed(series) else colour
    style = dict(marker=look["marker"], markersize=DENSE_SIZE if dense else look.get("size", 5), markerfacecolor=face, markeredgecolor=colour, linestyle="none")
    x, y, sd = inside(axes, series)
    axes.errorbar(x, y, yerr=sd, ecolor=colour, elinewidth=1, capsize=2.5, zorder=2 if dense else 5, clip_on=False, **style)
    return Line2D([], [], **style)


def draw_band(axes, series, look):
    if is_assumed(series):
        # No hatching: what is drawn over it has to be read.
        style = dict(facecolor=to_rgba(look["color"], 0.10), edgecolor=look["color"], linewidth=1.0, linestyle="--")
    else:
        style = dict(facecolor=look["color"], alpha=0.22, linewidth=0)
    axes.fill_between(series["x"], series["lower"], series["upper"], zorder=1, **style)
    return Patch(**style)


def bracket_style(series, look):
    if is_assumed(series):
        return dict(facecolor="none", edgecolor=look["color"], hatch="//////", linewidth=0.8, linestyle="--")
    return dict(facecolor=look["color"], alpha=0.35, linewidth=0)


def draw_bracket(axes, series, look):
    """Reserves the room; finish_bracket() draws once the limits of the axes are known."""
    axes.plot(series["x"], series["lower"], linestyle="none")
    axes.plot(series["x"], series["upper"], linestyle="none")
    return Patch(**bracket_style(series, look))


def finish_bracket(axes, series, look, half_width=5.0):
    """An upright bar of fixed width on the page [points] from lower to upper at each x."""
    pixels = half_width * axes.figure.dpi / 72
    to_page, to_data = axes.transData, axes.transData.inverted()
    for x, lower, upper in zip(series["x"], series["lower"], series["upper"]):
        centre = to_page.transform((x, lower))
        left = to_data.transform((centre[0] - pixels, centre[1]))[0]
        right = to_data.transform((centre[0] + pixels, centre[1]))[0]
        axes.add_patch(Rectangle((left, lower), right - left, upper - lower, zorder=2, **bracket_style(series, look)))
        axes.hlines([lower, upper], left, right, color=look["color"], linewidth=1.3, zorder=4)


def draw_mark(axes, series, look):
    face = "white" if is_assumed(series) else look["color"]
    style = dict(marker=look["marker"], markersize=6, markerfacecolor=face, markeredgecolor=look["color"], linestyle="none")
    axes.plot(series["x"], series["y"], zorder=6, clip_on=False, **style)
    for x, y in zip(series["x"], series["y"]):
        axes.annotate(series["text"], (x, y), xytext=(0, 6), textcoords="offset points", ha="center", va="bottom",
                      color=look["color"], fontsize=8, zorder=6)
    return Line2D([], [], **style)


def edges(places, logarithmic):
    """Half-way between places, on the axis' scale; outer ones as far out as the next ones in."""
    values = [math.log(v) if logarithmic else v for v in places]
    if len(values) == 1:
        values = [values[0] - 0.5, values[0] + 0.5]
    else:
        middle = [(a + b) / 2 for a, b in zip(values, values[1:])]
        values = [2 * values[0] - middle[0], *middle, 2 * values[-1] - middle[-1]]
    return [math.exp(v) if logarithmic else v for v in values]


def draw_heat(axes, series, look, panel):
    """Colours over x and y with lines of equal value; where there is nothing, the grey page."""
    x, y = series["x"], series["y"]
    rows = [[math.nan if v is None else v for v in series["z"][i * len(x):(i + 1) * len(x)]] for i in range(len(y))]
    axes.set_facecolor("#E8E8E8")
    axes.grid(False)
    mesh = axes.pcolormesh(edges(x, panel["x"]["logarithmic"]), edges(y, panel["y"]["logarithmic"]), rows, cmap="viridis",
                           shading="flat", rasterized=True)
    found = [v for row in rows for v in row if not math.isnan(v)]
    if len(x) > 1 and len(y) > 1 and found and min(found) < max(found):
        lines = axes.contour(x, y, rows, levels=6, colors="white", linewidths=0.7)
        for text in axes.clabel(lines, fontsize=8.5, fmt="%g"):  # on dark and on bright colours
            text.set_path_effects([withStroke(linewidth=1.6, foreground="#222222")])
    axes.figure.colorbar(mesh, ax=axes, fraction=0.16, pad=0.02, aspect=22)
    return Rectangle((0, 0), 1, 1, facecolor=mesh.get_cmap()(0.5))


DRAW = {"points": draw_points, "band": draw_band, "bracket": draw_bracket, "mark": draw_mark}


def axis_label(axis):
    quantity = plain_name(axis["quantity"])
    return f"{quantity} [{axis['unit']}]" if axis["unit"] else quantity


def plain_name(text):
    """The project's plain names as print writes them; not within a longer word, such as a file's name."""
    return re.sub(r"(?<![\w.-])(eta|lambda|tau)([1-9])(?![\w-]|\.\w)", lambda m: PRINTED[m[1]] + "₀₁₂₃₄₅₆₇₈₉"[int(m[2])], text)


def tick_short_log_axis(axis_of_plot, limits):
    """Below two decades powers of ten are too far apart: 1, 2, 5 times them, or round values."""
    low, high = limits
    if high / low > 100:
        return
    powers = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    places = [m * 10.0**k for k in powers for m in (1, 2, 5) if low <= m * 10.0**k <= high]
    if len(places) < 3:
        places = [v for v in MaxNLocator(4, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high) if low <= v <= high]
    axis_of_plot.set_major_locator(FixedLocator(places))
    axis_of_plot.set_major_formatter(FuncFormatter(plain_number))
    axis_of_plot.set_minor_locator(NullLocator())


def plain_number(value, _position):
    """12.5, or 2·10⁵ and 5·10⁻⁷ where that is shorter."""
    size = abs(value)
    if size == 0 or SMALLEST_PLAIN <= size < 1e4:
        return f"{value:g}".replace("-", "\u2212")
    exponent = math.floor(math.log10(size * (1 + 1e-12)))
    factor = value / 10.0**exponent
    power = "10" + str(exponent).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
    return power if abs(factor - 1) < 1e-9 else f"{factor:g}·{power}".replace("-", "\u2212")


def counts(panel):
    """True if the panel's x are counts or running numbers, which have no tick between them."""
    places = [x for s in panel["series"] if s["kind"] in ("points", "bracket") for x in s["x"]]
    return not panel["x"]["unit"] and not panel["x"]["logarithmic"] and places and all(x == int(x) for x in places)


def is_aslant(names, width):
    """Whether names side by side would touch each other on an axis of this width (inches)."""
    return max((len(name) for name in names), default=0) * 5.0 * len(names) > width * 72


def name_places(axes, names):
    """Names in place of the numbers 1, 2, ...; aslant where they would touch each other."""
    aslant = is_aslant(names, axes.get_position().width * axes.figure.get_figwidth())
    axes.set_xticks(range(1, len(names) + 1), names, rotation=35 if aslant else 0, ha="right" if aslant else "center",
                    rotation_mode="anchor")
    axes.tick_params(axis="x", length=0, labelsize=8)
    axes.grid(False, axis="x")
    if aslant:
        axes.set_xlabel("")  # its place is taken by the names


def draw_panel(axes, panel, look, handles, title):
    """Draws one panel and adds a handle per new legend text to `handles`."""
    axes.upper_limit = panel["y"].get("upper")
    many = repeated_lines(panel)
    for series in panel["series"]:
        if series["kind"] == "heat":
            handle = draw_heat(axes, series, look[series["label"]], panel)
        elif series["kind"] == "line":
            handle = draw_line(axes, series, look[series["label"]], series["label"] in many)
        else:
            handle = DRAW[series["kind"]](axes, series, look[series["label"]])
        handles.setdefault(legend_text(series), handle)
    axes.set_title(title, loc="left")
    if getattr(axes, "beyond", 0):
        axes.annotate(f"\u25b2 {axes.beyond} above {axes.upper_limit:g}", (0.98, 0.97), xycoords="axes fraction", ha="right", va="top", fontsize=7.5,
                      color="#444444", bbox=dict(facecolor="white", edgecolor="none", alpha=0.8, pad=1.5), zorder=7)
    for name, axis in (("x", panel["x"]), ("y", panel["y"])):
        getattr(axes, f"set_{name}label")(axis_label(axis))
        if axis["logarithmic"]:
            getattr(axes, f"set_{name}scale")("log")
        getattr(axes, f"set_{name}lim")(axis.get("lower"), axis.get("upper"))
        if axis["logarithmic"]:
            tick_short_log_axis(getattr(axes, f"{name}axis"), getattr(axes, f"get_{name}lim")())
        elif not SMALLEST_PLAIN < max(abs(v) for v in getattr(axes, f"get_{name}lim")()) < 1e5:
            # No power of ten apart from the ticks: it would lie on its neighbour's.
            getattr(axes, f"{name}axis").set_major_locator(MaxNLocator(5))
            getattr(axes, f"{name}axis").set_major_formatter(FuncFormatter(plain_number))
    if "names" in panel["y"]:
        axes.set_yticks(range(1, len(panel["y"]["names"]) + 1), [plain_name(name) for name in panel["y"]["names"]], fontsize=7.5)
        axes.tick_params(axis="y", length=0)
    if "names" in panel["x"]:
        name_places(axes, [plain_name(name) for name in panel["x"]["names"]])
    elif counts(panel):
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    for series in panel["series"]:
        if series["kind"] == "bracket":
            finish_bracket(axes, series, look[series["label"]])


def provenance_note(figure):
    present = []
    for series in (s for panel in figure["panels"] for s in panel["series"]):
        for word in [series["provenance"]] + (["assumed"] if "assumed" in series else []):
            if word not in present:
                present.append(word)
    return [f"[{word}] {PROVENANCE[word]}" for word in present]


def letter_of(panel, panels):
    """a, b, ... for the text to refer to; none where there is one panel."""
    return chr(ord("a") + panel) if 1 < panels <= 26 else ""


def lettered(letter, title):
    """A panel's title after its letter, unless it begins with one."""
    if not letter or re.match(r"\([a-z]\)( |$)", title):
        return title
    return f"({letter}) {title}".strip()


def keep_inside(page, axes, least):
    """Narrows a panel whose labels, of ticks or of names aslant, would begin left of `least` (inches)."""
    boxes = [axis.get_tightbbox(page.canvas.get_renderer()) for axis in (axes.xaxis, axes.yaxis)]
    missing = least - min(box.x0 for box in boxes) / page.dpi
    if missing <= 0:
        return
    place, share = axes.get_position(), missing / page.get_figwidth()
    axes.set_position([place.x0 + share, place.y0, place.width - share, place.height])


def below_names(panels, width):
    """More room below panels (of this width, inches) whose places have long names, which stand aslant."""
    aslant = [names for names in ([plain_name(n) for n in panel["x"].get("names", [])] for panel in panels) if is_aslant(names, width)]
    longest = max((len(name) for names in aslant for name in names), default=0)
    return max(0.0, 0.045 * longest + 0.10 - BELOW_AXIS)


def draw_figure(figure, most_across=1):
    """The figure, laid out from the bottom: provenance, legend, panels, so many beside each other."""
    if any(s["kind"] == "trail" for panel in figure["panels"] for s in panel["series"]):
        import work_precision  # beside this file; other figures do without
        return work_precision.draw_figure(figure, axis_label, lambda i, n, title: lettered(letter_of(i, n), title))
    panels, look = figure["panels"], looks(figure)
    labels = list(dict.fromkeys(legend_text(s) for panel in panels for s in panel["series"]))
    across = min(len(panels), most_across)
    width = SINGLE_PAGE_WIDTH if across == 1 else PAGE_WIDTH
    room = width - LEFT - RIGHT
    columns = 2 if len(labels) > 1 and max(text_width(label, LEGEND_SIZE) for label in labels) <= room / 2 - HANDLE else 1
    entries = ["\n".join(wrapped(label.split(" "), LEGEND_SIZE, room / columns - HANDLE)) for label in labels]
    rows = -(-len(labels) // columns) + sum(entry.count("\n") for entry in entries)
    notes = wrapped((figure.get("note") or "").split(), NOTE_SIZE, room) + wrapped(provenance_note(figure), NOTE_SIZE, room, "; ")
    panel_width = (room - (across - 1) * GAP) / across
    titles = [wrapped(lettered(letter_of(i, len(panels)), plain_name(panel["title"])).split(" "), TITLE_SIZE,
                      panel_width + (GAP / 2 if (i + 1) % across else RIGHT - EDGE)) for i, panel in enumerate(panels)]
    top = TOP + (max(len(lines) for lines in titles) - 1) * TITLE_ROW
    below_axis = BELOW_AXIS + below_names(panels, panel_width)
    below = below_axis + rows * LEGEND_ROW + 0.10 + len(notes) * NOTE_ROW + 0.08
    stacked = -(-len(panels) // across)
    row_height = top + PANEL_HEIGHT + below_axis
    height = top + PANEL_HEIGHT + below + (stacked - 1) * row_height
    page = plt.figure(figsize=(width, height))
    handles = {}
    for i, panel in enumerate(panels):
        left = LEFT + i % across * (panel_width + GAP)
        bottom = below + (stacked - 1 - i // across) * row_height
        axes = page.add_axes([left / width, bottom / height, panel_width / width, PANEL_HEIGHT / height])
        draw_panel(axes, panel, look, handles, "\n".join(titles[i]))
        keep_inside(page, axes, left - (GAP if i % across else LEFT) + EDGE)
    page.legend([handles[label] for label in labels], entries, loc="upper left", ncol=columns, frameon=False, borderaxespad=0,
                bbox_to_anchor=(LEFT / width, (below - below_axis) / height), handlelength=2.2, labelspacing=0.45)
    for i, note in enumerate(notes):
        page.text(LEFT / width, (0.08 + (len(notes) - 1 - i) * NOTE_ROW) / height, note, fontsize=NOTE_SIZE, color="#555555", va="bottom")
    return page


def with_own_ids(svg, name):
    """Several figures stand in one page: their ids must not meet. What XML or a style could misread is left out."""
    prefix = re.sub(r"[^A-Za-z0-9_.-]", "_", name)

    def own(tag):
        text = re.sub(r'\bid="', f'id="{prefix}-', tag[0])
        text = re.sub(r'href="#', f'href="#{prefix}-', text)
        return re.sub(r"url\(#", f"url(#{prefix}-", text)

    return re.sub(r"<[^>]*>", own, svg)  # the tags alone: what a user named stays as it is


def save(figure, folder, pdf, png, reads):
    page = draw_figure(figure)
    save_drawing(page, folder / f"{figure['id']}.svg", lambda svg: with_own_ids(svg, figure["id"]), reads,
                 dpi=PIXELS_PER_INCH, metadata={"Date": None, "Creator": None})
    if (pdf or png) and len(figure["panels"]) > 1:
        plt.close(page)
        page = draw_figure(figure, ACROSS_IN_PRINT)
    if png:
        save_drawing(page, folder / f"{figure['id']}.png", reads=reads, dpi=PIXELS_PER_INCH, metadata={"Software": None})
    if pdf:
        save_drawing(page, folder / f"{figure['id']}.pdf", reads=reads, dpi=PIXELS_PER_INCH,
                     metadata={"CreationDate": None, "Creator": None, "Producer": None})
    plt.close(page)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("figures", type=Path, help="figures.json as written by tpm")
    parser.add_argument("folder", type=Path, help="where the drawings go")
    formats = parser.add_mutually_exclusive_group()
    formats.add_argument("--pdf", action="store_true", help="write a PDF beside each SVG")
    formats.add_argument("--print", dest="for_print", action="store_true", help="write PNG (300 dpi) and PDF beside each SVG")
    arguments = parser.parse_args()
    try:
        figures = literal(json.loads(arguments.figures.read_text(encoding="utf-8"))["figures"])
        arguments.folder.mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError, KeyError) as error:
        sys.exit(f"draw_figures.py: {arguments.figures}: {error}; expected a figures.json of tpm and a folder to write to")
    matplotlib.rcdefaults()  # not what a matplotlibrc of this machine says
    matplotlib.rcParams.update(STYLE)
    for figure in figures:
        save(figure, arguments.folder, arguments.pdf or arguments.for_print, arguments.for_print, [arguments.figures])


if __name__ == "__main__":
    main()
