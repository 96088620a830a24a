"""Metrics of targets: a compiled function measures designs at once, and each metric is a row of its measures."""

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from explore.model.quantities import FloatArray

#: Function of a module that gives a compiled function of a mechanism: a worker finds it by its name.
FindFunction = Callable[[], Any]
#: Measures of designs, shape (n, k), then their input angles from the frame at the places of a target, rad, (n, m).
Measures = tuple[FloatArray, ...]


@dataclass(frozen=True)
class TargetMeasure:
    """A measure of designs against a target, a function of their parameters.

    `measures` is a function of a module that `keep_last` decorates, which takes `find`, the function of the mechanism,
    and the target. The row is the number among the measures, and the unit what it is multiplied by.
    """

    measures: Callable[[FindFunction, Any, tuple[FloatArray, ...]], Measures]
    find: FindFunction
    target: Any
    row: int
    unit: float = 1.0

    def __call__(self, *columns: FloatArray) -> FloatArray:
        """Measure designs, whose inputs are columns of shape (n,)."""
        return self.measures(self.find, self.target, columns)[0][:, self.row] * self.unit


def keep_last(
    measure: Callable[[FindFunction, Any, FloatArray], Measures],
) -> Callable[[FindFunction, Any, tuple[FloatArray, ...]], Measures]:
    """Measure columns by a function of a table, (n, p), once for all metrics of a block, which ask for the same."""
    last: tuple[FindFunction, Any, FloatArray, Measures] | None = None

    @functools.wraps(measure)
    def measures(find: FindFunction, target: Any, columns: tuple[FloatArray, ...]) -> Measures:
        nonlocal last
        known, table = last, np.column_stack(np.broadcast_arrays(*columns)).astype(np.float64)
        if not known or known[:2] != (find, target) or not np.array_equal(known[2], table, equal_nan=True):
            known = last = find, target, table, measure(find, target, table)
        return known[3]

    return measures


def moving_designs(table: FloatArray) -> FloatArray:
    """The designs of a table whose last column is a metric that is NaN where the crank does not turn, (n, p - 1).

    The first number of a design is NaN where any is not finite or the crank does not turn.
    """
    designs = np.ascontiguousarray(table[:, :-1])
    designs[~np.isfinite(table).all(axis=1), 0] = np.nan
    return designs
