"""Coordinates of tables as data: expressions of parameters."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass


@dataclass(frozen=True)
class Coordinate:
    """A coordinate, mm: an expression of parameters, in which numbers and angles are in degrees.

    Attributes
    ----------
    names
        The parameters it uses.
    steps
        Operations in postfix order, as in `explore.model.expressions.Expression`: ("input", k) is the parameter
        ``names[k]``.
    """

    names: tuple[str, ...]
    steps: tuple[tuple[str, float], ...]

    def __add__(self, other: Coordinate) -> Coordinate:
        return joined("+", self, other)

    def __sub__(self, other: Coordinate) -> Coordinate:
        return joined("-", self, other)

    def __mul__(self, other: Coordinate) -> Coordinate:
        return joined("*", self, other)


#: Two coordinates of a point in the frame of its body.
Place = tuple[Coordinate, Coordinate]


def constant(value: float) -> Coordinate:
    """The coordinate that is a number."""
    return Coordinate((), (("number", float(value) + 0.0),))


def length(name: str) -> Coordinate:
    """The coordinate that is a parameter."""
    return Coordinate((name,), (("input", 0.0),))


def joined(operation: str, *operands: Coordinate) -> Coordinate:
    """An operation of one or two coordinates, without negative numbers, which no formula has."""
    names = tuple(dict.fromkeys(name for each in operands for name in each.names))
    return Coordinate(names, (*(step for each in operands for step in _renamed(each, names)), (operation, 0.0)))


def _renamed(coordinate: Coordinate, names: tuple[str, ...]) -> Iterator[tuple[str, float]]:
    """Its steps with positions among other names."""
    for operation, operand in coordinate.steps:
        if operation == "input":
            yield operation, float(names.index(coordinate.names[int(operand)]))
        elif operation == "number" and operand < 0.0:
            yield from ((operation, -operand), ("negate", 0.0))
        else:
            yield operation, operand


#: The coordinate 0.
ZERO = constant(0.0)
