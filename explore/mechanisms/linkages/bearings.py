"""Pins with friction: the links that turn on them, and rigid parts, in which none does."""

from collections.abc import Iterable
from dataclasses import dataclass

from explore.mechanisms.linkages.graph import Number
from explore.mechanisms.linkages.steps import Circle, JoinPoint, Step
from explore.mechanisms.linkages.table import FRAME, LinkageTable


@dataclass(frozen=True)
class Bearing:
    """A pin with friction in a link that turns on it.

    Attributes
    ----------
    pin, link, holder
        The pin, the link, and the body that the pin is fast in.
    body
        The link, or where it has a slot for the pin the holder: the body whose force from the pin is known.
    arm
        Coefficient of friction times radius, mm.
    rate
        Rate of the link's angle against the holder's.
    sense
        Its sense.
    """

    pin: str
    link: str
    holder: str
    body: str
    arm: Number
    rate: Number
    sense: Number

    @property
    def turning(self) -> str:
        """The signal of the rate."""
        return f"{self.link}_velocity" if self.holder == FRAME else f"{self.pin}_turning_of_{self.link}"


def rigid_parts(table: LinkageTable, steps: Iterable[Step]) -> dict[str, str]:
    """For each body the name of its rigid part: two links that hold a third one in a triangle are of its part."""
    parts, driven = {body.name: body.name for body in table.bodies}, table.driven_slot
    for step in steps:
        match step:
            case JoinPoint(point, Circle() as first, Circle() as second) if not driven or point != driven.pin:
                at_first, at_second = (
                    {parts[body.name] for body in table.bodies_at(circle.centre)} for circle in (first, second)
                )
                for shared in at_first & at_second:
                    joined = parts[first.link], parts[second.link]
                    parts = {body: shared if part in joined else part for body, part in parts.items()}
    return parts
