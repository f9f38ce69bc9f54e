"""Recordings, results and sessions as xarray."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any, Iterator, Mapping

from . import _core
from ._kinds import needed, told
from ._tables import reading_of

if TYPE_CHECKING:
    import xarray

COMPUTED = "undetermined: a computed answer, compared with no measurement (tpmkit.validate)"
_UNITS = {"N", "m", "s", "Pa", "J", "Hz", "rad", "kg"}


def unit_of(key: str) -> str | None:
    """The unit that a key ends in, as text: "rate_m_per_s" to "m/s"; None if it ends in none."""
    words = key.split("_")
    if words[-1] not in _UNITS:
        return None
    if len(words) > 2 and words[-2] == "per":
        above = unit_of("_".join(words[:-2]))
        return f"{above or '1'}/{words[-1]}"
    if len(words) > 2 and words[-2] in _UNITS:  # Pa_s
        return f"{words[-2]} {words[-1]}"
    return words[-1]


def with_units(data: xarray.Dataset) -> xarray.Dataset:
    """The same, each variable with the unit of its name as attribute `units`, where it has none."""
    for key, variable in data.variables.items():
        unit = unit_of(str(key))
        if unit is not None:
            variable.attrs.setdefault("units", unit)
    return data


@told
def example(name: str | os.PathLike[str]) -> Path:
    """A file that comes with tpmkit, by its path, ``example("configs/liver_poke.json")``, or by its name alone,
    ``example("recording.csv")``. Raises tpmkit.Error if there is none, or several of that name."""
    asked, share = Path(name), Path(_core.share_dir())
    path = share / asked
    if path.is_file() and path.resolve().is_relative_to(share.resolve()):
        return path
    if asked.name != str(asked):
        folder = path.parent
        inside = folder.is_dir() and folder.resolve().is_relative_to(share.resolve())
        there = sorted(p.name for p in folder.iterdir() if p.is_file()) if inside else []
    else:
        found = [p for folder in ("configs", "data") for p in sorted((share / folder).rglob("*")) if p.is_file() and p.name == asked.name]
        if len(found) == 1:
            return found[0]
        there = [str(p.relative_to(share)) for p in found]
    raise _core.Error(f"example: there is no file, or not one alone, of the name {name}; expected "
                      + (f"one of {', '.join(there)}" if there else "a file of configs/ or data/, such as recording.csv"))


@told
def read_recording(path: str | os.PathLike[str], *, columns: Mapping[str, Any] | None = None) -> xarray.Dataset:
    """A measured recording as a Dataset over time_s (over the sample, if the file has no times): drive and
    response under their names with unit. `columns` as for `tpmkit.fit`; attrs: title, citation, provenance,
    sha256, and `findings`, what was understood of the file."""
    import numpy as np
    import xarray

    r = _core.read_recording(os.fspath(path), reading_of("read_recording", columns))
    n = len(r["response"])
    timed = len(r["time_s"]) == n
    along = "time_s" if timed else "sample"
    variables = {r["response_key"]: (along, r["response"])}
    if len(r["drive"]) == n:
        variables[r["drive_key"]] = (along, r["drive"])
    attrs = {k: r[k] for k in ("id", "title", "citation", "provenance", "sha256")}
    attrs["findings"] = "; ".join(f"{what}: {value}" for what, value in r["findings"])
    return with_units(xarray.Dataset(variables, coords={along: r["time_s"] if timed else np.arange(n)}, attrs=attrs))


def open_session(path: str | os.PathLike[str]) -> xarray.Dataset:
    """A recording of `tpm hil run` as a Dataset over time_s: positions, forces, depths, flags. The phases
    are in `phase_name`, `phase_start_s` and `phase_end_s`. attrs: `device` (SIMULATED DEVICE where no motor is
    known to have moved), `simulated_device`, `header` (JSON), `adequacy`, and `warnings`, a list: damage, how it
    ended if not as planned, what was known of the rendering."""
    import xarray

    r = _core.read_session_recording(os.fspath(path))
    columns = dict(r["columns"])
    time_s = columns.pop("time_s")
    variables: dict[str, Any] = {k: ("time_s", v) for k, v in columns.items()}
    for k in ("phase", "flags"):
        variables[k] = ("time_s", columns[k].astype("int64"))
    names, starts, ends = zip(*r["phases"])
    variables["phase_name"] = ("phase_number", list(names))
    variables["phase_start_s"] = ("phase_number", list(starts))
    variables["phase_end_s"] = ("phase_number", list(ends))
    attrs = {"device": r["device"], "simulated_device": int(r["simulated"]), "header": r["header"]}
    if r["damage"]:
        attrs["damage"] = r["damage"]
    attrs["adequacy"] = "undetermined: tpm hil verify compares the forces with the full network"
    attrs["warnings"] = list(r["warnings"])
    return with_units(xarray.Dataset(variables, coords={"time_s": time_s}, attrs=attrs))


def open_sweep(path: str | os.PathLike[str]) -> xarray.Dataset:
    """Results of `tpm sweep`: variables over the axes, with units; status 0 where a cell has an answer."""
    import xarray

    needed("h5netcdf", "open")
    # Without xarray's lock, which cannot be pickled: h5py has one of its own.
    data = xarray.open_dataset(os.fspath(path), engine="h5netcdf", lock=False)
    wrong = int((data["status"] != 0).sum())
    data.attrs["adequacy"] = "undetermined: computed answers, compared with no measurement"
    data.attrs["warnings"] = [f"{wrong} of {data['status'].size} cells have no answer; status and reason say why"] if wrong else []
    return data


def _passed_limits(file: Any) -> Iterator[str]:
    """Limits of validity that a run passed, of its file."""
    for limit in file["validity"].values():
        if "passed" not in limit.attrs:
            continue
        if limit.attrs["passed"]:
            meaning = limit.attrs["meaning"]
            meaning = meaning.decode() if isinstance(meaning, bytes) else meaning
            yield f"{meaning}: from {limit['first_time_s'][()].ravel()[0]:.4g} s on"


def open_simulation(path: str | os.PathLike[str]) -> xarray.Dataset:
    """Results of `tpm simulate`, as `tpmkit.simulate` returns them. The library has no reader for its own
    results; h5py reads them here."""
    import numpy as np
    import xarray

    h5py = needed("h5py", "open")

    with h5py.File(os.fspath(path), "r") as file:
        curve = {k: v[()].ravel() for k, v in file["curve"].items()}
        times = file["steps/time_s"][()].ravel()
        steps = sorted(k for k in file["steps"] if k != "time_s")
        positions = np.stack([file["steps"][k]["position_m"][()] for k in steps])
        attrs = {k: v.decode() if isinstance(v, bytes) else v for k, v in file.attrs.items()}
        attrs["warnings"] = list(_passed_limits(file)) if "validity" in file else []
    time_s = curve.pop("time_s")
    variables: dict[str, Any] = {k: ("time_s", v) for k, v in curve.items()}
    variables["position_m"] = (("output_s", "sphere", "axis"), positions)
    coords = {"time_s": time_s, "output_s": times, "sphere": np.arange(1, positions.shape[1] + 1), "axis": ["x", "y", "z"]}
    attrs["adequacy"] = COMPUTED
    return with_units(xarray.Dataset(variables, coords=coords, attrs=attrs))


@told
def open(path: str | os.PathLike[str]) -> xarray.Dataset:  # noqa: A001: tpmkit.open, as xarray.open_dataset
    """Opens what tpm wrote, or a measured recording, as an xarray Dataset.

    `.h5`: results of `tpm simulate` or `tpm sweep`; `.tpmrec`: a session of `tpm hil run`; anything else: a
    measured recording (`read_recording`).
    """
    suffix = Path(path).suffix
    if suffix == ".tpmrec":
        return open_session(path)
    if suffix != ".h5":
        return read_recording(path)
    if not Path(path).is_file():
        raise _core.Error(f"{os.fspath(path)}: there is no such file; expected a result of tpm simulate or tpm sweep")
    h5py, wanted = needed("h5py", "open"), "expected a result of tpm simulate or tpm sweep"
    try:
        with h5py.File(os.fspath(path), "r") as file:
            keys = set(file)
    except OSError as error:
        raise _core.Error(f"{os.fspath(path)}: is no HDF5 file that can be read ({error}); {wanted}") from None
    if {"steps", "curve"} <= keys:
        return open_simulation(path)
    if "status" in keys:
        return open_sweep(path)
    raise _core.Error(f"{os.fspath(path)}: is an HDF5 file of another kind; {wanted}")
