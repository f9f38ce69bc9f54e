"""Fits of recordings, material functions and configurations."""

from __future__ import annotations

import html
import json
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Sequence, Union

import numpy as np

from . import _core, _program
from ._core import Protocol
from ._kinds import needed, of_arguments, shown, told
from ._law import Law, number_of, times_of
from ._specimens import Specimens
from ._tables import TABLE, by_file, csv_of, frame_of, is_table, options_of, reading_of, renamed, same_error

if TYPE_CHECKING:
    import numpy.typing as npt
    import pandas as pd
    import xarray
    from matplotlib.axes import Axes

    from ._prediction import Prediction

PathLike = Union[str, "os.PathLike[str]"]


@dataclass(frozen=True)
class _Inputs:
    """What `_core.fit` was given: files, or one table as CSV, and the options behind them."""

    files: tuple[str, ...]
    options: tuple[Any, ...]
    table: str | None = None

    def fitted(self) -> Any:
        if self.table is None:
            return _core.fit(list(self.files), *self.options)
        return _OfTable(*by_file(self.table, lambda file: _core.fit([file], *self.options)))


_VALUES = ("parameters", "recordings", "has_law", "adequacy_json", "remarks", "summary", "correlation")
_TEXTS = ("answer", "text", "to_json")


def _answers_of(core: Any) -> dict[str, Any]:
    """All that a fit answers without its model."""
    answers = {name: getattr(core, name) for name in _VALUES}
    answers.update({name: getattr(core, name)() for name in _TEXTS})
    try:
        answers["law_json"] = core.law_json
    except _core.Error as error:
        answers["no_law"] = str(error)
    return answers


class _OfTable:
    """Stands for the `_core.Fit` of a table, whose answers name a file that is gone."""

    def __init__(self, core: Any, names: dict[str, str]) -> None:
        self._core, self._names = core, names

    def __getattr__(self, name: str) -> Any:
        value = getattr(self._core, name)
        if name in _TEXTS:
            return lambda: renamed(value(), self._names)
        return renamed(value, self._names)


class _Unpickled:
    """Stands for `_core.Fit`: the answers that were kept, and the model by another fit of the same inputs."""

    def __init__(self, answers: dict[str, Any], inputs: _Inputs) -> None:
        self._answers, self._inputs, self._core = answers, inputs, None

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        answers = self._answers
        if name in _TEXTS:
            return lambda: answers[name]
        if name in answers:
            return answers[name]
        if name == "law_json":
            raise _core.Error(answers["no_law"])
        return getattr(self._again(), name)

    def _again(self) -> Any:
        if self._core is None:
            core = self._inputs.fitted()
            if core.parameters != self._answers["parameters"]:
                raise _core.Error(f"{self._inputs.files[0]}: gives other parameters than the fit that was pickled; expected "
                                  "the file as it was, or another tpmkit.fit")
            self._core = core
        return self._core


def _unpickled(answers: dict[str, Any], inputs: _Inputs) -> Fit:
    return Fit(_Unpickled(answers, inputs), inputs)


def _whole(where: str, name: str, value: Any, least: int, most: int) -> int:
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or not least <= value <= most:
        raise _core.ArgumentError(f"{where}: {name} is {value!r:.60}; expected a whole number from {least} to {most}")
    return int(value)


class Fit:
    """What a fit found. Made by `tpmkit.fit`; it never changes, so a copy is the fit itself."""

    def __init__(self, core: Any, inputs: _Inputs) -> None:
        self._core = core
        self._inputs = inputs

    @property
    def parameters(self) -> pd.DataFrame:
        """One row per estimated parameter, by name; SI.

        Columns: estimate, standard_error (linearised), lower and upper (limits by profile likelihood; NaN
        where the data give none), unit, verdict, nuisance (belongs to the recording), only_if_described (the
        law does not describe the data: the row holds only if it did), not_separable (what the recording cannot
        tell it from; empty: nothing), unconfirmed (why its minimum is not trusted; empty: it is), with_drift,
        with_drift_lower, with_drift_upper (estimate and limits of the fit with a drift of the zero, where no
        rest tells one: lower and upper hold these limits, too; else NaN), summary.
        """
        import pandas as pd

        columns = ["name", "estimate", "standard_error", "lower", "upper", "unit", "verdict", "nuisance",
                   "only_if_described", "not_separable", "unconfirmed", "with_drift", "with_drift_lower",
                   "with_drift_upper", "summary"]
        table = pd.DataFrame(self._core.parameters, columns=columns).set_index("name")
        numbers = ["estimate", "standard_error", "lower", "upper", "with_drift", "with_drift_lower", "with_drift_upper"]
        table[numbers] = table[numbers].astype(float)
        return table

    @property
    def verdicts(self) -> pd.Series:
        """What the data say about each parameter: "identified", "flat", "lower_only", ..."""
        return self.parameters["verdict"]

    @property
    def correlation(self) -> pd.DataFrame:
        """Correlation of the free parameters (in the coordinates of the search), from the covariance."""
        import pandas as pd

        names = self._fitted["linearised"]["parameters"]
        return pd.DataFrame(self._core.correlation, index=names, columns=names)

    @property
    def covariance(self) -> pd.DataFrame:
        """Covariance of the free parameters, SI times SI: their correlation times their standard errors (linearised).
        Raises tpmkit.Error where the data leave a direction of the parameters open."""
        if not self._fitted["linearised"]["full_rank"]:
            raise _core.Error("covariance: the data leave a direction of the parameters open; expected fit.correlation, "
                              "or a law with fewer parameters")
        correlation = self.correlation
        error = self.parameters["standard_error"].reindex(correlation.index).to_numpy()
        return correlation * np.outer(error, error)

    @property
    def aic(self) -> float | None:
        """Akaike's information criterion; None under a robust loss. `aicc` and `bic` likewise; six digits."""
        return self._fitted["AIC"]

    @property
    def aicc(self) -> float | None:
        """AIC corrected for few readings."""
        return self._fitted["AICc"]

    @property
    def bic(self) -> float | None:
        """Bayesian information criterion."""
        return self._fitted["BIC"]

    @property
    def residuals(self) -> pd.DataFrame:
        """Observed minus predicted of every sample of the recordings, SI: dataset, time_s, residual, fitted. Empty
        for a fit without recordings."""
        import pandas as pd

        frames = []
        for frame in self.data:
            key = frame.attrs["response_key"]
            frames.append(pd.DataFrame({
                "dataset": frame.attrs["dataset"], "time_s": frame["time_s"],
                "residual": frame["observed_" + key] - frame["predicted_" + key], "fitted": frame["fitted"]}))
        if not frames:
            return pd.DataFrame(columns=["dataset", "time_s", "residual", "fitted"])
        return pd.concat(frames, ignore_index=True)

    @property
    def _fitted(self) -> dict[str, Any]:
        """The JSON of the fit that is recommended."""
        everything = self.to_dict()
        return everything.get("fit") or everything

    @property
    def law(self) -> Law:
        """The fitted law. Raises tpmkit.Error for a configuration without one."""
        return Law._of(_core.Law.from_json(self._core.law_json))

    @property
    def laws(self) -> pd.DataFrame:
        """The laws that were tried, by rising BIC: parameters, residual, delta_bic, why one is not
        identified. Empty for a configuration."""
        import pandas as pd

        laws = json.loads(self._core.to_json()).get("laws", [])
        columns = ["law", "summary", "parameters_estimated", "rms_over_peak", "delta_bic", "identified", "reason"]
        return pd.DataFrame(laws, columns=columns).set_index("law")

    @property
    def preferred(self) -> dict[str, Any] | None:
        """The law of the lowest BIC, where the data prefer it by more than 10 in BIC to the law that is
        recommended but do not identify its parameters: `law`, `ahead_in_bic`, `not_identified_because`, and its
        whole `fit`. Neither law answers alone then. None: the recommended law does."""
        return json.loads(self._core.to_json()).get("preferred")

    @property
    def adequacy(self) -> dict[str, Any] | None:
        """Whether the law describes the data: `verdict` (adequate, not_described, not_judged), `summary`,
        `residual_over_noise` where it was judged, `causes` where it is not described. None: not tested."""
        return json.loads(self._core.adequacy_json)

    @property
    def summary(self) -> list[str]:
        """The recommendation and its reasons."""
        return self._core.summary

    @property
    def warnings(self) -> list[str]:
        """What the experiment cannot tell, and what a reader must know."""
        adequacy = self.adequacy
        first = [adequacy["summary"]] if adequacy and adequacy["verdict"] != "adequate" else []
        return first + [remark["text"] for remark in self.remarks]

    @property
    def remarks(self) -> list[dict[str, str]]:
        """What the experiment cannot tell, and what a reader must know: `code`, which stays the same, and `text`."""
        return self._core.remarks

    @property
    def data(self) -> list[pd.DataFrame]:
        """One DataFrame per recording: time_s, drive, observed, predicted, lower, upper (where one new sample
        falls), fitted. `attrs` holds dataset, provenance, and names of drive and response with unit."""
        import pandas as pd

        frames = []
        for r in self._core.recordings:
            n = len(r["time_s"])
            band = {k: r[k] if len(r[k]) else np.full(n, np.nan) for k in ("lower", "upper")}
            frame = pd.DataFrame(
                {
                    "time_s": r["time_s"],
                    r["drive_key"]: r["drive"],
                    "observed_" + r["response_key"]: r["observed"],
                    "predicted_" + r["response_key"]: r["predicted"],
                    "lower_" + r["response_key"]: band["lower"],
                    "upper_" + r["response_key"]: band["upper"],
                    "fitted": r["fitted"],
                }
            )
            frame.attrs = {k: r[k] for k in ("dataset", "provenance", "drive_key", "response_key", "rms_residual", "peak")}
            frames.append(frame)
        return frames

    @told
    def predict(
        self, protocol: Protocol, times_s: npt.ArrayLike, *, placement: str = "surface", dataset: int = 0
    ) -> Prediction:
        """What the fitted law answers to another protocol. The answer is that of `tpm predict`.

        Parameters
        ----------
        protocol
            Of the same drive as the data.
        placement
            Contact and zero: "surface" (depths count from the surface, and the sensor has no zero error) or "fitted"
            (depths and forces count as in the recording: its contact point and offset, with their uncertainty).
        dataset
            The recording whose contact point and offset these are, from 0.

        Returns
        -------
        DataFrame by time_s: value, and standard_error from the parameters' covariance (delta method; NaN
        where that is not of full rank). Its `warnings` say where it extrapolates, in the words of `tpm predict`, and
        its `adequacy` is that of the fit; its repr shows both.
        """
        import pandas as pd

        from ._prediction import Prediction

        if placement not in ("surface", "fitted"):
            raise _core.ArgumentError(f"predict: placement is {placement!r:.60}; expected 'surface' or 'fitted'")
        times = times_of(times_s)
        most = 0 if type(dataset) is int and dataset == 0 else len(self._fitted["choices"]) - 1
        place = _whole("predict", "dataset", dataset, 0, most)
        value, error, warnings = of_arguments(self._core.predict)(protocol, times, place, placement == "surface")
        table = Prediction({"value": value, "standard_error": error}, index=pd.Index(times, name="time_s"))
        table.attrs["adequacy"] = self._judged()
        table.attrs["warnings"] = warnings
        return table

    @told
    def young_moduli(
        self,
        *,
        sphere_radius_m: float | None = None,
        cone_half_angle_rad: float | None = None,
        punch_radius_m: float | None = None,
        poisson_ratio: float | None = None,
    ) -> Prediction:
        """Young's modulus of each stiffness of the law under one rigid probe, as `tpm fit --radius` prints it.

        One row per modulus, by name ("E_inf", "E1", "E_instantaneous"): estimate, standard_error, lower, upper, unit,
        verdict, of. `attrs`: geometry, poisson_ratio (0.49, assumed, unless it is given). Its `adequacy` is that of the fit;
        its repr shows it and its `warnings`.
        """
        from ._prediction import Prediction

        sizes = {"sphere_radius_m": sphere_radius_m, "cone_half_angle_rad": cone_half_angle_rad, "punch_radius_m": punch_radius_m}
        for name, value in sizes.items():
            if value is not None and not number_of("young_moduli", name, value) > 0.0:
                raise _core.ArgumentError(f"young_moduli: {name} is {value!r:.60}; expected a number above 0")
        said = json.loads(of_arguments(self._core.young_moduli)(sphere_radius_m, cone_half_angle_rad, punch_radius_m, poisson_ratio))
        rows = []
        for m in said["moduli"]:
            lower, upper = m.get("interval_SI") or (None, None)
            rows.append({"name": m["name"], "estimate": m["estimate_SI"], "standard_error": m.get("standard_error_SI"),
                         "lower": lower, "upper": upper, **{k: m[k] for k in ("unit", "verdict", "of")}})
        table = Prediction(rows).set_index("name")
        table[["standard_error", "lower", "upper"]] = table[["standard_error", "lower", "upper"]].astype(float)
        table.attrs = {k: said[k] for k in ("geometry", "poisson_ratio", "poisson_ratio_provenance")}
        table.attrs["adequacy"] = self._judged()
        table.attrs["warnings"] = [remark["text"] for remark in said["remarks"]]
        return table

    def plot(self, recording: int = 0, ax: Axes | None = None) -> Axes:
        """Draws a recording with the fitted law and its prediction band; samples outside the window that was
        fitted are grey. Needs matplotlib."""
        plt = needed("matplotlib.pyplot", "plot")
        frames = self.data
        if not frames:
            raise _core.Error("plot: the fit has no recording; expected a fit of recordings")
        frame = frames[_whole("plot", "recording", recording, 0, len(frames) - 1)]
        key = frame.attrs["response_key"]
        if ax is None:
            ax = plt.subplots(figsize=(7.0, 4.0))[1]
        time, inside = frame["time_s"], frame["fitted"]
        observed, predicted = frame["observed_" + key], frame["predicted_" + key]
        label = frame.attrs["provenance"]
        ax.plot(time[~inside], observed[~inside], ".", ms=2, color="0.75", label=f"{label}, not fitted")
        ax.plot(time[inside], observed[inside], ".", ms=3, color="tab:blue", label=label)
        order = np.argsort(time.to_numpy())
        if frame["lower_" + key].notna().any():
            ax.fill_between(
                time.iloc[order], frame["lower_" + key].iloc[order], frame["upper_" + key].iloc[order],
                color="tab:orange", alpha=0.25, lw=0, label="prediction band",
            )
        ax.plot(time, predicted, color="tab:orange", lw=1.5, label=f"fit: {self.law.name}" if self._core.has_law else "fit")
        name, _, unit = key.rpartition("_")
        ax.set_xlabel("time (s)")
        ax.set_ylabel(f"{name} ({unit})" if name else key)
        if inside.all():
            handles, labels = ax.get_legend_handles_labels()
            ax.legend(handles[1:], labels[1:], frameon=False)
        else:
            ax.legend(frameon=False)
        return ax

    @told
    def save(self, folder: PathLike) -> list[str]:
        """Writes configuration, law, selection and figures, as `tpm fit` does. Figures are drawn by the
        Python that has matplotlib, in another process.

        A table in memory is written there as recording.csv, which the configuration names, and fitted once more.

        Returns the names of the files.
        """
        table = self._inputs.table
        if table is None:
            return self._core.write(os.fspath(folder))
        file = Path(folder) / "recording.csv"
        if file.exists() and file.read_text(encoding="utf-8") != table:
            raise _core.Error(f"{file}: exists and holds another recording; expected another folder")
        try:
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(table, encoding="utf-8", newline="")
        except OSError as error:
            raise _core.Error(f"{file}: {error.strerror}; expected a folder that can be written") from None
        return [file.name, *_core.fit([str(file)], *self._inputs.options).write(os.fspath(folder))]

    def to_dict(self) -> dict[str, Any]:
        """Everything, as `tpm fit --format json` writes it (keys in docs/fit_files.md)."""
        return json.loads(self._core.to_json())

    def details(self) -> str:
        """All that was computed, as `tpm fit --verbose` prints it."""
        return self._core.text()

    def __str__(self) -> str:
        """At most 25 lines, as `tpm fit` prints them."""
        return self._core.answer()

    def __repr__(self) -> str:
        lines = [f"<tpmkit.Fit {self.law.name}" if self._core.has_law else "<tpmkit.Fit"]
        for name, row in self.parameters.iterrows():
            interval = " .. ".join("open" if np.isnan(v) else f"{v:.4g}" for v in (row["lower"], row["upper"]))
            lines.append(f"  {name} {row['estimate']:.5g} ({interval}) {row['unit']}, {row['verdict']}")
        return "\n".join([*lines, *(f"  {words}" for words in self._remarks_shown())]) + ">"

    def __copy__(self) -> Fit:
        return self

    def __deepcopy__(self, memo: Any) -> Fit:
        return self

    def __reduce__(self) -> Any:
        """Keeps all answers, and the inputs: `predict`, `young_moduli` and `save` of a Fit that was unpickled fit the
        same files again, and raise tpmkit.Error if they are gone or give another answer."""
        return _unpickled, (_answers_of(self._core), self._inputs)

    def _repr_html_(self) -> str:
        digits = {"estimate": "{:.5g}".format, "standard_error": "{:.3g}".format}  # as tpm fit prints them
        table = self.parameters.to_html(formatters=digits, float_format=lambda v: f"{v:.4g}")
        return table + "".join(f"<p>{html.escape(words)}</p>" for words in self._remarks_shown())

    def _judged(self) -> dict[str, Any]:
        return self.adequacy or {"verdict": "not_judged", "summary": "not tested"}

    def _remarks_shown(self) -> list[str]:
        """Adequacy and warnings, as every repr shows them."""
        adequacy = self._judged()["summary"]
        return [f"adequacy: {adequacy}", *(f"warning: {w}" for w in self.warnings if w != adequacy)]


def _fit_table(table: Any, options: tuple[Any, ...]) -> Fit:
    """Fits a table as the file that it would be: one reader, one answer."""
    inputs = _Inputs((TABLE,), options, csv_of("fit", table, options[-1]))
    return Fit(inputs.fitted(), inputs)


@told
def fit(
    files: PathLike | Sequence[PathLike] | pd.DataFrame | xarray.Dataset | None = None,
    *,
    time: npt.ArrayLike | None = None,
    depth: npt.ArrayLike | None = None,
    force: npt.ArrayLike | None = None,
    units: Mapping[str, str] | None = None,
    law: str | None = None,
    starts: int | None = None,
    seed: int | None = None,
    reference: float | None = None,
    contact: float | None = None,
    contact_force: float | None = None,
    zero: float | None = None,
    columns: Mapping[str, Any] | None = None,
) -> Fit | Specimens:
    """Fits a law to recordings, or what a configuration says. The answer is that of `tpm fit`.

    Parameters
    ----------
    files
        A recording (any delimited text with times, depths and forces; a header that names units), several
        to be fitted together, a spectrum, a relaxation modulus, a creep compliance, or a configuration
        (schemas/fit.schema.json). A folder: each recording in it is fitted by one law and the parameters are pooled
        (in another process, by the program `tpm`). A DataFrame: it is read as the file that it would be, so its columns
        name their units ("time (s)", "depth (mm)", "force (mN)"), or `units` does; rows with a NaN are left out, and
        `Fit.warnings` says so. A Dataset of `tpmkit.read_recording`.
    time, depth, force
        A recording as three arrays of one length in place of `files`; none may hold NaN.
    units
        The unit of each array or column: ``{"time": "s", "depth": "mm", "force": "mN"}``.
    law
        The name of one ("power-2"), fitted instead of the simplest law that the recordings support.
    starts, seed
        Number of starts (1 to 1e9) and seed of the search; equal seeds give equal answers.
    reference
        Depth (m) at which coefficients are secants. Default: the largest.
    contact, contact_force, zero
        Depth of contact (m), or the force (N) that marks it, and reading without a load (N) of recordings, to be
        held. Default: measured, with their uncertainties.
    columns
        What a file does not say: ``{"time": "t", "drive": "z", "response": "F", "units": {"F": "mN"}}``;
        also sd, frequency, storage, loss, drive_quantity, response_quantity; and provenance, such as "assumed"
        for a synthetic recording (default "measured"). How the file is written and which part of it is read:
        encoding, separator, decimal, thousands, header_rows, block, step_time, from, until, negate_drive,
        negate_response, rest_length, area, spring_constant, deflection_sensitivity, segments, as the options
        of ``tpm fit`` of these names: ``{"decimal": "comma", "step_time": "185 s", "block": 2}``.

    Raises
    ------
    tpmkit.Error
        Files that cannot be read, with line and column; no law that could be fitted.

    Examples
    --------
    >>> fit = tpmkit.fit("recording.csv")
    >>> fit.parameters.loc["tau1", ["estimate", "lower", "upper", "verdict"]]
    """
    arrays = time is not None or depth is not None or force is not None
    if arrays == (files is not None):
        raise _core.ArgumentError("fit: expected files, a table, or time, depth and force, one of them")
    if law is not None and not isinstance(law, str):
        raise _core.ArgumentError(f'fit: law is {shown(law)}; expected its name, such as "power-2"')
    if starts is not None:
        starts = _whole("fit", "starts", starts, 1, 10**9)
    if seed is not None:
        seed = _whole("fit", "seed", seed, 0, 2**64 - 1)
    placement = {"reference": reference, "contact": contact, "contact_force": contact_force, "zero": zero}
    units_of = {"reference": "m", "contact": "m", "contact_force": "N", "zero": "N"}
    for name, value in placement.items():
        if value is None:
            continue
        if isinstance(value, bool) or not isinstance(value, (int, float, np.floating, np.integer)):
            raise _core.ArgumentError(f"fit: {name} is {value!r:.60}; expected a number, in {units_of[name]}")
        if not np.isfinite(value):
            raise _core.ArgumentError(f"fit: {name} is {value!r:.60}; expected a finite number, in {units_of[name]}")
    if reference is not None and not reference > 0.0:
        raise _core.ArgumentError(f"fit: reference is {reference!r:.60}; expected a depth above 0, in m")

    reading = reading_of("fit", columns, None if arrays else units)
    options = (law, starts, seed, *placement.values(), reading)
    if law is not None:
        of_arguments(_core.law_parameters)(law)
    if arrays:
        return _fit_table(frame_of("fit", {"time": time, "depth": depth, "force": force}, units), options)
    if is_table(files):
        if hasattr(files, "attrs") and "provenance" in files.attrs:
            reading.setdefault("provenance", files.attrs["provenance"])
        return _fit_table(files, options)
    if isinstance(files, (Mapping, np.ndarray)):
        raise _core.ArgumentError(f"fit: files is a {type(files).__name__}; expected files, a DataFrame, or time, depth and force with units")
    if isinstance(files, (str, bytes, os.PathLike)) or not isinstance(files, Iterable):
        if isinstance(files, (str, os.PathLike)) and os.path.isdir(files):
            words = ["fit", os.fspath(files), "--no-draw", *options_of(reading)]
            said = {"laws": law, "starts": starts, "seed": seed, **placement}
            for key, value in said.items():
                unit = " " + units_of[key] if key in units_of else ""
                words += [] if value is None else ["--" + key.replace("_", "-"), f"{value}{unit}"]
            try:
                return Specimens(_program.answer(words))
            except _core.Error as error:
                raise same_error(error, {"laws: unknown law": "law: unknown law"}) from None
        files = [files]  # type: ignore[list-item]
    several = list(files)  # type: ignore[arg-type]
    if any(is_table(f) for f in several):
        raise _core.ArgumentError("fit: files holds tables; expected one table, or files")
    for one in several:
        if not isinstance(one, (str, os.PathLike)) or one == "":
            raise _core.ArgumentError(f"fit: files holds {shown(one)}; expected the paths of recordings")
        if os.path.isdir(one):
            raise _core.ArgumentError(f"fit: {os.fspath(one)} is a folder among files; expected files, or one folder alone")
    names = [os.fspath(f) for f in several]
    return Fit(_core.fit(names, *options), _Inputs(tuple(os.path.abspath(n) for n in names), options))
