"""A linkage that another program draws in one position, and the study that describes it."""

import cmath
import math
import re
from dataclasses import dataclass, field
from typing import Any

from explore.base.errors import ConfigError, RequestError
from explore.base.suggest import one_line
from explore.mechanisms.linkages.coordinate import ZERO
from explore.mechanisms.linkages.table import FRAME, Slide, carrier
from explore.studies.config.linkage import Linkage
from explore.studies.config.toml_text import format_toml
from explore.studies.linkages.names import reason_against

#: Digits of lengths and coordinates that are written.
_DIGITS = 10
#: Largest number of characters of a name that is kept.
_LONGEST_NAME = 30


@dataclass(frozen=True)
class DrawnSlot:
    """A pin on a line of a body: the line's direction in the plane, as it is drawn."""

    pin: str
    body: str
    direction: complex


@dataclass
class Drawn:
    """Places in the plane, mm, of one position; names are those of the other program.

    Attributes
    ----------
    points
        All points.
    links
        The points of the frame, whose name is that of `table.FRAME`, and of each moving link.
    slots
        By name.
    slides
        For each link that only translates the body that it slides on, and the direction in the plane.
    driver
        The link that turns.
    speed
        Of the driver.
    remarks
        What is read in another way, or left out, a sentence each.
    """

    points: dict[str, complex] = field(default_factory=dict)
    links: dict[str, list[str]] = field(default_factory=lambda: {FRAME: []})
    slots: dict[str, DrawnSlot] = field(default_factory=dict)
    slides: dict[str, tuple[str, complex]] = field(default_factory=dict)
    driver: str = ""
    speed: str = "60 rpm"
    remarks: list[str] = field(default_factory=list)


def study_of(drawn: Drawn) -> str:
    """The text of a study of a drawn linkage; lengths are its parameters.

    Raises
    ------
    RequestError
        In one line, if no table can describe it.
    """
    _turn_slides_to_slots(drawn)
    writer = _Writer(drawn)
    try:
        linkage = Linkage(writer.section(), parameters=writer.lengths)
    except ConfigError as error:
        first, *others = error.problems
        more = f"; and {len(others)} more" if others else ""
        raise RequestError(f"as a table: {first}{more}") from None
    order = [p.name for p in linkage.table.parameters]
    parameters = {**{name: writer.lengths[name] for name in order}, "speed": drawn.speed}
    return format_toml({"mechanism": "linkage", "linkage": linkage.content, "parameters": parameters})


def _turn_slides_to_slots(drawn: Drawn) -> None:
    """A link with one pin that slides on another is that pin in a slot of the other."""
    for link, (body, direction) in list(drawn.slides.items()):
        points = drawn.links.get(link, [])
        used = {slot.body for slot in drawn.slots.values()} | {other for other, _ in drawn.slides.values()}
        if len(points) == 1 and link not in used:
            del drawn.slides[link], drawn.links[link]
            drawn.slots[link] = DrawnSlot(points[0], body, direction)
            drawn.remarks.append(f"{link} is a slot of {body}, in which {points[0]} slides")


class _Writer:
    """The section [linkage] of a drawn linkage."""

    def __init__(self, drawn: Drawn) -> None:
        self._drawn = drawn
        self._names: dict[str, str] = {}
        self._taken: set[str] = set()
        self.lengths: dict[str, float] = {}
        for name in (*drawn.points, *(link for link in drawn.links if link != FRAME), *drawn.slots):
            self._name(name)
        pivots = [point for point in drawn.links.get(drawn.driver, []) if point in drawn.links[FRAME]]
        self._order = {
            link: [*pivots, *(p for p in points if p not in pivots)] if link == drawn.driver else list(points)
            for link, points in drawn.links.items()
        }
        size = max(map(abs, drawn.points.values()), default=0.0)
        self._smallest = 1e-9 * size

    def _name(self, name: str) -> str:
        """The name in the table, the same where a table can have it; each thing has a name of its own."""
        if name not in self._names:
            base = re.sub(r"\W+|_+$", "_", name, flags=re.ASCII)[:_LONGEST_NAME].strip("_") or "part"
            base = base if base[0].isalpha() else f"n{base}"
            new, count = base, 1
            while new in self._taken or reason_against(new):
                count += 1
                new = f"{base}_{count}"
            if new != name:
                self._drawn.remarks.append(one_line(f"{name[:100]} is named {new}"))
            self._names[name] = new
            self._taken.add(new)
        return self._names[name]

    def section(self) -> dict[str, Any]:
        """The content of [linkage], with a sketch of the drawn position."""
        drawn = self._drawn
        frame = {self._name(p): self._pair(drawn.points[p]) for p in drawn.links[FRAME]}
        links = {self._name(link): self._link(link) for link in drawn.links if link != FRAME}
        slots = {self._name(name): self._slot(slot) for name, slot in drawn.slots.items()}
        slides = {
            self._name(link): {"link": self._body(body), "direction": self._pair(direction / self._pose(body)[1])}
            for link, (body, direction) in drawn.slides.items()
        }
        angle = math.degrees(cmath.phase(self._pose(drawn.driver)[1])) if drawn.driver in drawn.links else 0.0
        moving = [point for point in drawn.points if point not in drawn.links[FRAME]]
        sketch = {"crank_angle": _rounded(angle), **{self._name(p): self._pair(drawn.points[p]) for p in moving}}
        return {
            "driver": self._names.get(drawn.driver, drawn.driver),
            "frame": frame,
            "links": links,
            "slots": slots,
            "slides": slides,
            "branch": self._branch(),
            "sketch": sketch,
        }

    def _branch(self) -> dict[str, str]:
        """The sides of pins in slots of links with one point, whose direction no sketch of points tells."""
        drawn, found = self._drawn, {}
        for name, slot in drawn.slots.items():
            points = drawn.links.get(slot.body, [])
            if slot.body != FRAME and len(points) == 1 and slot.body not in drawn.slides:
                ahead = (drawn.points[slot.pin] - drawn.points[points[0]]) * slot.direction.conjugate()
                found[self._name(name)] = "positive" if ahead.real >= 0.0 else "negative"
        return found

    def _body(self, name: str) -> str:
        return FRAME if name == FRAME else self._name(name)

    def _link(self, link: str) -> dict[str, Any]:
        """The points of a link in its coordinates; the distance of the first two is a parameter named like the link."""
        origin, turn = self._pose(link)
        places = {p: (self._drawn.points[p] - origin) / turn for p in self._order[link]}
        result: dict[str, Any] = {self._name(point): self._pair(place) for point, place in places.items()}
        if link not in self._drawn.slides:
            along = [point for point, place in places.items() if abs(place.imag) <= self._smallest]
            result |= {self._name(point): _rounded(places[point].real) for point in along}
            name = self._name(link)
            if len(places) > 1:
                self.lengths[name] = result[self._name(self._order[link][1])]
                result[self._name(self._order[link][1])] = name
        return result

    def _slot(self, slot: DrawnSlot) -> dict[str, Any]:
        origin, turn = self._pose(slot.body)
        start = (self._drawn.points[slot.pin] - origin) / turn
        ends = (start, start + slot.direction / turn)
        return {"pin": self._name(slot.pin), "link": self._body(slot.body), "along": [self._pair(end) for end in ends]}

    def _pose(self, body: str) -> tuple[complex, complex]:
        """Origin and direction of the coordinates of a body in the plane."""
        slides = [Slide(link, other, (ZERO, ZERO)) for link, (other, _) in self._drawn.slides.items()]
        body = carrier(body, slides)
        if body == FRAME or body not in self._drawn.links:
            return 0j, 1 + 0j
        places = [self._drawn.points[point] for point in self._order[body]]
        own = [slot.direction for slot in self._drawn.slots.values() if slot.body == body]
        arm = places[1] - places[0] if len(places) > 1 else own[0] if own else 1 + 0j
        if not arm:
            raise RequestError(f"the first two points of {body} are at the same place")
        return (places[0] if places else 0j), arm / abs(arm)

    def _pair(self, place: complex) -> list[float]:
        return [_rounded(part if abs(part) > self._smallest else 0.0) for part in (place.real, place.imag)]


def _rounded(value: float) -> float:
    """A number to the digits that are written; whole ones without a point."""
    number = float(f"{value:.{_DIGITS}g}") + 0.0
    return int(number) if number.is_integer() and abs(number) < 1e15 else number
