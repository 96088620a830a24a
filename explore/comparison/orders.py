"""The observed order of convergence: the slope of log error on log step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from explore.model.quantities import FloatArray

#: Factor on the smallest error within which errors are rounding.
_ROUNDING_FACTOR = 30.0
#: Least number of points for a slope and its standard error.
_MIN_POINTS = 4


@dataclass(frozen=True)
class ObservedOrder:
    """A regression line through log error on log step: its slope and standard error, and the points included."""

    slope: float
    standard_error: float
    included: npt.NDArray[np.bool_]


def fit_order(steps: FloatArray, errors: FloatArray) -> ObservedOrder:
    """Fit the order of a method to its errors at several step sizes.

    The fit excludes errors that are NaN or 0, errors within 30 times the smallest, which rounding dominates, and the
    coarsest steps, where the error does not yet follow the power law: as many of them as minimise the standard error
    of the slope.

    Parameters
    ----------
    steps : (n,) array
        Step sizes, or anything proportional to them, such as the reciprocal of the number of steps.
    errors : (n,) array
        Error at each step size.

    Raises
    ------
    ValueError
        If fewer than four points remain, or the last four have the same step size.
    """
    steps, errors = np.asarray(steps, dtype=float), np.asarray(errors, dtype=float)
    is_usable = np.isfinite(errors) & (errors > 0.0)
    is_usable &= errors > _ROUNDING_FACTOR * errors[is_usable].min(initial=np.inf)
    candidates = np.flatnonzero(is_usable)
    candidates = candidates[np.argsort(-steps[candidates], kind="stable")]
    if len(candidates) < _MIN_POINTS or np.ptp(steps[candidates[-_MIN_POINTS:]]) == 0.0:
        raise ValueError(
            f"an order needs {_MIN_POINTS} errors at different steps, above {_ROUNDING_FACTOR:g} times the smallest; "
            f"{len(candidates)} of {len(errors)} qualify"
        )
    x, y = np.log(steps[candidates]), np.log(errors[candidates])
    lines = [_fit_line(x[k:], y[k:]) for k in range(len(x) - _MIN_POINTS + 1)]
    best = min(range(len(lines)), key=lambda k: lines[k][1])
    included = np.zeros(len(errors), dtype=bool)
    included[candidates[best:]] = True
    return ObservedOrder(*lines[best], included)


def _fit_line(x: FloatArray, y: FloatArray) -> tuple[float, float]:
    """Slope of the least-squares line, and its standard error."""
    # scipy.stats.linregress takes the standard error from 1 - r^2, which cancels: 0 for a scatter of 1e-9.
    x, y = x - x.mean(), y - y.mean()
    slope = float(x @ y / (x @ x))
    residual = y - slope * x
    return slope, float(np.sqrt(residual @ residual / (len(x) - 2) / (x @ x)))
