"""Linear equations with a column for each unknown: of many designs in arrays, or of one in numbers of any kind."""

from collections.abc import Sequence
from operator import itemgetter
from typing import Any

import numpy as np

#: Derivatives of each chain by each unknown, complex numbers or arrays.
Linear = Sequence[Sequence[Any]]


def solve(columns: Linear, right: Sequence[Any]) -> tuple[list[Any], Any]:
    """The real unknowns of complex equations, and the determinant; two unknowns by Cramer's rule."""
    if len(right) == 1:
        (a,), (b,), c = *columns, right[0]
        determinant = _cross(a, b)
        return [_cross(c, b) / determinant, _cross(a, c) / determinant], determinant
    parts = [[part for number in column for part in (number.real, number.imag)] for column in (*columns, right)]
    flat = [part for column in parts for part in column]
    if any(isinstance(part, np.ndarray) for part in flat):
        return _eliminate_all(np.array(np.broadcast_arrays(*flat)))
    return _eliminate([list(row) for row in zip(*parts, strict=True)])


def _cross(a: Any, b: Any) -> Any:
    return a.real * b.imag - a.imag * b.real


def _eliminate(rows: list[list[Any]]) -> tuple[list[Any], Any]:
    """Gaussian elimination with the largest pivot of each column; the last entry of a row is its right-hand side."""
    determinant: Any = 1.0
    for k in range(len(rows)):
        pivot = max(range(k, len(rows)), key=lambda row: abs(rows[row][k]))
        rows[k], rows[pivot] = rows[pivot], rows[k]
        determinant = determinant * (rows[k][k] if pivot == k else -rows[k][k])
        for row in filter(itemgetter(k), rows[k + 1 :]):  # those that are not 0 in this column
            factor = row[k] / rows[k][k]
            row[k + 1 :] = [x - factor * y if y else x for x, y in zip(row[k + 1 :], rows[k][k + 1 :], strict=True)]
    unknowns: list[Any] = []
    for k in reversed(range(len(rows))):
        known = sum(x * y for x, y in zip(rows[k][k + 1 : -1], unknowns, strict=True))
        unknowns.insert(0, (rows[k][-1] - known) / rows[k][k])
    return unknowns, determinant


def _eliminate_all(parts: Any) -> tuple[list[Any], Any]:
    """The same for arrays: parts of all columns, then of the right-hand side, on the first axis."""
    shape, count = parts.shape[1:], int(np.sqrt(len(parts)))
    rows = parts.reshape(count + 1, count, -1).swapaxes(0, 1).copy()
    which, determinant = np.arange(rows.shape[2]), np.ones(rows.shape[2])
    for k in range(count):
        pivot = k + np.abs(rows[k:, k]).argmax(axis=0)
        rows[k, :, which], rows[pivot, :, which] = rows[pivot, :, which], rows[k, :, which]
        determinant = determinant * np.where(pivot == k, rows[k, k], -rows[k, k])
        rows[k + 1 :] -= (rows[k + 1 :, k] / rows[k, k])[:, None] * rows[k]
    for k in reversed(range(count)):
        rows[k, -1] = (rows[k, -1] - (rows[k, k + 1 : -1] * rows[k + 1 :, -1]).sum(axis=0)) / rows[k, k]
    return list(rows[:, -1].reshape(count, *shape)), determinant.reshape(shape)
