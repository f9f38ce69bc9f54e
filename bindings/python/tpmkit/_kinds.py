"""Arguments of a wrong kind, in one sentence."""

from __future__ import annotations

import functools
from typing import Any, Callable, TypeVar

from . import _core

Function = TypeVar("Function", bound=Callable[..., Any])


def told(function: Function) -> Function:
    """The function, whose arguments of a kind that the compiled part does not take raise tpmkit.Error in a sentence
    without its types of C++."""

    @functools.wraps(function)
    def call(*arguments: Any, **named: Any) -> Any:
        try:
            return function(*arguments, **named)
        except TypeError as error:
            if "incompatible function arguments" not in str(error) and "incompatible constructor" not in str(error):
                raise
        name = function.__qualname__.removesuffix(".__init__")
        given = ", ".join([repr(a)[:40] for a in arguments if not hasattr(a, "_core")]
                          + [f"{k}={v!r}"[:40] for k, v in named.items()])
        refused = _core.Error(f"{name}({given}): an argument is of a wrong kind; expected what help(tpmkit.{name}) says")
        refused.code = 2
        raise refused

    return call  # type: ignore[return-value]
