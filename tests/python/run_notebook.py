#!/usr/bin/env python3
"""Executes a notebook and fails where a cell does, draws nothing, or was committed with outputs.

    run_notebook.py NOTEBOOK [OUTPUT]
"""

import os
import sys
from pathlib import Path

import nbformat
from nbconvert.preprocessors import ExecutePreprocessor


def main():
    file = Path(sys.argv[1])
    notebook = nbformat.read(file, as_version=4)
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    if any(cell.outputs for cell in code):
        sys.exit(f"{file}: holds outputs; expected none: they are made anew")
    os.environ.pop("MPLBACKEND", None)  # a notebook draws into itself
    os.environ["PYDEVD_DISABLE_FILE_VALIDATION"] = "1"
    ExecutePreprocessor(timeout=600, kernel_name="python3").preprocess(notebook, {"metadata": {"path": "."}})
    figures = sum("image/png" in output.get("data", {}) for cell in code for output in cell.outputs)
    if figures == 0:
        sys.exit(f"{file}: draws no figure")
    if len(sys.argv) > 2:
        nbformat.write(notebook, sys.argv[2])
    print(f"{file.name}: {len(code)} cells, {figures} figures")


if __name__ == "__main__":
    main()
