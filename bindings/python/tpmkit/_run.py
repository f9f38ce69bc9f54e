"""Scenes run and sweeps computed."""

from __future__ import annotations

import contextlib
import json
import numbers
import os
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any, Callable, Iterator, Mapping

from . import _core, _kinds

if TYPE_CHECKING:
    import pandas as pd
    import xarray

Progress = Callable[[int, int], None]


@contextlib.contextmanager
def shown(progress: bool | Progress, what: str) -> Iterator[Progress | None]:
    """The callback that the library gets: none, the caller's, or a line on standard error with the time
    that is left."""
    if not progress:
        yield None
        return
    if callable(progress):
        yield progress
        return
    start = time.monotonic()
    drawn = 0.0

    def line(done: int, total: int) -> None:
        nonlocal drawn
        now = time.monotonic()
        if now - drawn < 0.2 and done != total:
            return
        drawn = now
        left = (now - start) * (total - done) / done if done else 0.0
        ending = f", {left:.0f} s left" if left > 1.0 else ""
        sys.stderr.write(f"\r{what}: {done} of {total}{ending}    ")
        sys.stderr.flush()

    try:
        yield line
    finally:
        if drawn:
            sys.stderr.write("\n")


def scene_text(scene: str | os.PathLike[str] | Mapping[str, Any]) -> tuple[str, str, str]:
    """A scene as the library takes it: text, place for messages, folder of what it names."""
    if isinstance(scene, Mapping):
        return _kinds.json_text(scene, "scene"), "scene", ""
    path = Path(scene)
    return _core.read_text(os.fspath(path)), os.fspath(path), os.fspath(path.parent)


@_kinds.told
def simulate(
    scene: str | os.PathLike[str] | Mapping[str, Any],
    *,
    output: str | os.PathLike[str] | None = None,
    progress: bool | Progress = False,
) -> xarray.Dataset:
    """Runs what a scene says is done to its tissue (`tpm simulate`).

    Parameters
    ----------
    scene
        A file (schemas/scene.schema.json), or the same as a dict; a mesh that a dict names is looked up in
        the current folder.
    output
        HDF5 file of the result, with an XDMF beside it for ParaView; also a checkpoint while it runs, from
        which the same call goes on after an interruption. None: nothing is written.
    progress
        True: a line on standard error; or a function of (done, total).

    Returns
    -------
    Dataset. Over time_s: what was imposed and the response (depth_m and force_N, or load_N and depth_m),
    work_J, dissipated_J, stored_J. Over (output_s, sphere, axis): position_m of the spheres. attrs: formulation,
    error_estimate, scene, `adequacy`, and `warnings`, a list.
    """
    import numpy as np
    import xarray

    from ._data import COMPUTED, with_units

    text, where, folder = scene_text(scene)
    with shown(progress, "simulating") as told:
        answer = _core.simulate(text, where, folder, "" if output is None else os.fspath(output), told)
    by_depth = answer["depth_is_imposed"]
    imposed, response = ("depth_m", "force_N") if by_depth else ("load_N", "depth_m")
    curves = {imposed: answer["imposed"], response: answer["response"]}
    curves.update({k: answer[k] for k in ("work_J", "dissipated_J", "stored_J") if k in answer})
    variables: dict[str, Any] = {k: ("time_s", v) for k, v in curves.items()}
    variables["position_m"] = (("output_s", "sphere", "axis"), answer["position_m"])
    data = xarray.Dataset(
        variables,
        coords={
            "time_s": answer["time_s"],
            "output_s": answer["output_s"],
            "sphere": np.arange(1, answer["position_m"].shape[1] + 1),
            "axis": ["x", "y", "z"],
        },
        attrs={
            "formulation": answer["formulation"],
            "provenance": "model",
            "error_estimate": answer["error_estimate"],
            "scene": answer["scene"],
            "adequacy": COMPUTED,
            "warnings": list(answer["warnings"]),
        },
    )
    return with_units(data)


@_kinds.told
def sweep(
    file: str | os.PathLike[str],
    output: str | os.PathLike[str],
    *,
    workers: int = 0,
    progress: bool | Progress = False,
) -> xarray.Dataset:
    """Computes a sweep (`tpm sweep`, docs/sweep.md) into an HDF5 file and opens it.

    A file that holds this sweep already is only opened. An interrupted sweep goes on when the same call is
    made again. Shards, CSV and the record of times are the program's: `tpm sweep`.

    Parameters
    ----------
    workers
        Threads; 0: all processors.
    progress
        True: a line on standard error; or a function of (blocks done, blocks).
    """
    from ._data import open_sweep

    if isinstance(workers, bool) or not isinstance(workers, numbers.Integral) or workers < 0:
        raise _core.ArgumentError(f"sweep: workers is {workers!r}; expected a whole number, 0 for all processors")
    with shown(progress, "blocks of the sweep") as told:
        _core.sweep(os.fspath(file), os.fspath(output), workers, told)
    return open_sweep(output)


class Plan:
    """Which models were considered for a scene, and the least that keeps to the tolerance. Made by
    `tpmkit.plan`."""

    def __init__(self, json_text: str, words: str) -> None:
        self._dict: dict[str, Any] = json.loads(json_text)
        self._words = words

    @property
    def choice(self) -> str | None:
        """Name of the model that was picked; None if nothing keeps to tolerance and budget."""
        choice = self._dict.get("choice")
        return choice["name"] if choice else None

    @property
    def adequacy(self) -> dict[str, Any]:
        """Whether a model keeps to the tolerance: `verdict` (adequate or not_adequate) and `summary`. What scene and
        reference leave out, masses, counts."""
        tolerance = self._dict["tolerance"]
        if self.choice is None:
            return {"verdict": "not_adequate", "summary": "no model meets tolerance and budget"}
        error = self._dict["choice"]["verified_error"]
        verdict = "adequate" if error <= tolerance else "not_adequate"
        summary = f"{self.choice}: verified error {100 * error:.3g} % of the peak, {100 * tolerance:.3g} % allowed"
        left_out = self._dict["masses_left_out"]
        if left_out is not None:
            summary += f"; {100 * left_out:.3g} % of it by masses, which the model leaves out"
        elif self._dict["masses_matter"] is None:
            summary += "; not known what masses would change"
        return {"verdict": verdict, "summary": summary}

    @property
    def warnings(self) -> list[str]:
        """What a reader must know: masses that are left out, limits of validity that the scene passes."""
        return [remark["text"] for remark in self.remarks]

    @property
    def remarks(self) -> list[dict[str, str]]:
        """What a reader must know: `code`, which stays the same, and `text`."""
        return self._dict["remarks"]

    @property
    def candidates(self) -> pd.DataFrame:
        """By name: claimed and verified error in parts of the peak, cost in seconds per simulated second,
        whether it is feasible, and why not."""
        import pandas as pd

        return pd.DataFrame(self._dict["frontier"]).set_index("name")

    def to_dict(self) -> dict[str, Any]:
        """Everything, as `tpm plan --format json` writes it (keys in docs/json.md)."""
        return self._dict

    def __str__(self) -> str:
        return self._words

    def __repr__(self) -> str:
        lines = [f"<tpmkit.Plan: {self.choice or 'nothing meets tolerance and budget'}",
                 f"  adequacy: {self.adequacy['summary']}"]
        return "\n".join(lines + [f"  warning: {w}" for w in self.warnings]) + ">"


@_kinds.told
def plan(
    scene: str | os.PathLike[str] | Mapping[str, Any],
    *,
    tolerance: str | float = "1%",
    outputs: str = "force",
    rate_Hz: float | None = None,
    wall: str = "",
    costs: str | os.PathLike[str] = "nominal",
    progress: bool | Progress = False,
) -> Plan:
    """The cheapest model for a scene, verified against the nonlinear network (`tpm plan`, docs/plan.md).

    Parameters
    ----------
    scene
        A file or a dict, as for `tpmkit.simulate`.
    tolerance
        In parts of the peak, "1%" or 0.01; or "jnd", what a hand can feel.
    outputs
        What it is about: "force" (the response) or "field" (displacements of all spheres).
    rate_Hz
        Servo rate: every period needs its answer. None: no such limit.
    wall
        Computing time, such as "0.1 s per s".
    costs
        "nominal", the same on every machine, or a file of `tpm plan --calibrate`.
    """
    if isinstance(tolerance, numbers.Real) and not isinstance(tolerance, numbers.Integral):
        tolerance = repr(float(tolerance))
    for name, value, wanted in (("tolerance", tolerance, '"1%", 0.01 or "jnd"'), ("outputs", outputs, '"force" or "field"'),
                                ("wall", wall, 'a text such as "0.1 s per s"')):
        if not isinstance(value, str):
            raise _core.ArgumentError(f"plan: {name} is {value!r}; expected {wanted}")
    if rate_Hz is not None and (isinstance(rate_Hz, bool) or not isinstance(rate_Hz, numbers.Real)):
        raise _core.ArgumentError(f"plan: rate_Hz is {rate_Hz!r}; expected a number, in Hz")
    if outputs not in ("force", "field"):
        raise _core.ArgumentError(f'plan: outputs is {outputs!r:.60}; expected "force" or "field"')
    if rate_Hz is not None and not 1.0 <= rate_Hz <= 1e6:
        raise _core.ArgumentError(f"plan: rate_Hz is {rate_Hz!r}; expected a servo rate of 1 to 1e6, in Hz")
    text, where, folder = scene_text(scene)
    with shown(progress, "planning") as told:
        return Plan(*_core.plan(text, where, folder, tolerance, outputs, rate_Hz, wall, os.fspath(costs), told))
