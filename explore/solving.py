"""A length solved for instead of given: the smallest at which a closed-form metric has the value wanted."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise, product
from typing import Any

import numpy as np
import numpy.typing as npt

from explore.design_space import DesignSpace, Solved
from explore.evaluation import LARGEST, SMALLEST, evaluate_columns
from explore.vocabulary import Columns, FloatArray, Mechanism, Request, Status

#: Lengths tried between two flattened linkages. A metric has one extreme there at most, and that is looked for.
_POINTS = 9
#: Largest error, relative to the value wanted or to 1, with which the metric may touch the value without crossing it.
_TOUCHING = 1e-12
#: As large where it does cross: so near a flattened linkage that the next double is another value.
_CROSSING = 1e-9
#: Distance from a flattened linkage in units of the last place of all lengths together; nearer it counts as one.
_CLEARANCE = 8.0
# To the last bit: whether two lengths are equal must not depend on how long was searched.
_LAST_BIT: Any = {"xatol": 0.0, "xrtol": 4.0 * np.finfo(float).eps, "fatol": 0.0, "frtol": 0.0}

_Indices = npt.NDArray[np.intp]


@dataclass(frozen=True, kw_only=True)
class SolvedSpace(DesignSpace):
    """The designs of another space, each with one length more: solved for, NaN where there is none."""

    mechanism: Mechanism
    free: DesignSpace
    solved: Solved

    @staticmethod
    def over(free: DesignSpace, solved: Solved, mechanism: Mechanism) -> SolvedSpace:
        """The designs of `free` with the length added in its declared place."""
        order = [parameter.name for parameter in (*mechanism.geometry, mechanism.speed)]
        axes = tuple(sorted((*free.axes, solved), key=lambda axis: order.index(axis.name)))
        return SolvedSpace(axes, free.count, free.method, free.seed, mechanism=mechanism, free=free, solved=solved)

    def for_block(self, number: int) -> SolvedSpace:
        """What a worker needs to make this block."""
        return replace(self, free=self.free.for_block(number))

    def designs(self, start: int, stop: int) -> Columns:
        """Parameters of the designs start … stop - 1 by name, each of shape (stop - start,)."""
        columns = self.free.designs(start, stop)
        columns[self.solved.name] = solve(self.mechanism, self.solved, columns)
        return {axis.name: columns[axis.name] for axis in self.axes}

    def unreachable(self, columns: Columns) -> npt.NDArray[np.bool_]:
        """Which of these designs have no such length, shape (n,)."""
        return np.isnan(columns[self.solved.name])


def solve(mechanism: Mechanism, solved: Solved, columns: Columns) -> FloatArray:
    """The smallest length at which each design has the value wanted and its crank turns.

    Parameters
    ----------
    mechanism
        Whose designs.
    solved
        The length, the metric and its value.
    columns
        The other parameters by name, each of shape (n,).

    Returns
    -------
    (n,) array
        NaN where there is no such length within the bounds.

    Notes
    -----
    The range of the length falls into pieces at the flattened linkages. In each, from the smallest lengths on, a change
    of sign of the metric less its value is looked for at a few lengths, and where there is none before its smallest
    distance to the value, beyond that; then Chandrupatla's method finds the root to the last bit.
    """
    others = [_usable(columns[name]) for name in mechanism.loop if name != solved.name]
    found = np.full(len(others[0]), np.nan)
    gap = _gap(mechanism, solved, columns)
    for (lower, after), (upper, before) in pairwise(_ends(others)):
        low, high = np.maximum(lower + after, solved.low), np.minimum(upper - before, solved.high)
        open_ = np.flatnonzero(np.isnan(found) & (low < high))
        # The class of a linkage is the same all over a piece: one length tells whether the metric exists.
        open_ = open_[np.isfinite(gap(0.5 * (low + high)[open_], open_))]
        if len(open_):
            found[open_] = _smallest_root(gap, low[open_], high[open_], open_, max(abs(solved.value), 1.0))
    return found


def _usable(lengths: FloatArray) -> FloatArray:
    """The lengths that can be computed with; NaN in the place of others, so that nothing is found with them."""
    return np.where((lengths > SMALLEST) & (lengths <= LARGEST), lengths, np.nan)


_Gap = Callable[..., FloatArray]


def _gap(mechanism: Mechanism, solved: Solved, columns: Columns) -> _Gap:
    """Metric less the value wanted, of lengths and the numbers of their designs; NaN where the crank cannot turn."""
    window = next(window for window in mechanism.windows if window.name == mechanism.default_window)
    request = Request(mechanism, (solved.metric,), (), window, mechanism.default_drive, 1e-9)

    def gap(lengths: FloatArray, designs: _Indices) -> FloatArray:
        of_designs = {name: values[designs] for name, values in columns.items()} | {solved.name: lengths}
        found = evaluate_columns(request, of_designs).columns
        turns = (found["status"] == Status.OK) | (found["status"] == Status.NO_STROKE)
        return np.where(turns, found[solved.metric.name] - solved.value, np.nan)

    return gap


def _ends(others: list[FloatArray]) -> list[tuple[FloatArray, FloatArray]]:
    """Where pieces of the range end: lengths in ascending order and how far to stay away from them, each (n,)."""
    first, *rest = others
    flat = [
        np.abs(first + np.sum([sign * length for sign, length in zip(signs, rest, strict=True)], axis=0))
        for signs in product((1.0, -1.0), repeat=len(rest))
    ]
    clearance = _CLEARANCE * np.spacing(np.sum(others, axis=0))
    # At another link's length this one may become the shortest or longest: a corner of a margin, and allowed.
    flat_too = [np.min([np.abs(other - each) for each in flat], axis=0) <= clearance for other in others]
    ends = np.array([np.zeros_like(first), *flat, *others])
    away = np.concatenate([np.tile(clearance, (1 + len(flat), 1)), np.where(flat_too, clearance, 0.0)])
    order = np.argsort(ends, axis=0, kind="stable")
    return list(zip(np.take_along_axis(ends, order, 0), np.take_along_axis(away, order, 0), strict=True))


def _smallest_root(gap: _Gap, low: FloatArray, high: FloatArray, designs: _Indices, scale: float) -> FloatArray:
    """Smallest root of each design's gap between low and high, where it is smooth; NaN where there is none."""
    from scipy.optimize.elementwise import find_root

    # Closer at the ends, where a metric may change like a square root.
    steps = np.sin(0.5 * np.pi * np.linspace(0.0, 1.0, _POINTS)) ** 2
    lengths = low + steps[:, None] * (high - low)
    lengths[-1] = high
    gaps = np.array([gap(row, designs) for row in lengths])
    gaps[np.abs(gaps) <= _TOUCHING * scale] = 0.0
    changes = np.sign(gaps[1:]) * np.sign(gaps[:-1]) <= 0.0
    at, some = changes.argmax(axis=0), np.asarray(changes.any(axis=0))
    columns = np.arange(len(designs))
    left, right = np.where(some, lengths[at, columns], np.nan), np.where(some, lengths[at + 1, columns], np.nan)
    found, dip_left, dip_right = _dip(gap, lengths, gaps, designs, left, scale)
    left, right = np.where(np.isnan(dip_left), left, dip_left), np.where(np.isnan(dip_right), right, dip_right)
    for length, at_length in ((left, gaps[at, columns]), (right, gaps[at + 1, columns])):
        hit = np.isnan(found) & np.isnan(dip_left) & some & (at_length == 0.0)
        found[hit] = length[hit]
    rows = np.flatnonzero(np.isnan(found) & np.isfinite(left))
    if len(rows):
        root = find_root(gap, (left[rows], right[rows]), args=(designs[rows],), tolerances=_LAST_BIT)
        found[rows] = np.where(np.abs(root.f_x) <= _CROSSING * scale, root.x, np.nan)
    return found


def _dip(
    gap: _Gap, lengths: FloatArray, gaps: FloatArray, designs: _Indices, change: FloatArray, scale: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Where the gap comes nearest to 0 before its first change of sign: a root there, or else two lengths around one.

    Returns
    -------
    root, left, right : (n,) arrays
        NaN where there is none.
    """
    from scipy.optimize.elementwise import find_minimum

    root, left, right = (np.full(len(designs), np.nan) for _ in range(3))
    sizes, signs = np.abs(gaps), np.sign(gaps)
    dips = (signs[1:-1] == signs[:-2]) & (signs[1:-1] == signs[2:])
    dips &= (sizes[1:-1] <= sizes[:-2]) & (sizes[1:-1] < sizes[2:])
    dips &= ~(lengths[2:] > change)
    rows = np.flatnonzero(dips.any(axis=0))
    if len(rows) == 0:
        return root, left, right
    at = dips.argmax(axis=0)[rows]

    def distance(length: FloatArray, design: _Indices, sign: FloatArray) -> FloatArray:
        return sign * gap(length, design)

    nearest = find_minimum(
        distance,
        (lengths[at, rows], lengths[at + 1, rows], lengths[at + 2, rows]),
        args=(designs[rows], signs[at, rows]),
        tolerances=_LAST_BIT,
    )
    root[rows] = np.where(np.abs(nearest.f_x) <= _TOUCHING * scale, nearest.x, np.nan)
    crosses = nearest.f_x < 0.0
    left[rows], right[rows] = np.where(crosses, lengths[at, rows], np.nan), np.where(crosses, nearest.x, np.nan)
    return root, left, right
