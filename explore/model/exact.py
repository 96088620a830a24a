"""What a mechanism knows of a design without rounding."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class ExactDesign:
    """What follows from parameters that are fractions by signs of sums.

    Attributes
    ----------
    status
        Code of the status.
    metrics
        Closed-form metrics that are fractions, by their names.
    marks
        Input angles of the marks, by their names: squares of cosine and sine, each with the sign of what it is the
        square of.
    squares
        Antiderivatives of the squares of signals for unit speed, by their names in the table, as functions of balls:
        the input angle, rad, its cosine and its sine. The signals are derivatives of others.
    """

    status: int
    metrics: Mapping[str, Any] = field(default_factory=dict)
    marks: Mapping[str, tuple[Any, Any]] = field(default_factory=dict)
    squares: Mapping[str, Callable[[Any, Any, Any], Any]] = field(default_factory=dict)
