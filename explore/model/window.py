"""Windows: parts of the turn that statistics are taken over."""

from dataclasses import dataclass, field
from fractions import Fraction
from typing import Literal

#: Full turn, deg.
_TURN = 360


@dataclass(frozen=True)
class Window:
    """A part of the turn that statistics are taken over.

    Attributes
    ----------
    name, long_name
        Name in study files and at the end of names of metrics, and description.
    kind
        The full turn; the arc from one mark to another; the stroke that the drive names, or the other one; the part of
        the drive stroke that drives the output through one-way clutches; an interval, explicit or, with a name of its
        own, the range of input angles to which a mechanism is limited.
    ends
        Marks between which an arc lies.
    needs_stroke
        Whether the window exists only where the output rocks.
    start, stop
        First and last input angle of an interval, deg, exact; the first is less than a turn from 0.
    """

    name: str
    long_name: str
    kind: Literal["turn", "arc", "drive", "return", "clutch", "interval"]
    ends: tuple[str, ...] = ()
    needs_stroke: bool = True
    # without hashes: that of a fraction takes longer than all the rest
    start: Fraction = field(default=Fraction(0), hash=False)
    stop: Fraction = field(default=Fraction(0), hash=False)

    @property
    def is_whole(self) -> bool:
        """Whether it is all of the motion: the full turn, or the range of a limited mechanism."""
        return self.kind == "turn" or (self.kind == "interval" and self.name != "interval")

    @property
    def length(self) -> Fraction:
        """Length of an interval, deg, exact."""
        return self.stop - self.start

    @property
    def is_across_turns(self) -> bool:
        """Whether a whole turn from input angle 0 lies within an interval, not at its ends."""
        return any(self.start < turn < self.stop for turn in (0, _TURN))

    def turns_into(self, first: Fraction | float, last: Fraction | float) -> int | None:
        """Whole turns, deg, that bring input angles into this interval, but for their rounding; None if none do."""
        for turn in (0, -_TURN, _TURN):
            if float(self.start) <= float(first + turn) and float(last + turn) <= float(self.stop):
                return turn
        return None


#: An explicit interval of a mechanism whose output need not rock.
INTERVAL = Window(
    "interval", "an explicit interval of crank angles, { from = 0, to = 90 }", "interval", needs_stroke=False
)
