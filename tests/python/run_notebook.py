#!/usr/bin/env python3
"""Executes a notebook and fails where a cell does, draws nothing, or answers otherwise than its stored outputs.

    run_notebook.py NOTEBOOK [OUTPUT]
    run_notebook.py --write NOTEBOOK

Stored are texts and pictures. Words have to be the same, numbers within a thousandth (or 2e-6), pictures as many and as
large. --write stores what the notebook answers now.
"""

import os
import re
import struct
import sys
import base64
from pathlib import Path

import nbformat
from nbconvert.preprocessors import ExecutePreprocessor

NUMBER = re.compile(r"(?<![A-Za-z_])[-+]?(?:\d+\.\d*|\.?\d+)(?:[eE][-+]?\d+)?")
RELATIVE, ABSOLUTE = 1e-3, 2e-6
FOLDER = re.compile(r"/tmp/tmp\w+")


def kept(output):
    """What is stored of an output: no markup, no folder of this run."""
    output = dict(output)
    if "text" in output:
        output["text"] = FOLDER.sub("FOLDER", output["text"])
    if "data" in output:
        output["data"] = {kind: value if kind == "image/png" else FOLDER.sub("FOLDER", value)
                          for kind, value in output["data"].items() if kind in ("text/plain", "image/png")}
        output["metadata"] = {}
    return nbformat.from_dict(output)


def words_and_numbers(text):
    """The words without blanks and lines, which move with numbers, and the numbers."""
    words = re.sub(r"[\s\\]+", "", NUMBER.sub("#", text))
    return words, [float(n) for n in NUMBER.findall(text)]


def size_of(picture):
    return struct.unpack(">II", base64.b64decode(picture)[16:24])


def difference(stored, found):
    """What is another in two outputs, or None."""
    if stored["output_type"] != found["output_type"]:
        return f"{found['output_type']} in place of {stored['output_type']}"
    pictures = [o.get("data", {}).get("image/png") for o in (stored, found)]
    if any(pictures):
        if not all(pictures) or size_of(pictures[0]) != size_of(pictures[1]):
            return "another picture, or none"
        return None
    texts = [o.get("text") or o.get("data", {}).get("text/plain", "") for o in (stored, found)]
    (words, numbers), (other_words, other_numbers) = map(words_and_numbers, texts)
    if words != other_words or len(numbers) != len(other_numbers):
        at = next((i for i, (a, b) in enumerate(zip(words, other_words)) if a != b), min(len(words), len(other_words)))
        return f"'{other_words[at - 20:at + 40]}' in place of '{words[at - 20:at + 40]}'"
    for a, b in zip(numbers, other_numbers):
        if abs(a - b) > max(ABSOLUTE, RELATIVE * max(abs(a), abs(b))):
            return f"{b} in place of {a}"
    return None


def main():
    write = sys.argv[1] == "--write"
    file = Path(sys.argv[2 if write else 1])
    stored = nbformat.read(file, as_version=4)
    notebook = nbformat.read(file, as_version=4)
    os.environ.pop("MPLBACKEND", None)  # a notebook draws into itself
    os.environ["PYDEVD_DISABLE_FILE_VALIDATION"] = "1"
    ExecutePreprocessor(timeout=600, kernel_name="python3").preprocess(notebook, {"metadata": {"path": "."}})
    cells = [(s, f) for s, f in zip(stored.cells, notebook.cells) if f.cell_type == "code"]
    figures, faults = 0, []
    for number, (before, now) in enumerate(cells, 1):
        outputs = [kept(o) for o in now.outputs]
        figures += sum("image/png" in o.get("data", {}) for o in outputs)
        if write:
            before.outputs, before.execution_count = outputs, number
            continue
        if len(before.outputs) != len(outputs):
            faults.append(f"cell {number}: {len(outputs)} outputs, stored are {len(before.outputs)}")
        faults += [f"cell {number}: {said}" for s, f in zip(before.outputs, outputs) if (said := difference(s, f))]
    if figures == 0:
        faults.append("draws no figure")
    if write:
        nbformat.write(stored, file)
    elif len(sys.argv) > 2:
        nbformat.write(notebook, sys.argv[2])
    for fault in faults:
        print(f"{file.name}: {fault}")
    print(f"{file.name}: {len(cells)} cells, {figures} figures, {len(faults)} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
