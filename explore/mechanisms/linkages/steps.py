"""The order in which a linkage is solved: from the frame and the driver, one point or link after the other.

A point on two known circles or lines becomes known, and so does a link with two known points. This finds the dyads RRR
(two circles), RRP (circle and line), PRP (two lines) and RPR (a link with a known point whose slot has a known pin)
without naming them. Where nothing follows any more, two links may follow together from two bars or slots between
them and known bodies: groups of class III and IV of Assur. What is left then is not solved.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

from explore.base.errors import RequestError
from explore.mechanisms.linkages.freedoms import count_freedoms, held_too_often, is_joined, part_of, without
from explore.mechanisms.linkages.group_steps import PoseGroup, find_group
from explore.mechanisms.linkages.table import FRAME, Body, LinkageTable, Slide, Slot, carrier


@dataclass(frozen=True)
class Drive:
    """The driver turns about a point of the frame."""

    link: str
    pivot: str


@dataclass(frozen=True)
class DriveOnLines:
    """The driver turns with two of its points on lines of the frame, as the bar of a trammel."""

    link: str
    first: tuple[str, Slot | SlideLine]
    second: tuple[str, Slot | SlideLine]


@dataclass(frozen=True)
class PlacePoint:
    """A point of a link whose pose is known."""

    point: str
    body: str


@dataclass(frozen=True)
class PoseLink:
    """The pose of a link from two of its points."""

    link: str
    first: str
    second: str


@dataclass(frozen=True)
class TranslateLink:
    """The pose of a link that only translates, from one of its points; `SlideLine` places one of it or of its body."""

    link: str
    point: str
    slide: Slide


@dataclass(frozen=True)
class SlideInSlot:
    """RPP: the place of a link that only translates, from the known pin in its slot."""

    link: str
    slide: Slide
    slot: Slot


@dataclass(frozen=True)
class PoseBySlot:
    """RPR: the direction of a link from its known point and from the known pin in its slot."""

    link: str
    point: str
    slot: Slot


@dataclass(frozen=True)
class Circle:
    """A point keeps its distance from a known point of the same link."""

    link: str
    centre: str


@dataclass(frozen=True)
class SlideLine:
    """A point of a link that only translates along a direction of a known body, or of the body along a known link."""

    point: str
    slide: Slide
    is_of_body: bool = False

    @property
    def moving(self) -> str:
        """The body with the point."""
        return self.slide.body if self.is_of_body else self.slide.link

    @property
    def body(self) -> str:
        """The known body."""
        return self.slide.link if self.is_of_body else self.slide.body


Locus = Circle | Slot | SlideLine


@dataclass(frozen=True)
class JoinPoint:
    """RRR, RRP or PRP: a point from two of circles, slots of known bodies, and lines of links that translate."""

    point: str
    first: Locus
    second: Locus


Step = Drive | DriveOnLines | PlacePoint | PoseLink | TranslateLink | SlideInSlot | PoseBySlot | JoinPoint | PoseGroup


class TableError(RequestError):
    """A table that cannot be solved, with the name that the reason is about."""

    def __init__(self, name: str, reason: str) -> None:
        super().__init__(reason)
        self.name = name


def slots_of(step: Step) -> list[Slot]:
    """The slots, up to two, that a step places a pin or the driver by."""
    match step:
        case JoinPoint():
            loci = [step.first, step.second]
        case DriveOnLines():
            loci = [step.first[1], step.second[1]]
        case _:
            loci = []
    return [locus for locus in loci if isinstance(locus, Slot)]


def find_steps(table: LinkageTable) -> tuple[Step, ...]:
    """The steps that solve a linkage.

    Raises
    ------
    TableError
        If links move freely, are held twice, or form a group that no dyad solves.
    """
    return _Search(table).run()


class _Search:
    """Points and bodies whose places are known, and the equations that were not used yet."""

    def __init__(self, table: LinkageTable) -> None:
        self._table = table.pinned
        self._points = {point: FRAME for point, _ in table.frame.points}
        self._posed = {FRAME}
        self._slides = {slide.link: slide for slide in table.slides}
        self._slots = list(self._table.slots)
        self._steps: list[Step] = []

    def run(self) -> tuple[Step, ...]:
        self._drive()
        while self._place_points() or self._pose_link() or self._join_point() or self._pose_group():
            pass
        self._check()
        return tuple(self._steps)

    def _drive(self) -> None:
        driver = self._table.body_of.get(self._table.driver)
        if driver is None:  # a pin is driven
            return
        pivots = [point for point, _ in driver.points if point in self._points]
        lines = [] if pivots else [(point, line) for point, _ in driver.points for line in self._lines(point)]
        if len(pivots) == 1:
            self._steps.append(Drive(driver.name, pivots[0]))
        elif len(lines) >= 2:
            self._steps.append(DriveOnLines(driver.name, lines[0], lines[1]))
            self._use(lines[0][1], lines[1][1])
        else:
            found = " and ".join(pivots) or "none, nor pins on two lines of it"
            raise TableError(
                driver.name, f"the driver turns about one point of the frame, and {driver.name} has {found}"
            )
        self._posed.add(driver.name)

    def _place_points(self) -> bool:
        """Place the points of posed bodies; return whether there were any."""
        found = False
        for body in self._table.bodies:
            for point, _ in body.points if body.name in self._posed else ():
                if point not in self._points:
                    self._steps.append(PlacePoint(point, body.name))
                    self._points[point] = body.name
                    found = True
        return found

    def _pose_link(self) -> bool:
        for body in self._table.links:
            if body.name not in self._posed and (step := self._pose(body)):
                self._steps.append(step)
                self._posed.add(body.name)
                return True
        return False

    def _pose(self, body: Body) -> Step | None:
        """How the pose of a link follows from what is known; None where it does not."""
        known = [point for point, _ in body.points if point in self._points]
        slide = self._slides.get(body.name)
        if slide is not None:
            if known and carrier(slide.body, self._table.slides) in self._posed:
                return TranslateLink(body.name, known[0], slide)
            slot = self._slot_of(body.name) if slide.body in self._posed else None
            return SlideInSlot(body.name, slide, slot) if slot else None
        if len(known) >= 2:
            return PoseLink(body.name, known[0], known[1])
        slot = self._slot_of(body.name) if known else None
        return PoseBySlot(body.name, known[0], slot) if slot else None

    def _slot_of(self, body: str) -> Slot | None:
        """A slot of a body whose pin is known; it is used up."""
        for slot in self._slots:
            if slot.body == body and slot.pin in self._points:
                self._slots.remove(slot)
                return slot
        return None

    def _join_point(self) -> bool:
        for point in self._table.points:
            if point in self._points:
                continue
            loci = self._loci(point)
            if len(loci) >= 2:
                first, second = loci[:2]
                self._use(first, second)
                self._steps.append(JoinPoint(point, first, second))
                self._points[point] = "joint"
                return True
        return False

    def _pose_group(self) -> bool:
        """Pose two links of a group that hangs on the frame and on a driver that turns."""
        free = [link for link in self._table.links if link.name not in self._posed and link.name not in self._slides]
        bodies = FRAME, self._table.driver
        known = {point for point, body in self._points.items() if body in bodies}
        turns = any(isinstance(step, Drive) for step in self._steps)
        group = find_group(free, self._slots, known, bodies) if turns else None
        if group:
            self._steps.append(group)
            self._posed |= {group.first, group.second}
            self._use(*(tie for tie in group.ties if isinstance(tie, Slot)))
        return group is not None

    def _use(self, *loci: Locus) -> None:
        """Take slots off those that were not used yet."""
        self._slots = [slot for slot in self._slots if slot not in loci]

    def _loci(self, point: str) -> list[Locus]:
        """Circles and lines that a point is known to be on: circles first."""
        circles: list[Circle] = []
        for body in self._table.bodies_at(point):
            if body.name in self._posed or body.name in self._slides:
                continue
            centre = next((each for each, _ in body.points if each in self._points), None)
            # Two circles about one point meet everywhere or nowhere.
            if centre and centre not in {circle.centre for circle in circles}:
                circles.append(Circle(body.name, centre))
        return [*circles, *self._lines(point)]

    def _lines(self, point: str) -> list[Slot | SlideLine]:
        """Lines of posed bodies that a point is known to be on."""
        bodies = [body.name for body in self._table.bodies_at(point) if body.name not in self._posed]
        slides = [self._slides[name] for name in bodies if name in self._slides]
        own = [SlideLine(point, slide) for slide in slides if slide.body in self._posed]
        # A link that slides in the middle disc of an Oldham coupling is placed before the disc.
        moving, placed = (
            {line.moving for line in own},
            [each for each in self._table.slides if each.link in self._posed],
        )
        others = [SlideLine(point, slide, is_of_body=True) for slide in placed if slide.body in moving]
        return [*own, *others] + [slot for slot in self._slots if slot.pin == point and slot.body in self._posed]

    def _check(self) -> None:
        """Raise an error unless every link is posed and every equation is used, once."""
        rest = [body.name for body in self._table.links if body.name not in self._posed]
        freedoms = count_freedoms(self._table)
        placed = part_of(self._table, [body for body in self._table.links if body.name in self._posed])
        # What holds the placed links too often is missing nowhere else.
        free = freedoms - min(count_freedoms(placed), 0)
        words = _listed(rest)
        if free > 0 and rest:
            verb = "moves" if len(rest) == 1 else "move"
            hint = "a pin joins links that name the same point; look for a point that only one link names"
            raise TableError(rest[0], f"{words} {verb} freely: {free} joint equation{'s' * (free > 1)} too few; {hint}")
        if freedoms < 0:
            raise self._too_many()
        if rest:
            reason = (
                "form a group that no dyad solves; of such groups those of two links with two bars or slots, "
                "hung on the frame and a driver that turns, are supported"
                if len(rest) > 1
                else "is in no dyad; say of a link that only translates along which direction, in [linkage.slides]"
            )
            raise TableError(rest[0], f"{words} {reason}")

    def _too_many(self) -> TableError:
        """The error of more equations than freedoms; it names what the linkage moves without, if that is one thing."""
        table = self._table
        less = [(slot.name, replace(table, slots=without(table.slots, slot))) for slot in reversed(table.slots)]
        less += [
            (link.name, replace(table, links=without(table.links, link)))
            for link in reversed(table.links)
            if link.name != table.driver and link.name not in {slot.body for slot in table.slots}
        ]
        for name, other in less:
            with suppress(TableError):
                if count_freedoms(other) == 0 and is_joined(other) and find_steps(other):
                    return TableError(name, f"{name} holds what the other joints hold already; leave it out")
        held = held_too_often(table)
        names, count = [body.name for body in held.links], -count_freedoms(held)
        verb = "is" if len(names) == 1 else "are"
        equations = f"{count} joint equation{'s' * (count > 1)}"
        reason = f"{_listed(names)} {verb} held by {equations} too many; leave out what is redundant"
        return TableError(names[0], reason)


def _listed(names: Sequence[str]) -> str:
    return " and ".join(filter(None, [", ".join(names[:-1]), *names[-1:]]))
