"""Laws and the paper's element, asked with protocols."""

from __future__ import annotations

import math
import numbers
import os
from typing import TYPE_CHECKING, Any, Mapping, overload

import numpy as np

from . import _core
from ._core import Protocol
from ._kinds import json_text, of_arguments, shown, told

if TYPE_CHECKING:
    import numpy.typing as npt

    Array = npt.NDArray[np.float64]


def numbers_of(where: str, values: Any) -> Array:
    """A list of numbers, none of them missing; raises tpmkit.ArgumentError in one sentence."""
    if isinstance(values, np.ma.MaskedArray) and np.ma.is_masked(values):
        raise _core.ArgumentError(f"{where} is masked at place {np.flatnonzero(np.ma.getmaskarray(values))[0]}; expected numbers")
    if hasattr(values, "magnitude") or hasattr(values, "unit"):  # of pint, of astropy
        raise _core.ArgumentError(f"{where} is a {type(values).__name__} with a unit of its own; expected plain numbers")
    if hasattr(values, "isna"):  # of pandas, whose NA is no float
        missing = np.flatnonzero(np.asarray(values.isna()))
        if missing.size:
            raise _core.ArgumentError(f"{where} is NaN at place {missing[0]}; expected numbers")
    try:
        array = np.asarray(values)
    except (TypeError, ValueError):
        raise _core.ArgumentError(f"{where} is {shown(values)}; expected a list of numbers") from None
    if array.dtype.kind in "mM":
        raise _core.ArgumentError(f'{where} holds {array.dtype}; expected numbers, such as (t - t[0]) / numpy.timedelta64(1, "s")')
    if array.ndim == 0 and array.dtype.kind not in "iuf":
        raise _core.ArgumentError(f"{where} is {shown(values)}; expected a list of numbers")
    if array.dtype.kind not in "iufO":
        raise _core.ArgumentError(f"{where} holds {array.dtype}; expected numbers")
    try:
        array = np.ascontiguousarray(array, dtype=float)
    except (TypeError, ValueError, OverflowError):
        raise _core.ArgumentError(f"{where} is {shown(values)}; expected a list of numbers") from None
    if array.ndim != 1:
        raise _core.ArgumentError(f"{where} has the shape {array.shape}; expected a list of numbers")
    bad = np.flatnonzero(np.isnan(array))
    if bad.size:
        raise _core.ArgumentError(f"{where} is NaN at place {bad[0]}; expected numbers")
    return array


def times_of(times: npt.ArrayLike, name: str = "times_s") -> Array:
    """A list of numbers, none of them NaN; raises tpmkit.ArgumentError in one sentence."""
    return numbers_of(f"{name}:", times)


def number_of(where: str, name: str, value: Any) -> float:
    """A finite number of Python or of numpy; raises tpmkit.ArgumentError in one sentence."""
    if not isinstance(value, numbers.Real) or isinstance(value, bool) or not math.isfinite(value):
        raise _core.ArgumentError(f"{where}: {name} is {value!r:.60}; expected a finite number, SI")
    return float(value)


def _told_protocols() -> None:
    """Gives the ways to make a Protocol, which are compiled, messages without types of C++, and histories one dimension."""
    for name in ("step_and_hold", "ramp_and_hold", "creep"):
        setattr(Protocol, name, staticmethod(told(of_arguments(getattr(Protocol, name)), f"Protocol.{name}")))
    compiled, value, scaled = of_arguments(Protocol.history), Protocol.value_at, Protocol.scaled

    def history(
        times_s: npt.ArrayLike, values: npt.ArrayLike, drive: str = "displacement", equilibrium_at_start: bool = False
    ) -> Protocol:
        """A measured history of depths (m; drive "displacement") or loads (N; drive "force"); times increase.
        equilibrium_at_start: the first value had been kept for ever before."""
        return compiled(times_of(times_s), times_of(values, "values"), drive, equilibrium_at_start)

    def value_at(self: Protocol, time_s: float) -> float:
        """The imposed value at a time (s); at a jump the one after it."""
        return value(self, times_of([time_s], "time_s")[0])

    def scaled_by(self: Protocol, factor: float) -> Protocol:
        """The same history with every value times a factor, which is finite."""
        return scaled(self, number_of("scaled", "factor", factor))

    def no_constructor(self: Protocol, *arguments: Any, **named: Any) -> None:
        raise _core.ArgumentError("Protocol: is not made by its name; expected Protocol.step_and_hold, ramp_and_hold, creep or history")

    Protocol.history = staticmethod(told(history, "Protocol.history"))  # type: ignore[method-assign]
    Protocol.value_at = value_at  # type: ignore[method-assign]
    Protocol.scaled = scaled_by  # type: ignore[method-assign]
    Protocol.__init__ = no_constructor  # type: ignore[method-assign]


_told_protocols()


def _with_units(law: str, parameters: Mapping[str, float]) -> dict[str, float]:
    """Parameters by name with SI unit, whose names may be those of a fit, which have none."""
    try:
        given = dict(parameters)
    except (TypeError, ValueError):
        raise _core.ArgumentError(f'law: parameters are {shown(parameters)}; expected them by name: {{"k_inf": 60.0, ...}}, SI') from None
    known = [key for key, _, _ in of_arguments(_core.law_parameters)(law)]
    named: dict[str, float] = {}
    for name, value in given.items():
        meant = [key for key in known if key.startswith(f"{name}_")]
        key = meant[0] if name not in known and len(meant) == 1 else name
        if key in named:
            raise _core.ArgumentError(f"law: {key} stands twice; expected each parameter once")
        if name == "drift":
            raise _core.ArgumentError("law: drift belongs to a recording, not to a law; expected the parameters without it, or fit.law")
        named[key] = number_of("law", name, value)
    return named


class Law:
    """One member of the family of laws (docs/laws.md) with its parameters.

        F(t) = offset + integral G(t - s) dV(u(s)) + k_tension T(u(t)),   u = max(drive - contact, 0)

    Parameters
    ----------
    name
        Kernel, branches and more: "linear-1", "power-2", "hertz-fzener". `Law.describe(name)` lists the
        parameters.
    parameters
        By name with SI unit: ``{"k_inf_N_per_m": 60, "k1_N_per_m": 40, "tau1_s": 0.5}``, or by the names of a fit,
        in SI: ``{"k_inf": 60, "k1": 40, "tau1": 0.5}``; the law of a fit is ``fit.law``. Parameters with a preset may
        be left out.
    reference
        Depth (m) or change of relative length at which coefficients are secants, above 0. It has no
        meaning for linear laws.
    drive, response
        "indentation_depth" and "contact_force" (m, N), or "relative_length" and "stress" (1, Pa).
    provenance
        Where the numbers come from: "assumed", "measured", "derived", ...

    Raises
    ------
    tpmkit.ArgumentError
        An unknown law, a missing or unknown parameter, a value out of range.
    """

    _core: _core.Law

    @told
    def __init__(
        self,
        name: str,
        parameters: Mapping[str, float],
        *,
        reference: float = 1e-3,
        drive: str = "indentation_depth",
        response: str = "contact_force",
        provenance: str = "assumed",
    ) -> None:
        key = "reference" if drive == "relative_length" else "reference_m"
        document: dict[str, Any] = {
            "law": name,
            "drive": drive,
            "response": response,
            key: number_of("law", "reference", reference),
            "parameters": _with_units(name, parameters),
            "provenance": provenance,
        }
        self._core = of_arguments(_core.Law.from_json)(json_text(document, "law"))

    @classmethod
    def _of(cls, core: _core.Law) -> Law:
        law = cls.__new__(cls)
        law._core = core
        return law

    @classmethod
    @told
    def read(cls, path: str | os.PathLike[str]) -> Law:
        """Reads a law file (schemas/law.schema.json), as `tpm fit` and `Law.write` make it."""
        return cls._of(_core.Law.read(os.fspath(path)))

    @classmethod
    def _from_json(cls, text: str) -> Law:
        return cls._of(_core.Law.from_json(text))

    def __reduce__(self) -> Any:
        return Law._from_json, (self._core.to_json(),)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Law) and self._core.to_json() == other._core.to_json()

    def __hash__(self) -> int:
        return hash(self._core.to_json())

    @staticmethod
    @told
    def describe(name: str) -> dict[str, tuple[str, str]]:
        """Parameters of a law: name to (SI unit, meaning)."""
        return {key: (unit, meaning) for key, unit, meaning in of_arguments(_core.law_parameters)(name)}

    @told
    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes a law file; haptic sessions and `tpm export` read it."""
        self._core.write(os.fspath(path))

    @property
    def name(self) -> str:
        """The short name, such as "power-2"."""
        return self._core.name

    @property
    def summary(self) -> str:
        """The law in words."""
        return self._core.summary

    @property
    def parameters(self) -> dict[str, float]:
        """Parameters by name with SI unit."""
        return self._core.parameters

    @property
    def provenance(self) -> str:
        """Where the numbers come from."""
        return self._core.provenance

    @property
    def reference(self) -> float:
        """Depth (m) or relative length at which coefficients are secants."""
        return self._core.reference

    @property
    def fitted_to(self) -> float | None:
        """Largest depth of the data that the law was fitted to; None if it was not fitted."""
        return self._core.fitted_to

    @overload
    def respond(self, protocol: Protocol, times_s: npt.ArrayLike) -> Array: ...
    @overload
    def respond(
        self, protocol: Protocol, times_s: npt.ArrayLike, *, sensitivity: bool
    ) -> Array | tuple[Array, Array]: ...
    @told
    def respond(
        self, protocol: Protocol, times_s: npt.ArrayLike, *, sensitivity: bool = False
    ) -> Array | tuple[Array, Array]:
        """The response at given times: a force (N) under a displacement, a depth (m) under a load.

        An array of doubles is read where it lies, and the answer is handed over; nothing is copied. With
        `sensitivity` the answer is (values, derivatives): n times by n parameters, in the order of
        `parameters`, SI over SI. A value that the law does not predict is NaN.
        """
        return of_arguments(self._core.respond)(protocol, times_of(times_s), sensitivity)

    @told
    def respond_spectrum(self, frequency_Hz: npt.ArrayLike) -> tuple[Array, Array]:
        """Storage and loss at given frequencies, about the reference depth; N/m, or Pa for a strip."""
        return of_arguments(self._core.respond_spectrum)(times_of(frequency_Hz, "frequency_Hz"))

    def __repr__(self) -> str:
        return repr(self._core)


class Element:
    """The paper's element: a spring E2 in series with a Kelvin-Voigt unit (E1, eta1), beside it the tension
    of two neighbours (Bao et al. 2013, Eqs. 1 to 9).

    Parameters
    ----------
    E1_Pa, E2_Pa, Eprime_Pa, eta1_Pa_s, spacing_m, A0_m2, l0_m
        As in docs/notation.md; all above 0 (E1 and E' may be 0).
    formulation
        "closed_form" (exact), or "cvodes", the differential equation, integrated.

    Raises
    ------
    tpmkit.ArgumentError
        A parameter out of range, an unknown formulation.
    """

    def __init__(
        self,
        E1_Pa: float = 12e3,
        E2_Pa: float = 12e3,
        Eprime_Pa: float = 12e3,
        eta1_Pa_s: float = 5.0,
        spacing_m: float = 0.030,
        A0_m2: float = 12.56e-6,
        l0_m: float = 1e-3,
        *,
        formulation: str = "closed_form",
    ) -> None:
        self.parameters = {
            "E1_Pa": E1_Pa,
            "E2_Pa": E2_Pa,
            "Eprime_Pa": Eprime_Pa,
            "eta1_Pa_s": eta1_Pa_s,
            "spacing_m": spacing_m,
            "A0_m2": A0_m2,
            "l0_m": l0_m,
        }
        for name, value in self.parameters.items():
            number = number_of("element", name, value)
            may_be_0 = name in ("E1_Pa", "Eprime_Pa")
            if number < 0.0 or (number == 0.0 and not may_be_0):
                raise _core.ArgumentError(f"element: {name} is {number:g}; expected a number {'of at least' if may_be_0 else 'above'} 0")
            self.parameters[name] = number
        if formulation not in ("closed_form", "cvodes"):
            raise _core.ArgumentError(f'element: formulation is {formulation!r:.60}; expected "closed_form" or "cvodes"')
        self.formulation = formulation

    @property
    def relaxation_time_s(self) -> float:
        """tau = eta1 / (E1 + E2), at constant elongation."""
        return self.parameters["eta1_Pa_s"] / (self.parameters["E1_Pa"] + self.parameters["E2_Pa"])

    @told
    def respond(
        self, protocol: Protocol, times_s: npt.ArrayLike, *, sensitivity: bool = False
    ) -> Array | tuple[Array, Array]:
        """The response at given times; see `Law.respond`. Derivatives are by E1, E2, E', eta1, x, A0, l0."""
        times = times_of(times_s)
        values = list(self.parameters.values())
        return of_arguments(_core.respond_element)(values, self.formulation, protocol, times, sensitivity)

    def __repr__(self) -> str:
        return "<tpmkit.Element " + ", ".join(f"{k}={v:g}" for k, v in self.parameters.items()) + ">"
