"""What the sizing rules accept: one behaviour for all of them."""

from __future__ import annotations

import numpy as np

from explore.errors import RequestError
from explore.vocabulary import FloatArray

#: A number or an array of any shape; the arguments of a rule broadcast against each other.
Number = float | FloatArray


def positive(name: str, value: Number) -> FloatArray:
    """The value as an array, NaN where it is unknown.

    Raises
    ------
    RequestError
        If any of it is 0 or less.
    """
    return _checked(name, value, bad=np.less_equal, words="greater than 0")


def magnitude(name: str, value: Number) -> FloatArray:
    """The value as an array, 0 allowed, NaN where it is unknown.

    Raises
    ------
    RequestError
        If any of it is negative.
    """
    return _checked(name, value, bad=np.less, words="0 or more; give the magnitude")


def ratio(name: str, value: Number) -> FloatArray:
    """A ratio from 0 up to but without 1 as an array.

    Raises
    ------
    RequestError
        If any of it is outside.
    """
    values = magnitude(name, value)
    if np.any(values >= 1.0):
        raise RequestError(f"{name}: must be below 1, got {np.max(values[values >= 1.0]):g}")
    return values


def _checked(name: str, value: Number, *, bad: np.ufunc, words: str) -> FloatArray:
    values = np.asarray(value, dtype=np.float64)
    wrong = bad(values, 0.0)  # false for NaN, which stays what it is
    if np.any(wrong):
        raise RequestError(f"{name}: must be {words}, got {np.min(values[wrong]):g}")
    return values
