"""Fits of the recordings of a folder."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas as pd


class Specimens:
    """Fits of the recordings of a folder, pooled. Made by `tpmkit.fit(folder)`."""

    def __init__(self, document: dict[str, Any]) -> None:
        self._document = document

    @property
    def law(self) -> str:
        """The name of the law that all recordings were fitted with; `why` says how it was chosen."""
        return self._document["law"]

    @property
    def why(self) -> str:
        """How the law was chosen."""
        return self._document["why"]

    @property
    def pooled(self) -> pd.DataFrame:
        """One row per material parameter, by name, SI: typical, lower, upper, unit, specimens, left_out, identified,
        only_if_described (the law does not describe all recordings: the row holds only if it did), only_without (what
        no recording tells it from; empty: nothing), i_squared, summary."""
        import pandas as pd

        rows = []
        for p in self._document["pooled"]:
            lower, upper = p.get("interval_SI") or (None, None)
            rows.append({"name": p["name"], "typical": p.get("typical_SI"), "lower": lower, "upper": upper,
                         "unit": p["unit"], "specimens": p["specimens"], "left_out": p["left_out"],
                         "identified": p["identified"], "only_if_described": p.get("only_if_described", False),
                         "only_without": p.get("only_without", {}).get("text", ""), "i_squared": p.get("i_squared"),
                         "summary": p["summary"]})
        table = pd.DataFrame(rows).set_index("name")
        for column in ("typical", "lower", "upper"):
            table[column] = table[column].astype(float)
        return table

    @property
    def adequacy(self) -> dict[str, Any]:
        """Whether the law describes the recordings: `verdict` (not_described if one recording says so, else not_judged
        if one cannot be judged, else adequate), `summary`, and the names of the recordings by verdict."""
        names: dict[str, list[str]] = {}
        for r in self.recordings:
            said = (r.get("fit") or {}).get("adequacy")
            if "fit" in r:
                names.setdefault(said["verdict"] if said else "not_judged", []).append(r["recording"])
        verdict = next((v for v in ("not_described", "not_judged", "adequate") if v in names), "not_judged")
        words = "; ".join(f"{len(rows)} of {len(self.recordings)} recordings {v.replace('_', ' ')}" for v, rows in names.items())
        return {"verdict": verdict, "summary": words or "no recording is fitted", **names}

    @property
    def warnings(self) -> list[str]:
        """What a reader must know: recordings that are not fitted, or that the law does not describe."""
        found = []
        for r in self.recordings:
            fit = r.get("fit")
            if not fit:
                found.append(f"{r['recording']} is not fitted: {r.get('reason', 'no reason is stored')}")
                continue
            adequacy = fit.get("adequacy")
            if adequacy and adequacy["verdict"] != "adequate":
                found.append(f"{r['recording']}: {adequacy['summary']}")
            found += [f"{r['recording']}: {remark['text']}" for remark in fit.get("remarks", [])]
        return found

    @property
    def recordings(self) -> list[dict[str, Any]]:
        """Of each recording: `recording`, `specimen`, and its `fit` (keys in docs/fit_files.md), or why it has none."""
        return self._document["recordings"]

    def to_dict(self) -> dict[str, Any]:
        """Everything, as `tpm fit FOLDER --format json` writes it."""
        return self._document

    def __repr__(self) -> str:
        lines = [f"<tpmkit.Specimens {self.law}, {len(self.recordings)} recordings"]
        for name, row in self.pooled.iterrows():
            interval = " .. ".join("open" if math.isnan(v) else f"{v:.4g}" for v in (row["lower"], row["upper"]))
            lines.append(f"  {name} {row['typical']:.5g} ({interval}) {row['unit']}: {row['summary']}")
        lines.append(f"  adequacy: {self.adequacy['summary']}")
        lines += [f"  warning: {w}" for w in self.warnings]
        return "\n".join(lines) + ">"
