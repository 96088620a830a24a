"""Lengths at which a rocker's swing or a slider's stroke has a prescribed value: roots of quadratic equations.

Both equations are squares of the cosine rule, so their roots include lengths of linkages whose limit positions are that
far apart on two branches. Arrays are of shape (n,), lengths of shape (k, n): inf where an equation has no real root,
NaN where a length is one.
"""

from collections.abc import Mapping

import numpy as np

from explore.model.quantities import FloatArray

#: Relative size below which a difference counts as 0, so that no double root is lost to its rounding.
_ROUNDING = 1e-12


def lengths_of_swing(name: str, lengths: Mapping[str, FloatArray], swing: float) -> FloatArray:
    """Lengths of the named link of a four-bar at which the rocker may swing by an angle, deg, shape (2, n).

    (rocker² + ground² - crank² - coupler²)² + 4 crank² coupler² cot²(swing/2) = 4 rocker² ground² cos²(swing/2)
    is quadratic in each square, with a discriminant of two factors.
    """
    half = np.deg2rad(0.5 * swing)
    sine, cosine = np.sin(half), np.cos(half)
    partner = {"crank": "coupler", "coupler": "crank", "rocker": "ground", "ground": "rocker"}[name]
    other = lengths[partner]
    one, two = (length for each, length in lengths.items() if each != partner)
    with np.errstate(all="ignore"):
        if name in ("crank", "coupler"):
            rest = one**2 + two**2 - other**2
            product = (rest - 2.0 * one * two * cosine) * (rest + 2.0 * one * two * cosine)
            middle = rest - 2.0 * (other * cosine / sine) ** 2
            factors = _difference_of_squares(one * sine, other) * _difference_of_squares(two * sine, other) / sine**2
        else:
            rest = other**2 - one**2 - two**2
            product = rest**2 + (2.0 * one * two * cosine / sine) ** 2
            middle = 2.0 * (other * cosine) ** 2 - rest
            factors = _difference_of_squares(other * sine, one) * _difference_of_squares(two, other * sine)
        larger = middle + np.copysign(2.0 * cosine / sine * np.sqrt(factors), middle)
        squares = np.where(factors < 0.0, -1.0, [larger, product / larger])
    return _roots(squares)


def lengths_of_stroke(name: str, lengths: Mapping[str, FloatArray], stroke: float) -> FloatArray:
    """Cranks or rods, shape (1, n), or offsets, shape (2, n), of a slider-crank at which the stroke may be the given.

    offset² = (rod² - stroke²/4) (stroke²/4 - crank²) / (stroke²/4).
    """
    half = 0.5 * stroke
    with np.errstate(all="ignore"):
        if name == "offset":
            crank, rod = lengths["crank"], lengths["rod"]
            offset = _roots(_difference_of_squares(rod, half) * _difference_of_squares(half, crank) / half**2)
            return np.array([-offset, offset])
        other = lengths["rod" if name == "crank" else "crank"]
        rest = _difference_of_squares(other, np.hypot(half, lengths["offset"]))
        return _roots(half**2 * rest / _difference_of_squares(other, half))[None]


def _difference_of_squares(one: FloatArray | float, other: FloatArray | float) -> FloatArray:
    """one² - other²; 0 where rounding may have given it its sign."""
    difference, total = one - other, np.abs(one) + np.abs(other)
    return np.asarray(np.where(np.abs(difference) <= _ROUNDING * total, 0.0, difference * total))


def _roots(squares: FloatArray) -> FloatArray:
    """Square roots, inf for those of negative numbers."""
    with np.errstate(invalid="ignore"):
        return np.where(squares < 0.0, np.inf, np.sqrt(squares))
