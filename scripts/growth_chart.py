#!/usr/bin/env python3
"""Measures how the direct solvers grow with the number of spheres, and draws the chart of reports/networks.

    growth_chart.py measure RECORD --after PROGRAM [--before PROGRAM] [--cholmod PROGRAM] [--growth PROGRAM]
                    [--shell COUNT...] [--solid COUNT...] [--most-s S] [--most-GiB G]
    growth_chart.py draw RECORD FIGURE.svg

PROGRAM is measure_factorisation of this version and of an earlier one, tests/measure/peers/cholmod_factor, and
measure_growth for conjugate gradients with multigrid; scipy's solver is scripts/growth_scipy.py. Every case is a
process of its own. One that passes the limits of time or memory is named in the record, and larger ones of
its kind are left out. The record, a line of JSON a case, is kept: cases that it has are not run again. `draw`
also prints the tables in Markdown.
"""
import argparse
import json
import math
import pathlib
import resource
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent


def run(command, most_s, most_gib):
    """The JSON that a command prints, or why there is none."""
    def limit():
        resource.setrlimit(resource.RLIMIT_CPU, (int(most_s) + 1, int(most_s) + 2))
        size = int(most_gib * 2**30)
        resource.setrlimit(resource.RLIMIT_AS, (size, size))
    done = subprocess.run(command, capture_output=True, text=True, preexec_fn=limit)
    if done.returncode == 0 and done.stdout.strip():
        return done.stdout, None
    if done.returncode < 0 and -done.returncode in (9, 24):
        return None, f"more than {most_s:g} s"
    last = (done.stderr.strip().splitlines() or [f"exit {done.returncode}"])[-1]
    memory = "bad_alloc" in done.stderr or "MemoryError" in done.stderr or "memory" in last.lower()
    return None, f"more than {most_gib:g} GiB" if memory or done.returncode < 0 else last


def multigrid_case(text):
    """The last row of measure_growth's table."""
    words = text.strip().splitlines()[-1].split()
    # kind spheres solver x patch fill join solve peak Newton ...
    fill, join, solve, peak, newton = (float(w) for w in words[5:10])
    return {"spheres": int(words[1]), "fill_s": fill, "join_s": join, "factorise_s": solve / newton,
            "peak_GiB": peak}


def measure(options):
    record = pathlib.Path(options.record)
    known = [json.loads(line) for line in record.read_text().splitlines()] if record.exists() else []
    stopped = {(k["kind"], k["solver"]) for k in known if "stopped" in k}

    def add(kind, count, solver, command, parse=json.loads):
        if (kind, solver) in stopped or any(
                k["kind"] == kind and k["count"] == count and k["solver"] == solver for k in known):
            return
        text, why = run(command, options.most_s, options.most_GiB)
        case = {"kind": kind, "count": count, "solver": solver}
        case.update({"stopped": why} if why else {k: v for k, v in parse(text).items() if k != "kind"})
        if why:
            stopped.add((kind, solver))
        known.append(case)
        with record.open("a") as file:
            file.write(json.dumps(case) + "\n")
        print(json.dumps(case), flush=True)

    for kind, counts in (("shell", options.shell), ("solid", options.solid)):
        for count in counts:
            with tempfile.TemporaryDirectory() as folder:
                matrix = str(pathlib.Path(folder, "matrix"))
                add(kind, count, "tpm", [options.after, kind, str(count)])
                if options.before:
                    add(kind, count, "before", [options.before, kind, str(count)])
                peers = {}
                if options.cholmod:
                    peers["cholmod"] = [options.cholmod, matrix]
                    peers["supernodal"] = [options.cholmod, matrix, "supernodal"]
                peers["splu"] = [sys.executable, str(HERE / "growth_scipy.py"), matrix]
                wanted = [s for s in peers if (kind, s) not in stopped and not any(
                    k["kind"] == kind and k["count"] == count and k["solver"] == s for k in known)]
                if wanted and not (kind, "tpm") in stopped:
                    subprocess.run([options.after, kind, str(count), matrix], check=True, stdout=subprocess.DEVNULL)
                    for solver in wanted:
                        add(kind, count, solver, peers[solver])
    if options.growth:
        for kind, counts in (("shell", options.shell_multigrid), ("solid", options.solid_multigrid)):
            for count in counts:
                add(kind, count, "multigrid", [options.growth, kind, str(count), "multigrid"], multigrid_case)


NAMES = {"tpm": "tpm", "before": "tpm before", "cholmod": "CHOLMOD, simplicial",
         "supernodal": "CHOLMOD, supernodal", "splu": "scipy splu",
         "multigrid": "tpm, multigrid, a Newton step"}


def exponent(points):
    """Slope in logarithms, least squares."""
    if len(points) < 2:
        return None
    x = [math.log(p[0]) for p in points]
    y = [math.log(p[1]) for p in points]
    mean_x, mean_y = sum(x) / len(x), sum(y) / len(y)
    return sum((a - mean_x) * (b - mean_y) for a, b in zip(x, y)) / sum((a - mean_x) ** 2 for a in x)


def curve(cases, kind, solver, key, least=0):
    found = sorted((c["count"], c[key]) for c in cases
                   if c["kind"] == kind and c["solver"] == solver and key in c and c["count"] >= least)
    return [(n, v) for n, v in found if v > 0]


def number(value, digits=3):
    return "" if value is None else f"{float(f'{value:.{digits}g}'):g}"


def print_tables(cases):
    print("| filling | spheres | solver | fill, s | join, s | order, s | factorise, s | solve, s | 8 lanes, s | "
          "entries | operations | peak, GiB |")
    print("| --- " * 12 + "|")
    for c in sorted(cases, key=lambda c: (c["kind"], c["count"], list(NAMES).index(c["solver"]))):
        if "stopped" in c:
            print(f"| {c['kind']} | {c['count']:,} | {NAMES[c['solver']]} | stopped: {c['stopped']} |" + " |" * 8)
            continue
        keys = ["fill_s", "join_s", "order_s", "factorise_s", "solve_s", "lanes_s", "factor_entries", "operations",
                "peak_GiB"]
        print(f"| {c['kind']} | {c['count']:,} | {NAMES[c['solver']]} | "
              + " | ".join(number(c.get(k)) for k in keys) + " |")
    print("\n| exponent of spheres, from 1,700 on | " + " | ".join(NAMES.values()) + " |")
    print("| --- " * (len(NAMES) + 1) + "|")
    for kind in ("shell", "solid"):
        for key, words in (("factorise_s", "factorise"), ("solve_s", "solve"), ("factor_entries", "entries")):
            row = [number(exponent(curve(cases, kind, s, key, 1700))) for s in NAMES]
            print(f"| {kind}, {words} | " + " | ".join(row) + " |")


def draw(options):
    sys.path.insert(0, str(HERE))
    import draw_figures  # its style, and a backend without a screen
    from drawing_files import save_drawing
    import matplotlib.pyplot as plt
    cases = [json.loads(line) for line in pathlib.Path(options.record).read_text().splitlines()]
    print_tables(cases)
    plt.rcParams.update(draw_figures.STYLE)
    figure, axes = plt.subplots(2, 2, figsize=(draw_figures.PAGE_WIDTH, 6.2))
    rest = axes.flat[3]  # where the legend stands
    rest.axis("off")
    panels = [("shell", "factorise_s", "(a) shell: one factorisation", "processor time [s]"),
              ("solid", "factorise_s", "(b) solid: one factorisation", "processor time [s]"),
              ("shell", "factor_entries", "(c) shell: entries of the factor", "entries")]
    handles = {}
    for axis, (kind, key, title, label) in zip(axes.flat, panels):
        for colour, marker, solver in zip(draw_figures.MODEL_COLOURS, draw_figures.DATA_MARKERS, NAMES):
            points = curve(cases, kind, solver, key)
            if not points:
                continue
            handles[solver], = axis.loglog(*zip(*points), color=colour, marker=marker, markersize=4,
                                           linewidth=2.2 if solver == "tpm" else 1.3, label=NAMES[solver])
        axis.set_title(title, loc="left")
        axis.set_xlabel("spheres")
        axis.set_ylabel(label)
    rest.legend(handles.values(), [NAMES[s] for s in handles], loc="center", frameon=False)
    figure.subplots_adjust(left=0.1, right=0.98, top=0.95, bottom=0.08, wspace=0.3, hspace=0.34)
    save_drawing(figure, options.figure, metadata={"Date": None, "Creator": None})


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(required=True)
    m = commands.add_parser("measure")
    m.add_argument("record")
    m.add_argument("--after", required=True)
    for name in ("before", "cholmod", "growth"):
        m.add_argument(f"--{name}")
    m.add_argument("--shell", type=int, nargs="*", default=[424, 1700, 6800, 27200, 100000, 400000])
    m.add_argument("--solid", type=int, nargs="*", default=[424, 1700, 4000, 12000, 40000, 400000])
    m.add_argument("--shell-multigrid", type=int, nargs="*", default=[4000, 40000, 400000])
    m.add_argument("--solid-multigrid", type=int, nargs="*", default=[4000, 40000, 400000])
    m.add_argument("--most-s", type=float, default=1200.0)
    m.add_argument("--most-GiB", type=float, default=20.0)
    m.set_defaults(do=measure)
    d = commands.add_parser("draw")
    d.add_argument("record")
    d.add_argument("figure")
    d.set_defaults(do=draw)
    options = parser.parse_args()
    options.do(options)
    return 0


if __name__ == "__main__":
    sys.exit(main())
