#!/usr/bin/env python3
"""Checks the rooms and flows of docs/architecture.md against the sources:

- every folder of src/tpm stands in one room, and a room includes only rooms above it in the table;
- every function of a flow is declared in its header, and the source named includes that header and calls it;
- every file of a folder opens the namespace that the page states for its room, and src/tpm/base/namespaces.hpp lets
  it see the namespaces that the page states;
- a source without a header of its name says in its first line which header declares what it defines;
  the folders whose functions CMake collects (formulations, shapes) have none;
- docs/library.md lists every public header, with a folder that includes it or one that another public header includes;
- docs/figures/rooms.svg is what scripts/draw_rooms.py draws of all that.

    python3 tests/programs/rooms.py ROOT
"""
import re
import sys
from pathlib import Path

root = Path(sys.argv[1]).resolve()
sys.path.insert(0, str(root / "scripts"))
import draw_rooms as rooms  # noqa: E402  (the place is an argument)


def faults_of_rooms(page):
    table = rooms.rooms_of(page)
    order = list(table)
    listed = [folder for folders in table.values() for folder in folders]
    folders = sorted(d.name for d in (root / "src/tpm").iterdir() if d.is_dir())
    for folder in sorted(set(folders) ^ set(listed)):
        yield f"docs/architecture.md: folder {folder} is in src/tpm or in a room, not in both"
    for folder in sorted({f for f in listed if listed.count(f) > 1}):
        yield f"docs/architecture.md: folder {folder} is in two rooms"
    room_of = {folder: room for room, inside in table.items() for folder in inside}
    for here, there, file in rooms.includes(root):
        a, b = room_of.get(here), room_of.get(there)
        if a and b and order.index(b) > order.index(a):
            yield f"{file.relative_to(root)}: includes {there}, of the room {b}, from the room {a}"


def faults_of_namespaces(page):
    room_of = {folder: room for room, folders in rooms.rooms_of(page).items() for folder in folders}
    rows = rooms.rows_after(page, "| namespace |")
    space_of = {room: row[0].strip("`") for row in rows for room in row[1].split(", ")}
    for room in sorted(set(room_of.values()) - set(space_of)):
        yield f"docs/architecture.md: the room {room} has no namespace"
    directives = (root / "src/tpm/base/namespaces.hpp").read_text(encoding="utf-8")
    for space, _, sees, *_ in rows:
        space = space.strip("`")
        opened = re.search(rf"^namespace {space} \{{(.*?)\}}", directives, re.M | re.S)
        given = re.findall(r"using namespace (\w+);", opened.group(1)) if opened else []
        if [f"`tpm::{name}`" for name in given] != ([s for s in sees.split(", ") if s]):
            yield f"src/tpm/base/namespaces.hpp: {space} sees {given}; docs/architecture.md says {sees or 'none'}"
    for file in sorted((root / "src/tpm").glob("*/*.[ch]pp")):
        space = "tpm::report" if file.parent.name == "report" else space_of.get(room_of.get(file.parent.name, ""))
        if space is None or file.parent.name == "library" or file.name == "namespaces.hpp":
            continue
        for opened in re.findall(r"^namespace (tpm[\w:]*) \{", file.read_text(encoding="utf-8"), re.M):
            if opened != space and opened != "tpm::sundials":
                yield f"{file.relative_to(root)}: opens {opened}; files of {file.parent.name} stand in {space}"


def faults_of_sources():
    for file in sorted((root / "src/tpm").glob("*/*.cpp")):
        public = root / "include/tpmkit" / file.with_suffix(".hpp").name
        if file.with_suffix(".hpp").exists() or public.exists() or file.parent.name in ("formulations", "shapes"):
            continue
        first = file.read_text(encoding="utf-8").split("\n", 1)[0]
        said = re.fullmatch(r"// Declared in ((tpm|tpmkit)/\S+\.hpp)\.", first)
        folder = "src" if said and said[2] == "tpm" else "include"
        if said is None:
            yield f"{file.relative_to(root)}:1: no header has its name; expected '// Declared in tpm/FOLDER/HEADER.hpp.'"
        elif not (root / folder / said[1]).exists():
            yield f"{file.relative_to(root)}:1: {said[1]} does not exist"


def faults_of_flows(page):
    flows = rooms.flows_of(page)
    if len(flows) != 3:
        yield f"docs/architecture.md: {len(flows)} flows; expected 3"
    for flow, steps in flows.items():
        for function, header, source in steps:
            name = header if header.startswith("tpmkit/") else f"tpm/{header}"
            place = root / ("include" if header.startswith("tpmkit/") else "src") / name
            if not place.exists() or not re.search(rf"\b{function}\(", place.read_text(encoding="utf-8")):
                yield f"{flow}: {name} does not declare {function}()"
            caller = root / source
            text = caller.read_text(encoding="utf-8") if caller.exists() else ""
            if not re.search(rf"\b{function}\(", text):
                yield f"{flow}: {source} does not call {function}()"
            if name not in reached(caller):
                yield f"{flow}: {source} does not include {name}"


def reached(file, seen=None):
    """Names of the headers that a file includes, directly or not."""
    seen = set() if seen is None else seen
    for name in re.findall(r'#include "([\w/.]+)"', file.read_text(encoding="utf-8")) if file.exists() else []:
        if name in seen:
            continue
        seen.add(name)
        for place in (root / "src" / name, root / "include" / name, file.parent / name):
            if place.exists():
                reached(place, seen)
                break
    return seen


def faults_of_headers():
    listed = rooms.public_headers(root)
    there = {h.name for h in (root / "include/tpmkit").iterdir()}
    for name in sorted(there ^ set(listed)):
        yield f"docs/library.md: header {name} is in include/tpmkit or in the table, not in both"
    for name, folder in listed.items():
        place = root / folder if "/" in folder else root / "src/tpm" / folder
        files = [*sorted(place.glob("*.[ch]pp")), *sorted((root / "include/tpmkit").glob("*.hpp"))]
        if not place.is_dir() or not any(f'"tpmkit/{name}"' in f.read_text(encoding="utf-8") for f in files):
            yield f"docs/library.md: nothing in {folder} includes {name}"


def main():
    page = (root / "docs/architecture.md").read_text(encoding="utf-8")
    faults = [*faults_of_rooms(page), *faults_of_namespaces(page), *faults_of_sources(), *faults_of_flows(page),
              *faults_of_headers()]
    drawn = root / "docs/figures/rooms.svg"
    if not faults and (not drawn.exists() or drawn.read_text(encoding="utf-8") != rooms.drawing(root)):
        faults.append("docs/figures/rooms.svg: not what is drawn now; python3 scripts/draw_rooms.py > docs/figures/rooms.svg")
    for fault in faults:
        print(fault)
    print(f"{len(faults)} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
