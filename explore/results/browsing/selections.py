"""Conditions by the column that they are on, for counts that leave out the conditions on the counted column itself."""

from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

from explore.results.browsing.index_files import Index
from explore.results.browsing.kernels import SEVERAL, mark_failed
from explore.results.ranking.conditions import Condition

Conditions = tuple[Condition, ...]
#: Largest number of designs of an index of which a selection keeps what it found, a byte for each.
_MOST_KEPT = 1 << 25


class Selection:
    """The designs of an index that meet at most 250 conditions on its columns.

    The conditions on one column are a group; those that compare columns are one more, which no column leaves out.
    """

    def __init__(self, index: Index, conditions: Iterable[Condition]) -> None:
        groups: dict[str, Conditions] = {}
        for condition in conditions:
            name = condition.names[0] if len(condition.names) == 1 else ""
            groups[name] = (*groups.get(name, ()), condition)
        self._index, self._groups = index, groups
        self._outcomes = {name: index.columns[name].cells.outcomes(own) for name, own in groups.items() if name}
        self._failed: dict[tuple[int, int], npt.NDArray[np.uint8]] = {}

    def group_of(self, column: str) -> int:
        """Number of the group of the conditions on a column, from 1; 0 if there is none."""
        return 1 + list(self._groups).index(column) if column in self._groups else 0

    def failed(self, rows: slice) -> npt.NDArray[np.uint8]:
        """For each design 0 if it meets all conditions, else the number of the one group it fails, or `SEVERAL`.

        Kept for the next count of the same designs, which asks for the same rows, unless the index is very large.
        """
        key = rows.start, rows.stop
        found = self._failed.get(key)
        if found is None:
            found = self._find_failed(rows)
            if self._index.n_designs <= _MOST_KEPT:
                self._failed[key] = found
        return found

    def _find_failed(self, rows: slice) -> npt.NDArray[np.uint8]:
        failed = np.zeros(rows.stop - rows.start, np.uint8)
        unsure = np.empty(len(failed), np.uint32)
        for number, (name, conditions) in enumerate(self._groups.items(), start=1):
            if name:
                cells = self._index.columns[name].numbers[rows]
                n_unsure = mark_failed(cells, self._outcomes[name], number, failed, unsure)
                places = unsure[:n_unsure].astype(np.int64)
            else:
                places = np.arange(len(failed))
            if len(places):
                fails = places[~self._meets(conditions, places + rows.start)]
                failed[fails] = np.where(failed[fails] == 0, number, SEVERAL)
        return failed

    def _meets(self, conditions: Conditions, rows: npt.NDArray[np.int64]) -> npt.NDArray[np.bool_]:
        """Which of some designs meet conditions, by their values."""
        meets = np.ones(len(rows), bool)
        for condition in conditions:
            names = condition.names or list(self._index.columns)[:1]  # how many there are, for one without columns
            meets &= condition.test({name: self._index.columns[name].values(rows) for name in names})
        return meets
