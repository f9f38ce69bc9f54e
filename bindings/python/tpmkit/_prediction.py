"""The answers of `Fit.predict` and `Fit.young_moduli`."""

from __future__ import annotations

import html
from typing import Any

import pandas as pd


class Prediction(pd.DataFrame):
    """A table that follows from a fit: of `Fit.predict` value and standard_error by time_s, of `Fit.young_moduli` the moduli.

    It is a DataFrame whose `attrs` hold adequacy and warnings; parts of it keep them.
    """

    @property
    def _constructor(self) -> type[Prediction]:
        return Prediction

    @property
    def warnings(self) -> list[str]:
        """What a reader must know: where it extrapolates beyond what the law was fitted to, and what is known
        against the law."""
        return self.attrs.get("warnings", [])

    @property
    def adequacy(self) -> dict[str, Any] | None:
        """Whether the law describes the data that it was fitted to, as `Fit.adequacy`; None in a table made of others."""
        return self.attrs.get("adequacy")

    def _remarks_shown(self) -> list[str]:
        adequacy = self.adequacy["summary"] if self.adequacy else "not known"
        return [f"adequacy: {adequacy}", *(f"warning: {w}" for w in self.warnings if w != adequacy)]

    def __repr__(self) -> str:
        return "\n".join([super().__repr__(), *self._remarks_shown()])

    def _repr_html_(self) -> Any:
        table = super()._repr_html_()  # type: ignore[operator]
        return table and table + "".join(f"<p>{html.escape(words)}</p>" for words in self._remarks_shown())
