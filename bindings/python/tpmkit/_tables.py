"""Recordings in memory, as the files that they would be, and what is said about reading them."""

from __future__ import annotations

import numbers
import re
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from . import _core
from ._kinds import of_arguments, shown
from ._law import numbers_of

if TYPE_CHECKING:
    import pandas as pd
    import xarray

# What `columns` may say: the options of reading of the program, and where a recording comes from.
KEYS = ("encoding", "separator", "decimal", "thousands", "header_rows", "block", "time", "drive", "response", "sd", "frequency",
        "storage", "loss", "drive_quantity", "response_quantity", "negate_drive", "negate_response", "step_time", "from", "until",
        "rest_length", "area", "spring_constant", "deflection_sensitivity", "segments", "units", "provenance")
OF_FILES = ("encoding", "separator", "decimal", "thousands", "header_rows")  # how a file is written
TABLE = "table"  # what messages and answers call a recording in memory
Answer = TypeVar("Answer")


def options_of(columns: Mapping[str, Any]) -> list[str]:
    """What `columns` says as options of the program."""
    words: list[str] = []
    for key, value in columns.items():
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


def reading_of(where: str, columns: Mapping[str, Any] | None, units: Mapping[str, str] | None = None) -> dict[str, Any]:
    """`columns` of a call as a dict, with the units of columns by name among them."""
    for name, value in (("columns", columns), ("units", units)):
        if value is not None and not isinstance(value, Mapping):
            raise _core.ArgumentError(f"{where}: {name} is {shown(value)}; expected a dict")
    reading = dict(columns or {})
    unknown = [key for key in reading if key not in KEYS]
    if unknown:
        raise _core.ArgumentError(f"{where}: columns names {shown(unknown[0])}; expected keys of {', '.join(KEYS)}")
    said = reading.get("units", {})
    if not isinstance(said, Mapping):
        raise _core.ArgumentError(f'{where}: units is {shown(said)}; expected a dict such as {{"force": "mN"}}')
    if units or "units" in reading:
        reading["units"] = {**said, **(units or {})}
    for column, unit in reading.get("units", {}).items():
        if not isinstance(column, str) or not isinstance(unit, str):
            raise _core.ArgumentError(f'{where}: units has {shown(column)}: {shown(unit)}; expected two texts, such as "force": "mN"')
    segments = reading.get("segments")
    if segments is not None and (isinstance(segments, str) or not all(isinstance(s, str) for s in segments)):
        raise _core.ArgumentError(f"{where}: segments is {shown(segments)}; expected a list of texts")
    for key, value in reading.items():
        if key not in ("units", "segments") and not isinstance(value, (str, numbers.Real)):
            raise _core.ArgumentError(f"{where}: {key} is {shown(value)}; expected a text, a number or True")
    return reading


def is_table(value: Any) -> bool:
    """Is it a DataFrame, or a Dataset of xarray."""
    return hasattr(value, "to_csv") or hasattr(value, "to_dataframe")


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


# Units that are written between brackets behind the name of a quantity of a recording.
_BRACKETED = {"s", "ms", "min", "h", "m", "cm", "mm", "um", "nm", "%", "N", "kN", "mN", "uN", "nN", "pN", "g", "kg", "Pa", "kPa",
              "MPa", "GPa"}


def _with_titles(where: str, data: xarray.Dataset, units: Mapping[str, str]) -> xarray.Dataset:
    """The same with the attributes `units` in the names: force with the units "mN" becomes "force (mN)". Words between
    brackets that the attribute does not repeat stay where they are no unit of these quantities: "force (raw)". Raises
    tpmkit.ArgumentError where a name, or `units` of the call, says another unit."""
    from ._data import unit_of

    titles = {}
    for name, variable in data.variables.items():
        unit = variable.attrs.get("units")
        if not isinstance(unit, str) or not unit or not isinstance(name, str):
            continue
        inside = re.search(r"[(\[]([^()\[\]]*)[)\]]\s*$", name)
        own = (inside[1] if inside[1] in {unit, *_BRACKETED} else None) if inside else unit_of(name)
        for said, by in ((units.get(name), "units"), (own, "its name")):
            if said is not None and said != unit:
                raise _core.ArgumentError(f"{where}: {name} is in {unit} by its attribute and {by} says {said}; expected the same")
        if own is None and not name.endswith(f"_{unit}"):
            titles[name] = f"{name} ({unit})"
    return data.rename(titles)


def csv_of(where: str, table: Any, reading: Mapping[str, Any]) -> str:
    """A DataFrame, or a Dataset over one dimension, as a file of comma-separated values. An index without a name that
    counts rows is left out, as filtering leaves it behind. `reading` is what the call says of its columns."""
    import pandas as pd

    for key in OF_FILES:
        if key in reading:
            raise _core.ArgumentError(f"{where}: columns names {key}, which says how a file is written; expected none of "
                                      f"{', '.join(OF_FILES)} for numbers in memory")
    if hasattr(table, "to_dataframe"):
        if not hasattr(table, "data_vars"):
            raise _core.ArgumentError(f"{where}: a {type(table).__name__}; expected a Dataset, or a DataFrame")
        if len(table.dims) != 1:
            raise _core.ArgumentError(f"{where}: a Dataset over {', '.join(map(str, table.dims)) or 'nothing'}; expected one over "
                                      "time_s, as tpmkit.read_recording returns it")
        table = _with_titles(where, table, reading.get("units", {})).to_dataframe()
        if table.index.name == "sample":
            table.index.name = None
    if not isinstance(table, pd.DataFrame):
        raise _core.ArgumentError(f"{where}: a {type(table).__name__}; expected a DataFrame with columns of times, depths and forces")
    if table.empty or table.isna().to_numpy().all():
        raise _core.ArgumentError(f"{where}: the table has {len(table)} rows and {len(table.columns)} columns, and no number; "
                                  "expected times, depths and forces")
    index = table.index
    if any(name is not None for name in index.names):
        table = table.reset_index()
    elif index.nlevels > 1 or not pd.api.types.is_integer_dtype(index.dtype):
        raise _core.ArgumentError(f"{where}: the table's index has no name; expected "
                                  'frame.rename_axis("time (s)") to read it, or frame.reset_index(drop=True) to leave it out')
    for name, column in table.items():
        # A number as a name would be read as the first row.
        if not isinstance(name, str) or _is_number(name):
            raise _core.ArgumentError(f"{where}: a column of the table has the name {shown(name)}; expected texts with units, such as "
                                      '"time (s)", "depth (mm)", "force (mN)"')
        if column.dtype.kind == "m":
            raise _core.ArgumentError(f"{where}: {name} holds {column.dtype}; expected numbers, such as its .dt.total_seconds()")
        if column.dtype.kind == "c":
            raise _core.ArgumentError(f"{where}: {name} holds {column.dtype}; expected numbers")
    return table.to_csv(index=False)


def frame_of(where: str, arrays: Mapping[str, Any], units: Mapping[str, str] | None) -> pd.DataFrame:
    """Arrays by name, with units, as a table that reads like a file."""
    import pandas as pd

    missing = [name for name, values in arrays.items() if values is None]
    if missing:
        raise _core.ArgumentError(f"{where}: {' and '.join(missing)} missing; expected {', '.join(arrays)} together")
    if not isinstance(units, Mapping) or set(units) != set(arrays):
        raise _core.ArgumentError(f"{where}: units are not guessed; expected units="
                                  '{"time": "s", "depth": "mm", "force": "mN"}, one for each')
    for name, unit in units.items():
        if not isinstance(unit, str) or not unit.strip():
            raise _core.ArgumentError(f'{where}: units has {name!r}: {shown(unit)}; expected a text, such as "mN"')
    columns: dict[str, Any] = {}
    for name, values in arrays.items():
        own = getattr(values, "attrs", {}).get("units")  # of an array of xarray
        if own is not None and own != units[name]:
            raise _core.ArgumentError(f"{where}: {name} is in {own} and units says {units[name]}; expected the same")
        array = numbers_of(f"{where}: {name}", values)
        if columns and array.size != len(next(iter(columns.values()))):
            first = next(iter(arrays))
            raise _core.ArgumentError(f"{where}: {name} has {array.size} values and {first} "
                                      f"{len(next(iter(columns.values())))}; expected as many of each")
        bad = np.flatnonzero(~np.isfinite(array))
        if bad.size:
            raise _core.ArgumentError(f"{where}: {name} is {array[bad[0]]} at place {bad[0]}; expected finite numbers")
        columns[f"{name} ({units[name]})"] = array  # type: ignore[index]
    return pd.DataFrame(columns)


def renamed(value: Any, names: Mapping[str, str]) -> Any:
    """The same with the names of files that are gone replaced in every text; lines of a TABLE are counted as its rows."""
    if isinstance(value, str):
        for old, new in names.items():
            if new == TABLE:  # rows from 0, below a line of names
                value = re.sub(re.escape(old) + r":([2-9]|[1-9]\d+)\b", lambda line: f"{TABLE}: row {int(line[1]) - 2}", value)
            value = value.replace(old, new)
        return value
    if isinstance(value, list):
        return [renamed(v, names) for v in value]
    if isinstance(value, dict):
        return {renamed(k, names): renamed(v, names) for k, v in value.items()}
    return value


def same_error(error: _core.Error, names: Mapping[str, str]) -> _core.Error:
    """The same error with these names in its text."""
    told = type(error)(renamed(str(error), names))
    told.code = error.code
    return told


def by_file(csv: str, work: Callable[[str], Answer]) -> tuple[Answer, dict[str, str]]:
    """What `work` makes of a table as a file, and TABLE by the name of that file, which is gone."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "table.csv"
        file.write_text(csv, encoding="utf-8", newline="")
        names = {str(file): TABLE}
        try:
            return of_arguments(work)(str(file)), names
        except _core.Error as error:
            refusal = same_error(error, names)
            said = type(refusal)(re.sub(r'\bunit "([^"]*)=UNIT"', r'units={"\1": UNIT}', str(refusal)))
            said.code = refusal.code
            raise said from None
