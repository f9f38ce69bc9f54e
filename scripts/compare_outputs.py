#!/usr/bin/env python3
"""Runs the commands of two programs on equal inputs and compares all that they write.

    compare_outputs.py A B [--configs FOLDER] [--keep FOLDER] [--only WORD] [--details FILE]

A and B are tpm executables; each reads configs/ of the source folder above it. Numbers agree to six significant digits,
in a list to six digits of its largest; two errors or residuals below 1e-9 agree. Keys, columns and datasets of other
names whose values agree are listed as OLD -> NEW. Times, machine, version, commits and pictures are left out.
"""

import argparse
import csv
import difflib
import io
import json
import math
import re
import shlex
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import h5py
import numpy
from command_help import commands
from fault_table import EXPERIMENTS, INDENTED, LAW, SESSION, recording

DIGITS, ZERO = 1e-6 / 2, 1e-9
RESIDUAL = re.compile(r"error|agreement|difference|missing|residual", re.IGNORECASE)
IDENTITY = ("law", "name", "id")
LEFT_OUT = re.compile(r"(^|[_/ ])(wall|version|commit|machine|host|cpu|processors?|compiler|created|written|busy|woke|"
                      r"latency|jitter|took|clock|seconds|calibrated|timings?)([_/ ]|$)|^cost_s|_ns$", re.IGNORECASE)
LINES_LEFT_OUT = re.compile(r"\b(version|commit|took|computed in|computing time|wall)\b|^tpm \d|%E2%", re.IGNORECASE)
NUMBER = re.compile(r"(?<![\w.])[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
FILES_LEFT_OUT = (".png", ".run.json", ".checkpoint", ".blocks", ".pdf", ".svg", ".tpmrec")  # .tpmrec: by hil export

RUNS = [[shlex.split(words) for words in line.split(" => ")] for line in Path(__file__).with_suffix(".txt").read_text(encoding="utf-8").splitlines()
        if not line.startswith("#")]
INPUTS = {"liver.json": INDENTED, "session.json": SESSION, "experiments.json": EXPERIMENTS, "law.json": LAW}

class Program:
    def __init__(self, path, folder, configs):
        self.path, self.folder = Path(path).resolve(), folder
        self.source = next(p for p in self.path.parents if (p / "configs").is_dir() and (p / "data").is_dir())
        self.configs = Path(configs).resolve() if configs else self.source / "configs"
        self.helps = {" ".join(c.words): c for c in commands(str(self.path))}
        (folder / "in").mkdir(parents=True)
        for name, content in INPUTS.items():
            (folder / "in" / name).write_text(json.dumps(content))
        for name in ("a.csv", "b.csv"):
            (folder / "in" / name).write_text(recording())

    def choice(self, run):
        """The first of the command lines of a run that the program knows; None if it knows none."""
        def knows(words):
            command = self.command(words)
            named = {w.split("=")[0] for w in words if re.match(r"--?[A-Za-z]", w)}
            return command is not None and named <= set(self.helps[command].options)
        return next((words for words in run if knows(words)), None)

    def command(self, words):
        """The command that the words call; None if the program has none."""
        names = (" ".join(words[:2]), words[0])
        return next((n for n in names if n in self.helps and " SUBCOMMAND" not in self.helps[n].usage), None)

    def run(self, words):
        """Exit code, and what the run wrote: {file name: comparable content}."""
        options = self.helps[self.command(words)].options
        words = [w.lstrip("?") for w in words if not w.startswith("?") or w[1:] in options]
        words = [w.replace("CONFIGS", str(self.configs)) for w in words]
        before = {f: f.stat().st_mtime_ns for f in self.folder.rglob("*") if f.is_file()}
        try:
            done = subprocess.run([self.path, *words], cwd=self.folder, capture_output=True, timeout=300, check=False)
        except subprocess.TimeoutExpired:
            return "no end", {}
        written = {"stdout": self.read(done.stdout), "stderr": self.read(done.stderr) if done.returncode else ""}
        for file in sorted(f for f in self.folder.rglob("*") if f.is_file() and before.get(f) != f.stat().st_mtime_ns):
            if not any(end in file.name for end in FILES_LEFT_OUT):
                name = str(file.relative_to(self.folder))
                is_hdf5 = h5py.is_hdf5(file)
                written[name] = hdf5(file) if is_hdf5 else self.read(file.read_bytes(), file.suffix)
        return done.returncode, written

    def read(self, data, suffix=""):
        text = data.decode(errors="replace")
        for place, name in ((self.configs, "CONFIGS"), (self.source, "SOURCE"), (self.path, "tpm")):
            text = text.replace(str(place), name)
        try:
            return json.loads(text)
        except ValueError:
            pass
        if suffix == ".csv":
            rows = list(csv.reader(line for line in io.StringIO(text) if not line.startswith("#")))
            if rows and all(len(row) == len(rows[0]) for row in rows):
                return {f"{name}": [value(row[i]) for row in rows[1:]] for i, name in enumerate(rows[0])}
        return text


def value(cell):
    return float(cell) if NUMBER.fullmatch(cell) else cell


def hdf5(path):
    found = {}
    with h5py.File(path) as file:
        def add(name, item):
            for key, content in item.attrs.items():
                found[f"{name}@{key}"] = plain(content)
            if isinstance(item, h5py.Dataset):
                found[name] = plain(item[()])
        add("", file)
        file.visititems(add)
    return found


def plain(content):
    if isinstance(content, bytes):
        text = content.decode(errors="replace")
        return json.loads(text) if text.startswith("{") else text
    array = numpy.asarray(content)
    if array.dtype.names:
        return {name: plain(array[name]) for name in array.dtype.names}
    if array.dtype.kind in "OS":
        return [c.decode() if isinstance(c, bytes) else str(c) for c in array.ravel()]
    return array if array.ndim and array.dtype.kind in "fiu" else array.tolist()


def near(a, b, floor=0.0):
    if isinstance(a, bool) or isinstance(b, bool) or math.isnan(a) or math.isnan(b):
        return a == b or (a != a and b != b)
    return a == b or abs(a - b) <= max(DIGITS * max(abs(a), abs(b)), floor)


def is_number(x):
    return isinstance(x, (int, float)) and not isinstance(x, bool)


def identity(a, b):
    """The key by whose values the entries of both lists are told apart."""
    def tells(key, entries):
        names = [e.get(key) if isinstance(e, dict) else None for e in entries]
        return len(names) > 1 and all(isinstance(n, str) for n in names) and len(set(names)) == len(names)
    return next((key for key in IDENTITY if tells(key, a) and tells(key, b)), None)


class Comparison:
    def __init__(self):
        self.numbers, self.words, self.renamed, self.missing, self.added = [], [], [], [], []

    def compare(self, a, b, where):
        if isinstance(a, dict) and isinstance(b, dict):
            self.keys(a, b, where)
        elif isinstance(a, numpy.ndarray) or isinstance(b, numpy.ndarray):
            self.arrays(numpy.asarray(a), numpy.asarray(b), where)
        elif isinstance(a, list) and isinstance(b, list) and (key := identity(a, b)):
            if [x[key] for x in a] != [y[key] for y in b]:
                self.words.append(f"{where}: order or number of entries, {len(a)} and {len(b)}")
            self.keys({x[key]: x for x in a}, {y[key]: y for y in b}, where)
        elif isinstance(a, list) and isinstance(b, list):
            if len(a) != len(b):
                self.numbers.append(f"{where}: {len(a)} and {len(b)} entries")
            floor = DIGITS * max((abs(x) for x in a if is_number(x) and math.isfinite(x)), default=0.0)
            for i, (x, y) in enumerate(zip(a, b)):
                if not (is_number(x) and is_number(y) and near(x, y, floor)):
                    self.compare(x, y, f"{where}[{i}]")
        elif isinstance(a, str) and isinstance(b, str):
            self.text(a, b, where)
        elif is_number(a) and is_number(b):
            residual = RESIDUAL.search(where) and max(abs(a), abs(b)) < ZERO
            if not residual and not near(a, b):
                self.numbers.append(f"{where}: {a:.6g} and {b:.6g}")
        elif type(a) is not type(b) or a != b:
            self.numbers.append(f"{where}: {a!r:.60} and {b!r:.60}")

    def arrays(self, a, b, where):
        numeric = a.dtype.kind in "fiu" and b.dtype.kind in "fiu"
        if not numeric or a.shape != b.shape:
            if not numeric or a.size or b.size:
                self.numbers.append(f"{where}: arrays of {a.shape} and {b.shape}")
            return
        largest, apart = (numpy.nanmax(numpy.append(numpy.abs(x), 0.0)) for x in (a, a - b.astype(float)))
        if not numpy.allclose(a, b, DIGITS, DIGITS * largest, equal_nan=True):
            self.numbers.append(f"{where}: arrays of {a.shape}, largest difference {apart:.3g} of {largest:.3g}")

    def keys(self, a, b, where):
        gone = [k for k in a if k not in b and not LEFT_OUT.search(k)]
        new = [k for k in b if k not in a and not LEFT_OUT.search(k)]
        for old in gone:
            equal = {}
            for candidate in new:
                trial = Comparison()
                trial.compare(a[old], b[candidate], "")
                if not trial.numbers + trial.words + trial.missing + trial.added:
                    equal[candidate] = trial.renamed
            if equal:
                best = max(equal, key=lambda name: difflib.SequenceMatcher(None, old, name).ratio())
                self.renamed += [f"{old} -> {best}", *equal[best]]
                new.remove(best)
            else:
                self.missing.append(f"{where}/{old}")
        self.added += [f"{where}/{k}" for k in new]
        for key in a:
            if key in b and not LEFT_OUT.search(key):
                self.compare(a[key], b[key], f"{where}/{key}")

    def text(self, a, b, where):
        a, b = ("\n".join(line for line in t.splitlines() if not LINES_LEFT_OUT.search(line)) for t in (a, b))
        x, y = NUMBER.findall(a), NUMBER.findall(b)
        if len(x) != len(y) or not all(near(float(p), float(q)) for p, q in zip(x, y)):
            self.numbers.append(f"{where}: " + first_lines(a, b))
        elif NUMBER.sub("#", a).split() != NUMBER.sub("#", b).split():
            self.words.append(f"{where}: " + first_lines(a, b))


def first_lines(a, b):
    for p, q in zip(a.splitlines() + [""], b.splitlines() + [""]):
        x, y = p.split(), q.split()
        if x != y:
            at = max(0, next((i for i, (m, n) in enumerate(zip(x, y)) if m != n), min(len(x), len(y))) - 4)
            return "'{:.80}' and '{:.80}'".format(" ".join(x[at:]), " ".join(y[at:]))
    return "more lines in one of them"


def verdict(comparison):
    if comparison.numbers or comparison.missing:
        return "differs"
    return "words" if comparison.words else "renamed" if comparison.renamed else "same"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("a")
    parser.add_argument("b")
    parser.add_argument("--configs", help="both programs read this folder in place of their own configs")
    parser.add_argument("--keep", help="keep what the programs wrote in this folder, which must not be there")
    parser.add_argument("--only", default="", help="only runs that contain this word")
    parser.add_argument("--details", help="write every difference into this file")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        place = Path(options.keep or scratch).resolve()
        programs = *(Program(p, place / n, options.configs) for p, n in ((options.a, "a"), (options.b, "b"))),
        rows, renamed, details = [], {}, []
        with ThreadPoolExecutor(2) as pool:
            for run in (run for run in RUNS if any(options.only in shlex.join(words) for words in run)):
                title = " => ".join(shlex.join(w.replace("CONFIGS/", "").lstrip("?") for w in words) for words in run)
                missing = [p for p in programs if p.choice(run) is None]
                if missing:
                    rows.append((title, "only in B" if missing[0] is programs[0] else "only in A", ""))
                    continue
                (code_a, a), (code_b, b) = pool.map(lambda p: p.run(p.choice(run)), programs)
                found = Comparison()
                if code_a != code_b:
                    said = [str(w.get("stderr", "")).strip().splitlines()[-1:] for w in (a, b)]
                    found.numbers.insert(0, f"exit code {code_a} and {code_b}: " + " ".join(sum(said, [])))
                else:
                    found.compare(a, b, "")
                for line in found.renamed:
                    renamed.setdefault(line, title)
                first = next(iter(found.numbers + [f"only in A: {m}" for m in found.missing] + found.words), "")
                more = f" (+ {len(found.added)} keys only in B)" if found.added else ""
                rows.append((title, verdict(found) + (f", exit code {code_a}" if code_a else "") + more, first))
                details += [title, *(f"  {kind}: {line}" for kind in ("numbers", "missing", "words", "renamed", "added")
                                     for line in dict.fromkeys(getattr(found, kind)))]
    print("| command | A and B | first difference |\n| --- | --- | --- |")
    for row in rows:
        print("| " + " | ".join(" ".join(c.replace("|", "\\|").split()) for c in row) + " |")
    print("\nRenamed:\n" + "\n".join(f"- {line} ({where})" for line, where in renamed.items()))
    never = [n for n, c in programs[1].helps.items() if n and " SUBCOMMAND" not in c.usage]
    never = sorted(set(never) - {programs[1].command(words) for run in RUNS for words in run})
    if never:
        print("\nNot run: " + ", ".join(never))
    if options.details:
        Path(options.details).write_text("\n".join(details) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
