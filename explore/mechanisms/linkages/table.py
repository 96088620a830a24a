"""The table of a planar linkage, as data: bodies with their points, slots, slides, and how each joint assembles.

`explore.studies.linkages` reads it from the sections of a file and checks it; nothing here knows of files.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import cached_property

from explore.mechanisms.linkages.coordinate import Coordinate, Place, constant
from explore.mechanisms.linkages.load_table import Loads
from explore.model.quantities import Parameter

#: The body that does not move.
FRAME = "frame"
#: Beginning of the names of mechanisms of tables.
PREFIX = "linkage-"
#: Stands for the place of a driven pin, which depends on the input angle.
_DRIVEN: Place = (constant(math.nan),) * 2


@dataclass(frozen=True)
class Body:
    """A link, or the frame: its points by name, in coordinates of the body."""

    name: str
    points: tuple[tuple[str, Place], ...]

    @cached_property
    def place_of(self) -> dict[str, Place]:
        """The place of each point."""
        return dict(self.points)


@dataclass(frozen=True)
class Slot:
    """A pin on a line of another body.

    Attributes
    ----------
    name
        Name of the slot, of its signals and of its branch.
    pin
        The point that stays on the line.
    body
        The body that carries the line.
    along
        Two ends that give the line and its direction: points of `body` by name, or places in its coordinates.
    """

    name: str
    pin: str
    body: str
    along: tuple[str | Place, str | Place]


@dataclass(frozen=True)
class Slide:
    """A link that only translates along a direction of another body."""

    link: str
    body: str
    direction: Place

    @property
    def sliding(self) -> str:
        """The signal of the velocity along its direction of a link that turns too, if it has friction."""
        return f"{self.link}_sliding_velocity"


def carrier(body: str, slides: Iterable[Slide]) -> str:
    """The body that a body turns with: links that only translate turn with what they slide on."""
    found = {slide.link: slide.body for slide in slides}
    for _ in found:
        body = found.get(body, body)
    return body


def sliders_of(slots: Iterable[Slot], slides: Sequence[Slide]) -> tuple[str, ...]:
    """The names of what has a position along its line: slots, and links that slide and do not turn."""
    straight = [slide.link for slide in slides if carrier(slide.link, slides) == FRAME]
    return (*(slot.name for slot in slots), *straight)


@dataclass(frozen=True)
class TableParameter:
    """A parameter of a table; ranges and units as in `explore.model.quantities.Parameter`."""

    name: str
    unit: str
    meaning: str = ""
    default: float | None = None
    lower: float = -float("inf")
    upper: float = float("inf")


def parameter_of_table(parameter: Parameter) -> TableParameter:
    """A parameter of a mechanism as one of its table."""
    return TableParameter(parameter.name, parameter.unit, parameter.long_name, parameter.default)


@dataclass(frozen=True)
class LinkageTable:
    """A planar linkage.

    Attributes
    ----------
    driver
        The link that turns, or the slot whose pin is driven along it.
    output
        Link or slot that the plain statistics are of; empty for none.
    frame
        The points that do not move.
    links
        The moving bodies, in the order of the table.
    slots, slides
        Pins on lines, and links that only translate.
    parameters
        All parameters of coordinates and loads, in the order of their first use.
    signs
        Side of each joint or slot that has two: 1 left, positive or far, -1 right, negative or near.
    travel
        Positions in the driven slot at input angles of 0 and 180 deg, mm; between them the pin moves as a sine.
    limits
        First and last input angle, deg, of a driver that does not turn fully; None for the full turn.
    loads
        Masses and forces; None for a linkage without.
    branches
        Joints whose side is a parameter, 1 or -1, with its name.
    starts
        For each group of links, in the order of `steps`, where it is sketched: the crank angle and the directions
        of both links that it poses, deg.
    """

    driver: str
    output: str
    frame: Body
    links: tuple[Body, ...]
    slots: tuple[Slot, ...]
    slides: tuple[Slide, ...]
    parameters: tuple[TableParameter, ...]
    signs: tuple[tuple[str, int], ...] = ()
    travel: Place | None = None
    limits: tuple[float, float] | None = None
    loads: Loads | None = None
    branches: tuple[tuple[str, str], ...] = ()
    starts: tuple[tuple[float, float, float], ...] = ()

    @property
    def bodies(self) -> Iterator[Body]:
        """The frame and all links."""
        yield self.frame
        yield from self.links

    @cached_property
    def body_of(self) -> dict[str, Body]:
        """The bodies by name."""
        return {body.name: body for body in self.bodies}

    @cached_property
    def sliders(self) -> tuple[str, ...]:
        """The names of `sliders_of`."""
        return sliders_of(self.slots, self.slides)

    @property
    def output_turns(self) -> bool:
        """Whether the output has an angle, not a position along a line."""
        return self.output in self.body_of and self.output not in self.sliders

    def line_of(self, name: str) -> Slot | Slide:
        """The slot of a name, or the slide of a link."""
        lines: dict[str, Slot | Slide] = {slot.name: slot for slot in self.slots}
        return lines.get(name) or next(slide for slide in self.slides if slide.link == name)

    @cached_property
    def points(self) -> tuple[str, ...]:
        """All points, in the order of the table, each once."""
        return tuple(dict.fromkeys(point for body in self.bodies for point, _ in body.points))

    def bodies_at(self, point: str) -> tuple[Body, ...]:
        """The bodies that have a point of that name, which a pin joins."""
        return tuple(body for body in self.bodies if point in body.place_of)

    @property
    def driven_slot(self) -> Slot | None:
        """The slot whose pin is driven; None where a link turns."""
        return next((slot for slot in self.slots if slot.name == self.driver), None)

    @cached_property
    def pinned(self) -> LinkageTable:
        """The table in which a driven pin is a point of the body with its slot, as its place there is known."""
        slot = self.driven_slot
        if slot is None:
            return self
        bodies = {
            body.name: replace(body, points=(*body.points, (slot.pin, _DRIVEN))) if body.name == slot.body else body
            for body in self.bodies
        }
        others = tuple(each for each in self.slots if each is not slot)
        links = tuple(bodies[link.name] for link in self.links)
        return replace(self, frame=bodies[FRAME], links=links, slots=others)

    @cached_property
    def moving_names(self) -> frozenset[str]:
        """The parameters that the motion depends on."""
        parts = (self.frame, self.links, self.slots, self.slides, self.travel)
        return frozenset([*_names(parts), *(name for _, name in self.branches)])

    @cached_property
    def load_names(self) -> frozenset[str]:
        """The parameters that only the loads depend on."""
        return frozenset(_names(self.loads)) - self.moving_names

    @cached_property
    def digest(self) -> str:
        """A hash of everything that the motion, its signals and their names follow from."""
        *others, limits, loads, branches, starts = [_plain(getattr(self, field.name)) for field in fields(self)]
        # Results of before there were limits, loads, curves or motors name their mechanism by a hash without them.
        if self.loads and not self.loads.motor:
            told = fields(self.loads)[: -1 if self.loads.curves else -2]
            loads = _plain(tuple(getattr(self.loads, field.name) for field in told))
        content = (*others, *(part for part in (limits, loads, branches, starts) if part))
        return hashlib.sha256(repr(content).encode()).hexdigest()


def _names(value: object) -> Iterator[str]:
    """The parameters of all coordinates in nested parts of a table."""
    if isinstance(value, Coordinate):
        yield from value.names
    elif is_dataclass(value):
        yield from (name for field in fields(value) for name in _names(getattr(value, field.name)))
    elif isinstance(value, tuple):
        yield from (name for each in value for name in _names(each))


def _plain(value: object) -> object:
    """Nested tuples of texts and numbers."""
    if is_dataclass(value):
        return tuple(_plain(getattr(value, field.name)) for field in fields(value))
    return tuple(map(_plain, value)) if isinstance(value, tuple) else value
