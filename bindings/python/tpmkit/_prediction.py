"""The answer of `Fit.predict`."""

from __future__ import annotations

import html
from typing import Any

import pandas as pd


class Prediction(pd.DataFrame):
    """What a fitted law answers, by time_s: value and standard_error; `warnings` are those of `tpm predict`.

    It is a DataFrame whose `attrs` hold the warnings; parts of it keep them.
    """

    @property
    def _constructor(self) -> type[Prediction]:
        return Prediction

    @property
    def warnings(self) -> list[str]:
        """What a reader must know: where it extrapolates beyond what the law was fitted to, and what is known
        against the law."""
        return self.attrs.get("warnings", [])

    def __repr__(self) -> str:
        return "\n".join([super().__repr__(), *(f"warning: {w}" for w in self.warnings)])

    def _repr_html_(self) -> Any:
        table = super()._repr_html_()  # type: ignore[operator]
        return table and table + "".join(f"<p>warning: {html.escape(w)}</p>" for w in self.warnings)
