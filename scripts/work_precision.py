"""Charts of error against cost, for draw_figures.py: the series `trail`, `failed`, `upright`, `level`.

A trail is one method at its settings, joined in the order given. What failed has no error: it stands
in a band above the panel, in a row that says how, at the cost at which it did. A row "not applicable"
lists names.
"""

import math

import matplotlib.pyplot as plt
from drawing_files import text_width
from matplotlib.lines import Line2D

# Inches: one and a half columns of a journal (130 mm), whose text is read at 400 pixels; panels stand one below the
# other, for their points are many.
PAGE_WIDTH, PANEL_HEIGHT, LEFT, RIGHT, TOP, BELOW_AXIS = 130 / 25.4, 3.4, 1.1, 0.12, 0.32, 0.54
LEGEND_ROW, BAND_ROW, NOTE_ROW, COLUMNS = 0.185, 0.175, 0.165, 2
BAND_SIZE, NAME_SIZE, LIMIT_SIZE, LEGEND_SIZE, NOTE_SIZE = 8, 7.5, 8, 8.5, 7.5  # points
NAME_OF_LEVEL = 0.27  # of the width of a panel, and of its height above the line
ABOVE_LEVEL = 0.055
NOTE = "errors computed against the reference of the problem; "

# One look per method in every chart. Colours after Okabe and Ito, and two greys.
BLUE, RED, GREEN, PINK, ORANGE, SKY, BLACK, GREY = (
    "#0072B2", "#C75400", "#00805E", "#B0508A", "#9C6B00", "#3A86B8", "#222222", "#767676")
LOOKS = {
    "forward_euler": (RED, "v"), "semi_implicit_euler": (RED, "<"), "rk4": (RED, "D"),
    "backward_euler": (BLUE, "o"), "implicit_midpoint": (BLUE, "s"), "newmark": (BLUE, "P"),
    "tr_bdf2": (BLUE, "X"), "exponential": (GREEN, "o"),
    "xpbd": (PINK, "o"), "xpbd, 1 sweep": (PINK, "o"), "xpbd, 10 sweeps": (PINK, "s"),
    "xpbd, 100 sweeps": (PINK, "D"), "xpbd, 1000 sweeps": (PINK, "P"),
    "cvode_adams": (ORANGE, "^"), "cvode_bdf": (ORANGE, "s"), "ida": (ORANGE, "D"),
    "collocation": (BLACK, "*"), "closed_form": (BLACK, "x"),
    "inertial": (ORANGE, "o"), "inertial, order 2": (ORANGE, "o"), "inertial, order 5": (ORANGE, "P"),
    "condensed": (GREEN, "o"), "condensed, 4 kHz": (GREEN, "^"), "condensed, all positions": (PINK, "s"),
    "full_network": (BLUE, "o"), "full_network, 4 kHz": (BLUE, "^"),
    "MuJoCo, Euler": (GREY, "v"), "MuJoCo, RK4": (GREY, "D"), "MuJoCo, implicit": (GREY, "s"),
    "Bullet, 1 iteration": (BLACK, "h"), "Bullet, 4 iterations": (BLACK, "p"),
}
SPARE = [(colour, marker) for marker in "hp8d>" for colour in (GREY, GREEN, SKY, PINK, BLACK)]


def curves(figure):
    """Labels in order of appearance with their looks."""
    found, spare = {}, iter(SPARE)
    for series in (s for panel in figure["panels"] for s in panel["series"] if s["kind"] in ("trail", "failed")):
        if series["label"] not in found:
            found[series["label"]] = LOOKS[series["label"]] if series["label"] in LOOKS else next(spare)
    return found


def marker_style(look):
    colour, marker = look
    size = {"*": 9, "x": 6, "D": 4.6}.get(marker, 5.5)
    return dict(marker=marker, markersize=size, markeredgecolor=colour, markerfacecolor=colour if marker == "x" else colour + "B0", markeredgewidth=1.2 if marker == "x" else 0.6)


def draw_trail(axes, series, look):
    if not series["x"]:
        return
    spread = None
    if "lower" in series:
        spread = [[max(x - low, 0) for x, low in zip(series["x"], series["lower"])],
                  [max(high - x, 0) for x, high in zip(series["x"], series["upper"])]]
    axes.errorbar(series["x"], series["y"], xerr=spread, color=look[0], linewidth=0.9, elinewidth=0.8, capsize=1.5, zorder=4, **marker_style(look))


def draw_upright(axes, series):
    for x in series["x"]:
        axes.axvline(x, color=BLACK, linewidth=1, linestyle=(0, (5, 2)), zorder=2)
        axes.annotate(series["text"], (x, 0.98), xycoords=("data", "axes fraction"), xytext=(-2, 0), textcoords="offset points",
                      rotation=90, ha="right", va="top", fontsize=LIMIT_SIZE, color=BLACK)


def freer_side(places, height):
    """Where the name of a level hides fewer of the points (shares of the panel): at its left end or at its right."""
    near = [x for x, y in places if height - 0.01 <= y <= height + ABOVE_LEVEL]
    left, right = sum(x <= NAME_OF_LEVEL for x in near), sum(x >= 1 - NAME_OF_LEVEL for x in near)
    return "right" if right < left else "left"


def draw_level(axes, series, points):
    """@param points  of all trails, once the limits of the axes are set."""
    to_share = axes.transAxes.inverted()
    places = to_share.transform(axes.transData.transform(points)) if points else []
    for y in series["y"]:
        side = freer_side(places, to_share.transform(axes.transData.transform((axes.get_xlim()[0], y)))[1])
        axes.axhline(y, color=GREY, linewidth=0.9, linestyle=":", zorder=1)
        axes.annotate(series["text"], (0.01 if side == "left" else 0.99, y), xycoords=("axes fraction", "data"), xytext=(0, 2), textcoords="offset points",
                      ha=side, va="bottom", fontsize=LIMIT_SIZE, color="#595959", zorder=2.5,
                      bbox=dict(facecolor="white", edgecolor="none", alpha=0.7, pad=0.6))


def failure_rows(figure):
    """How something failed, over all panels, so that their bands are equally high."""
    rows = []
    for series in (s for panel in figure["panels"] for s in panel["series"] if s["kind"] == "failed"):
        if series["text"] not in rows:
            rows.append(series["text"])
    return rows


def fitting_names(names, width):
    """As many names as go side by side into `width` (inches), and how many are left out."""
    for count in range(len(names), 0, -1):
        text = ", ".join(names[:count]) + (f" and {len(names) - count} more" if count < len(names) else "")
        if text_width(text, NAME_SIZE) <= width:
            return text
    return f"{len(names)} methods"


def widest_gap(shares):
    """Between places on an axis (shares of its length): where it begins, and how long it is."""
    ends = [0.0, *sorted(shares), 1.0]
    return max(((low, high - low) for low, high in zip(ends, ends[1:])), key=lambda gap: gap[1])


def draw_band(band, panel, rows, look):
    band.set_ylim(-0.5, len(rows) - 0.5)
    band.set_yticks(range(len(rows)), rows, fontsize=BAND_SIZE)
    band.tick_params(axis="x", which="both", bottom=False, labelbottom=False)
    band.tick_params(axis="y", length=0)
    band.grid(False)
    band.set_facecolor("#F6EDED")
    for row, name in enumerate(rows):
        row_series = [s for s in panel["series"] if s["kind"] == "failed" and s["text"] == name]
        for series in row_series:
            band.plot(series["x"], [row] * len(series["x"]), linestyle="none", zorder=4, **marker_style(look[series["label"]]))
        unplaced = [s["label"] for s in row_series if not s["x"]]
        if unplaced:
            places = [x for series in row_series for x in series["x"]]
            low, high = (math.log(x) for x in band.get_xlim())
            start, length = widest_gap([(math.log(x) - low) / (high - low) for x in places])
            width = (length - 0.02) * band.get_position().width * band.figure.get_figwidth()
            band.text(start + 0.01, row, fitting_names(unplaced, width), transform=band.get_yaxis_transform(), fontsize=NAME_SIZE, va="center", color=BLACK)


def limits(panel):
    """Room for what is drawn and for the limits named; the same for the band above."""
    xs = [v for s in panel["series"] if s["kind"] != "level" for key in ("x", "lower", "upper") for v in s.get(key, []) if v > 0]
    ys = [v for s in panel["series"] if s["kind"] in ("trail", "level") for v in s.get("y", []) if v > 0]
    return (min(xs) / 1.6, max(xs) * 1.6), (min(ys) / 3, max(max(ys), 0.3) * 3)


def draw_panel(page, place, band_height, panel, look, rows, axis_label, title):
    left, bottom, width, height = place
    axes = page.add_axes([left, bottom, width, height])
    axes.set_xscale("log")
    axes.set_yscale("log")
    x_limits, y_limits = limits(panel)
    for series in panel["series"]:
        if series["kind"] == "trail":
            draw_trail(axes, series, look[series["label"]])
        elif series["kind"] == "upright":
            draw_upright(axes, series)
    axes.set_xlim(x_limits)
    axes.set_ylim(y_limits)
    points = [point for s in panel["series"] if s["kind"] == "trail" for point in zip(s.get("x", []), s.get("y", []))]
    for series in (s for s in panel["series"] if s["kind"] == "level"):
        draw_level(axes, series, points)
    axes.set_xlabel(axis_label(panel["x"]))
    axes.set_ylabel(axis_label(panel["y"]))
    top = axes
    if rows:
        band = page.add_axes([left, bottom + height + 0.01, width, band_height])
        band.set_xscale("log")
        band.set_xlim(x_limits)
        draw_band(band, panel, rows, look)
        top = band
    top.set_title(title, loc="left")


def note_of(panels):
    """Where the numbers come from."""
    timed = any(panel["x"]["quantity"].startswith("wall time") for panel in panels)
    return NOTE + ("wall times measured on one machine" if timed else "work counted")


def draw_figure(figure, axis_label, title_of):
    panels, look, rows = figure["panels"], curves(figure), failure_rows(figure)
    legend_rows = -(-len(look) // COLUMNS)
    below = BELOW_AXIS + legend_rows * LEGEND_ROW + NOTE_ROW + 0.2  # the lowest panel
    band = len(rows) * BAND_ROW
    row_height = TOP + band + PANEL_HEIGHT + BELOW_AXIS
    height = len(panels) * row_height + below - BELOW_AXIS
    page = plt.figure(figsize=(PAGE_WIDTH, height))
    for i, panel in enumerate(panels):
        bottom = below + (len(panels) - 1 - i) * row_height
        place = [LEFT / PAGE_WIDTH, bottom / height, 1 - (LEFT + RIGHT) / PAGE_WIDTH, PANEL_HEIGHT / height]
        draw_panel(page, place, band / height, panel, look, rows, axis_label, title_of(i, len(panels), panel["title"]))
    handles = [Line2D([], [], color=style[0], linewidth=0.9, **marker_style(style)) for style in look.values()]
    page.legend(handles, list(look), loc="upper left", ncol=COLUMNS, frameon=False, borderaxespad=0, handlelength=2.0, labelspacing=0.4, fontsize=LEGEND_SIZE,
                columnspacing=1.2, bbox_to_anchor=(0.25 / PAGE_WIDTH, (below - BELOW_AXIS) / height))
    page.text(0.25 / PAGE_WIDTH, 0.08 / height, note_of(panels), fontsize=NOTE_SIZE, color="#555555", va="bottom")
    return page
