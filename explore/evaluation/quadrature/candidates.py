"""Samples from which the least value is looked for: local minima, ends, and nodes with a hidden minimum beside them."""

import math

from explore.base.compiling import LANES
from explore.base.subroutines import subroutine
from explore.evaluation.quadrature.equispaced import abscissa
from explore.evaluation.quadrature.hidden_extremes import (
    has_doubtful_slope,
    is_near_end,
    is_open,
    mark_hidden,
    mark_hidden_near_end,
    neighbours,
)
from explore.evaluation.quadrature.tiles import sample_abscissa

#: Factor on the largest drop of a parabola below a local minimum, which may win if this reaches the least sample.
_DROP_MARGIN = 64.0
#: Slope at an end, over curvature times distance to the next sample, below which the extreme may be inside.
_DOUBTFUL = 0.1
#: Rise to both neighbours of a sample, over its size, up to which a minimum is one of rounding.
_CONSTANT = 2.0**-46


@subroutine(inlined=True)
def abscissa_of(is_turn, count, table, rule, j):
    """Abscissa of a sample; of a turn also of those before the first and after the last."""
    return abscissa(count, j - 1) if is_turn else sample_abscissa(table, rule, count, j)


@subroutine(inlined=True)
def abscissas_about(is_turn, count, table, rule, j):
    """Abscissas of a sample between the ends, and of those before and after it."""
    return (
        abscissa_of(is_turn, count, table, rule, j - 1), abscissa_of(is_turn, count, table, rule, j),
        abscissa_of(is_turn, count, table, rule, j + 1),
    )  # fmt: skip


@subroutine(inlined=True)
def divided_differences(f0, f1, f2, f3, f4, x1, x2, x3, x4):
    """Newton's divided differences of the orders 1 to 4 of five values at 0 and four other places."""
    d01, d12, d23, d34 = (f1 - f0) / x1, (f2 - f1) / (x2 - x1), (f3 - f2) / (x3 - x2), (f4 - f3) / (x4 - x3)
    d02, d13, d24 = (d12 - d01) / x2, (d23 - d12) / (x3 - x1), (d34 - d23) / (x4 - x2)
    d03, d14 = (d13 - d02) / x3, (d24 - d13) / (x4 - x1)
    return d01, d02, d03, (d14 - d03) / x4


@subroutine(no_alias=True)
def _mark_end(at_0, at_1, at_2, at_3, at_4, x1, x2, x3, x4, number, following, marks):
    """Fill the number of an end that is not above the sample next to it where the least value may be inside, or go on.

    The samples are those from the end on, and their distances from it in abscissas. The slope at the end is the least
    by five samples: what the fifth changes in the slope of four is at least what more would.
    """
    # derivatives of the interpolant at the end
    for lane in range(len(at_0)):
        f0, f1, f2, f3, f4 = at_0[lane], at_1[lane], at_2[lane], at_3[lane], at_4[lane]
        d01, d02, d03, d04 = divided_differences(f0, f1, f2, f3, f4, x1, x2, x3, x4)
        slope = d01 - x1 * (d02 - x2 * (d03 - x3 * d04)) - x1 * x2 * x3 * abs(d04)
        curvature = 2.0 * (d02 - (x1 + x2) * d03 + (x1 * x2 + x1 * x3 + x2 * x3) * d04)
        starts = (f0 <= f1) & (f0 < math.inf) & (slope < _DOUBTFUL * x1 * abs(curvature))
        marks[lane] = number if starts else following[lane]


@subroutine(no_alias=True)
def _skip(values, marks):
    """Fill the mark of a sample with that of the next one, and return whether in no lane it may be a candidate.

    The sample is the middle one of five. It is none where it is no local minimum and its slope is not in doubt, as for
    most; to see this takes a third of the time of looking for a candidate.
    """
    is_other = False
    for lane in range(LANES):
        marks[lane] = marks[LANES + lane]
        left, value, right = values[LANES + lane], values[2 * LANES + lane], values[3 * LANES + lane]
        near, far = abs(right - left), abs(values[4 * LANES + lane] - values[lane])
        is_other = is_other | ((value <= left) & (value <= right)) | has_doubtful_slope(near, far)
    return not is_other


@subroutine(no_alias=True)
def _mark_inside(values, far_before, far_behind, j, a, x, b, least, following, marks, width):
    """Fill the number of the next sample that may win from sample j on, by its neighbours.

    Return whether in some lane a minimum may be hidden beside the sample, by the ones next to its neighbours too.

    Only a local minimum may, by `_DROP_MARGIN` times what a parabola of the curvature there drops below it at most, in
    the middle of the wider distance; the slope does not tell, for at a sample beside the minimum it may seem to be 0.
    At a tolerance of 1e-6, whose nodes are few, a factor of 8 missed two of 3.4 million extremes.
    """
    to_left, to_right, both = 1.0 / (x - a), 1.0 / (b - x), 1.0 / (b - a)
    share = 0.25 * _DROP_MARGIN * max(x - a, b - x) ** 2
    count = 0
    for lane in range(width):
        left, value, right = values[lane], values[LANES + lane], values[2 * LANES + lane]
        before, after = (value - left) * to_left, (right - value) * to_right
        curvature = (after - before) * both
        reaches = value - least[lane] <= share * curvature
        rise = (left if left > right else right) - value  # 0 on a plateau
        is_lowest = (value <= left) & (value <= right) & (rise > _CONSTANT * abs(value))
        marks[lane] = 1.0 * j if is_lowest & reaches else following[lane]
        open_here = is_open(value, left, right, far_before[lane], far_behind[lane], least[lane])
        count += 1 if open_here | (is_lowest & reaches) else 0
    return count > 0


@subroutine()
def mark_candidates(is_turn, values, least, count, table, rule, marks):
    """Fill for each sample the number of the next one from it on at which a lane starts; behind the last for none."""
    width, last = len(least), count + 1
    marks[last * LANES : (last + 2) * LANES] = 1.0 * (last + 1)
    x1, x2 = 1.0 + sample_abscissa(table, rule, count, 1), 1.0 + sample_abscissa(table, rule, count, 2)
    x3, x4 = 1.0 + sample_abscissa(table, rule, count, 3), 1.0 + sample_abscissa(table, rule, count, 4)
    if not is_turn:
        _mark_end(
            values[last * LANES : (last + 1) * LANES], values[(last - 1) * LANES :], values[(last - 2) * LANES :],
            values[(last - 3) * LANES :], values[(last - 4) * LANES :], x1, x2, x3, x4, 1.0 * last,
            marks[(last + 1) * LANES :], marks[last * LANES :],
        )  # fmt: skip
    for j in range(count, 0, -1):
        if 3 < j < count - 2 and _skip(values[(j - 2) * LANES :], marks[j * LANES :]):
            continue
        a, x, b = abscissas_about(is_turn, count, table, rule, j)
        far_before, far_behind = (j, j) if is_near_end(is_turn, count, j) else neighbours(count, j, 2)
        may_hide = _mark_inside(
            values[(j - 1) * LANES :], values[far_before * LANES :], values[far_behind * LANES :], j, a, x, b, least,
            marks[(j + 1) * LANES :], marks[j * LANES :], width,
        )  # fmt: skip
        if is_near_end(is_turn, count, j):
            mark_hidden_near_end(values, least, count, j, marks[j * LANES :])
        elif may_hide:
            mark_hidden(values, least, count, j, marks[j * LANES :])
    for lane in range(LANES):
        marks[lane] = marks[LANES + lane]
    if not is_turn:
        _mark_end(
            values[:LANES], values[LANES:], values[2 * LANES :], values[3 * LANES :], values[4 * LANES :],
            x1, x2, x3, x4, 0.0, marks[LANES:], marks,
        )  # fmt: skip
