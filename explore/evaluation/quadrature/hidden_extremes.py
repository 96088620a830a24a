"""Minima that no sample shows, where a signal has two nearly equal ones a few nodes apart.

One stands beside a node through which the samples fall, or rise, while the signal has the other slope there; or two on
both sides of the least sample, where the signal is not convex. Seven samples tell slope and curvature by the number of
the node, of which its angle is a smooth function: slopes have the same sign. Two minima between the same two nodes are
not told apart: the search may end at either.
"""

import numpy as np

from explore.base.compiling import LANES
from explore.base.subroutines import subroutine

#: Part of the difference of a derivative by seven and by five samples that the former may be wrong by.
_DOUBT = 0.25
#: Factor on the drop of a parabola to the next node, up to which a hidden minimum is taken to be below the node.
_DEPTH = 2.0
#: Slope at a node, over its size, up to which a minimum is one of rounding.
_ROUNDING = 2.0**-46
#: Fraction that the number of a node is raised by where a minimum may be hidden before it.
BEFORE = 0.25
#: Fraction where minima may be hidden on both sides.
BOTH = 0.5
#: Fraction where a minimum may be hidden behind it.
BEHIND = 0.75
#: Number of the end of a panel, as the nodes of Gauss and Legendre are near cos(pi (k - 0.25)/(n + 0.5)).
_END = 0.25


def _stencil(*distances: float) -> tuple[float, ...]:
    """Weights of samples at distances from a node, less the value there, in slope and curvature by all and by four."""
    weights: list[float] = []
    for count in (len(distances), 4):
        powers = np.vander(distances[:count], count + 1, increasing=True)[:, 1:].T
        weights += np.linalg.solve(powers, np.eye(count)[:, :2] * [1.0, 2.0]).T.ravel().tolist()
    return tuple(weights)


#: Weights at a node of a turn or inside a panel: the neighbours, then further ones.
_INSIDE = _stencil(-1.0, 1.0, -2.0, 2.0, -3.0, 3.0)
#: Weights at the first three nodes from an end, which is among the six.
_NEAR_END = (
    _stencil(_END - 1.0, 1.0, 2.0, 3.0, 4.0, 5.0),
    _stencil(-1.0, 1.0, _END - 2.0, 2.0, 3.0, 4.0),
    _stencil(-1.0, 1.0, -2.0, 2.0, _END - 3.0, 3.0),
)
#: Numbers of these six samples from the end, which is number 0.
_SAMPLES_NEAR_END = ((0, 2, 3, 4, 5, 6), (1, 3, 0, 4, 5, 6), (2, 4, 1, 5, 0, 6))


@subroutine(inlined=True)
def is_open(at, left, right, third, fourth, least):
    """Whether five samples leave it open that a minimum near the least is hidden beside a node of a slope."""
    near, far = abs(right - left), abs(fourth - third)
    return ((left - at) * (right - at) < 0.0) & has_doubtful_slope(near, far) & (at - least <= near + far)


@subroutine(inlined=True)
def has_doubtful_slope(near, far):
    """Whether the slope at a node may be the other one, by the sizes of differences of its four neighbours.

    The slope by them is (8 near - far)/12, and that by two near/2; they may err by twice the difference.
    """
    return far > 4.0 * near


@subroutine(no_alias=True)
def _mark(weights, at, left, right, third, fourth, fifth, sixth, least, inside, number, on_left, on_right, marks):
    """Fill the raised number of a node in the lanes where a minimum is hidden beside it that may be the least value.

    It is raised by `on_left` where that is on the side of the neighbour `left`. At a node `inside` lanes that are not
    open (`is_open`) are left alone, whatever other lanes hold.
    """
    for lane in range(len(least)):
        here = at[lane]
        a, b, c, d = left[lane] - here, right[lane] - here, third[lane] - here, fourth[lane] - here
        e, f = fifth[lane] - here, sixth[lane] - here
        slope = weights[0] * a + weights[1] * b + weights[2] * c + weights[3] * d + weights[4] * e + weights[5] * f
        bend = weights[6] * a + weights[7] * b + weights[8] * c + weights[9] * d + weights[10] * e + weights[11] * f
        slope_by_four = weights[12] * a + weights[13] * b + weights[14] * c + weights[15] * d
        bend_by_four = weights[16] * a + weights[17] * b + weights[18] * c + weights[19] * d
        # the slope towards the hidden minimum, at most
        fall = _DOUBT * abs(slope - slope_by_four) + (slope if a > 0.0 else -slope)
        drop = _DEPTH * (fall - (0.5 * bend if bend < 0.0 else 0.0))
        open_here = is_open(here, left[lane], right[lane], third[lane], fourth[lane], least[lane])
        hides = (a * b < 0.0) & (open_here | (not inside)) & (here - least[lane] <= drop)
        hides &= fall > _ROUNDING * abs(here)
        is_double = (marks[lane] == number) & (bend < _DOUBT * abs(bend - bend_by_four))
        mark = number + BOTH if is_double else marks[lane]
        marks[lane] = number + (on_left if a > 0.0 else on_right) if hides else mark


@subroutine(inlined=True)
def is_near_end(is_turn, count, j):
    """Whether a node is one of the first three from an end of the panel."""
    return not is_turn and min(j, count + 1 - j) <= len(_NEAR_END)


@subroutine(inlined=True)
def neighbours(count, j, distance):
    """Numbers of the samples so many nodes before and behind a node, which of a turn may be those at its other side."""
    # without remainders, which take as long as all else
    before, behind = j - distance, j + distance
    return before if before > 0 else before + count, behind if behind <= count else behind - count


@subroutine()
def mark_hidden(values, least, count, j, marks):
    """Fill the number of node j, raised by `BEFORE`, `BOTH` or `BEHIND`, where minima may be hidden beside it.

    The node is none near an end of a panel. The samples are those of `explore.evaluation.quadrature.extremes`; `least`
    are the least ones. In `marks` is the number where the node is a minimum of the samples.
    """
    (c, d), (e, f) = neighbours(count, j, 2), neighbours(count, j, 3)
    _mark(
        _INSIDE, values[j * LANES :], values[(j - 1) * LANES :], values[(j + 1) * LANES :], values[c * LANES :],
        values[d * LANES :], values[e * LANES :], values[f * LANES :], least, True, 1.0 * j, BEFORE, BEHIND, marks,
    )  # fmt: skip


@subroutine()
def mark_hidden_near_end(values, least, count, j, marks):
    """`mark_hidden` at one of the first three nodes from an end."""
    from_end, is_last, last = min(j, count + 1 - j), 2 * j > count + 1, count + 1
    a, b, c, d, e, f = _SAMPLES_NEAR_END[from_end - 1]
    if f >= last:
        return
    if is_last:
        a, b, c, d, e, f = last - a, last - b, last - c, last - d, last - e, last - f
    _mark(
        _NEAR_END[from_end - 1], values[j * LANES :], values[a * LANES :], values[b * LANES :], values[c * LANES :],
        values[d * LANES :], values[e * LANES :], values[f * LANES :], least, False, 1.0 * j,
        BEHIND if is_last else BEFORE, BEFORE if is_last else BEHIND, marks,
    )  # fmt: skip
