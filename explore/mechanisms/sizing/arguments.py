"""Checks of the arguments of the sizing rules."""

import numpy as np

from explore.base.errors import RequestError
from explore.model.quantities import FloatArray

#: A number or an array of any shape; the arguments of a rule broadcast against each other.
Number = float | FloatArray


def as_positive(name: str, value: Number) -> FloatArray:
    """The value as an array, NaN where it is unknown.

    Raises
    ------
    RequestError
        If any of it is 0 or less.
    """
    return _as_checked(name, value, is_refused=np.less_equal, rule="greater than 0")


def as_magnitude(name: str, value: Number) -> FloatArray:
    """The value as an array, 0 allowed, NaN where it is unknown.

    Raises
    ------
    RequestError
        If any of it is negative.
    """
    return _as_checked(name, value, is_refused=np.less, rule="0 or more; give the magnitude")


def as_hollow_ratio(value: Number) -> FloatArray:
    """Inner over outer diameter, at least 0 and below 1, as an array.

    Raises
    ------
    RequestError
        If any of it is outside this range.
    """
    values = as_magnitude("hollow_ratio", value)
    if np.any(values >= 1.0):
        raise RequestError(f"hollow_ratio: must be below 1, got {np.max(values[values >= 1.0]):g}")
    return values


def _as_checked(name: str, value: Number, *, is_refused: np.ufunc, rule: str) -> FloatArray:
    values = np.asarray(value, dtype=np.float64)
    refused = is_refused(values, 0.0)  # false for NaN
    if np.any(refused):
        raise RequestError(f"{name}: must be {rule}, got {np.min(values[refused]):g}")
    return values
