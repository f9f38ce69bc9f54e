#!/usr/bin/env python3
"""The largest force of a ball with mass against the stiffness of its contacts, by two versions of the program.

    python3 scripts/contact_table.py OLD/build/release/tpm build/release/tpm -o out/contacts.md

The paper's liver, a ball of 2 mm radius and 10 g driven 8 mm deep at 200 mm/s, held 20 ms and taken off; last, the same
with sphere 71 driven itself, which has no contact. A number that grows with the stiffness is one of the contact, not of
the tissue.
"""
import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

STIFFNESSES_KN_PER_M = (1.5, 15, 150, 553, 1500, 15000, 150000)
KNOTS = [("0 s", "0 mm"), ("40 ms", "8 mm"), ("60 ms", "8 mm"), ("100 ms", "-8 mm"), ("200 ms", "-8 mm")]


def scene(contact: dict, knots: list) -> dict:
    return {"organ": {"kind": "liver"}, "anchors": [{"kind": "far_side"}], "contacts": [contact],
            "material": {"E1": "12 kPa", "E2": "12 kPa", "Eprime": "12 kPa", "eta1": "240 kPa s"},
            "protocol": {"kind": "knots", "knots": [{"time": t, "depth": d} for t, d in knots]},
            "formulation": {"kind": "inertial"}, "outputs": {"count": 41}}


def answer(program: str, contact: dict, knots: list) -> dict:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "s.json"
        file.write_text(json.dumps(scene(contact, knots)))
        done = subprocess.run([program, "simulate", file, "-o", f"{folder}/o.h5", "--format", "json"],
                              capture_output=True, text=True)
        if done.returncode:
            sys.exit(f"{program}: {done.stderr.strip()}")
        return json.loads(done.stdout)


def newton(number: float) -> str:
    return f"{number:.5g}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("old"), parser.add_argument("new")
    parser.add_argument("-o", "--output", required=True)
    parser.add_argument("--name-old", default="64250a5")
    choice = parser.parse_args()
    lines = ["# The largest force of a tool with mass against the stiffness of its contacts", "",
             f"{time.strftime('%Y-%m-%d')}, by", "",
             f"    python3 scripts/contact_table.py OLD/build/release/tpm build/release/tpm -o {choice.output}", "",
             f"OLD is {choice.name_old}. The paper's liver at E1 = E2 = E' = 12 kPa and a relaxation time of 10 s; a ball of 2 mm",
             "radius and 10 g, driven 8 mm deep at 200 mm/s, held 20 ms and taken off. \"Changes\": what the program says that contacts",
             "four times softer change, in parts of the largest force: of the largest force, the last one, or the curve in the mean",
             "over time, whichever is largest.", "",
             f"| contact stiffness, kN/m | {choice.name_old}: largest force, N | now: largest force, N | at, s | changes |",
             "| --- | --- | --- | --- | --- |"]
    for stiffness in STIFFNESSES_KN_PER_M:
        contact = {"kind": "ball", "radius": "2 mm", "mass_kg": 0.01, "stiffness": f"{stiffness} kN/m"}
        old, new = answer(choice.old, contact, KNOTS), answer(choice.new, contact, KNOTS)
        check = new["motion"]["contact_check"]
        warned = ", warned of" if check["depends_on_stiffness"] else ""
        lines.append(f"| {stiffness} | {newton(old['largest']['response'])} | {newton(new['largest']['response'])} | "
                     f"{new['largest']['time_s']:.4g} | {100 * check['difference']:.2g} %{warned} |")
    old, new = (answer(p, {"kind": "sphere"}, KNOTS[:3]) for p in (choice.old, choice.new))
    lines.append(f"| sphere 71 driven itself, in and held | {newton(old['largest']['response'])} | "
                 f"{newton(new['largest']['response'])} | {new['largest']['time_s']:.4g} | |")
    Path(choice.output).parent.mkdir(parents=True, exist_ok=True)
    Path(choice.output).write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
