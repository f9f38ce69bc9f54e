"""Judgements: a law against recordings that it has not seen, designs of experiments, pages to look at.

These are done by the program `tpm` in another process.
"""

from __future__ import annotations

import numbers
import os
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _core, _program
from ._fit import Fit, PathLike
from ._kinds import json_text, shown, told
from ._law import Law
from ._tables import TABLE, csv_of, is_table, options_of, reading_of, renamed, same_error

if TYPE_CHECKING:
    import pandas as pd


class Validation:
    """A comparison with recordings, in the words of ASME V&V 20. Made by `tpmkit.validate`."""

    def __init__(self, document: dict[str, Any]) -> None:
        self._document = document

    @property
    def verdict(self) -> str:
        """Of all quantities together: "adequate", "not_adequate" or "undetermined" for a requirement; without one "seen"
        (a model error) or "not_seen"; "calibration_residual" for data that the law was fitted to, which validate
        nothing; "no_requirement" where none is in its unit."""
        return self._document["verdict"]

    @property
    def summary(self) -> str:
        """The conclusion, with its conditions."""
        words = self._document["summary"]
        return words if isinstance(words, str) else " ".join(words)

    @property
    def adequacy(self) -> dict[str, Any]:
        """`verdict` and `summary`, as other results have them."""
        return {"verdict": self.verdict, "summary": self.summary}

    @property
    def warnings(self) -> list[str]:
        """What a reader must know."""
        return [remark["text"] for remark in self.remarks]

    @property
    def remarks(self) -> list[dict[str, str]]:
        """What a reader must know: `code`, which stays the same, and `text`."""
        return self._document["remarks"]

    @property
    def quantities(self) -> pd.DataFrame:
        """One row per recording and quantity of interest: recording and the keys of `tpm validate --format json`, SI."""
        import pandas as pd

        rows = [{"recording": r["recording"], **q} for r in self._document["recordings"] for q in r["quantities"]]
        return pd.DataFrame(rows)

    def to_dict(self) -> dict[str, Any]:
        """Everything, as `tpm validate --format json` writes it."""
        return self._document

    def __repr__(self) -> str:
        return "\n".join([f"<tpmkit.Validation {self.verdict}: {self.summary}", *(f"  warning: {w}" for w in self.warnings)]) + ">"


@told
def validate(
    law: PathLike | Law | Fit,
    recordings: PathLike | Sequence[PathLike] | pd.DataFrame,
    *,
    require: str | float | None = None,
    placement: str | None = None,
    instrument: PathLike | None = None,
    new_specimen: bool = False,
    columns: Mapping[str, Any] | None = None,
) -> Validation:
    """Compares a law, or the organ that it was put on, with recordings that it has not seen (`tpm validate`).

    Parameters
    ----------
    law
        A Fit or a Law; law.json as `tpm fit` or `Fit.save` writes it; the scene or material.json of `tpm material`.
    recordings
        One or several files, or a DataFrame as for `tpmkit.fit`. Of one that the law was fitted to the verdict is "calibration_residual".
    require
        How large the error of the model may be: "10%" or 0.1 of the measured value, "20 mN", or "jnd". None: no verdict.
    new_specimen
        The recordings are of new specimens: the spread between the recordings that the law was fitted to, each of
        another specimen, adds to the uncertainty. Needs a law of two recordings or more, and these beside it.
    placement, instrument, columns
        As the options of `tpm validate`; `columns` as for `tpmkit.fit`.

    Raises
    ------
    tpmkit.Error
        What the program refuses, in its words.
    """
    if isinstance(require, numbers.Real) and not isinstance(require, numbers.Integral):
        require = f"{100.0 * float(require):.12g}%"
    if require is not None and not isinstance(require, str):
        raise _core.ArgumentError(f'validate: require is {require!r:.60}; expected "10%", 0.1, "20 mN" or "jnd"')
    reading = reading_of("validate", columns)
    options = options_of(reading)
    for option, value in (("--require", require), ("--placement", placement), ("--instrument", instrument)):
        options += [] if value is None else [option, os.fspath(value)]
    options += ["--new-specimen"] if new_specimen else []
    with tempfile.TemporaryDirectory() as folder:
        names = {}
        if isinstance(law, Fit):
            law = law.law
        if isinstance(law, Law):
            file = Path(folder) / "law.json"
            law.write(file)
            names[str(file)] = "law"
            law = file
        if is_table(recordings):
            file = Path(folder) / "table.csv"
            file.write_text(csv_of("validate", recordings, reading), encoding="utf-8", newline="")
            names[str(file)] = TABLE
            recordings = file
        if isinstance(recordings, (Mapping, np.ndarray)):
            raise _core.ArgumentError(f"validate: recordings is {shown(recordings)}; expected files, or a DataFrame")
        alone = isinstance(recordings, (str, os.PathLike)) or not isinstance(recordings, Iterable)
        files = [os.fspath(f) for f in ([recordings] if alone else recordings)]  # type: ignore[union-attr, list-item]
        if not files:
            raise _core.ArgumentError("validate: recordings holds no file; expected one or more")
        try:
            document = _program.answer(["validate", os.fspath(law), *files, *options], answers=(0, 1))
        except _core.Error as error:
            raise same_error(error, names) from None
        return Validation(renamed(document, names))


class Design:
    """Experiments by what they would tell. Made by `tpmkit.design`."""

    def __init__(self, document: dict[str, Any]) -> None:
        self._document = document

    @property
    def ranked(self) -> pd.DataFrame:
        """One row per candidate, the best first, with the keys of `tpm design --format json`, SI."""
        import pandas as pd

        return pd.DataFrame(self._document["ranked"])

    def to_dict(self) -> dict[str, Any]:
        """Everything, as `tpm design --format json` writes it."""
        return self._document

    @property
    def summary(self) -> list[str]:
        """What the best experiment would tell, and what it would not."""
        return list(self._document["summary"])

    @property
    def adequacy(self) -> dict[str, Any]:
        """Whether simulated repetitions of the best candidate confirm its expected intervals: `verdict` (adequate,
        not_adequate if one of its parameters is covered too rarely or too often, not_judged without repetitions) and
        `summary`."""
        check = self._document["check"]
        if not check:
            return {"verdict": "not_judged", "summary": "the expected intervals were not checked by simulated repetitions"}
        doubts = len(check["remarks"])
        return {"verdict": "not_adequate" if doubts else "adequate",
                "summary": f"{check['data_sets']} simulated repetitions, {check['failed']} of them not fitted: "
                           + (f"{doubts} warnings" if doubts else "they confirm the expected intervals")}

    @property
    def warnings(self) -> list[str]:
        """What was left out, and what the check of the expected intervals found against them."""
        left_out = [f"left out: {limit['text']}" for limit in self._document["left_out"]]
        return left_out + [remark["text"] for remark in self.remarks]

    @property
    def remarks(self) -> list[dict[str, str]]:
        """What the check found against the expected intervals: `code`, which stays the same, and `text`."""
        return (self._document["check"] or {}).get("remarks", [])

    def __repr__(self) -> str:
        lines = [f"<tpmkit.Design of {len(self._document['ranked'])} candidates", f"  adequacy: {self.adequacy['summary']}"]
        return "\n".join(lines + [f"  warning: {w}" for w in self.warnings]) + ">"


@told
def design(problem: PathLike | Mapping[str, Any], *, repetitions: int = 100, seed: int = 0) -> Design:
    """Which experiment would identify the parameters (`tpm design`).

    Parameters
    ----------
    problem
        A file (schemas/design.schema.json), or the same as a dict.
    repetitions
        How often the best candidate is simulated and fitted: 0, or 10 and more.
    """
    names: dict[str, str] = {}
    with tempfile.TemporaryDirectory() as folder:
        if isinstance(problem, Mapping):
            file = Path(folder) / "design.json"
            file.write_text(json_text(problem, "design"), encoding="utf-8")
            problem = file
            names[str(file)] = "design"
        words = ["design", os.fspath(problem), "--repetitions", str(repetitions), "--seed", str(seed)]
        try:
            return Design(renamed(_program.answer(words), names))
        except _core.Error as error:
            raise same_error(error, names) from None


@told
def view(file: PathLike | Fit | Law, output: PathLike) -> Path:
    """Writes a Fit, a Law, or a file or folder of results, as one interactive page, which needs nothing else (`tpm view`).

    Returns the page. Raises tpmkit.Error, also where `output` is there already and not such a page.
    """
    page = Path(output)
    if page.is_file():
        with page.open("rb") as there:
            if b"<title>tpm view</title>" not in there.read(4096):
                raise _core.ArgumentError(f"view: {page} is there already and is no page of tpm view; expected another name")
    with tempfile.TemporaryDirectory() as folder:
        if isinstance(file, Fit):
            file.save(folder)
            file = folder
        elif isinstance(file, Law):
            path = Path(folder) / "law.json"
            file.write(path)
            file = path
        _program.run(["view", os.fspath(file), "-o", os.fspath(output)])
    return Path(output)
