"""Pareto fronts of designs that come in blocks."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import numpy.typing as npt

from explore.errors import RequestError
from explore.ranking.tallies import Tally
from explore.vocabulary import Columns, FloatArray, Objective


def nondominated(values: FloatArray) -> npt.NDArray[np.bool_]:
    """Which rows no other row dominates, all columns minimised; equal rows are all kept.

    Parameters
    ----------
    values
        Finite numbers, shape (n, m).

    Returns
    -------
    (n,) array
    """
    import moocore

    # moocore crashes the process on -inf, mis-masks +inf and is silent on NaN.
    if not np.isfinite(values).all():
        raise RequestError("objectives must be finite; leave out the other designs first")
    if len(values) == 0:
        return np.zeros(0, dtype=np.bool_)
    return np.asarray(moocore.is_nondominated(np.ascontiguousarray(values), keep_weakly=True), dtype=np.bool_)


def front_numbers(values: FloatArray, most: int) -> npt.NDArray[np.int64]:
    """Which front each row is in, all columns minimised: the second is the first of what is left, and so on.

    Parameters
    ----------
    values
        Finite numbers, shape (n, m).
    most
        How many fronts to tell apart.

    Returns
    -------
    (n,) array
        From 1; 0 in none of the first `most`.
    """
    numbers, left = np.zeros(len(values), dtype=np.int64), np.arange(len(values))
    for number in range(1, most + 1):
        if len(left) == 0:
            break
        best = nondominated(values[left])
        numbers[left[best]] = number
        left = left[~best]
    return numbers


def signed(columns: Columns, objectives: Sequence[Objective]) -> FloatArray:
    """The objectives as columns that are all to be minimised, shape (n, m)."""
    signs = [1.0 if objective.sense == "min" else -1.0 for objective in objectives]
    return np.column_stack([np.asarray(columns[o.metric], dtype=np.float64) for o in objectives]) * signs


class _Fronts:
    """The first fronts of the rows added so far."""

    def __init__(self, objectives: int, most: int) -> None:
        self._most = most
        self._values, self._rows = np.empty((0, objectives)), np.empty(0, dtype=np.int64)
        self._waiting: list[tuple[FloatArray, npt.NDArray[np.int64]]] = []
        self._n_waiting = 0

    def add(self, values: FloatArray, rows: npt.NDArray[np.int64]) -> None:
        """Add a block; a row in front k is in no later one of any part of the rows, so each part keeps all it must."""
        local = front_numbers(values, self._most) > 0
        self._waiting.append((values[local], rows[local]))
        self._n_waiting += int(np.count_nonzero(local))
        # Waiting for as many as are kept, merging costs no more than the blocks themselves, however large the fronts.
        if self._n_waiting >= len(self._rows):
            self.merge()

    def merge(self) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
        """Rows and the numbers of their fronts."""
        values = np.vstack([self._values, *(values for values, _ in self._waiting)])
        rows = np.concatenate([self._rows, *(rows for _, rows in self._waiting)])
        numbers = front_numbers(values, self._most)
        kept = numbers > 0
        self._values, self._rows, self._waiting, self._n_waiting = values[kept], rows[kept], [], 0
        return self._rows, numbers[kept]


def fronts(
    blocks: Iterable[Columns], objectives: Sequence[Objective], most: int = 1, tally: Tally | None = None
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """The first fronts of designs that come in blocks; memory holds a block and twice these fronts.

    Parameters
    ----------
    blocks
        Columns of consecutive designs, each with the objectives and, where they exist, ``feasible`` and "design".
    objectives
        At least one.
    most
        How many fronts.
    tally
        Counts the designs.

    Returns
    -------
    rows, numbers : (k,) arrays
        Ascending row numbers, counted over all blocks or taken from "design"; the front of each, from 1.
    """
    found, offset = _Fronts(len(objectives), most), 0
    for columns in blocks:
        values = signed(columns, objectives)
        n = len(values)
        rows = np.asarray(columns["design"]) if "design" in columns else np.arange(offset, offset + n)
        eligible = np.asarray(columns["feasible"]).astype(bool) if "feasible" in columns else np.ones(n, dtype=bool)
        finite: npt.NDArray[np.bool_] = np.logical_and.reduce(np.isfinite(values), axis=1)
        if tally is not None:
            tally.add(columns, eligible, finite)
        chosen = eligible & finite
        found.add(values[chosen], rows[chosen])
        offset += n
    rows, numbers = found.merge()
    order = np.argsort(rows)
    return rows[order], numbers[order]


def front(
    blocks: Iterable[Columns], objectives: Sequence[Objective], tally: Tally | None = None
) -> npt.NDArray[np.int64]:
    """Row numbers of the first front, ascending; see `fronts`."""
    return fronts(blocks, objectives, 1, tally)[0]
