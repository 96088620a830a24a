"""The order of convergence that a method shows: the slope of log error on log step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from explore.vocabulary import FloatArray

#: Errors so many times the least one still feel what stops it from falling further.
_FLOOR = 30.0
#: Points that a slope and its standard error are worth the name with.
_LEAST_POINTS = 4


@dataclass(frozen=True)
class Order:
    """A regression line through log error on log step.

    Attributes
    ----------
    slope
        The observed order.
    standard_error
        Of the slope.
    used : (n,) array
        Which of the points, as they were given, the line goes through.
    """

    slope: float
    standard_error: float
    used: npt.NDArray[np.bool_]


def observed_order(steps: FloatArray, errors: FloatArray) -> Order:
    """Order of a method from its errors at several steps.

    Left out are points without an error (NaN, 0), those near the floor of rounding (within 30 times the least error),
    and so many of the coarsest that the standard error of the slope is least: there the error does not yet follow the
    power law.

    Parameters
    ----------
    steps : (n,) array
        Step sizes, or anything proportional to them, such as one by the number of steps.
    errors : (n,) array
        The error at each.

    Raises
    ------
    ValueError
        Fewer than four points are left, or all have the same step.
    """
    steps, errors = np.asarray(steps, dtype=float), np.asarray(errors, dtype=float)
    usable = np.isfinite(errors) & (errors > 0.0)
    usable &= errors > _FLOOR * errors[usable].min(initial=np.inf)
    candidates = np.flatnonzero(usable)
    candidates = candidates[np.argsort(-steps[candidates], kind="stable")]
    if len(candidates) < _LEAST_POINTS or np.ptp(steps[candidates[-_LEAST_POINTS:]]) == 0.0:
        raise ValueError(
            f"an order needs {_LEAST_POINTS} errors at different steps, {_FLOOR:g} times above the least error; "
            f"{len(candidates)} of {len(errors)} are"
        )
    x, y = np.log(steps[candidates]), np.log(errors[candidates])
    lines = [_line(x[k:], y[k:]) for k in range(len(x) - _LEAST_POINTS + 1)]
    best = min(range(len(lines)), key=lambda k: lines[k][1])
    used = np.zeros(len(errors), dtype=bool)
    used[candidates[best:]] = True
    return Order(*lines[best], used)


def _line(x: FloatArray, y: FloatArray) -> tuple[float, float]:
    """Slope and its standard error."""
    x, y = x - x.mean(), y - y.mean()
    slope = float(x @ y / (x @ x))
    residual = y - slope * x
    return slope, float(np.sqrt(residual @ residual / (len(x) - 2) / (x @ x)))
