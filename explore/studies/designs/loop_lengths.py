"""Solve for a length of a mechanism of one loop: by a formula of its metric, else between the flattened loops."""

from itertools import pairwise, product

import numpy as np
import numpy.typing as npt

from explore.evaluation.evaluate import LARGEST_PARAMETER, SMALLEST_PARAMETER
from explore.model.columns import Arrays
from explore.model.quantities import FloatArray, Metric, Parameter
from explore.studies.designs.smallest_roots import TOUCHING_TOLERANCE, Difference, Indices, smallest_root
from explore.studies.designs.spaces import SolvedLength

#: Number of lengths evaluated between two flattened loops, where a metric has at most one extremum.
_SCAN_POINTS = 9
#: Longest length that is tried where none flattens the loop, in sums of the other lengths.
_LONGEST = 1e6
#: Distance to a flattened loop, in units in the last place of the sum of all lengths, that counts as flattened.
_CLEARANCE = 8.0
#: Error of a formula, relative to the sum of the other lengths or to the prescribed value, that is not ruled out.
_FORMULA_ERROR = 1e-6


def solve_loop(
    solved: SolvedLength, columns: Arrays, lowest: float, highest: float, difference: Difference
) -> FloatArray:
    """The smallest length of each design within the bounds, (n,); the columns are the other parameters by name."""
    mechanism = solved.request.mechanism
    parameter, n = mechanism.parameter(solved.name), len(next(iter(columns.values())))
    others = {
        other.name: _usable(other, columns[other.name] if other.name in columns else np.full(n, other.default))
        for other in map(mechanism.parameter, mechanism.loop_lengths)
        if other is not parameter
    }
    lengths, is_doubtful = _by_formula(solved, others, lowest, highest, difference)
    designs = np.flatnonzero(is_doubtful)
    if len(designs):
        others = {name: values[designs] for name, values in others.items()}
        lengths[designs] = _between_flattened(solved, list(others.values()), designs, lowest, highest, difference)
    return lengths


def _by_formula(
    solved: SolvedLength, others: Arrays, lowest: float, highest: float, difference: Difference
) -> tuple[FloatArray, npt.NDArray[np.bool_]]:
    """The smallest length of the metric's formula that has the value, and whether rounding leaves that in doubt."""
    columns = list(others.values())
    formula = solved.metric.lengths if isinstance(solved.metric, Metric) else None
    lengths, is_doubtful = np.full(len(columns[0]), np.nan), np.full(len(columns[0]), formula is None)
    if formula is None:
        return lengths, is_doubtful
    candidates = np.sort(formula(solved.name, others, solved.value), axis=0)
    is_doubtful |= np.isnan(candidates).any(axis=0)
    scale, margin = max(abs(solved.value), 1.0), _FORMULA_ERROR * np.sum(np.abs(columns), axis=0)
    for candidate in candidates:
        is_near = (candidate >= lowest - margin) & (candidate <= highest + margin) & np.isfinite(candidate)
        designs = np.flatnonzero(is_near & np.isnan(lengths) & ~is_doubtful)
        tried = candidate[designs]
        gaps = np.abs(difference(tried, designs))
        is_root = (gaps <= TOUCHING_TOLERANCE * scale) & (tried >= lowest) & (tried <= highest)
        lengths[designs[is_root]] = tried[is_root]
        designs, tried, gaps = designs[~is_root], tried[~is_root], gaps[~is_root]
        # NaN beside a flattened loop may be a motion
        flattened = _flattened([column[designs] for column in columns])
        distance = np.min([np.abs(np.abs(tried) - each) for each in flattened], axis=0)
        is_doubtful[designs] = (gaps <= _FORMULA_ERROR * scale) | (np.isnan(gaps) & (distance <= margin[designs]))
    return lengths, is_doubtful


def _between_flattened(
    solved: SolvedLength, others: list[FloatArray], designs: Indices, lowest: float, highest: float,
    difference: Difference,
) -> FloatArray:  # fmt: skip
    """The smallest length of each design, without a formula.

    Where one length equals a signed sum of the others the loop is flattened. Flattened loops divide the range of the
    length into intervals. In each, in ascending order, the difference between the metric and its prescribed value is
    evaluated at a few lengths. A change of sign brackets a root. A minimum of the difference's size before the first
    change of sign is a root or brackets one.
    """
    lengths, total = np.full(len(designs), np.nan), np.sum(np.abs(others), axis=0)
    is_signed = solved.request.mechanism.parameter(solved.name).lower < 0.0
    for (lower, lower_clearance), (upper, upper_clearance) in pairwise(_interval_ends(others, is_signed)):
        low, high = np.maximum(lower + lower_clearance, lowest), np.minimum(upper - upper_clearance, highest)
        unsolved = np.flatnonzero(np.isnan(lengths) & (low < high))
        # What kind of loop it is does not change in an interval: one length decides whether the metric exists.
        middle = np.clip(0.5 * (low + high), -2.0 * total, 2.0 * total)
        unsolved = unsolved[np.isfinite(difference(middle[unsolved], designs[unsolved]))]
        if len(unsolved):
            scale = max(abs(solved.value), 1.0)
            scan = _scan(low[unsolved], high[unsolved], total[unsolved])
            differences = np.array([difference(row, designs[unsolved]) for row in scan])
            lengths[unsolved] = smallest_root(difference, scan, differences, designs[unsolved], scale)
    return lengths


def _flattened(others: list[FloatArray]) -> list[FloatArray]:
    """Sizes of the length that flatten the loop."""
    first, *rest = others
    return [
        np.abs(first + np.sum([sign * length for sign, length in zip(signs, rest, strict=True)], axis=0))
        for signs in product((1.0, -1.0), repeat=len(rest))
    ]


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


def _interval_ends(others: list[FloatArray], is_signed: bool) -> list[tuple[FloatArray, FloatArray]]:
    """Ends of the intervals, ascending, and the clearance to keep from each, (n,); a signed length may be negative."""
    flattened = _flattened(others)
    total = np.sum(np.abs(others), axis=0)
    clearance = _CLEARANCE * np.spacing(total)
    # At 0 and where two lengths are equal a margin has a corner, but the length is allowed, so no clearance is kept
    # unless the loop is flattened too.
    corners = [np.abs(other) for other in others]
    if is_signed:
        flattened += [-each for each in flattened]
        corners += [np.zeros_like(others[0]), *(-each for each in corners)]
    is_flattened = [np.min([np.abs(corner - each) for each in flattened], axis=0) <= clearance for corner in corners]
    ends = [*flattened, *corners, _LONGEST * total, -_LONGEST * total if is_signed else np.zeros_like(others[0])]
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
