"""Fits of recordings, material functions and configurations."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Mapping, Sequence, Union

import numpy as np

from . import _core, _program
from ._core import Protocol
from ._kinds import told
from ._law import Law, times_of

if TYPE_CHECKING:
    import numpy.typing as npt
    import pandas as pd
    from matplotlib.axes import Axes

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
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "table.csv"
            file.write_text(self.table, encoding="utf-8", newline="")
            try:
                return _core.fit([str(file)], *self.options)
            except _core.Error as error:
                told = _core.Error(str(error).replace(str(file), "table"))
                told.code = error.code
                raise told from None


_VALUES = ("parameters", "recordings", "has_law", "adequacy_json", "flags", "summary", "warnings", "correlation")
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
        tell it from; empty: nothing), with_drift, with_drift_lower, with_drift_upper (estimate and limits of the
        fit with a drift of the zero, where no rest tells one: lower and upper hold these limits, too; else NaN),
        summary.
        """
        import pandas as pd

        columns = ["name", "estimate", "standard_error", "lower", "upper", "unit", "verdict", "nuisance",
                   "only_if_described", "not_separable", "with_drift", "with_drift_lower", "with_drift_upper", "summary"]
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
        return first + self._core.warnings + self._core.flags

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
    def predict(self, protocol: Protocol, times_s: npt.ArrayLike, *, dataset: int = 0) -> pd.DataFrame:
        """What the fitted model answers to another protocol.

        Parameters
        ----------
        protocol
            Of the same drive as the data. Its depths count from where those of the recording do: the
            contact point and the offset of `dataset` are part of the model.
        dataset
            Whose nuisance parameters are used, from 0.

        Returns
        -------
        DataFrame by time_s: value, and standard_error from the parameters' covariance (delta method; NaN
        where that is not of full rank).
        """
        import pandas as pd

        times = times_of(times_s)
        value, error = self._core.predict(protocol, times, dataset)
        return pd.DataFrame({"value": value, "standard_error": error}, index=pd.Index(times, name="time_s"))

    @told
    def young_moduli(
        self,
        *,
        sphere_radius_m: float | None = None,
        cone_half_angle_rad: float | None = None,
        punch_radius_m: float | None = None,
        poisson_ratio: float | None = None,
    ) -> pd.DataFrame:
        """Young's modulus of each stiffness of the law under one rigid probe, as `tpm fit --radius` prints it.

        One row per modulus, by name ("E_inf", "E1", "E_instantaneous"): estimate, standard_error, lower, upper, unit,
        verdict, of. `attrs`: geometry, poisson_ratio (0.49, assumed, unless it is given), warnings.
        """
        import pandas as pd

        said = json.loads(self._core.young_moduli(sphere_radius_m, cone_half_angle_rad, punch_radius_m, poisson_ratio))
        rows = []
        for m in said["moduli"]:
            lower, upper = m.get("interval_SI") or (None, None)
            rows.append({"name": m["name"], "estimate": m["estimate_SI"], "standard_error": m.get("standard_error_SI"),
                         "lower": lower, "upper": upper, **{k: m[k] for k in ("unit", "verdict", "of")}})
        table = pd.DataFrame(rows).set_index("name")
        table[["standard_error", "lower", "upper"]] = table[["standard_error", "lower", "upper"]].astype(float)
        table.attrs = {k: said[k] for k in ("geometry", "poisson_ratio", "poisson_ratio_provenance", "warnings")}
        return table

    def plot(self, recording: int = 0, ax: Axes | None = None) -> Axes:
        """Draws a recording with the fitted law and its prediction band; samples outside the window that was
        fitted are grey. Needs matplotlib."""
        import matplotlib.pyplot as plt

        frames = self.data
        if not frames:
            raise _core.Error("plot: the fit has no recording; expected a fit of recordings")
        frame = frames[recording]
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
        adequacy = self.adequacy
        lines.append("  adequacy: " + (adequacy["summary"] if adequacy else "not tested"))
        doubted = adequacy["summary"] if adequacy else None
        lines += [f"  warning: {w}" for w in self.warnings if w != doubted]
        return "\n".join(lines) + ">"

    def __copy__(self) -> Fit:
        return self

    def __deepcopy__(self, memo: Any) -> Fit:
        return self

    def __reduce__(self) -> Any:
        """Keeps all answers, and the inputs: `predict`, `young_moduli` and `save` of a Fit that was unpickled fit the
        same files again, and raise tpmkit.Error if they are gone or give another answer."""
        return _unpickled, (_answers_of(self._core), self._inputs)

    def _repr_html_(self) -> str:
        return self.parameters.to_html(float_format=lambda v: f"{v:.4g}")


class Specimens:
    """Fits of the recordings of a folder, pooled. Made by `tpmkit.fit(folder)`."""

    def __init__(self, document: dict[str, Any]) -> None:
        self._document = document

    @property
    def law(self) -> str:
        """The name of the law that all recordings were fitted with; `why` says how it was chosen."""
        return self._document["law"]

    @property
    def why(self) -> str:
        """How the law was chosen."""
        return self._document["why"]

    @property
    def pooled(self) -> pd.DataFrame:
        """One row per material parameter, by name, SI: typical, lower, upper, unit, specimens, left_out, identified,
        i_squared, summary."""
        import pandas as pd

        rows = []
        for p in self._document["pooled"]:
            lower, upper = p.get("interval_SI") or (None, None)
            rows.append({"name": p["name"], "typical": p.get("typical_SI"), "lower": lower, "upper": upper,
                         **{k: p.get(k) for k in ("unit", "specimens", "left_out", "identified", "i_squared", "summary")}})
        table = pd.DataFrame(rows).set_index("name")
        for column in ("typical", "lower", "upper"):
            table[column] = table[column].astype(float)
        return table

    @property
    def adequacy(self) -> dict[str, Any]:
        """Whether the law describes the recordings: `verdict` (not_described if one recording says so, else not_judged
        if one cannot be judged, else adequate), `summary`, and the names of the recordings by verdict."""
        names: dict[str, list[str]] = {}
        for r in self.recordings:
            said = (r.get("fit") or {}).get("adequacy")
            if "fit" in r:
                names.setdefault(said["verdict"] if said else "not_judged", []).append(r["recording"])
        verdict = next((v for v in ("not_described", "not_judged", "adequate") if v in names), "not_judged")
        words = "; ".join(f"{len(rows)} of {len(self.recordings)} recordings {v.replace('_', ' ')}" for v, rows in names.items())
        return {"verdict": verdict, "summary": words or "no recording is fitted", **names}

    @property
    def warnings(self) -> list[str]:
        """What a reader must know: recordings that are not fitted, or that the law does not describe."""
        found = []
        for r in self.recordings:
            fit = r.get("fit")
            if not fit:
                found.append(f"{r['recording']} is not fitted: {r.get('reason', 'no reason is stored')}")
                continue
            adequacy = fit.get("adequacy")
            if adequacy and adequacy["verdict"] != "adequate":
                found.append(f"{r['recording']}: {adequacy['summary']}")
            found += [f"{r['recording']}: {flag}" for flag in fit.get("flags", [])]
        return found

    @property
    def recordings(self) -> list[dict[str, Any]]:
        """Of each recording: `recording`, `specimen`, and its `fit` (keys in docs/fit_files.md), or why it has none."""
        return self._document["recordings"]

    def to_dict(self) -> dict[str, Any]:
        """Everything, as `tpm fit FOLDER --format json` writes it."""
        return self._document

    def __repr__(self) -> str:
        lines = [f"<tpmkit.Specimens {self.law}, {len(self.recordings)} recordings"]
        lines += [f"  {name}: {row['summary']}" for name, row in self.pooled.iterrows()]
        lines.append(f"  adequacy: {self.adequacy['summary']}")
        lines += [f"  warning: {w}" for w in self.warnings]
        return "\n".join(lines) + ">"


def _options(columns: Mapping[str, Any] | None) -> list[str]:
    """What `columns` says as options of the program."""
    words: list[str] = []
    for key, value in (columns or {}).items():
        option = "--" + key.replace("_", "-")
        if key == "units":
            for column, unit in value.items():
                words += ["--unit", f"{column}={unit}"]
        elif isinstance(value, bool):
            words += [option] if value else []
        elif key == "segments":
            words += [option, ",".join(value)]
        else:
            words += [option, str(value)]
    return words


def _table_of(time: Any, depth: Any, force: Any, units: Mapping[str, str] | None) -> pd.DataFrame:
    """Arrays with units as a table that reads like a file."""
    import pandas as pd

    given = {"time": time, "depth": depth, "force": force}
    missing = [name for name, values in given.items() if values is None]
    if missing:
        raise _core.Error(f"fit: {' and '.join(missing)} missing; expected time, depth and force together")
    if set(units or {}) != set(given):
        raise _core.Error('fit: units are not guessed; expected units={"time": "s", "depth": "mm", "force": "mN"}, one for each')
    columns = {}
    for name, values in given.items():
        array = np.asarray(values)
        if array.ndim != 1:
            raise _core.Error(f"fit: {name} has the shape {array.shape}; expected a list of numbers")
        if array.size != np.size(time):
            raise _core.Error(f"fit: {name} has {array.size} values and time {np.size(time)}; expected as many of each")
        try:
            array = array.astype(float)
        except (TypeError, ValueError):
            raise _core.Error(f"fit: {name} holds {array.dtype}; expected numbers") from None
        bad = np.flatnonzero(~np.isfinite(array))
        if bad.size:
            raise _core.Error(f"fit: {name} is {array[bad[0]]} at place {bad[0]}; expected finite numbers")
        columns[f"{name} ({units[name]})"] = array  # type: ignore[index]
    return pd.DataFrame(columns)


def _fit_table(table: pd.DataFrame, options: tuple[Any, ...]) -> Fit:
    """Fits a table as the file that it would be: one reader, one answer."""
    import pandas as pd

    if not isinstance(table.index, pd.RangeIndex):
        if table.index.name is None:
            raise _core.Error("fit: the table's index has no name; expected frame.reset_index(), or a name with a unit")
        table = table.reset_index()
    inputs = _Inputs(("table",), options, table.to_csv(index=False))
    return Fit(inputs.fitted(), inputs)


@told
def fit(
    files: PathLike | Sequence[PathLike] | pd.DataFrame | None = None,
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
        name their units ("time (s)", "depth (mm)", "force (mN)").
    time, depth, force, units
        A recording as three arrays of one length in place of `files`; `units` names the unit of each:
        ``{"time": "s", "depth": "mm", "force": "mN"}``.
    law
        Fit this one ("power-2") instead of the simplest law that the recordings support.
    starts, seed
        Number of starts and seed of the search; equal seeds give equal answers.
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
    arrays = time is not None or depth is not None or force is not None or units is not None
    if arrays == (files is not None):
        raise _core.Error("fit: expected files, a table, or time, depth and force, one of them")
    for name, value in (("starts", starts), ("seed", seed)):
        if value is not None and (isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < 0):
            raise _core.Error(f"fit: {name} is {value!r}; expected a whole number")
    placement = {"reference": reference, "contact": contact, "contact_force": contact_force, "zero": zero}
    units_of = {"reference": "m", "contact": "m", "contact_force": "N", "zero": "N"}
    for name, value in placement.items():
        if value is not None and not isinstance(value, (int, float, np.floating, np.integer)):
            raise _core.Error(f"fit: {name} is {value!r}; expected a number, in {units_of[name]}")

    options = (law, starts, seed, *placement.values(), dict(columns or {}))
    if arrays:
        return _fit_table(_table_of(time, depth, force, units), options)
    if hasattr(files, "to_csv"):
        return _fit_table(files, options)
    if isinstance(files, (str, os.PathLike)) or not isinstance(files, Iterable):
        if os.path.isdir(os.fspath(files)):
            words = ["fit", os.fspath(files), "--no-draw", *_options(columns)]
            said = {"laws": law, "starts": starts, "seed": seed, **placement}
            for key, value in said.items():
                unit = " " + units_of[key] if key in units_of else ""
                words += [] if value is None else ["--" + key.replace("_", "-"), f"{value}{unit}"]
            return Specimens(_program.answer(words))
        files = [files]
    names = [os.fspath(f) for f in files]  # type: ignore[union-attr]
    return Fit(_core.fit(names, *options), _Inputs(tuple(os.path.abspath(n) for n in names), options))
