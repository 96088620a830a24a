"""Means over a turn and over arcs, with errors that bounds at complex angles prove.

A function of period 2 pi that is analytic where the imaginary part of the angle is below a, and at most M there, has a
mean that n equal steps miss by at most 2 M/(exp(a n) - 1) (Trefethen and Weideman, SIAM Review 56, 2014, theorem 3.2).
One that is analytic and at most M in the ellipse of the sum rho of the semi-axes about a piece, whose ends are the foci
-1 and 1, has a mean that n + 1 nodes of Gauss miss by at most 32/15 M rho^(-2 n)/(1 - rho^(-2)) (Trefethen,
Approximation Theory and Approximation Practice, theorem 19.3).

A function here is real at real angles, and has no finite value on a box of angles in which it is not analytic.
"""

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any

from flint import acb, arb, ctx

from explore.analysis.certifying.balls import UnprovedError

#: Half the height of the highest strip that is tried, rad.
_HIGHEST = 1.0
#: Half the height of a strip over that of the one tried before it.
_LOWER = 0.7
#: Half the height of the lowest strip that is tried, rad.
_LOWEST = 5e-3
#: Sum of the semi-axes of ellipses, over half the length of a piece.
_SUM = 2.0
#: Half the length of the longest piece, rad.
_LONGEST = 0.4
#: Half the length of the shortest piece that is halved, rad.
_SHORTEST = 1e-3
#: Number of angles that tell how large a function usually is.
_SAMPLES = 8
#: Height of the lowest box that is halved, over half of that of the first boxes.
_NARROWEST = 0.6
#: Overlap of boxes, rad, so that rounding leaves no gap.
_OVERLAP = 1e-9
#: Largest number of boxes that are looked at.
_MOST_BOXES = 250

Function = Callable[[Any], Any]
#: The centre and half the width of a box, and the middle and half the height of its imaginary part, rad.
Box = tuple[float, float, float, float]


def turn_means(function: Function, reason: str) -> tuple[arb, arb]:
    """Mean of a function and of its square over a full turn; `UnprovedError` with the reason where none is proved."""
    height, bound = _find_strip(function, reason)
    digits = _digits(bound, [function(arb(k)) for k in range(_SAMPLES)])
    count = math.ceil(digits / height) + 1
    values = [function(2 * arb.pi() * k / count) for k in range(count)]
    missed = 2 / ((arb(height) * count).exp() - 1)
    return (
        sum(values, arb(0)) / count + arb(0, (bound * missed).upper()),
        sum((value * value for value in values), arb(0)) / count + arb(0, (bound * bound * missed).upper()),
    )


def arc_means(function: Function, start: arb, stop: arb, reason: str) -> tuple[arb, arb]:
    """Mean of a function and of its square over an arc."""
    count = math.ceil(float(stop - start) / (2.0 * _LONGEST))
    half = (stop - start) / (2 * count)
    waiting = [(start + (2 * k + 1) * half, half) for k in range(count)]
    total = square = arb(0)
    while waiting:
        middle, half = waiting.pop()
        bound = _bound_about(function, middle, half)
        if bound is None:
            if float(half) < _SHORTEST:
                raise UnprovedError(reason)
            waiting += [(middle - half / 2, half / 2), (middle + half / 2, half / 2)]
            continue
        mean, mean_square = _piece_means(function, middle, half, bound)
        total, square = total + mean * half, square + mean_square * half
    return 2 * total / (stop - start), 2 * square / (stop - start)


def _piece_means(function: Function, middle: arb, half: arb, bound: arb) -> tuple[arb, arb]:
    """Mean of a function and of its square over a piece, in whose ellipse the function has a bound."""
    samples = [function(middle + half * (2 * k - _SAMPLES) / _SAMPLES) for k in range(_SAMPLES)]
    order = math.ceil(_digits(bound, samples) / (2.0 * math.log(_SUM))) + 1
    mean = square = arb(0)
    for node, weight in _gauss_rule(order + 1, ctx.prec):
        value = function(middle + half * node)
        mean, square = mean + weight * value / 2, square + weight * value * value / 2
    missed = arb(32) / 15 * arb(_SUM) ** (-2 * order) / (1 - arb(_SUM) ** -2)
    return mean + arb(0, (bound * missed).upper()), square + arb(0, (bound * bound * missed).upper())


@lru_cache
def _gauss_rule(count: int, bits: int) -> list[tuple[arb, arb]]:
    """Nodes and weights of Gauss and Legendre on -1 to 1."""
    with ctx.workprec(bits):
        return [arb.legendre_p_root(count, k, weight=True) for k in range(count)]


def _digits(bound: arb, values: list[arb]) -> float:
    """Natural logarithm of what errors of squares over the square of the bound must be below."""
    usual = max(abs(float(value.mid())) for value in values)
    loose = math.log(float(bound) / usual) if usual > 0.0 else 0.0
    digits = 0.75 * float(ctx.prec)
    return digits * math.log(2.0) + 2.0 * max(loose, 0.0)


# bounds at complex angles


def _find_strip(function: Function, reason: str) -> tuple[float, arb]:
    """Half the height of a strip in which a function is analytic, and a bound of it there."""
    height = _HIGHEST
    while height > _LOWEST:
        columns = math.ceil(math.pi / height)
        boxes = [((2 * k + 1) * height / 2, height / 2, height / 2, height / 2) for k in range(2 * columns)]
        bound = _bound_in(function, boxes)
        if bound is not None:
            return height, bound
        height *= _LOWER
    raise UnprovedError(reason)


def _bound_about(function: Function, middle: arb, half: arb) -> arb | None:
    """A bound of a function in the rectangle around the ellipse about a piece."""
    length = float(half.upper()) * (1.0 + 1e-9)
    across, up = 0.5 * length * (_SUM + 1.0 / _SUM), 0.5 * length * (_SUM - 1.0 / _SUM)
    centre = float(middle.mid())
    return _bound_in(function, [(centre, across + 1e-9 * (1.0 + abs(centre)), 0.5 * up, 0.5 * up)])


def _bound_in(function: Function, boxes: list[Box]) -> arb | None:
    """A bound of a function in boxes above the real angles, and in those below to which they are conjugate.

    None if there is none, or none is found.
    """
    waiting, bound, count = boxes, 0.0, 0
    least = _NARROWEST * boxes[0][3] / 2.0
    while waiting:
        x, width, y, half = waiting.pop()
        count += 1
        value = function(acb(arb(x, width + _OVERLAP), arb(y, half + _OVERLAP)))
        if value.is_finite():
            bound = max(bound, float(value.abs_upper().upper()))
        elif half < least or count > _MOST_BOXES:
            return None
        else:
            width, half = width / 2, half / 2
            waiting += [(x + i * width, width, y + j * half, half) for i in (-1, 1) for j in (-1, 1)]
    return arb(bound) * (1 + arb(2.0**-50)) if math.isfinite(bound) else None
