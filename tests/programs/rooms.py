#!/usr/bin/env python3
"""Checks the rooms and flows of docs/architecture.md against the sources and the build:

- every folder of src/tpm stands in one room of the page, holds at most 25 sources, and includes only folders that stand
  before it: those of its room in the order of the page, and rooms that tpm_room() in CMakeLists.txt says it needs;
- a room needs only rooms that stand above it in the page's table, and each that it names is included;
- every file opens the namespace of its room; src/tpm/base/namespaces.hpp lets a room see the namespaces of those that it
  needs; a source in the namespace of a public header implements one;
- every function of a flow is declared in its header, and the source named includes that header and calls it;
- a source without a header of its name says in its first line which header declares what it defines; the folders whose
  functions CMake collects (formulations, shapes) have none;
- docs/library.md lists every public header, with a room that includes it or one that another public header includes;
- docs/figures/rooms.svg is what scripts/draw_rooms.py draws of all that.

It says how much it saw, and fails if that is less than the library has.

    python3 tests/programs/rooms.py ROOT
"""
import re
import sys
from pathlib import Path

root = Path(sys.argv[1]).resolve()
sys.path.insert(0, str(root / "scripts"))
import draw_rooms as rooms  # noqa: E402  (the place is an argument)

MOST_SOURCES = 25
FEWEST_FILES, FEWEST_INCLUDES = 850, 1500  # of src/tpm: a check that looks in the wrong place sees none
COLLECTED = ("formulations", "shapes")
LINKED_ONLY = {("accuracy", "haptics")}  # for shipped_formulations(), which a public header declares
PUBLIC_SPACES = ("tpm", "tpm::organ", "tpm::fit", "tpm::haptics")  # of include/tpmkit


def place(folder):
    """A folder of src/tpm as the page writes it: its room, and its name in there."""
    room, _, inner = folder.partition("/")
    return room, inner or "."


def faults_of_folders(page):
    table = rooms.rooms_of(page)
    there = sorted({rooms.folder_of(f) for f in rooms.files(root)})
    listed = {(room, inner) for room, folders in table.items() for inner in folders}
    for room, inner in sorted({place(f) for f in there} ^ listed):
        yield f"docs/architecture.md: folder {inner} of {room} is in src/tpm or in the table, not in both"
    for folder in there:
        count = len(list((root / "src/tpm" / folder).glob("*.cpp")))
        if count > MOST_SOURCES:
            yield f"src/tpm/{folder}: {count} sources; expected at most {MOST_SOURCES}"


def faults_of_includes(page):
    table, needs, used, seen = rooms.rooms_of(page), rooms.needs_of(root), set(), 0
    order = list(table)
    for room in sorted(set(order) ^ set(needs)):
        yield f"CMakeLists.txt: room {room} is in tpm_room() or in docs/architecture.md, not in both"
    for room, needed in needs.items():
        for other in needed:
            if order.index(other) >= order.index(room):
                yield f"CMakeLists.txt: {room} needs {other}, which stands below it in docs/architecture.md"
    for here, there, file in rooms.includes(root):
        seen += 1
        (room, inner), (other, folder) = place(here), place(there)
        name = file.relative_to(root)
        if room != other:
            used.add((room, other))
            if other not in needs.get(room, []):
                yield f"{name}: includes {other}, which {room} does not need (CMakeLists.txt)"
        elif inner in table[room] and folder in table[room] and table[room].index(folder) > table[room].index(inner):
            yield f"{name}: includes {there}, which stands behind {here} in docs/architecture.md"
    for room, needed in needs.items():
        for other in needed:
            if (room, other) not in used | LINKED_ONLY:
                yield f"CMakeLists.txt: {room} needs {other} and includes nothing of it"
    if seen < FEWEST_INCLUDES:
        yield f"only {seen} includes seen; expected {FEWEST_INCLUDES} or more"


def faults_of_namespaces():
    needs = rooms.needs_of(root)
    directives = (root / "src/tpm/base/namespaces.hpp").read_text(encoding="utf-8")
    for room, needed in needs.items():
        opened = re.search(rf"^namespace tpm::{room} \{{(.*?)\}}", directives, re.M | re.S)
        given = re.findall(r"using namespace (\w+);", opened.group(1)) if opened else []
        if given != needed:
            yield f"src/tpm/base/namespaces.hpp: {room} sees {given}; CMakeLists.txt says it needs {needed}"
    for header in sorted((root / "include/tpmkit").glob("*.hpp")):
        for space in re.findall(r"^namespace (tpm[\w:]*) \{", header.read_text(encoding="utf-8"), re.M):
            if space not in PUBLIC_SPACES:
                yield f"{header.relative_to(root)}: opens {space}; expected one of {', '.join(PUBLIC_SPACES)}"
    seen = 0
    for file in rooms.files(root):
        seen += 1
        room = rooms.folder_of(file).split("/")[0]
        text = file.read_text(encoding="utf-8")
        implements = file.suffix == ".cpp" and '#include "tpmkit/' in text
        for space in re.findall(r"^namespace (tpm[\w:]*) \{", text, re.M):
            if f"{space}::".startswith(f"tpm::{room}::") or file.name == "namespaces.hpp" or implements and space in PUBLIC_SPACES:
                continue
            yield f"{file.relative_to(root)}: opens {space}; files of {room} stand in tpm::{room}"
    if seen < FEWEST_FILES:
        yield f"only {seen} files of src/tpm seen; expected {FEWEST_FILES} or more"


def faults_of_sources():
    for file in rooms.files(root):
        public = root / "include/tpmkit" / file.with_suffix(".hpp").name
        if file.suffix != ".cpp" or file.with_suffix(".hpp").exists() or public.exists() or file.parent.name in COLLECTED:
            continue
        first = file.read_text(encoding="utf-8").split("\n", 1)[0]
        said = re.fullmatch(r"// Declared in ((tpm|tpmkit)/\S+\.hpp)\.", first)
        folder = "src" if said and said[2] == "tpm" else "include"
        if said is None:
            yield f"{file.relative_to(root)}:1: no header has its name; expected '// Declared in tpm/ROOM/HEADER.hpp.'"
        elif not (root / folder / said[1]).exists():
            yield f"{file.relative_to(root)}:1: {said[1]} does not exist"


def faults_of_flows(page):
    flows = rooms.flows_of(page)
    if len(flows) != 3:
        yield f"docs/architecture.md: {len(flows)} flows; expected 3"
    for flow, steps in flows.items():
        for function, header, source in steps:
            name = header if header.startswith("tpmkit/") else f"tpm/{header}"
            place_of = root / ("include" if header.startswith("tpmkit/") else "src") / name
            if not place_of.exists() or not re.search(rf"\b{function}\(", place_of.read_text(encoding="utf-8")):
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
        for there in (root / "src" / name, root / "include" / name, file.parent / name):
            if there.exists():
                reached(there, seen)
                break
    return seen


def faults_of_headers():
    listed = rooms.public_headers(root)
    there = {h.name for h in (root / "include/tpmkit").iterdir()}
    for name in sorted(there ^ set(listed)):
        yield f"docs/library.md: header {name} is in include/tpmkit or in the table, not in both"
    for name, room in listed.items():
        folder = root / room if "/" in room else root / "src/tpm" / room
        files = [*sorted(folder.rglob("*.[ch]pp")), *sorted((root / "include/tpmkit").glob("*.hpp"))]
        if not folder.is_dir() or not any(f'"tpmkit/{name}"' in f.read_text(encoding="utf-8") for f in files):
            yield f"docs/library.md: nothing in {room} includes {name}"


def main():
    page = (root / "docs/architecture.md").read_text(encoding="utf-8")
    faults = [*faults_of_folders(page), *faults_of_includes(page), *faults_of_namespaces(), *faults_of_sources(),
              *faults_of_flows(page), *faults_of_headers()]
    drawn = root / "docs/figures/rooms.svg"
    if not faults and (not drawn.exists() or drawn.read_text(encoding="utf-8") != rooms.drawing(root)):
        faults.append("docs/figures/rooms.svg: not what is drawn now; python3 scripts/draw_rooms.py > docs/figures/rooms.svg")
    sizes = [int(size) for size in re.findall(r'font-size="(\d+)"', rooms.drawing(root))]
    if min(sizes) / rooms.WIDTH * 400 < 8:
        faults.append(f"docs/figures/rooms.svg: text of {min(sizes)} is less than 8 pixels high where the picture is 400 wide")
    for fault in faults:
        print(fault)
    arrows = rooms.arrows(root)
    print(f"{len(list(rooms.files(root)))} files in {len(rooms.rooms_of(page))} rooms, {len(arrows)} arrows between them, "
          f"{rooms.floors(arrows)} floors; {len(faults)} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
