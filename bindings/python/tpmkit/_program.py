"""The program `tpm` in another process, for what it does with whole folders and pages."""

from __future__ import annotations

import functools
import json
import shutil
import subprocess
from pathlib import Path
from typing import Any, Sequence

from . import _core
from ._kinds import USAGE


def found() -> str | None:
    """The program that belongs to this package: the wheel's, that of the build, or the installed one."""
    here = Path(__file__).resolve().parent
    for own in (here / "bin" / "tpm", here.parents[1] / "tpm"):
        if own.is_file():
            return str(own)
    # Not the script of this name that a wheel puts on the path: that is tpmkit.__main__.
    return shutil.which("tpm", path="/usr/bin:/usr/local/bin")


@functools.lru_cache(maxsize=None)
def _program() -> str:
    program = found()
    if program is None:
        raise _error("tpmkit: the program tpm is not installed; expected the wheel, or the Debian package tpmkit", 5)
    version = subprocess.run([program, "version"], capture_output=True, text=True, check=False).stdout.split()
    if _core.__version__ not in version:
        raise _error(f"{program}: is version {' '.join(version)}; expected {_core.__version__}, as this package", 5)
    return program


def _error(text: str, code: int) -> _core.Error:
    error = (_core.ArgumentError if code == USAGE else _core.Error)(text)
    error.code = code
    return error


def run(words: Sequence[str], answers: Sequence[int] = (0,)) -> str:
    """What the program prints. Its error is raised as tpmkit.Error, with its exit code."""
    made = subprocess.run([_program(), *words], capture_output=True, text=True, check=False)
    if made.returncode in answers:
        return made.stdout
    said = [line for line in made.stderr.splitlines() if line]
    if not said:
        raise _error(f"tpm {words[0]}: ended with {made.returncode}", made.returncode)
    raise _error(_core.with_arguments_for_options(said[-1].removeprefix("tpm: ")), made.returncode)


def answer(words: Sequence[str], answers: Sequence[int] = (0,)) -> dict[str, Any]:
    """The JSON that the program prints."""
    return json.loads(run([*words, "--format", "json"], answers))
