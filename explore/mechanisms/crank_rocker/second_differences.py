"""The objective that a published optimisation of crank-rockers minimised, from fifty samples of the rocker's angle.

It is the variance of the magnitudes of the second differences over their mean, for crank angles that are evenly spread
from the extended to the overlapped position, both included. The paper describes it on first differences, and its values
come from the second ones; `docs/published-study.md` has both. Unlike a coefficient of variation it has the unit of an
angle, and falls with the swing.
"""

import numpy as np

from explore.model.quantities import FloatArray, Formula

_N_SAMPLES = 50
#: Number of designs whose samples are held at once.
_CHUNK = 4096


def _dispersion(
    crank: FloatArray, coupler: FloatArray, rocker: FloatArray, ground: FloatArray, swing: FloatArray
) -> FloatArray:
    found = np.full(len(crank), np.nan)
    rows = np.flatnonzero(np.isfinite(swing))  # a rocker that swings
    for first in range(0, len(rows), _CHUNK):
        chunk = rows[first : first + _CHUNK]
        found[chunk] = _dispersion_of(*(length[chunk, None] for length in (crank, coupler, rocker, ground)))
    return found


def _dispersion_of(crank: FloatArray, coupler: FloatArray, rocker: FloatArray, ground: FloatArray) -> FloatArray:
    """Of linkages of which each length has the shape (n, 1)."""
    extended = _angle_between(coupler + crank, ground, rocker)
    overlapped = _angle_between(coupler - crank, ground, rocker) + np.pi
    angles = extended + (overlapped - extended) * np.linspace(0.0, 1.0, _N_SAMPLES)
    across, along = crank * np.sin(angles), ground - crank * np.cos(angles)
    rocker_angle = _angle_between(np.hypot(across, along), rocker, coupler) + np.arctan2(across, along)
    sizes = np.abs(np.diff(rocker_angle, 2, axis=1))
    return np.asarray(sizes.var(axis=1, ddof=1) / sizes.mean(axis=1))


def _angle_between(first: FloatArray, second: FloatArray, opposite: FloatArray) -> FloatArray:
    """The angle of a triangle between two sides, rad; half of it keeps its digits at both ends."""
    difference = first - second
    near = np.maximum((opposite - difference) * (opposite + difference), 0.0)
    far = np.maximum((first + second - opposite) * (first + second + opposite), 0.0)
    return np.asarray(2.0 * np.arctan2(np.sqrt(near), np.sqrt(far)))


SECOND_DIFFERENCES = Formula(
    "second_difference_dispersion",
    "rad",
    "variance over mean of the second differences of 50 rocker angles, extended to overlapped: a published objective",
    "min",
    ("crank", "coupler", "rocker", "ground", "swing_angle"),
    _dispersion,
)
