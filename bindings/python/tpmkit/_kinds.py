"""Arguments of a wrong kind, in one sentence."""

from __future__ import annotations

import functools
import json
import os
from typing import Any, Callable, Mapping, TypeVar

from . import _core

# What pybind11 and os.fspath() say of an argument of another kind.
KINDS = ("incompatible function arguments", "incompatible constructor", "expected str, bytes or os.PathLike object")
Function = TypeVar("Function", bound=Callable[..., Any])


def shown(value: Any) -> str:
    """A value in a message; of what tpmkit made its name alone."""
    return f"a {type(value).__name__}" if hasattr(value, "_core") else repr(value)[:40]


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
