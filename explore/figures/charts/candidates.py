"""Kinds of the candidates that a synthesis found, such as families or cognates, told apart by marks."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from explore.figures.charts.style import BROWN, INK, ORANGE, PURPLE, SKY
from explore.model.columns import Column
from explore.model.quantities import FloatArray
from explore.results.store.results import Results

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Marks of the kinds in the order of their codes' labels; more kinds share the last.
_MARKS = (("o", INK), ("^", ORANGE), ("s", PURPLE), ("D", BROWN), ("v", SKY))
#: Words of the column of cognates.
_COGNATES = {0: "0, as found", 1: "1", 2: "2"}
#: Columns with labels that every results file has.
_OF_ALL = ("feasible", "status")


def kinds_of_candidates(results: Results) -> Column | None:
    """The column that says of which kind each candidate is; None where there is none.

    Of linkages with cognates it is which of them a candidate is, else the first that has labels.
    """
    own = [c for c in results.columns if c.role == "bookkeeping" and c.name not in _OF_ALL]
    cognates = (replace(c, labels=_COGNATES) for c in own if c.name == "cognate")
    return next(cognates, None) or next((c for c in own if c.labels), None)


def draw_kinds(panel: Axes, points: FloatArray, codes: np.ndarray, column: Column) -> None:
    """Draw feasible designs, (n, 2), with a mark for each kind, a code of a column, and their numbers in the legend."""
    for number, (code, label) in enumerate(column.labels.items()):
        marker, colour = _MARKS[min(number, len(_MARKS) - 1)]
        own = points[codes == code]
        if not len(own):
            continue
        text = f"feasible, {column.name} {label.replace('_', ' ')}: {len(own):,}"
        panel.plot(*own.T, ls="", marker=marker, color=colour, ms=5, mew=0, zorder=3.5, label=text)
