"""An ordinary crank in place of the variable one: its share of the turn near the wanted speed, as derived metrics.

The fixed crank of length r turns as fast and has the same rod l. With q = r/l its slider's speed over r times that of
the crank is

    f = sin(theta) (1 + q cos(theta)/sqrt(1 - q^2 sin(theta)^2)),

which rises from 0 at the outer dead centre to one largest value and falls to 0 at the inner one; the way back is the
mirror image. So the share of the turn above a level is the distance of two roots, found by bisection.

There are two such cranks: of equal stroke, r half the stroke, and of equal length, r the longest length of the variable
crank, which is that at the inner dead centre.
"""

import math
from collections.abc import Callable
from functools import partial

import numpy as np
import numpy.typing as npt

from explore.model.quantities import FloatArray, Formula

#: Number of halvings of an interval shorter than pi until its length is a rounding of it.
_HALVINGS = 54
#: Rounding of levels and speeds, relative.
_MARGIN = 16 * np.finfo(np.float64).eps


def _speed(theta: FloatArray, ratio: FloatArray) -> FloatArray:
    """Speed f at a ratio of crank to rod."""
    sine = ratio * np.sin(theta)
    return np.asarray(np.sin(theta) * (1.0 + ratio * np.cos(theta) / np.sqrt((1.0 - sine) * (1.0 + sine))))


def _slope(theta: FloatArray, ratio: FloatArray) -> FloatArray:
    """The derivative of f."""
    sine, cosine = np.sin(theta), np.cos(theta)
    root = np.sqrt((1.0 - ratio * sine) * (1.0 + ratio * sine))
    return np.asarray(cosine + ratio * ((cosine - sine) * (cosine + sine) + (ratio * sine * cosine / root) ** 2) / root)


def _last_true(holds: Callable[[FloatArray], npt.NDArray[np.bool_]], start: FloatArray, stop: FloatArray) -> FloatArray:
    """Where a condition that holds at the start ends to hold, by bisection; the stop where it holds throughout."""
    for _ in range(_HALVINGS):
        middle = 0.5 * (start + stop)
        is_true = holds(middle)
        start, stop = np.where(is_true, middle, start), np.where(is_true, stop, middle)
    return start


def fixed_crank_share(
    crank: FloatArray, rod: FloatArray, wanted: FloatArray, speed: FloatArray, deviation: float
) -> FloatArray:
    """Share of the turn in which a fixed crank's slider is within a relative deviation of the wanted speed, (n,)."""
    ratio = crank / rod
    fastest = _last_true(lambda theta: _slope(theta, ratio) > 0.0, np.zeros_like(ratio), np.full_like(ratio, math.pi))
    peak = _speed(fastest, ratio)

    def share_above(level: FloatArray) -> FloatArray:
        first = _last_true(lambda theta: _speed(theta, ratio) < level, np.zeros_like(ratio), fastest)
        last = _last_true(lambda theta: _speed(theta, ratio) >= level, fastest, np.full_like(ratio, math.pi))
        return np.where(level < peak, (last - first) / math.pi, 0.0)

    level = wanted / (crank * speed)
    share = share_above((1.0 - deviation) * level) - share_above((1.0 + deviation) * level)
    return np.where(np.isfinite(ratio), share, np.nan)


def _share(
    deviation: float,
    crank_per_length: float,
    length: FloatArray,
    rod: FloatArray,
    wanted: FloatArray,
    speed: FloatArray,
) -> FloatArray:
    return fixed_crank_share(crank_per_length * length, rod, wanted, speed, deviation)


def _rounding(
    share: Callable[..., FloatArray], length: FloatArray, rod: FloatArray, wanted: FloatArray, speed: FloatArray
) -> FloatArray:
    """Bound of the absolute error: where a level is the largest speed, the share is as the root of what it is above."""
    value = share(length, rod, wanted, speed)
    moved = [share(length, rod, (1.0 + change) * wanted, speed) for change in (-_MARGIN, _MARGIN)]
    return np.asarray(np.abs(np.array(moved) - value).max(axis=0) + _MARGIN * (value > 0.0))


def _declare(percent: int, kind: str, length: str, crank_per_length: float) -> tuple[Formula, Formula]:
    """The share of a fixed crank, and how many times as large that of the variable crank is."""
    name = f"fixed_crank_speed_share_{percent}_equal_{kind}"
    text = f"share of the turn within {percent} % of the wanted speed"
    share = partial(_share, 0.01 * percent, crank_per_length)
    return (
        Formula(name, "1", f"{text}, of a fixed crank of equal {kind}", "max",
                (length, "rod", "slider_speed", "speed"), share, rounding=partial(_rounding, share)),
        Formula(f"speed_share_{percent}_gain_equal_{kind}", "1", f"{text}, over that of a fixed crank of equal {kind}",
                "max", (f"speed_share_{percent}", name), np.divide),
    )  # fmt: skip


FORMULAS = tuple(
    formula
    for kind, length, crank_per_length in (("stroke", "stroke", 0.5), ("length", "crank_inner", 1.0))
    for percent in (1, 2, 5)
    for formula in _declare(percent, kind, length, crank_per_length)
)
