"""Arguments of a wrong kind, in one sentence."""

from __future__ import annotations

import functools
import importlib
import json
import numbers
import os
from typing import Any, Callable, Mapping, TypeVar

from . import _core

# What pybind11, os.fspath() and pathlib say of an argument of another kind.
KINDS = ("incompatible function arguments", "incompatible constructor", "expected str, bytes or os.PathLike object",
         "argument should be a str")
USAGE, BAD_INPUT, ENVIRONMENT = 2, 3, 5  # exit codes of the program, as Error.code
Function = TypeVar("Function", bound=Callable[..., Any])


def shown(value: Any) -> str:
    """A value in a message; of anything but a text, a number or a list of them the name of its type alone."""
    if value is None or isinstance(value, (str, bytes, numbers.Number, os.PathLike, list, tuple, dict)):
        text = repr(value)[:40]
        if "\n" not in text:
            return text
    return f"a {type(value).__name__}"


def of_arguments(function: Any) -> Any:
    """A function of nothing but arguments: what it refuses of them is an ArgumentError."""

    @functools.wraps(function)
    def call(*arguments: Any, **named: Any) -> Any:
        try:
            return function(*arguments, **named)
        except _core.ArgumentError:
            raise
        except _core.Error as error:
            if error.code > BAD_INPUT:
                raise
            refusal = _core.ArgumentError(str(error))
            refusal.code = error.code
            raise refusal from None

    return call


def needed(module: str, where: str) -> Any:
    """A module that only this call needs; raises tpmkit.Error in one sentence where it is not installed."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        name = module.partition(".")[0]
        missing = _core.Error(f"{where}: Python cannot import {name} ({error}); expected it installed, as the Debian package python3-{name}")
        missing.code = ENVIRONMENT
        raise missing from None


def json_text(document: Mapping[str, Any], where: str) -> str:
    """A dict as JSON. Numbers and arrays of numpy, and paths, may stand in it; NaN may not."""

    def plain(value: Any) -> Any:
        if isinstance(value, os.PathLike):
            return os.fspath(value)
        if hasattr(value, "tolist"):
            return value.tolist()
        raise TypeError(f"a {type(value).__name__}")

    try:
        return json.dumps(dict(document), default=plain, allow_nan=False)
    except ValueError:
        words = "holds NaN, an infinite number or itself; expected finite numbers, texts, lists and dicts"
    except TypeError as error:
        words = f"holds {error}; expected numbers, texts, lists and dicts"
    raise _core.ArgumentError(f"{where}: {words}")


def told(function: Function, name: str | None = None) -> Function:
    """The function, whose arguments of a kind that the compiled part does not take, or that are no paths, raise
    tpmkit.ArgumentError in a sentence without its types of C++. `name` is what messages call it."""
    known = name or function.__qualname__.removesuffix(".__init__")

    @functools.wraps(function)
    def call(*arguments: Any, **named: Any) -> Any:
        try:
            return function(*arguments, **named)
        except TypeError as error:
            if not any(said in str(error) for said in KINDS):
                raise
        owner = function.__qualname__.rpartition(".")[0]
        if owner and arguments and owner in (type(arguments[0]).__qualname__, getattr(arguments[0], "__qualname__", "")):
            arguments = arguments[1:]  # without self, or the class
        given = ", ".join([shown(a) for a in arguments] + [f"{k}={shown(v)}" for k, v in named.items()])
        words = f"{known}({given}): an argument is missing or of a wrong kind; expected what help(tpmkit.{known}) says"
        raise _core.ArgumentError(words)

    return call  # type: ignore[return-value]
