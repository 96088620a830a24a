"""Coordinates of tables as data: expressions of parameters."""

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


#: Two coordinates of a point in the frame of its body.
Place = tuple[Coordinate, Coordinate]


def constant(value: float) -> Coordinate:
    """The coordinate that is a number."""
    return Coordinate((), (("number", float(value) + 0.0),))


def length(name: str) -> Coordinate:
    """The coordinate that is a parameter."""
    return Coordinate((name,), (("input", 0.0),))


#: The coordinate 0.
ZERO = constant(0.0)
