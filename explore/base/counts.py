"""Whole numbers that a user gives as arguments."""

from numbers import Integral

import numpy as np
import numpy.typing as npt

from explore.base.errors import RequestError
from explore.base.suggest import format_value


def check_count(name: str, value: object, least: int, otherwise: str = "") -> None:
    """Raise `RequestError` unless an argument is a whole number that is at least so much."""
    if not isinstance(value, Integral):
        raise RequestError(f"{name} = {value!r}: must be a whole number")
    if value < least:
        raise RequestError(f"{name} = {value}: must be at least {least}{otherwise}")


def design_numbers(numbers: npt.ArrayLike) -> npt.NDArray[np.int64]:
    """Numbers of designs, shape (n,) or (); `RequestError` unless they are whole.

    Those beyond 64 bits keep their values, so that what looks for them can say which it lacks.
    """
    given = np.asarray(numbers)
    if given.dtype.kind == "f":  # NumPy makes floats of 1 and 2**63 together
        given = np.asarray(numbers, dtype=object)
    is_whole = given.dtype.kind in "iu" or all(type(number) is int for number in given.ravel().tolist())
    if given.ndim > 1 or not is_whole:
        raise RequestError(f"designs: must be whole numbers, got {format_value(numbers)}")
    limits = np.iinfo(np.int64)
    fits = not given.size or (given.min() >= limits.min and given.max() <= limits.max)
    return given.astype(np.int64) if fits else given
