#!/usr/bin/env python3
"""Draws the rooms of the library, the includes between them and the three flows of docs/architecture.md, as SVG.

    python3 scripts/draw_rooms.py > docs/figures/rooms.svg

Everything comes from the tables of the page and from the includes; tests/programs/rooms.py checks both.
"""
import re
import sys
from html import escape
from pathlib import Path

# At a width of 400 pixels the smallest text is 8 pixels high. The folders of a room stand in the page's table.
WIDTH, BOX_WIDTH, BOX_HEIGHT, GAP, TOP = 540, 110, 30, 18, 48
LEFT, FIRST_FLOW, FLOW_GAP = 105, 265, 104
COLOURS = ("#b3541e", "#1f6f8b", "#5b7f2b")


def rows_after(text: str, heading: str) -> list:
    """Cells of the first table whose heading line begins so."""
    lines = text.split("\n")
    start = next(i for i, line in enumerate(lines) if line.startswith(heading))
    rows = []
    for line in lines[start + 2:]:
        if not line.startswith("|"):
            break
        rows.append([cell.strip() for cell in line.strip("|").split("|")])
    return rows


def rooms_of(page: str) -> dict:
    """The folders of each room, in order."""
    return {row[0]: row[1].split(", ") for row in rows_after(page, "| room |")}


def needs_of(root: Path) -> dict:
    """The rooms that each room needs, from tpm_room() in CMakeLists.txt."""
    text = (root / "CMakeLists.txt").read_text(encoding="utf-8")
    called = re.findall(r"^tpm_room\((\w+)(?: NEEDS ([a-z ]+?))?(?: LINKS .*)?\)$", text, re.M)
    return {room: needs.split() for room, needs in called}


def flows_of(page: str) -> dict:
    """Of each flow its steps: function, header, source that calls it."""
    flows: dict = {}
    name = ""
    for row in rows_after(page, "| flow |"):
        name = row[0] or name
        flows.setdefault(name, []).append((row[1].strip("`"), row[2], row[3]))
    return flows


def public_headers(root: Path) -> dict:
    """The room of src/tpm that implements each public header, from docs/library.md."""
    rows = rows_after((root / "docs/library.md").read_text(encoding="utf-8"), "| header |")
    return {row[0].strip("`"): row[3] for row in rows}


def files(root: Path):
    """Every header and source of the library."""
    return sorted((root / "src/tpm").rglob("*.[ch]pp"))


def folder_of(file: Path) -> str:
    """Of a file below src/tpm, such as law/bond."""
    parts = file.parent.parts
    return "/".join(parts[parts.index("tpm", parts.index("src")) + 1:])


def includes(root: Path):
    """Pairs of folders, the one that includes first, with the file; a public header counts as its room's own folder only
    between rooms."""
    public = public_headers(root)
    for file in files(root):
        here = folder_of(file)
        for place, name in re.findall(r'#include "(tpm|tpmkit)/([\w/.]+)"', file.read_text(encoding="utf-8")):
            there = name.rpartition("/")[0] if place == "tpm" else public.get(name)
            if not there or there == here or place == "tpmkit" and there == here.split("/")[0]:
                continue
            yield here, there, file


def arrows(root: Path) -> list:
    pairs = ((a.split("/")[0], b.split("/")[0]) for a, b, _ in includes(root))
    return sorted({(a, b) for a, b in pairs if a != b})


def floors(pairs: list) -> int:
    """How many rooms stand on one another, the longest way down."""
    def height(room, seen=()):
        return 1 + max((height(b, (*seen, room)) for a, b in pairs if a == room and b not in seen), default=0)

    return max(height(room) for room in {a for a, _ in pairs})


def nearest(pairs: list) -> list:
    """Arrows that no chain of others says already."""
    direct = set(pairs)

    def reaches(a, b, without):
        todo, seen = [a], set()
        while todo:
            at = todo.pop()
            for x, y in direct:
                if x == at and (x, y) != without and y not in seen:
                    if y == b:
                        return True
                    seen.add(y)
                    todo.append(y)
        return False

    return [(a, b) for a, b in pairs if not reaches(a, b, (a, b))]


def drawing(root: Path) -> str:
    page = (root / "docs/architecture.md").read_text(encoding="utf-8")
    rooms = rooms_of(page)
    names = list(reversed(rooms))  # the ground at the bottom
    y_of = {name: TOP + i * (BOX_HEIGHT + GAP) for i, name in enumerate(names)}
    height = TOP + len(names) * (BOX_HEIGHT + GAP) + 30
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" font-family="sans-serif" font-size="14">',
           f'<rect width="{WIDTH}" height="{height}" fill="white"/>',
           '<defs><marker id="tip" markerWidth="8" markerHeight="8" refX="7" refY="4" orient="auto">'
           '<path d="M0,0 L8,4 L0,8 z" fill="#888"/></marker></defs>']
    # Includes: a curve at the left of the boxes, further out the further it reaches.
    for i, (a, b) in enumerate(nearest(arrows(root))):
        span = names.index(b) - names.index(a)
        start, end = y_of[a] + BOX_HEIGHT - 8, y_of[b] + 8 + 3 * (i % 4)
        if span == 1:
            x = LEFT + BOX_WIDTH / 2
            out.append(f'<path d="M{x},{y_of[a] + BOX_HEIGHT} L{x},{y_of[b] - 1}" fill="none" stroke="#888" '
                       'marker-end="url(#tip)"/>')
            continue
        out_by = 26 * span
        out.append(f'<path d="M{LEFT},{start} C{LEFT - out_by},{start} {LEFT - out_by},{end} {LEFT - 1},{end}" '
                   'fill="none" stroke="#888" marker-end="url(#tip)"/>')
    for name in names:
        y = y_of[name]
        out.append(f'<rect x="{LEFT}" y="{y}" width="{BOX_WIDTH}" height="{BOX_HEIGHT}" rx="6" fill="#f3f1ec" stroke="#555"/>')
        out.append(f'<text x="{LEFT + BOX_WIDTH / 2:g}" y="{y + 20}" text-anchor="middle">{escape(name)}</text>')
    # Flows: a line at the right through the rooms of its steps.
    for i, (flow, steps) in enumerate(flows_of(page).items()):
        x = FIRST_FLOW + FLOW_GAP * i
        headers = public_headers(root)
        at = [headers[h.split("/")[1]] if h.startswith("tpmkit/") else h.split("/")[0] for _, h, _ in steps]
        visited = [at[0]] + [b for a, b in zip(at, at[1:]) if a != b]
        colour = COLOURS[i]
        path, drop = [], {}
        for k, room in enumerate(visited):
            drop[room] = drop.get(room, 0) + 1
            path.append((x + 21 * (drop[room] - 1), y_of[room] + BOX_HEIGHT / 2))
        out.append(f'<polyline points="{" ".join(f"{px:g},{py:g}" for px, py in path)}" fill="none" stroke="{colour}" '
                   'stroke-width="2.5"/>')
        for k, (px, py) in enumerate(path):
            out.append(f'<circle cx="{px:g}" cy="{py:g}" r="10" fill="{colour}"/>')
            out.append(f'<text x="{px:g}" y="{py + 4:g}" fill="white" font-size="12" text-anchor="middle">{k + 1}</text>')
        start, _, end = flow.partition(" to ")
        for row, words in enumerate((start, f"to {end}")):
            out.append(f'<text x="{x}" y="{18 + 17 * row}" fill="{colour}" text-anchor="middle">{escape(words)}</text>')
    for row, words in enumerate(("arrows: a room includes another (what a chain of others implies is left out)",
                                 "numbers: the rooms that a flow passes, in order")):
        out.append(f'<text x="12" y="{height - 24 + 16 * row}" fill="#555" font-size="12">{words}</text>')
    out.append("</svg>")
    return "\n".join(out) + "\n"


if __name__ == "__main__":
    sys.stdout.write(drawing(Path(__file__).resolve().parent.parent))
