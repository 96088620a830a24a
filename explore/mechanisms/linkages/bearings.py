"""Pins with friction: the links that turn on them, and rigid parts, in which none does."""

from collections.abc import Iterable
from dataclasses import dataclass, field

from explore.mechanisms.linkages.graph import Number
from explore.mechanisms.linkages.steps import Circle, JoinPoint, Locus, PoseBySlot, SlideInSlot, SlideLine, Step
from explore.mechanisms.linkages.table import FRAME, LinkageTable, Slot


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


@dataclass
class RigidParts:
    """What does not move against each other in any design.

    Attributes
    ----------
    parts
        For each body the name of its rigid part.
    points
        Points that rest in a rigid part of which no link has them, with the part.
    """

    table: LinkageTable
    parts: dict[str, str]
    points: dict[str, list[str]] = field(default_factory=dict)

    def around(self, point: str) -> set[str]:
        """The rigid parts in which a point rests."""
        bodies = [body.name for body in self.table.bodies_at(point)]
        return {self.parts[body] for body in [*bodies, *self.points.get(point, ())]}

    def rests_in(self, slot: Slot) -> bool:
        """Whether the pin of a slot does not move along it."""
        return self.parts[slot.body] in self.around(slot.pin)

    def where(self, locus: Locus) -> set[str]:
        """The rigid parts in which a circle or a line rests."""
        return self.around(locus.centre) if isinstance(locus, Circle) else {self.parts[locus.body]}

    def join(self, links: Iterable[str], part: str) -> None:
        """Take links, and all that is of their parts, into a part."""
        joined = {self.parts[link] for link in links}
        self.parts = {body: part if own in joined else own for body, own in self.parts.items()}


def rigid_parts(table: LinkageTable, steps: Iterable[Step]) -> RigidParts:
    """The rigid parts: what two circles or lines of one part hold, or a slot between points of one, is of that part."""
    found, driven = RigidParts(table, {body.name: body.name for body in table.bodies}), table.driven_slot
    for step in steps:
        match step:
            case JoinPoint(point, first, second) if not driven or point != driven.pin:
                for shared in found.where(first) & found.where(second):
                    found.points[point] = [shared]
                    found.join([_moving(each) for each in (first, second) if not isinstance(each, Slot)], shared)
            case PoseBySlot(link, point, slot):
                for shared in found.around(point) & found.around(slot.pin):
                    found.join([link], shared)
            case SlideInSlot(link, slide, slot):
                for shared in {found.parts[slide.body]} & found.around(slot.pin):
                    found.join([link], shared)
    return found


def _moving(locus: Circle | SlideLine) -> str:
    """The link that a circle or a line of a link holds."""
    return locus.link if isinstance(locus, Circle) else locus.moving
