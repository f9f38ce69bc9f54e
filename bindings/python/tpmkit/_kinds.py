"""Arguments of a wrong kind, in one sentence."""

from __future__ import annotations

import functools
from typing import Any, Callable, TypeVar

from . import _core

# What pybind11 and os.fspath() say of an argument of another kind.
KINDS = ("incompatible function arguments", "incompatible constructor", "expected str, bytes or os.PathLike object")
Function = TypeVar("Function", bound=Callable[..., Any])


def shown(value: Any) -> str:
    """A value in a message; of what tpmkit made its name alone."""
    return f"a {type(value).__name__}" if hasattr(value, "_core") else repr(value)[:40]


def told(function: Function) -> Function:
    """The function, whose arguments of a kind that the compiled part does not take, or that are no paths, raise
    tpmkit.ArgumentError in a sentence without its types of C++."""

    @functools.wraps(function)
    def call(*arguments: Any, **named: Any) -> Any:
        try:
            return function(*arguments, **named)
        except TypeError as error:
            if not any(said in str(error) for said in KINDS):
                raise
        name = function.__qualname__.removesuffix(".__init__")
        owner = function.__qualname__.rpartition(".")[0]
        if owner and arguments and owner in (type(arguments[0]).__qualname__, getattr(arguments[0], "__qualname__", "")):
            arguments = arguments[1:]  # without self, or the class
        given = ", ".join([shown(a) for a in arguments] + [f"{k}={shown(v)}" for k, v in named.items()])
        words = f"{name}({given}): an argument is of a wrong kind; expected what help(tpmkit.{name}) says"
        raise _core.ArgumentError(words)

    return call  # type: ignore[return-value]
