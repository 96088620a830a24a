"""How each joint assembles, from a sketch: rough places of the points at one crank angle. Nothing is solved."""

import cmath
import math
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, Self

from explore.base.entries import read_number
from explore.base.errors import KeyPath, Problems
from explore.base.suggest import format_value, suggestion
from explore.mechanisms.linkages.coordinate import Place
from explore.mechanisms.linkages.steps import Circle, Drive, JoinPoint, Locus, SlideLine, Step
from explore.mechanisms.linkages.table import FRAME, Body, LinkageTable, Slot
from explore.studies.linkages.branch import TwoSided, words_of
from explore.studies.linkages.coordinates import value_of
from explore.studies.linkages.structure import SECTION

_ANGLE = "crank_angle"
#: Distance from the border between two assemblies below which a sketch is refused, as a share of the lengths there.
_NEAREST = 0.02
#: Ratio of a sketched distance to that of the table, or its inverse, above which the sketch is of another linkage.
_MOST_OFF = 2.0


def read_places(entries: Mapping[str, Any], points: Collection[str], problems: Problems) -> dict[str, complex]:
    """The places of points that the section [linkage.sketch] says; those that are wrong are left out."""
    rough: dict[str, complex] = {}
    for name, entry in entries.items():
        key: KeyPath = (SECTION, "sketch", name)
        if name == _ANGLE:
            continue
        if name not in points:
            problems.append((key, f"unknown point {format_value(name)}; {suggestion(name, points)}"))
        elif not isinstance(entry, list | tuple) or len(entry) != 2:
            problems.append((key, f"must be a pair [x, y], got {format_value(entry)}"))
        else:
            place = (read_number(each, "mm", (*key, n), problems) for n, each in enumerate(entry))
            rough[name] = complex(*(each or 0.0 for each in place))
    return rough


@dataclass
class Sketch:
    """Rough places as complex numbers, mm; those of the frame and of the driver are exact.

    Attributes
    ----------
    drive
        The first step: the driver and its point in the frame; None for another driver.
    angle
        The crank angle, deg; 0 where a pin is driven.
    rough
        The sketched places.
    values
        The values of all parameters.
    problems
        Each problem is appended with its key.
    """

    table: LinkageTable
    drive: Drive | None
    angle: float
    rough: Mapping[str, complex]
    values: Mapping[str, float]
    problems: Problems
    places: dict[str, complex] = field(init=False)
    _said: set[str] = field(default_factory=set)

    @classmethod
    def read(
        cls,
        entries: Mapping[str, Any],
        table: LinkageTable,
        steps: tuple[Step, ...],
        values: Mapping[str, float],
        problems: Problems,
    ) -> Self | None:
        """The sketch that the section [linkage.sketch] describes; None after its problems are appended."""
        key: KeyPath = (SECTION, "sketch")
        before = len(problems)
        angle = 0.0
        if table.driven_slot:
            if _ANGLE in entries:
                reason = f"{table.driver} is a driven slot, whose pin is sketched; leave it out"
                problems.append(((*key, _ANGLE), reason))
        elif _ANGLE in entries:
            angle = read_number(entries[_ANGLE], "deg", (*key, _ANGLE), problems) or 0.0
        else:
            problems.append((key, f"the key '{_ANGLE}' is missing; a sketch is of one crank angle, {_ANGLE} = 40"))
        rough = read_places(entries, table.points, problems)
        if len(problems) > before:
            return None
        drive = next((step for step in steps if isinstance(step, Drive)), None)
        return cls(table, drive, angle, rough, values, problems)

    @property
    def _crank(self) -> complex:
        """The direction of the driver."""
        return cmath.rect(1.0, math.radians(self.angle))

    def __post_init__(self) -> None:
        self.places = dict(self.rough) | {point: self.local(place) for point, place in self.table.frame.points}
        if self.drive is None:
            return
        driver, turn = self.table.body_of[self.drive.link], self._crank
        origin = self.places[self.drive.pivot] - self.local(driver.place_of[self.drive.pivot]) * turn
        self.places |= {
            point: origin + self.local(place) * turn for point, place in driver.points if point != self.drive.pivot
        }

    def signs(self, sides: Mapping[str, TwoSided], given: Mapping[str, int]) -> dict[str, int]:
        """The side of each joint or slot, as far as the sketch tells it; `given` are those of [linkage.branch]."""
        undefined = [point for point, place in self.places.items() if not cmath.isfinite(place)]
        if undefined:
            self.note(undefined[0], f"the place of {undefined[0]} is not a finite number{self._at_values(self.values)}")
            return {}
        self._note_misplaced()
        self._note_misfits()
        found: dict[str, int] = {}
        for name, step in sides.items():
            if name in given:
                self._compare(name, step, given[name])
            elif sign := self._sign(name, step):
                found[name] = sign
        return found

    def _compare(self, name: str, step: TwoSided, given: int) -> None:
        """Note that a side of [linkage.branch] is not that of the sketch."""
        said, self.problems = self.problems, []
        sign = self._sign(name, step)
        self.problems = said
        if sign and sign != given:
            plus, minus = words_of(step)
            reason = f'is not the side of the sketch, "{plus if sign > 0 else minus}"; leave out one of the two'
            self.problems.append(((SECTION, "branch", name), reason))

    def direction_of(self, link: str) -> complex:
        """The direction of a link, which two of its points tell; 0 after a problem is noted."""
        body = self.table.body_of[link]
        for point, _ in body.points:
            if point not in self.places:
                self._find(point)
        turn = self._turn(body)
        missing = [point for point, _ in body.points if point not in self.places]
        if not turn and missing:
            self._note_missing(missing[0], f"the direction of {link}")
        elif not turn:
            self.note(
                body.points[0][0], f"the direction of {link} does not follow from its points; sketch others of it"
            )
        return turn

    def local(self, place: Place) -> complex:
        """A place in coordinates of its body."""
        return complex(*(value_of(coordinate, self.values) for coordinate in place))

    def note(self, name: str, reason: str) -> None:
        """Note a problem of a sketched point, or of the whole sketch."""
        key: KeyPath = (SECTION, "sketch", name) if name in self.rough else (SECTION, "sketch")
        self.problems.append((key, reason))

    def _note_misplaced(self) -> None:
        """Note points of the frame and the driver that are sketched farther from their places than the body is long."""
        for body in (self.table.frame, *([self.table.body_of[self.drive.link]] if self.drive else [])):
            exact = [(point, self.places[point]) for point, _ in body.points]
            for point, place in exact:
                size = max(abs(place - other) for _, other in exact)
                if size and abs(self.rough.get(point, place) - place) > size:
                    names = dict.fromkeys(name for coordinate in body.place_of[point] for name in coordinate.names)
                    at = f"[{place.real:.4g}, {place.imag:.4g}]{self._at_values(names)}"
                    self.note(point, f"fits no assembly: the table has {point} at {at}")

    def _note_misfits(self) -> None:
        """Note links of which the sketch has quite another length than the table."""
        for body in self.table.links:
            points = [point for point, _ in body.points if point in self.places]
            for first, second in pairwise(points):
                length = abs(self.local(body.place_of[second]) - self.local(body.place_of[first]))
                sketched = abs(self.places[second] - self.places[first])
                if first not in self.rough and second not in self.rough:
                    continue
                if not length <= _MOST_OFF * sketched or not sketched <= _MOST_OFF * length:
                    name = second if second in self.rough else first
                    names = dict.fromkeys(name for _, place in body.points for c in place for name in c.names)
                    self.note(
                        name,
                        f"fits no assembly: {first} and {second} of {body.name} are {sketched:.4g} mm apart in the "
                        f"sketch and {length:.4g} mm in the table{self._at_values(names)}",
                    )
                    self._said.update((first, second))

    def _at_values(self, names: Iterable[str]) -> str:
        """The values of some parameters, for a message."""
        shown = ", ".join(f"{name} = {self.values[name]:.4g}" for name in list(names)[:4])
        return f" at {shown}" if shown else ""

    def _sign(self, name: str, step: TwoSided) -> int:
        """The side on which the sketch shows a joint or the pin of a slot; 0 after a problem is noted."""
        if isinstance(step, JoinPoint):
            joint, line = step.point, step.second
            ends = [locus.centre for locus in (step.first, step.second) if isinstance(locus, Circle)]
        else:
            joint, line, ends = step.slot.pin, step.slot, [step.point]
        missing = [point for point in (joint, *ends) if point not in self.places and not self._find(point)]
        if missing:
            self._note_missing(missing[0], f"the side of {name}")
            return 0
        offset = self.places[joint] - self.places[ends[0]]
        if len(ends) == 2:
            along = self.places[ends[1]] - self.places[ends[0]]
            # A joint is left of the line from the first to the second centre where this is positive.
            distance = (offset * along.conjugate()).imag / abs(along) if along else 0.0
            size = max(abs(along), abs(offset), abs(offset - along))
            border = f"the line from {ends[0]} to {ends[1]}"
        else:
            direction = self._direction(line, name)
            if not direction or (isinstance(line, Slot) and self._is_off(joint, line, direction, abs(offset))):
                return 0
            distance, size = (offset * direction.conjugate()).real, abs(offset)
            border = f"the foot of {ends[0]} on its line"
        if self._said & {joint, *ends}:
            return 0
        if not abs(distance) >= _NEAREST * size or not distance:
            self.note(
                joint,
                f"{joint} is too near to {border}, {abs(distance):.2g} mm, to tell on which side it is; "
                "sketch another crank angle, or write the side in [linkage.branch]",
            )
            return 0
        return 1 if distance > 0.0 else -1

    def _is_off(self, pin: str, slot: Slot, direction: complex, size: float) -> bool:
        """Whether the sketch has a pin far from the line of its slot, which is noted; `size` is a length there."""
        body = self.table.body_of[slot.body]
        known = next((point for point, _ in body.points if point in self.places), None)
        if known is None:
            return False
        start = self._end(slot.along[0], body) - self.local(body.place_of[known])
        offset = self.places[pin] - self.places[known] - start * self._turn(body)
        distance = abs((offset * direction.conjugate()).imag)
        if distance <= size / _MOST_OFF:
            return False
        if pin not in self._said:
            self._said.add(pin)
            self.note(pin, f"fits no assembly: {pin} is {distance:.4g} mm away from the line of {slot.name}")
        return True

    def _note_missing(self, point: str, what: str) -> None:
        if point not in self._said:
            self._said.add(point)
            reason = f"the place of {point} is missing, which {what} needs; write {point} = [x, y]"
            self.problems.append(((SECTION, "sketch"), reason))

    def _find(self, point: str) -> bool:
        """Place a point that is not sketched by two sketched ones of its link; return whether there are any."""
        for body in self.table.bodies_at(point):
            turn, known = self._turn(body), next((each for each, _ in body.points if each in self.places), None)
            if turn and known is not None:
                offset = self.local(body.place_of[point]) - self.local(body.place_of[known])
                self.places[point] = self.places[known] + offset * turn
                return True
        return False

    def _turn(self, body: Body, depth: int = 0) -> complex:
        """The direction of the x axis of a body; 0 where the sketch does not tell it."""
        if body.name in (FRAME, self.table.driver):
            return 1.0 + 0.0j if body.name == FRAME else self._crank
        slide = next((slide for slide in self.table.slides if slide.link == body.name), None)
        if slide is not None:
            return self._turn(self.table.body_of[slide.body], depth + 1) if depth < len(self.table.links) else 0.0j
        points = [point for point, _ in body.points if point in self.places]
        pairs = [(a, b) for number, a in enumerate(points) for b in points[:number]]
        turns = [
            (self.places[b] - self.places[a])
            * (self.local(body.place_of[b]) - self.local(body.place_of[a])).conjugate()
            for a, b in pairs
        ]
        turn = max(turns, key=abs, default=0.0j)
        return turn / abs(turn) if turn and cmath.isfinite(turn) else 0.0j

    def _end(self, end: str | Place, body: Body) -> complex:
        """An end of a slot in coordinates of its body."""
        return self.local(body.place_of[end] if isinstance(end, str) else end)

    def _direction(self, line: Locus, name: str) -> complex:
        """The direction of the line of a slot or a slide; 0 after a problem is noted."""
        if isinstance(line, Slot):
            body = self.table.body_of[line.body]
            along = self._end(line.along[1], body) - self._end(line.along[0], body)
        elif isinstance(line, SlideLine):
            body, along = self.table.body_of[line.body], self.local(line.slide.direction)
        else:
            raise TypeError(line)
        turn = self._turn(body)
        if not turn or not along or not cmath.isfinite(along):
            unknown = [point for point, _ in body.points if point not in self.places]
            if unknown:
                self._note_missing(unknown[0], f"the side of {name}")
            else:
                self.note(name, f"the direction of {body.name} does not follow from its points; sketch others of it")
            return 0.0j
        return along * turn / abs(along)
