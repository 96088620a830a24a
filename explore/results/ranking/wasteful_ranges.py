"""Ends of the swept ranges where the length to solve for mostly does not exist."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from explore.model.quantities import FloatArray
from explore.model.status import Status

if TYPE_CHECKING:
    from explore.results.store.results import Results

#: Approximate number of intervals into which the range of a parameter is divided.
_N_INTERVALS = 20
#: Width below which a range is a single value, in the parameter's unit.
_MIN_WIDTH = 1e-30

_Counts = npt.NDArray[np.int64]


@dataclass(frozen=True)
class WastefulRange:
    """The designs between one bound of a parameter and a value, in its unit, and how many of them are reachable.

    The side is ``"<"``, from the lower bound up to the value, or ``">="``, from the value up to the upper bound.
    """

    parameter: str
    side: str
    value: float
    n_designs: int
    n_reachable: int


def find_wasteful_ranges(source: Results) -> list[WastefulRange]:
    """Find the ends of the swept ranges where the reachable fraction is less than half of that of all designs.

    The source keeps every design, and is read twice, block by block. The ends are sorted by falling number of
    unreachable designs. Their values are round numbers, so the counts are exact for the printed value. There is none
    when no or every design is reachable.
    """
    edges = _edges(source)
    n_designs = {name: np.zeros(len(values) + 1, dtype=np.int64) for name, values in edges.items()}
    n_reachable = {name: np.zeros(len(values) + 1, dtype=np.int64) for name, values in edges.items()}
    for columns in source.blocks(["status", *edges]):
        reachable = columns["status"] != Status.UNREACHABLE
        for name, values in edges.items():
            intervals = np.searchsorted(values, columns[name], side="right")
            n_designs[name] += np.bincount(intervals, minlength=len(values) + 1)
            n_reachable[name] += np.bincount(intervals[reachable], minlength=len(values) + 1)
    ranges = [end for name in edges for end in _wasteful_ends(name, edges[name], n_designs[name], n_reachable[name])]
    return sorted(ranges, key=lambda end: end.n_reachable - end.n_designs)


def _edges(source: Results) -> dict[str, FloatArray]:
    """Round values that divide the range of each swept parameter; none for the solved length, which can be NaN."""
    names = [column.name for column in source.columns if column.role == "parameter"]
    low, high = dict.fromkeys(names, math.inf), dict.fromkeys(names, -math.inf)
    for columns in source.blocks(names):
        for name in names:  # NaN propagates
            low[name] = float(np.minimum(low[name], columns[name].min()))
            high[name] = float(np.maximum(high[name], columns[name].max()))
    widths = {name: high[name] - low[name] for name in names}
    return {name: _round_values(low[name], high[name]) for name in names if _MIN_WIDTH < widths[name] < math.inf}


def _round_values(low: float, high: float) -> FloatArray:
    """Multiples of 1, 2 or 5 times a power of ten, above `low` and up to `high`."""
    least = (high - low) / _N_INTERVALS
    power = 10.0 ** math.floor(math.log10(least))
    factors = (1.0, 2.0, 5.0, 10.0, 20.0)  # the last where the logarithm was rounded down
    step = next(factor * power for factor in factors if factor * power >= least)
    multiples = np.arange(math.floor(low / step) + 1, math.floor(high / step) + 1) * step
    return np.array([float(f"{value:.12g}") for value in multiples])  # 3 times 0.1 is 0.3


def _wasteful_ends(name: str, edges: FloatArray, n_designs: _Counts, n_reachable: _Counts) -> Iterator[WastefulRange]:
    """The wasteful end at the lower bound and the one at the upper bound, if any."""
    # In floating point, because integers can overflow.
    is_wasteful = 2.0 * n_reachable * n_designs.sum() < 1.0 * n_designs * n_reachable.sum()
    for side, order in (("<", slice(None)), (">=", slice(None, None, -1))):
        # An interval may hold none of the values of a list; it does not end the range.
        is_inside = is_wasteful[order] | (n_designs[order] == 0)
        if is_inside.all():
            continue
        occupied = np.flatnonzero(n_designs[order][: is_inside.argmin()] > 0)
        if len(occupied):
            last = occupied[-1]
            counts = (int(count[order][: last + 1].sum()) for count in (n_designs, n_reachable))
            yield WastefulRange(name, side, float(edges[order][last]), *counts)
