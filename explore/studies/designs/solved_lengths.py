"""Solve for a length: the smallest at which a metric has a prescribed value."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise, product
from typing import Any

import numpy as np
import numpy.typing as npt

from explore.evaluation.evaluate import LARGEST_PARAMETER, SMALLEST_PARAMETER, evaluate_columns
from explore.model.columns import Arrays
from explore.model.quantities import FloatArray, Parameter
from explore.model.status import Status
from explore.studies.designs.spaces import DesignSpace, SolvedLength

#: Number of lengths evaluated between two flattened loops, where a metric has at most one extremum.
_SCAN_POINTS = 9
#: Number of lengths evaluated between the bounds of a mechanism whose flattened loops are not known.
_N_LENGTHS = 33
#: Number of halvings of the interval in which a design begins to have a motion.
_N_HALVINGS = 50
#: Longest length that is tried where none flattens the loop, in sums of the other lengths.
_LONGEST = 1e6
#: Largest error, relative to the prescribed value or to 1, of a metric that touches the value without crossing it.
_TOUCHING_TOLERANCE = 1e-12
#: Largest relative error where it crosses the value, as it changes from double to double beside a flattened loop.
_CROSSING_TOLERANCE = 1e-9
#: Distance to a flattened loop, in units in the last place of the sum of all lengths, that counts as flattened.
_CLEARANCE = 8.0
#: Tolerances of the last bit, so that equal designs get equal lengths whatever the iterations.
_TOLERANCES: Any = {"xatol": 0.0, "xrtol": 4.0 * np.finfo(float).eps, "fatol": 0.0, "frtol": 0.0}

_Indices = npt.NDArray[np.intp]


@dataclass(frozen=True, kw_only=True)
class SolvedSpace(DesignSpace):
    """The designs of another space with one length added: the solution, or NaN where there is none."""

    base: DesignSpace
    solved_length: SolvedLength

    @staticmethod
    def over(base: DesignSpace, solved_length: SolvedLength) -> SolvedSpace:
        """The designs of `base` with the length added in its declared place."""
        order = [parameter.name for parameter in solved_length.request.mechanism.axis_order]
        axes = tuple(sorted((*base.axes, solved_length), key=lambda axis: order.index(axis.name)))
        return SolvedSpace(axes, base.n_designs, base.method, base.seed, base=base, solved_length=solved_length)

    def space_for_block(self, number: int) -> SolvedSpace:
        """A space that can compute this block and is small when pickled, to send to a worker."""
        return replace(self, base=self.base.space_for_block(number))

    def designs(self, start: int, stop: int) -> Arrays:
        """Parameters of the designs start … stop - 1 by name, each of shape (stop - start,)."""
        columns = self.base.designs(start, stop)
        columns[self.solved_length.name] = solve(self.solved_length, columns)
        return {axis.name: columns[axis.name] for axis in self.axes}

    def unreachable(self, columns: Arrays) -> npt.NDArray[np.bool_]:
        """Whether each design has no solution, shape (n,)."""
        return np.isnan(columns[self.solved_length.name])


def solve(solved: SolvedLength, columns: Arrays) -> FloatArray:
    """Solve for the smallest length at which each design has a motion and the prescribed value.

    The columns are the other parameters by name, each of shape (n,); those with a default may be missing. A length (n,)
    is NaN where there is none within the bounds. Chandrupatla's method finds roots to the last bit.
    """
    mechanism = solved.request.mechanism
    parameter = mechanism.parameter(solved.name)
    lowest = max(solved.low, float(np.nextafter(parameter.lower, math.inf)))
    highest = min(solved.high, parameter.upper)
    if mechanism.loop_lengths:
        return _solve_loop(solved, columns, lowest, highest)
    n = len(next(iter(columns.values())))
    difference, designs = _difference(solved, columns), np.arange(n)
    lengths = np.tile(np.linspace(lowest, highest, _N_LENGTHS)[:, None], (1, n))
    differences = np.array([difference(row, designs) for row in lengths])
    between = _between(difference, lengths, np.isfinite(differences), designs)
    scan = _interleaved(lengths, between)
    differences = _interleaved(differences, np.array([difference(row, designs) for row in between]))
    return _first_root(difference, scan, differences, designs, max(abs(solved.value), 1.0))


def _first_root(
    difference: _Difference, lengths: FloatArray, differences: FloatArray, designs: _Indices, scale: float
) -> FloatArray:
    """Smallest root of each design's difference within a scan; NaN where there is none.

    Where the difference jumps from one sign to the other, or a dip of its size does not reach 0, there is no root, and
    the next change of sign or dip is tried.
    """
    differences = np.where(np.abs(differences) <= _TOUCHING_TOLERANCE * scale, 0.0, differences)
    roots, first, order = np.full(len(designs), np.nan), np.zeros(len(designs), int), np.arange(len(lengths))[:, None]
    todo = np.arange(len(designs))
    while len(todo):
        rest = np.where(order >= first[todo], differences[:, todo], np.nan)
        signs = np.sign(rest)
        starts = signs[1:] * signs[:-1] <= 0.0
        starts[:-1] |= _dips(np.abs(rest), signs)
        at, has_start = starts.argmax(axis=0), starts.any(axis=0)
        todo, at, rest = todo[has_start], at[has_start], rest[:, has_start]
        if len(todo):
            near = np.where(order <= at + 2, rest, np.nan)
            roots[todo] = _smallest_root(difference, lengths[:, todo], near, designs[todo], scale)
            first[todo] = at + 1
            todo = todo[np.isnan(roots[todo])]
    return roots


def _between(
    difference: _Difference, lengths: FloatArray, moves: npt.NDArray[np.bool_], designs: _Indices
) -> FloatArray:
    """One length between any two of a scan: the last with a motion where only one of both has one, else the middle."""
    between = 0.5 * (lengths[1:] + lengths[:-1])
    rows, columns = np.nonzero(moves[1:] != moves[:-1])
    is_first = moves[rows, columns]
    inner, outer = lengths[rows + ~is_first, columns], lengths[rows + is_first, columns]
    for _ in range(_N_HALVINGS):
        middle = 0.5 * (inner + outer)
        is_inner = np.isfinite(difference(middle, designs[columns]))
        inner, outer = np.where(is_inner, middle, inner), np.where(is_inner, outer, middle)
    between[rows, columns] = inner
    return between


def _interleaved(rows: FloatArray, between: FloatArray) -> FloatArray:
    """The rows in turn, the first and last from `rows`."""
    both = np.empty((len(rows) + len(between), rows.shape[1]))
    both[::2], both[1::2] = rows, between
    return both


def _solve_loop(solved: SolvedLength, columns: Arrays, lowest: float, highest: float) -> FloatArray:
    """The lengths of a mechanism of one loop.

    Where one length equals a signed sum of the others the loop is flattened. Flattened loops divide the range of the
    length into intervals. In each, in ascending order, the difference between the metric and its prescribed value is
    evaluated at a few lengths. A change of sign brackets a root. A minimum of the difference's size before the first
    change of sign is a root or brackets one.
    """
    mechanism = solved.request.mechanism
    parameter, n = mechanism.parameter(solved.name), len(next(iter(columns.values())))
    others = [
        _usable(other, columns[other.name] if other.name in columns else np.full(n, other.default))
        for other in map(mechanism.parameter, mechanism.loop_lengths)
        if other is not parameter
    ]
    lengths, total = np.full(n, np.nan), np.sum(np.abs(others), axis=0)
    difference = _difference(solved, columns)
    for (lower, lower_clearance), (upper, upper_clearance) in pairwise(_interval_ends(others, parameter.lower < 0.0)):
        low, high = np.maximum(lower + lower_clearance, lowest), np.minimum(upper - upper_clearance, highest)
        unsolved = np.flatnonzero(np.isnan(lengths) & (low < high))
        # What kind of loop it is does not change in an interval: one length decides whether the metric exists.
        middle = np.clip(0.5 * (low + high), -2.0 * total, 2.0 * total)
        unsolved = unsolved[np.isfinite(difference(middle[unsolved], unsolved))]
        if len(unsolved):
            scale = max(abs(solved.value), 1.0)
            scan = _scan(low[unsolved], high[unsolved], total[unsolved])
            differences = np.array([difference(row, unsolved) for row in scan])
            lengths[unsolved] = _smallest_root(difference, scan, differences, unsolved, scale)
    return lengths


def _usable(parameter: Parameter, values: FloatArray) -> FloatArray:
    """The values, NaN where they are out of range, so that those designs have no solution."""
    sizes = np.abs(values)
    is_usable = (sizes <= LARGEST_PARAMETER) & ((sizes > SMALLEST_PARAMETER) | (values == 0.0))
    return np.where(is_usable & parameter.allows(values), values, np.nan)


def _scan(low: FloatArray, high: FloatArray, total: FloatArray) -> FloatArray:
    """Lengths to evaluate from `low` to `high`, ascending, shape (k, n).

    They are denser at the ends, where a metric may vary like a square root. Where they go beyond the sum of the other
    lengths, `total`, they are evenly spaced in the logarithm of the distance.
    """
    steps = np.sin(0.5 * np.pi * np.linspace(0.0, 1.0, _SCAN_POINTS))[:, None] ** 2
    lengths = low + steps * (high - low)
    growth = np.log1p((high - low) / total)
    lengths = np.where(low >= total, low + total * np.expm1(steps * growth), lengths)
    lengths = np.where(high <= -total, high - total * np.expm1((1.0 - steps) * growth), lengths)
    lengths[0], lengths[-1] = low, high
    return lengths


_Difference = Callable[..., FloatArray]


def _difference(solved: SolvedLength, columns: Arrays) -> _Difference:
    """A function of lengths and indices of designs: metric minus prescribed value, NaN where there is no motion."""
    request = solved.request
    moving = [*request.mechanism.moving_statuses, Status.TOLERANCE_NOT_MET]

    def difference(lengths: FloatArray, designs: _Indices) -> FloatArray:
        inputs = {name: values[designs] for name, values in columns.items()} | {solved.name: lengths}
        results = evaluate_columns(request, inputs).columns
        return np.where(np.isin(results["status"], moving), results[solved.metric.name] - solved.value, np.nan)

    return difference


def _interval_ends(others: list[FloatArray], is_signed: bool) -> list[tuple[FloatArray, FloatArray]]:
    """Ends of the intervals, ascending, and the clearance to keep from each, (n,); a signed length may be negative."""
    first, *rest = others
    flattened = [
        np.abs(first + np.sum([sign * length for sign, length in zip(signs, rest, strict=True)], axis=0))
        for signs in product((1.0, -1.0), repeat=len(rest))
    ]
    total = np.sum(np.abs(others), axis=0)
    clearance = _CLEARANCE * np.spacing(total)
    # At 0 and where two lengths are equal a margin has a corner, but the length is allowed, so no clearance is kept
    # unless the loop is flattened too.
    corners = [np.abs(other) for other in others]
    if is_signed:
        flattened += [-each for each in flattened]
        corners += [np.zeros_like(first), *(-each for each in corners)]
    is_flattened = [np.min([np.abs(corner - each) for each in flattened], axis=0) <= clearance for corner in corners]
    ends = [*flattened, *corners, _LONGEST * total, -_LONGEST * total if is_signed else np.zeros_like(first)]
    clearances = np.concatenate(
        [
            np.tile(clearance, (len(flattened), 1)),
            np.where(is_flattened, clearance, 0.0),
            np.tile(clearance, (2, 1)),
        ]
    )
    order = np.argsort(ends, axis=0, kind="stable")
    return list(
        zip(np.take_along_axis(np.array(ends), order, 0), np.take_along_axis(clearances, order, 0), strict=True)
    )


def _smallest_root(
    difference: _Difference, lengths: FloatArray, differences: FloatArray, designs: _Indices, scale: float
) -> FloatArray:
    """Smallest root of each design's difference within a scan, where it is smooth; NaN where there is none."""
    from scipy.optimize.elementwise import find_root

    differences[np.abs(differences) <= _TOUCHING_TOLERANCE * scale] = 0.0
    sign_changes = np.sign(differences[1:]) * np.sign(differences[:-1]) <= 0.0
    at, has_change = sign_changes.argmax(axis=0), np.asarray(sign_changes.any(axis=0))
    columns = np.arange(len(designs))
    left = np.where(has_change, lengths[at, columns], np.nan)
    right = np.where(has_change, lengths[at + 1, columns], np.nan)
    roots, dip_left, dip_right = _dip(difference, lengths, differences, designs, left, scale)
    left, right = np.where(np.isnan(dip_left), left, dip_left), np.where(np.isnan(dip_right), right, dip_right)
    for length, at_length in ((left, differences[at, columns]), (right, differences[at + 1, columns])):
        hit = np.isnan(roots) & np.isnan(dip_left) & has_change & (at_length == 0.0)
        roots[hit] = length[hit]
    rows = np.flatnonzero(np.isnan(roots) & np.isfinite(left))
    if len(rows):
        root = find_root(difference, (left[rows], right[rows]), args=(designs[rows],), tolerances=_TOLERANCES)
        roots[rows] = np.where(np.abs(root.f_x) <= _CROSSING_TOLERANCE * scale, root.x, np.nan)
    return roots


def _dips(sizes: FloatArray, signs: FloatArray) -> npt.NDArray[np.bool_]:
    """Whether each length but the first and the last has a smaller difference than its neighbours, of one sign."""
    is_one_sign = (signs[1:-1] == signs[:-2]) & (signs[1:-1] == signs[2:])
    return np.asarray(is_one_sign & (sizes[1:-1] <= sizes[:-2]) & (sizes[1:-1] < sizes[2:]))


def _dip(
    difference: _Difference,
    lengths: FloatArray,
    differences: FloatArray,
    designs: _Indices,
    change: FloatArray,
    scale: float,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The minimum of the difference's size before the first change of sign: a root there, or two lengths around one.

    Root, left and right length are of shape (n,), NaN where there is none.
    """
    from scipy.optimize.elementwise import find_minimum

    root, left, right = (np.full(len(designs), np.nan) for _ in range(3))
    signs = np.sign(differences)
    dips = _dips(np.abs(differences), signs) & ~(lengths[2:] > change)
    rows = np.flatnonzero(dips.any(axis=0))
    if len(rows) == 0:
        return root, left, right
    at = dips.argmax(axis=0)[rows]

    def distance(length: FloatArray, design: _Indices, sign: FloatArray) -> FloatArray:
        return sign * difference(length, design)

    nearest = find_minimum(
        distance,
        (lengths[at, rows], lengths[at + 1, rows], lengths[at + 2, rows]),
        args=(designs[rows], signs[at, rows]),
        tolerances=_TOLERANCES,
    )
    root[rows] = np.where(np.abs(nearest.f_x) <= _TOUCHING_TOLERANCE * scale, nearest.x, np.nan)
    crosses = nearest.f_x < 0.0
    left[rows], right[rows] = np.where(crosses, lengths[at, rows], np.nan), np.where(crosses, nearest.x, np.nan)
    return root, left, right
