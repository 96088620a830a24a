"""Means over a turn and over arcs, with errors that bounds at complex angles prove.

A function of period 2 pi that is analytic where the imaginary part of the angle is below a, and at most M there, has a
mean that n equal steps miss by at most 2 M/(exp(a n) - 1) (Trefethen and Weideman, SIAM Review 56, 2014, theorem 3.2).
One that is analytic and at most M in the ellipse of the sum rho of the semi-axes about a piece, whose ends are the foci
-1 and 1, has a mean that n + 1 nodes of Gauss miss by at most 32/15 M rho^(-2 n)/(1 - rho^(-2)) (Trefethen,
Approximation Theory and Approximation Practice, theorem 19.3).

A function here is real at real angles, and has no finite value on a box of angles in which it is not analytic.
"""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import lru_cache
from typing import Any

from flint import acb, arb, ctx

from explore.analysis.certifying.balls import UnprovedError

#: Heights of the strips that are tried about a full turn, rad.
_STRIPS = (1.0, 0.5, 0.25)
#: Sum of the semi-axes of ellipses, over half the length of a piece.
_SUM = 2.0
#: Half the length of the longest piece, rad.
_LONGEST = 1.6
#: Half the length of a piece that is so short that its values are close enough, rad.
_SHORTEST = 2.0**-40
#: Largest number of pieces of an arc.
_MOST_PIECES = 1000
#: Number of angles that tell how large a function usually is.
_SAMPLES = 4
#: Number of boxes in a row about a piece at first.
_COLUMNS = 4
#: Overlap of boxes over their size, so that rounding leaves no gap.
_OVERLAP = 1e-9
#: Rounding of the centre of a box, relative to 1 and the centre.
_ROUNDING = 1e-15
#: Height of the lowest box that is halved, over that of the first boxes.
_NARROWEST = 0.6
#: Largest number of boxes that are looked at.
_MOST_BOXES = 60

Function = Callable[[Any], Any]
#: The centre and half the width of a box, and the middle and half the height of its imaginary part, rad.
Box = tuple[float, float, float, float]

_is_left_out = ContextVar("integration is left out", default=False)


@contextmanager
def integration_left_out() -> Iterator[None]:
    """Here what needs an integral, which takes up to seconds, is not proved."""
    token = _is_left_out.set(True)
    try:
        yield
    finally:
        _is_left_out.reset(token)


def turn_means(function: Function, reason: str) -> tuple[arb, arb]:
    """Mean of a function and of its square over a full turn; `UnprovedError` with the reason where none is proved."""
    _require_integration()
    for height in _STRIPS:
        columns = math.ceil(math.pi / height)
        boxes = [((2 * k + 1) * height / 2, height / 2, height / 2, height / 2) for k in range(2 * columns)]
        bound = _bound_in(function, boxes)
        if bound is not None:
            return _equal_steps(function, height, bound)
    return arc_means(function, arb(0), 2 * arb.pi(), reason)


def _equal_steps(function: Function, height: float, bound: arb) -> tuple[arb, arb]:
    """Mean of a function and of its square over a turn, in a strip of which it has a bound."""
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
    _require_integration()
    count = math.ceil(float(stop - start) / (2.0 * _LONGEST))
    half = whole = (stop - start) / (2 * count)
    waiting = [(start + (2 * k + 1) * half, half) for k in range(count)]
    total = square = arb(0)
    while waiting:
        middle, half = waiting.pop()
        bound = _bound_about(function, middle, half)
        if bound is not None:
            mean, mean_square = _piece_means(function, middle, half, bound, float(half / whole))
        elif float(half) > _SHORTEST and count < _MOST_PIECES:
            count += 1
            waiting += [(middle - half / 2, half / 2), (middle + half / 2, half / 2)]
            continue
        else:
            mean = function(middle + arb(0, half.upper()))
            mean_square = mean * mean
            if float(half) > _SHORTEST or not mean.is_finite():
                raise UnprovedError(reason)
        total, square = total + mean * half, square + mean_square * half
    return 2 * total / (stop - start), 2 * square / (stop - start)


def _require_integration() -> None:
    if _is_left_out.get():
        raise UnprovedError("integration is left out")


def _piece_means(function: Function, middle: arb, half: arb, bound: arb, share: float) -> tuple[arb, arb]:
    """Mean of a function and of its square over a piece, in whose ellipse the function has a bound.

    A piece that is a small share of the longest needs so many digits less.
    """
    samples = [function(middle + half * (2 * k - _SAMPLES) / _SAMPLES) for k in range(_SAMPLES)]
    order = max(2, math.ceil((_digits(bound, samples) + math.log(share)) / (2.0 * math.log(_SUM))) + 1)
    mean = square = arb(0)
    for node, weight in _gauss_rule(order + 1, ctx.prec):
        value = function(middle + half * node)
        weighted = weight * value
        mean, square = mean + weighted, square + weighted * value
    missed = arb(32) / 15 * arb(_SUM) ** (-2 * order) / (1 - arb(_SUM) ** -2)
    return mean / 2 + arb(0, (bound * missed).upper()), square / 2 + arb(0, (bound * bound * missed).upper())


@lru_cache
def _gauss_rule(count: int, bits: int) -> list[tuple[arb, arb]]:
    """Nodes and weights of Gauss and Legendre on -1 to 1."""
    with ctx.workprec(bits):
        return [arb.legendre_p_root(count, k, weight=True) for k in range(count)]


def _digits(bound: arb, values: list[arb]) -> float:
    """Natural logarithm of what errors of squares over the square of the bound must be below.

    Values that are smaller than the bound by more than these digits are rounding.
    """
    usual, digits = max(abs(float(value.mid())) for value in values), 0.6 * float(ctx.prec) * math.log(2.0)
    loose = math.log(float(bound)) - math.log(usual) if usual > 0.0 else 0.0
    return digits + 2.0 * min(max(loose, 0.0), digits)


# bounds at complex angles


def _bound_about(function: Function, middle: arb, half: arb) -> arb | None:
    """A bound of a function in the ellipse about a piece."""
    length, centre = float(half.upper()) * (1.0 + 1e-9), float(middle.mid())
    across = 0.5 * length * (_SUM + 1.0 / _SUM) + _ROUNDING * (1.0 + abs(centre)) + float(middle.rad())
    up, width = 0.5 * length * (_SUM - 1.0 / _SUM), across / _COLUMNS
    boxes = [(centre - across + (2 * k + 1) * width, width, 0.5 * up, 0.5 * up) for k in range(_COLUMNS)]
    return _bound_in(function, boxes, (centre, across, up))


def _bound_in(function: Function, boxes: list[Box], ellipse: tuple[float, float, float] | None = None) -> arb | None:
    """A bound of a function in boxes above the real angles, and in those below to which they are conjugate.

    Of an ellipse, given by its centre and semi-axes, only boxes that reach into it count. None if there is no bound, or
    none is found.
    """
    waiting, bound, count, least = list(boxes), 0.0, 0, _NARROWEST * boxes[0][3]
    while waiting:
        x, width, y, half = waiting.pop()
        if ellipse and _is_outside(x, width, y, half, *ellipse):
            continue
        count += 1
        across = width * (1.0 + _OVERLAP) + _ROUNDING * (1.0 + abs(x))
        value = function(acb(arb(x, across), arb(y, half * (1.0 + _OVERLAP))))
        if value.is_finite():
            bound = max(bound, float(value.abs_upper().upper()))
        elif half < least or count + len(waiting) > _MOST_BOXES:
            return None
        else:
            width, half = width / 2, half / 2
            waiting += [(x + i * width, width, y + j * half, half) for i in (-1, 1) for j in (-1, 1)]
    return arb(bound) * (1 + arb(2.0**-50)) if math.isfinite(bound) else None


def _is_outside(x: float, width: float, y: float, half: float, centre: float, across: float, up: float) -> bool:
    """Whether a box is outside of an ellipse, for certain."""
    near_x, near_y = max(abs(x - centre) - width, 0.0) / across, max(y - half, 0.0) / up
    return near_x * near_x + near_y * near_y > 1.0 + 1e-6
