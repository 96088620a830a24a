"""Conditions by the column that they are on, for counts that leave out the conditions on the counted column itself."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from explore.browsing.index_files import Index
from explore.ranking.conditions import Condition

#: What `Selection.failed` gives for designs that fail the conditions of several groups.
SEVERAL = 255
#: Largest number of groups.
_MOST_GROUPS = SEVERAL - 1


@dataclass(frozen=True)
class Selection:
    """Conditions in groups: those on each column, and in one more group those that compare columns.

    Attributes
    ----------
    groups
        Conditions by the name of their one column, or "" for those on several columns.
    """

    groups: dict[str, tuple[Condition, ...]]

    def group_of(self, column: str) -> int:
        """Number of the group of the conditions on a column, from 1; 0 if there is none."""
        return 1 + list(self.groups).index(column) if column in self.groups else 0

    def failed(self, index: Index, rows: slice) -> npt.NDArray[np.uint8]:
        """For each design 0 if it meets all conditions, else the number of the one group it fails, or `SEVERAL`."""
        failed = np.zeros(rows.stop - rows.start, np.uint8)
        for number, conditions in enumerate(self.groups.values(), start=1):
            meets = np.ones(len(failed), bool)
            for condition in conditions:
                names = condition.names or tuple(index.columns)[:1]  # the length of a condition without columns
                meets &= condition.test({name: index.columns[name].values[rows] for name in names})
            failed[~meets] = np.where(failed[~meets] == 0, number, SEVERAL)
        return failed


def group_conditions(conditions: Iterable[Condition]) -> Selection:
    """Put conditions into groups."""
    groups: dict[str, list[Condition]] = {}
    for condition in conditions:
        groups.setdefault(condition.names[0] if len(condition.names) == 1 else "", []).append(condition)
    assert len(groups) <= _MOST_GROUPS  # noqa: S101 -- a request has far fewer conditions
    return Selection({name: tuple(own) for name, own in groups.items()})


def make_edges(low: float, high: float, bins: int) -> npt.NDArray[np.float64]:
    """Edges of bins of equal width, (bins + 1,), those of NumPy's histograms, also over the whole range of floats."""
    if np.isfinite(high - low):
        return np.linspace(low, high, bins + 1)
    return 2.0 * np.linspace(low / 2.0, high / 2.0, bins + 1)


def find_bins(values: npt.NDArray[np.float64], edges: npt.NDArray[np.float64]) -> npt.NDArray[np.int64]:
    """Number of the bin of each value, (n,), or -1 outside; a bin has its lower edge, and the last one both.

    Where all edges are equal, the first bin has them.
    """
    low, high, bins = edges[0], edges[-1], len(edges) - 1
    if low == high:
        return np.where(values == low, 0, -1)
    found = np.minimum(np.searchsorted(edges, values, side="right") - 1, bins - 1)
    return np.where((values >= low) & (values <= high), found, -1)
