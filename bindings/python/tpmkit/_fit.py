"""Fits of recordings, material functions and configurations."""

from __future__ import annotations

import json
import os
from typing import TYPE_CHECKING, Any, Mapping, Sequence, Union

import numpy as np
import numpy.typing as npt
import pandas as pd

from . import _core
from ._core import Protocol
from ._law import Law

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PathLike = Union[str, "os.PathLike[str]"]


class Fit:
    """What a fit found. Made by `tpmkit.fit`."""

    def __init__(self, core: _core.Fit) -> None:
        self._core = core

    @property
    def parameters(self) -> pd.DataFrame:
        """One row per estimated parameter, by name; SI.

        Columns: estimate, standard_error (linearised), lower and upper (limits by profile likelihood; NaN
        where the data give none), unit, verdict, nuisance (belongs to the recording), only_if_described (the
        law does not describe the data: the row holds only if it did), words.
        """
        columns = ["name", "estimate", "standard_error", "lower", "upper", "unit", "verdict", "nuisance",
                   "only_if_described", "words"]
        table = pd.DataFrame(self._core.parameters, columns=columns).set_index("name")
        numbers = ["estimate", "standard_error", "lower", "upper"]
        table[numbers] = table[numbers].astype(float)
        return table

    @property
    def verdicts(self) -> pd.Series:
        """What the data say about each parameter: "identified", "flat", "lower_only", ..."""
        return self.parameters["verdict"]

    @property
    def correlation(self) -> pd.DataFrame:
        """Correlation of the free parameters (in the coordinates of the search), from the covariance."""
        free = json.loads(self._core.to_json())
        names = (free.get("fit") or free)["linearised"]["parameters"]
        return pd.DataFrame(self._core.correlation, index=names, columns=names)

    @property
    def law(self) -> Law:
        """The fitted law. Raises tpmkit.Error for a configuration without one."""
        return Law._of(_core.Law.from_json(self._core.law_json))

    @property
    def laws(self) -> pd.DataFrame:
        """The laws that were tried, by rising BIC: parameters, residual, delta_bic, why one is not
        identified. Empty for a configuration."""
        laws = json.loads(self._core.to_json()).get("laws", [])
        columns = ["law", "words", "parameters_estimated", "rms_over_peak", "delta_bic", "identified", "reason"]
        return pd.DataFrame(laws, columns=columns).set_index("law")

    @property
    def preferred(self) -> dict[str, Any] | None:
        """The law of the lowest BIC, where the data prefer it by more than 10 in BIC to the law that is
        recommended but do not identify its parameters: `law`, `ahead_in_bic`, `not_identified_because`, and its
        whole `fit`. Neither law answers alone then. None: the recommended law does."""
        return json.loads(self._core.to_json()).get("preferred")

    @property
    def adequacy(self) -> dict[str, Any] | None:
        """Whether the law describes the data: `verdict` (adequate, not_described, not_judged), `words`,
        `residual_over_noise` where it was judged, `causes` where it is not described. None: not tested."""
        return json.loads(self._core.adequacy_json)

    @property
    def words(self) -> list[str]:
        """The recommendation and its reasons."""
        return self._core.words

    @property
    def warnings(self) -> list[str]:
        """What the experiment cannot tell, and what a reader must know."""
        adequacy = self.adequacy
        first = [adequacy["words"]] if adequacy and adequacy["verdict"] != "adequate" else []
        return first + self._core.warnings + self._core.flags

    @property
    def data(self) -> list[pd.DataFrame]:
        """One DataFrame per recording: time_s, drive, observed, predicted, lower, upper (where one new sample
        falls), fitted. `attrs` holds dataset, provenance, and names of drive and response with unit."""
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
        times = np.ascontiguousarray(times_s, dtype=float)
        value, error = self._core.predict(protocol, times, dataset)
        return pd.DataFrame({"value": value, "standard_error": error}, index=pd.Index(times, name="time_s"))

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

    def save(self, folder: PathLike) -> list[str]:
        """Writes configuration, law, selection and figures, as `tpm fit` does. Figures are drawn by the
        Python that has matplotlib, in another process.

        Returns the names of the files.
        """
        return self._core.write(os.fspath(folder))

    def to_dict(self) -> dict[str, Any]:
        """Everything, as `tpm fit --format json` writes it (keys in docs/fit_results.md)."""
        return json.loads(self._core.to_json())

    def __str__(self) -> str:
        return self._core.text()

    def __repr__(self) -> str:
        names = ", ".join(self.parameters.index)
        return f"<tpmkit.Fit of {names}>"

    def _repr_html_(self) -> str:
        return self.parameters.to_html(float_format=lambda v: f"{v:.4g}")


def fit(
    files: PathLike | Sequence[PathLike],
    *,
    law: str | None = None,
    starts: int | None = None,
    seed: int | None = None,
    reference: float | None = None,
    contact: float | None = None,
    zero: float | None = None,
    columns: Mapping[str, Any] | None = None,
) -> Fit:
    """Fits a law to recordings, or what a configuration says.

    Parameters
    ----------
    files
        A recording (any delimited text with times, depths and forces; a header that names units), several
        to be fitted together, a spectrum, a relaxation modulus, a creep compliance, or a configuration
        (schemas/fit.schema.json).
    law
        Fit this one ("power-2") instead of the least law that the recordings support.
    starts, seed
        Number of starts and seed of the search; equal seeds give equal answers.
    reference
        Depth (m) at which coefficients are secants. Default: the largest.
    contact, zero
        Depth of contact (m) and reading without a load (N) of recordings, to be held. Default: measured, with
        their uncertainties.
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
    if isinstance(files, (str, os.PathLike)):
        files = [files]
    names = [os.fspath(f) for f in files]
    return Fit(_core.fit(names, law, starts, seed, reference, contact, zero, dict(columns or {})))
