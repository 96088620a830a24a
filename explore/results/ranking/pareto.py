"""Pareto fronts of designs that come in blocks."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from explore.base.errors import RequestError
from explore.model.columns import Arrays
from explore.model.quantities import FloatArray
from explore.model.request import Objective
from explore.results.ranking.tallies import Tally

#: Number of cells of the grid that finds dominated rows: more find more, but 32 KiB of minima stay in the first cache.
_CELLS = 4096
#: Number of rows below which they are sorted as they are.
_FEW_ROWS = 2048


def is_nondominated(values: FloatArray) -> npt.NDArray[np.bool_]:
    """Mask (n,) of the rows that no other row dominates; equal rows are all kept.

    `values` (n, m) are finite, and all columns minimised.
    """
    import moocore

    # moocore accepts NaN and returns a wrong mask; versions of it have crashed at -inf.
    if not np.isfinite(values).all():
        raise RequestError("objectives must be finite; leave out the other designs first")
    if len(values) == 0:
        return np.zeros(0, dtype=np.bool_)
    if len(values) < _FEW_ROWS:
        return np.asarray(moocore.is_nondominated(np.ascontiguousarray(values), keep_weakly=True), dtype=np.bool_)
    # A dominated row is dominated by one that no row dominates, which is a candidate.
    candidates = np.flatnonzero(_may_be_nondominated(values))
    mask = np.zeros(len(values), dtype=np.bool_)
    mask[candidates] = moocore.is_nondominated(values.take(candidates, axis=0), keep_weakly=True)
    return mask


def _may_be_nondominated(values: FloatArray) -> npt.NDArray[np.bool_]:
    """Mask of rows, shape (n,): false only where a row dominates. It takes a tenth of the time of sorting.

    The objectives but the last divide the rows into the cells of a grid. A row is dominated if a cell that is lower in
    all of them has a row that is not worse in the last.
    """
    *divided, last = values.T
    if not divided:
        return np.asarray(last == last.min())
    count = int(_CELLS ** (1 / len(divided)))
    cells, is_above = np.zeros(len(last), dtype=np.intp), np.ones(len(last), dtype=np.bool_)
    for column in divided:
        steps = _steps(column, count)
        cells = cells * count + steps
        is_above &= steps > 0
    least = np.full(count ** len(divided), np.inf)
    np.minimum.at(least, cells, last)
    least = least.reshape((count,) * len(divided))
    for axis in range(len(divided)):
        np.minimum.accumulate(least, axis=axis, out=least)
    one_step = sum(count**k for k in range(len(divided)))  # in all directions at once
    return np.asarray(~is_above | (last < least.ravel()[cells - one_step]))


def _steps(column: FloatArray, count: int) -> npt.NDArray[np.intp]:
    """Steps 0 … count - 1 that do not descend where the values ascend, shape (n,).

    The highest tenth of the values is in the last step and the lowest 500th in the first, because a few large values
    would leave the other steps empty.
    """
    sample = column[:: max(len(column) // _CELLS, 1)]
    ends = len(sample) // 500, len(sample) - len(sample) // 10 - 1
    low, high = np.partition(sample, ends)[list(ends)]
    with np.errstate(over="ignore", divide="ignore"):
        scale = (count - 1) / (high - low)
        if not 0.0 < scale < math.inf:
            return np.zeros(len(column), dtype=np.intp)
        steps: npt.NDArray[np.intp] = np.clip((column - low) * scale, 0.0, count - 1).astype(np.intp)
    return steps


def front_numbers(values: FloatArray, n_fronts: int) -> npt.NDArray[np.int64]:
    """Number of the front of each row (n,), from 1; 0 for rows behind the first `n_fronts`.

    `values` (n, m) are finite, and all columns minimised; front k + 1 is the first without the fronts 1 to k.
    """
    # moocore.pareto_rank finds the same fronts, but always all of them: for 10^5 random rows in 3 objectives 0.45 s
    # against 0.04 s for the first front here and 0.19 s for five; in 2 objectives 0.05 s against 0.04 s and 0.17 s.
    numbers, remaining = np.zeros(len(values), dtype=np.int64), np.arange(len(values))
    for number in range(1, n_fronts + 1):
        if len(remaining) == 0:
            break
        best = is_nondominated(values if number == 1 else values[remaining])
        numbers[remaining[best]] = number
        remaining = remaining[~best]
    return numbers


def objectives_to_minimise(columns: Arrays, objectives: Sequence[Objective]) -> FloatArray:
    """Values of the objectives, negated where the larger value is better, shape (n, m)."""
    values = np.empty((len(columns[objectives[0].metric]), len(objectives)))
    for k, objective in enumerate(objectives):
        sign = 1.0 if objective.sense == "min" else -1.0
        np.multiply(columns[objective.metric], sign, out=values[:, k])
    return values


@dataclass(frozen=True)
class _FrontRows:
    """Rows in the first fronts of some part of all rows: values (k, m), row numbers (k,) and front numbers (k,)."""

    values: FloatArray
    rows: npt.NDArray[np.int64]
    numbers: npt.NDArray[np.int64]

    @staticmethod
    def select(values: FloatArray, rows: npt.NDArray[np.int64], n_fronts: int) -> _FrontRows:
        """Keep the rows that are in the first fronts."""
        numbers = front_numbers(values, n_fronts)
        in_front = numbers > 0
        return _FrontRows(values[in_front], rows[in_front], numbers[in_front])


class _FrontMerger:
    """The first fronts of the rows added so far."""

    def __init__(self, n_objectives: int, n_fronts: int) -> None:
        self._n_fronts = n_fronts
        no_rows = np.empty(0, dtype=np.int64)
        self._merged = _FrontRows(np.empty((0, n_objectives)), no_rows, no_rows)
        self._pending: list[_FrontRows] = []
        self._n_pending = 0

    def add(self, values: FloatArray, rows: npt.NDArray[np.int64]) -> None:
        """Add a block. A row in front k of all rows is in a front <= k of its block, so no row of a front is lost."""
        part = _FrontRows.select(values, rows, self._n_fronts)
        self._pending.append(part)
        self._n_pending += len(part.rows)
        # Merging only when the pending rows are as many as the merged ones bounds the cost of merging to that of the
        # blocks, however large the fronts are.
        if self._n_pending >= len(self._merged.rows):
            self.merge()

    def merge(self) -> _FrontRows:
        """Merge the pending rows and return all rows that are in a front."""
        parts = [part for part in (self._merged, *self._pending) if len(part.rows)]
        if len(parts) == 1:  # its fronts are known; sorting a large front again is slow
            self._merged = parts[0]
        elif parts:
            values, rows = np.vstack([part.values for part in parts]), np.concatenate([part.rows for part in parts])
            self._merged = _FrontRows.select(values, rows, self._n_fronts)
        self._pending, self._n_pending = [], 0
        return self._merged


def find_fronts(
    blocks: Iterable[Arrays],
    objectives: Sequence[Objective],
    n_fronts: int = 1,
    tally: Tally | None = None,
    numbered_by: str | None = "design",
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Find the first fronts of designs that arrive in blocks; memory holds one block and twice the fronts.

    The blocks are columns of consecutive designs, with the objectives and optionally ``feasible``; `tally` receives
    the counts of the designs of each. The result is ascending row numbers (k,), from the column `numbered_by` where
    there is one, else counted over all blocks, and the front of each, (k,), from 1.
    """
    merger, offset = _FrontMerger(len(objectives), n_fronts), 0
    for columns in blocks:
        values = objectives_to_minimise(columns, objectives)
        n = len(values)
        rows = np.asarray(columns[numbered_by]) if numbered_by in columns else np.arange(offset, offset + n)
        feasible = np.asarray(columns["feasible"]).astype(bool) if "feasible" in columns else np.ones(n, dtype=bool)
        finite = np.ones(n, dtype=np.bool_)
        for column in values.T:  # short rows are slow to reduce
            finite &= np.isfinite(column)
        if tally is not None:
            tally.count(columns, feasible, finite)
        ranked = np.flatnonzero(feasible & finite)
        merger.add(values.take(ranked, axis=0), rows[ranked])
        offset += n
    fronts = merger.merge()
    order = np.argsort(fronts.rows)
    return fronts.rows[order], fronts.numbers[order]


def find_front(
    blocks: Iterable[Arrays], objectives: Sequence[Objective], tally: Tally | None = None
) -> npt.NDArray[np.int64]:
    """Row numbers of the first front, ascending; see `find_fronts`."""
    return find_fronts(blocks, objectives, 1, tally)[0]
