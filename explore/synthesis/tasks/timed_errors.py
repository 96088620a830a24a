"""How far points with crank angles are from where a four-bar is at these angles."""

from __future__ import annotations

import numpy as np

from explore.model.quantities import FloatArray
from explore.synthesis.linkages import ComplexArray, FourBar

#: Number of directions of the angle 0 that are tried where it is free, before the best is improved.
_N_SHIFTS = 720


def find_timed_errors(
    linkage: FourBar, points: ComplexArray, angles: FloatArray, weights: FloatArray, *, is_shift_free: bool
) -> tuple[float, float]:
    """The weighted rms and the largest distance, NaN where the linkage cannot be assembled at an angle.

    Parameters
    ----------
    linkage
        The four-bar.
    points, angles, weights
        Shape (n,); the angles are of the crank, rad.
    is_shift_free
        Whether the angles count from any direction, the best one; else from the line of the pivots.
    """
    from scipy.optimize import minimize_scalar

    def distances(shift: float) -> FloatArray:
        return np.asarray(np.abs(linkage.points(angles + shift) - points))

    def square(shift: float) -> float:
        total = float(np.average(distances(shift) ** 2, weights=weights))
        return total if np.isfinite(total) else np.inf

    shift = float(np.angle(linkage.rocker_pivot - linkage.crank_pivot))
    if is_shift_free:
        step = 2.0 * np.pi / _N_SHIFTS
        tried = np.arange(_N_SHIFTS) * step
        squares = [square(each) for each in tried]
        shift = float(tried[int(np.argmin(squares))])
        if np.isfinite(min(squares)):
            shift = float(minimize_scalar(square, bounds=(shift - step, shift + step), options={"xatol": 1e-12}).x)
    if not np.isfinite(square(shift)):
        return np.nan, np.nan
    return float(np.sqrt(square(shift))), float(distances(shift).max())
