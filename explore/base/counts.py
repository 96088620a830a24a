"""Whole numbers that a user gives as arguments."""

from numbers import Integral

from explore.base.errors import RequestError


def check_count(name: str, value: object, least: int, otherwise: str = "") -> None:
    """Raise `RequestError` unless an argument is a whole number that is at least so much."""
    if not isinstance(value, Integral):
        raise RequestError(f"{name} = {value!r}: must be a whole number")
    if value < least:
        raise RequestError(f"{name} = {value}: must be at least {least}{otherwise}")
