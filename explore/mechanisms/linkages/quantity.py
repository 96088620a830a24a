"""A signal with the number of the graph that it is."""

from dataclasses import dataclass

from explore.mechanisms.linkages.graph import Number, Series
from explore.model.quantities import Signal


@dataclass(frozen=True)
class Quantity:
    """A signal, whose rows are not placed yet.

    Attributes
    ----------
    signal
        The declaration.
    number
        Its number of the graph, in rad and per radian.
    links
        Links whose angles it follows from.
    squares
        Squares of distances that it divides by, and that positions do not.
    lag_rate
        Rate, per radian, at which the torque of a motor follows it; None for none.
    """

    signal: Signal
    number: Number
    links: tuple[str, ...] = ()
    squares: tuple[Series, ...] = ()
    lag_rate: Number | None = None
