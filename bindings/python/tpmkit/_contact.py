"""Contacts for loops of one's own, and sessions on the simulated device."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, Callable

import numpy as np

from . import _core, _kinds
from ._run import shown

MOST_MISSED = 2**20  # far above what stops a contact
NO_DEVICE = (
    "no device is named: stability is that of the simulated Omega.7, and no limit of a device was checked; "
    "name device or device_file before the forces go to motors"
)

if TYPE_CHECKING:
    import numpy.typing as npt

    Array = npt.NDArray[np.float64]


def _numbers(where: str, name: str, values: Any, shape: tuple[int | None, ...], expected: str) -> Array:
    """An argument as an array of this shape; None is a length of any size."""
    try:
        array = np.ascontiguousarray(values, dtype=float)
    except (TypeError, ValueError):
        raise _core.ArgumentError(f"{where}: {name} is {values!r:.60}; expected {expected}") from None
    if len(array.shape) != len(shape) or any(n not in (None, m) for n, m in zip(shape, array.shape)):
        raise _core.ArgumentError(f"{where}: {name} has the shape {array.shape}; expected {expected}")
    return array


def _number(where: str, name: str, value: Any) -> float:
    """An argument that is a real number, of Python or of numpy; its name ends in its unit."""
    try:
        if isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool):
            return float(value)
    except OverflowError:
        pass
    raise _core.ArgumentError(f"{where}: {name} is {value!r:.60}; expected a number, in {name.rpartition('_')[2]}")


class Contact:
    """A tissue at a tool, stepped once in every period of a servo loop.

    A step is a whole cycle of `tpm hil run`: one-sided contact, limits of the force and of its rise,
    passivity, watch of energy and oscillation. The same contact in C: tpmkit/haptics.h.

    Parameters
    ----------
    file
        A session (schemas/hil.schema.json) or a law file.
    rate_Hz
        Of the loop, 500 to 4000. Default: that of the file, or 1000.
    start_gate
        Forces wait until the tool was in free air and at rest for 0.25 s.
    longest_s
        Of a law file: for how long spring-pots keep their history.
    accept_unstable
        Open what would be unstable on the device. Only with device="virtual".
    device
        Whose limits apply, as `tpm hil run --device` takes it, but for "replay". Default: the device of
        `device_file`. "virtual" where nothing has motors: forces are computed, and nobody feels them. Without a device
        and a `device_file` the contact is opened as that of "virtual", and a warning says that no limit of a device
        was checked.
    device_file
        What is known of your device: limits, and the delay and friction that `tpm hil identify` measured
        (schemas/device.schema.json). Without a measured delay a device with motors counts as 20 ms late and free of
        friction, and a tissue above 49 N/m (at 1 kHz) is refused.

    Raises
    ------
    tpmkit.Error
        A file that cannot be read; a rendering that would be unstable.
    """

    @_kinds.told
    def __init__(
        self,
        file: str | os.PathLike[str],
        *,
        rate_Hz: float = 0.0,
        start_gate: bool = True,
        longest_s: float = 600.0,
        accept_unstable: bool = False,
        device: str = "",
        device_file: str | os.PathLike[str] = "",
    ) -> None:
        rate, longest = _number("contact", "rate_Hz", rate_Hz), _number("contact", "longest_s", longest_s)
        device_path = os.fspath(device_file)
        # What may be unstable is opened only for a caller who says that nothing has motors.
        self._no_device = device == "" and device_path == "" and not accept_unstable
        named = "virtual" if self._no_device else device
        self._core = _core.Contact(os.fspath(file), rate, start_gate, longest, accept_unstable, named, device_path)

    def step(self, position_m: npt.ArrayLike, *, missed: int = 0) -> Array:
        """One period: position of the tool (m) to force on the hand (N), both in device coordinates.

        `missed` periods without a step, 0 or more, are lived through. Raises tpmkit.Error once the contact has stopped,
        tpmkit.ArgumentError (a ValueError) for an argument of another kind or range.
        """
        if not isinstance(missed, (int, np.integer)) or isinstance(missed, bool) or missed < 0:
            raise _core.ArgumentError(f"step: missed is {missed!r:.60}; expected a whole number of periods, 0 or more")
        place = _numbers("step", "position_m", position_m, (3,), "three numbers, m")
        return self._core.step(place, min(int(missed), MOST_MISSED))

    def step_at(self, t_s: float, position_m: npt.ArrayLike) -> Array:
        """The same at the time `t_s` of your clock, from which the number of periods since the last call follows.

        A loop that runs at another rate than the contact lives through the same time as the tissue. A faster one receives
        the force of the last period in between; one that misses periods in too many calls is stopped. The mean rate
        counts: intervals may vary by up to 80 % of a period about it.

        `t_s` are seconds of a clock that does not jump, such as time.monotonic(), rising from call to call, at most 1e10.
        Raises tpmkit.Error once the contact has stopped, tpmkit.ArgumentError (a ValueError) for a time that is not finite,
        is larger, lies before that of the last call, or is the same in more than 100 calls in a row.
        """
        place = _numbers("step_at", "position_m", position_m, (3,), "three numbers, m")
        force = self._core.step_at(_number("step_at", "t_s", t_s), place)
        if force is None:
            raise _core.ArgumentError(f"step_at: t_s is {t_s!r:.60}; expected seconds that rise with the calls, at most 1e10")
        return force

    def steps(self, positions_m: npt.ArrayLike) -> Array:
        """Many periods: positions of shape (n, 3) to forces of shape (n, 3)."""
        return self._core.steps(_numbers("steps", "positions_m", positions_m, (None, 3), "a table of three columns, m"))

    def push(self, depths_m: npt.ArrayLike) -> Array:
        """Many periods along the push: depths below the surface at rest to forces against the push, N."""
        depths = _numbers("push", "depths_m", depths_m, (None,), "a list of numbers, m")
        push, surface = self.info["push"], self.info["surface_m"]
        return -self.steps(surface + depths[:, None] * push) @ push

    def reset(self) -> None:
        """Back to rest; a contact that has stopped goes on."""
        self._core.reset()

    @property
    def state(self) -> dict[str, Any]:
        """The newest step: time_s, position_m, force_N, tool_depth_m, surface_depth_m, model_force_N,
        model_error_N, touching, waiting, valid, stop."""
        return self._core.state

    @property
    def info(self) -> dict[str, Any]:
        """What does not change: model, error_bound, period_s, stiffness and its limits of stability and passivity,
        verdict, warnings, surface_m, push, force_limit_N, spheres."""
        found = self._core.info
        if self._no_device:
            found["warnings"] = [NO_DEVICE, *found["warnings"]]
        return found

    @property
    def adequacy(self) -> dict[str, Any]:
        """Whether the contact can be rendered on the device: `verdict` (adequate: passive or stable, within the
        device and safe in six hands; not_adequate) and `summary`. Whether its forces are those of the tissue only
        `tpm hil verify` and `tpmkit.validate` say."""
        info = self.info
        verdict = "adequate" if info["passive"] or info["acceptable"] else "not_adequate"
        return {"verdict": verdict, "summary": f"{info['verdict']}; error of the model: {info['error_bound']}"}

    @property
    def warnings(self) -> list[str]:
        """What a reader must know of the device and of this rendering; once the contact has stopped, why."""
        found = list(self.info["warnings"])
        if self.state["stop"] not in ("", "none", "still running"):
            found.append(f"has stopped: {self.state['stop']}; reset() before the next step")
        return found

    @property
    def positions_m(self) -> Array:
        """Centres of all spheres, shape (n, 3), in the coordinates of the scene."""
        return self._core.positions()

    def __repr__(self) -> str:
        lines = [f"<tpmkit.Contact {self.info['model']}", f"  adequacy: {self.adequacy['summary']}"]
        return "\n".join(lines + [f"  warning: {w}" for w in self.warnings]) + ">"


@_kinds.told
def run_session(
    session: str | os.PathLike[str],
    output: str | os.PathLike[str],
    *,
    law: str | os.PathLike[str] = "",
    accept_unstable: bool = False,
    progress: bool | Callable[[int, int], None] = False,
) -> str:
    """Runs a session on the simulated device, as fast as it goes, and records it (`tpm hil run --device
    virtual`).

    `law` replaces the session's tissue. `accept_unstable` runs what would be unstable. `progress` is True for a line on
    standard error, or is called with (phases done, phases). Returns the cause of the end, "finished" if all went well; `tpmkit.open(output)`
    opens the recording.
    """
    with shown(progress, "session") as told:
        return _core.run_session(os.fspath(session), os.fspath(output), os.fspath(law), accept_unstable, told)
