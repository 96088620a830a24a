"""Vectors of the plane as pairs of numbers of a graph."""

from typing import TypeVar

from explore.mechanisms.linkages.graph import Number, Series

#: Two coordinates of the design, mm.
Local = tuple[Number, Number]
#: Two coordinates in the plane, or in a body, mm, with their derivatives.
Vector = tuple[Series, Series]

_Scalar = TypeVar("_Scalar", Number, Series)


def length(vector: Vector) -> Series:
    """The length of a vector; exact along an axis."""
    for along, across in (vector, vector[::-1]):
        if across.is_zero:
            return abs(along)
    return dot(vector, vector).sqrt()


def unit(vector: Vector) -> Vector:
    """The vector of length 1 along another one."""
    inverse = length(vector).inverse()
    return vector[0] * inverse, vector[1] * inverse


def larger(a: Number, b: Number) -> Number:
    """The larger of two conditions, which are at least 1."""
    if a.value is not None and b.value is not None:
        return a if a.value >= b.value else b
    if a.index == b.index or b.value == 1.0:
        return a
    return b if a.value == 1.0 else a.graph.put("max", a.index, b.index)


def minus(a: tuple[_Scalar, _Scalar], b: tuple[_Scalar, _Scalar]) -> tuple[_Scalar, _Scalar]:
    """From b to a."""
    return a[0] - b[0], a[1] - b[1]


def plus(a: tuple[_Scalar, _Scalar], b: tuple[_Scalar, _Scalar]) -> tuple[_Scalar, _Scalar]:
    """The sum."""
    return a[0] + b[0], a[1] + b[1]


def times(a: Local, factor: Number | float) -> Local:
    """A multiple."""
    return a[0] * factor, a[1] * factor


def left(a: Local) -> Local:
    """A vector turned by a quarter to the left."""
    return -a[1], a[0]


def dot(a: tuple[_Scalar, _Scalar], b: tuple[_Scalar, _Scalar]) -> _Scalar:
    """The scalar product."""
    return a[0] * b[0] + a[1] * b[1]


def cross(a: tuple[_Scalar, _Scalar], b: tuple[_Scalar, _Scalar]) -> _Scalar:
    """The product of the lengths and the sine of the angle from a to b."""
    return a[0] * b[1] - a[1] * b[0]
