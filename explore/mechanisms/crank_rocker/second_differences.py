"""The objective that a published optimisation of crank-rockers minimised, from fifty samples of the rocker's angle.

It is the variance of the magnitudes of the second differences over their mean, for crank angles that are evenly spread
from the extended to the overlapped position, both included. The paper describes it on first differences, and its values
come from the second ones; `docs/published-study.md` has both. Unlike a coefficient of variation it has the unit of an
angle, and falls with the swing.
"""

from collections.abc import Callable

import numpy as np

from explore.model.quantities import FloatArray, Formula

_N_SAMPLES = 50
#: Rounding of a side or an angle, relative.
_EPSILON = np.finfo(np.float64).eps
#: Number of standard deviations that bound the sum of roundings, which are taken as independent.
_DEVIATIONS = 3.0
#: Number of designs whose samples are held at once.
_CHUNK = 4096


def _of_swinging(function: Callable[..., FloatArray], *columns: FloatArray) -> FloatArray:
    """A function of the lengths, of the shape (n, 1), where the rocker swings; the swing is the last column."""
    found = np.full(len(columns[0]), np.nan)
    rows = np.flatnonzero(np.isfinite(columns[-1]))
    for first in range(0, len(rows), _CHUNK):
        chunk = rows[first : first + _CHUNK]
        found[chunk] = function(*(length[chunk, None] for length in columns[:-1]))
    return found


def _dispersion(*columns: FloatArray) -> FloatArray:
    return _of_swinging(_value_of, *columns)


def _rounding(*columns: FloatArray) -> FloatArray:
    """Bound of the absolute error: sizes are differences of larger angles, which are sensitive where links fold."""
    return _of_swinging(_rounding_of, *columns)


def _value_of(*lengths: FloatArray) -> FloatArray:
    extended, overlapped, _, _ = _ends(lengths)
    return _ratio(_sizes(lengths, extended, overlapped))


def _rounding_of(*lengths: FloatArray) -> FloatArray:
    crank, coupler, rocker, ground = lengths
    extended, overlapped, of_extended, of_overlapped = _ends(lengths)
    sizes = _sizes(lengths, extended, overlapped)
    value, mean = _ratio(sizes), sizes.mean(axis=1)
    angles = extended + (overlapped - extended) * np.linspace(0.0, 1.0, _N_SAMPLES)
    diagonal = np.hypot(crank * np.sin(angles), ground - crank * np.cos(angles))
    own = _EPSILON + _rounding_between(diagonal, rocker, coupler)
    slopes = np.abs(2.0 * (sizes - mean[:, None]) / (_N_SAMPLES - 3) - value[:, None] / (_N_SAMPLES - 2))
    differences = own[:, :-2] ** 2 + 4.0 * own[:, 1:-1] ** 2 + own[:, 2:] ** 2  # of roundings that are independent
    total = _DEVIATIONS * np.sqrt((slopes**2 * differences).sum(axis=1)) / mean
    for moved in ((extended + of_extended, overlapped), (extended, overlapped + of_overlapped)):
        total += np.abs(_ratio(_sizes(lengths, *moved)) - value)
    return np.asarray(total)


def _ends(lengths: tuple[FloatArray, ...]) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """The crank angles of the extended and the overlapped position, and bounds of their roundings."""
    crank, coupler, rocker, ground = lengths
    extended = _angle_between(coupler + crank, ground, rocker)
    overlapped = _angle_between(coupler - crank, ground, rocker) + np.pi
    return (
        extended, overlapped, _rounding_between(coupler + crank, ground, rocker),
        _EPSILON + _rounding_between(coupler - crank, ground, rocker),
    )  # fmt: skip


def _sizes(lengths: tuple[FloatArray, ...], extended: FloatArray, overlapped: FloatArray) -> FloatArray:
    """Magnitudes of the second differences, shape (n, samples less two)."""
    crank, coupler, rocker, ground = lengths
    angles = extended + (overlapped - extended) * np.linspace(0.0, 1.0, _N_SAMPLES)
    across, along = crank * np.sin(angles), ground - crank * np.cos(angles)
    rocker_angle = _angle_between(np.hypot(across, along), rocker, coupler) + np.arctan2(across, along)
    return np.asarray(np.abs(np.diff(rocker_angle, 2, axis=1)))


def _ratio(sizes: FloatArray) -> FloatArray:
    return np.asarray(sizes.var(axis=1, ddof=1) / sizes.mean(axis=1))


def _angle_between(first: FloatArray, second: FloatArray, opposite: FloatArray) -> FloatArray:
    """The angle of a triangle between two sides, rad; half of it keeps its digits at both ends."""
    difference = first - second
    near = np.maximum((opposite - difference) * (opposite + difference), 0.0)
    far = np.maximum((first + second - opposite) * (first + second + opposite), 0.0)
    return np.asarray(2.0 * np.arctan2(np.sqrt(near), np.sqrt(far)))


def _rounding_between(first: FloatArray, second: FloatArray, opposite: FloatArray) -> FloatArray:
    """Bound of the rounding of such an angle: its factors are differences of sides, of which the first is rounded."""
    angle, difference, total = _angle_between(first, second, opposite), first - second, first + second
    shares = sum(total / np.abs(factor) for factor in (
        opposite - difference, opposite + difference, total - opposite, total + opposite
    ))  # fmt: skip
    return np.asarray(_EPSILON * (angle + 0.5 * np.sin(angle) * shares))


SECOND_DIFFERENCES = Formula(
    "second_difference_dispersion",
    "rad",
    "variance over mean of the second differences of 50 rocker angles, extended to overlapped: a published objective",
    "min",
    ("crank", "coupler", "rocker", "ground", "swing_angle"),
    _dispersion,
    rounding=_rounding,
)
