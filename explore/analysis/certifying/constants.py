"""Signals that are the same at all angles of an arc, by their operations or by their variance."""

import math

from flint import arb, ctx

from explore.analysis.certifying.ball_graph import Function
from explore.analysis.certifying.means import arc_means
from explore.analysis.certifying.subdivision import cells_of, over_cell
from explore.mechanisms.linkages.graph import Number

#: Shares of an arc at which a signal that is the same at all of its angles has values that are not told apart.
_PLACES = (0.1, 0.37, 0.71)


def constant_of(number: Number, function: Function) -> tuple[arb, arb] | None:
    """A number that is the same at all angles, twice; None for others.

    A trigonometric polynomial of order n that is the same at 2 n + 1 equal steps is so everywhere; what its values
    differ by is enlarged by at most their number.
    """
    if not math.isfinite(number.order):
        return None
    count = 2 * int(number.order) + 1
    first, *others = [function.value(2 * arb.pi() * k / count) for k in range(count)]
    spread = sum((abs(other - first).upper() for other in others), arb(0))
    value = first + arb(0, spread.upper())
    return (value, value) if value.rad() <= value.abs_upper() * arb(2) ** -(ctx.prec // 2) else None


def same_value(function: Function, start: arb, stop: arb, reason: str) -> tuple[arb, arb] | None:
    """The value of a number over an arc, twice, if it seems to be the same at all angles; None for others.

    Where it differs from its mean by s and its slope is at most D, it does so by s - D x at the distance x, on at least
    half the arc of the length L. With the variance v, s^3 <= 3 D v L while s <= D L/2, and else s^2 <= 8 v.
    """
    length = stop - start
    first, *others = [function.value(start + length * share) for share in _PLACES]
    if not all(value.overlaps(first) for value in others):
        return None
    slope = arb(0)
    for cell in cells_of(start, stop):
        slope = slope.max(abs(over_cell(function.series_over(cell.middle, cell.half)[0], cell.half)[1]))
    if not slope.is_finite():
        return None
    mean, square = arc_means(function.value, start, stop, reason)
    variance = (square - mean * mean).abs_upper()
    cube = (3 * slope * variance * length).abs_upper()
    most = arb(0) if cube.is_zero() else cube.root(3)  # flint has no cube root of 0 with few bits
    most = most.max((8 * variance).sqrt())
    value = mean + arb(0, most.upper())
    return value, value
