"""Why designs are infeasible, in words and hatches."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from explore.charts.style import INK
from explore.store.results import Results
from explore.vocabulary import Status

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.patches import Patch

#: Paler and denser by turns, so that neighbours differ in more than the direction of their lines.
_HATCHES = ("///", "\\\\\\\\", "...", "xxx", "--", "||", "oo", "++")
_TINTS = ("#e3e6ea", "#fbe3d3", "#dcecf7", "#f6e3ee", "#e0f1ea", "#fdf3d9", "#efe6df", "#ffffff")
_JUDGED = (int(Status.OK), int(Status.SCREENED))


@dataclass(frozen=True)
class Look:
    """How an infeasible region is drawn."""

    face: str
    hatch: str

    def patch(self, label: str) -> Patch:
        """A legend's entry."""
        from matplotlib.patches import Patch

        return Patch(facecolor=self.face, edgecolor=INK, hatch=self.hatch, lw=0, label=label)


def look(number: int) -> Look:
    """How the reason of that number is drawn; after eight they repeat."""
    return Look(_TINTS[number % len(_TINTS)], _HATCHES[number % len(_HATCHES)])


def needed_columns(results: Results) -> list[str]:
    """Columns that `reasons` reads."""
    return ["feasible", "status", *(c.name for c in results.columns if c.role == "margin")]


def reasons(results: Results, frame: pd.DataFrame) -> dict[str, npt.NDArray[np.bool_]]:
    """Which designs are infeasible for which reason, each of shape (n,); a design may have several.

    Parameters
    ----------
    results
        That the designs are of.
    frame
        Designs, with `needed_columns`.
    """
    labels = next(c.labels for c in results.columns if c.name == "status")
    status = frame["status"].to_numpy()
    found = {
        labels.get(int(code), f"status {code}"): status == code for code in np.unique(status) if code not in _JUDGED
    }
    judged = np.isin(status, _JUDGED)
    for column in results.columns:
        if column.role == "margin":
            margin = frame[column.name].to_numpy()
            constraint = column.name.removesuffix("_margin")
            found[f"misses {constraint}"] = judged & (margin < 0.0)
            found[f"{constraint} undefined"] = (status == Status.OK) & np.isnan(margin)
    return {name: mask for name, mask in found.items() if mask.any()}


def in_words(names: Sequence[str]) -> list[str]:
    """Reasons as a legend says them."""
    return [name.replace("_", " ") if not name.startswith("misses") else name for name in names]
