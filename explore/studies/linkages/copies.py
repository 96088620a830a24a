"""Copies of all that hangs on the driver, at other phases of it: of a chain that several cranks of one shaft move."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from explore.base.errors import KeyPath
from explore.mechanisms.linkages.coordinate import Coordinate, Place
from explore.mechanisms.linkages.table import FRAME, Body, Slide, Slot, carrier
from explore.studies.linkages.coordinates import moved, read_amount, turned
from explore.studies.linkages.names import reason_against
from explore.studies.linkages.structure import SECTION, Structure


def add_copies(structure: Structure, driver: str, entries: Mapping[str, Any]) -> None:
    """Add the links, points, slots and slides of each copy, whose names end with the name of the copy.

    Points of the frame are shared; those of the driver that the others hang at are turned about its pivot.
    """
    base = replace(structure, bodies=dict(structure.bodies), slots=list(structure.slots), slides=list(structure.slides))
    for name, entry in entries.items():
        key: KeyPath = (SECTION, "copies", name)
        phase = read_amount(entry, key, structure.problems, "deg")
        pivots = [point for point, _ in base.bodies[driver].points if point in base.bodies[FRAME].place_of]
        if len(pivots) != 1:
            structure.problems.append((key, f"{driver} turns about no point of the frame, so it has no phases"))
            return
        _Copy(structure, base, driver, pivots[0], name, phase).add()


class _Copy:
    """One copy; `base` is the structure without copies."""

    def __init__(
        self, structure: Structure, base: Structure, driver: str, pivot: str, name: str, phase: Coordinate
    ) -> None:
        self._structure, self._base, self._phase = structure, base, phase
        self._driver, self._pivot = base.bodies[driver], base.bodies[driver].place_of[pivot]
        self._name, self._key = name, (SECTION, "copies", name)
        self._fixed = base.bodies[FRAME].place_of
        self._taken = {*structure.bodies, *structure.points, *(slot.name for slot in structure.slots)}
        self._turning = {link.name for link in base.links if carrier(link.name, base.slides) == driver}

    def add(self) -> None:
        structure, base, driver = self._structure, self._base, self._driver
        others = [link for link in base.links if link is not driver]
        named = {end for slot in base.slots if slot.body == driver.name for end in slot.along if isinstance(end, str)}
        joints = {slot.pin for slot in base.slots} | {point for link in others for point, _ in link.points} | named
        points = [
            (point, self._place(driver.name, place))
            for point, place in driver.points
            if point in joints - {*self._fixed}
        ]
        own = structure.bodies[driver.name]
        new = tuple((self._point(point), place) for point, place in points)
        structure.bodies[driver.name] = Body(driver.name, (*own.points, *new))
        for link in others:
            places = tuple((self._point(point), self._place(link.name, place)) for point, place in link.points)
            new_link = self._renamed(link.name)
            structure.bodies[new_link] = Body(new_link, places)
            structure.phases[new_link] = link.name, self._phase
        structure.slots += [self._slot(slot) for slot in base.slots]
        structure.slides += [
            Slide(
                f"{slide.link}_{self._name}",
                self._body(slide.body),
                self._turned(slide.direction) if slide.body in self._turning else slide.direction,
            )
            for slide in base.slides
        ]

    def _renamed(self, name: str) -> str:
        """The name in this copy, which is noted where nothing can have it, or something else has it."""
        new = f"{name}_{self._name}"
        reason = f"{new} is the name of something else" if new in self._taken else reason_against(new)
        if reason:
            self._structure.problems.append((self._key, f"names of the copy end with _{self._name}: {reason}"))
        return new

    def _point(self, point: str) -> str:
        if point in self._fixed:
            return point
        new = f"{point}_{self._name}"
        self._structure.copied[new] = point
        return self._renamed(point)

    def _body(self, name: str) -> str:
        return name if name in (FRAME, self._driver.name) else f"{name}_{self._name}"

    def _slot(self, slot: Slot) -> Slot:
        new = self._renamed(slot.name)
        self._structure.copied[new] = slot.name
        first, second = (
            (end if end in self._fixed else f"{end}_{self._name}")
            if isinstance(end, str)
            else self._place(slot.body, end)
            for end in slot.along
        )
        pin = slot.pin if slot.pin in self._fixed else f"{slot.pin}_{self._name}"
        return Slot(new, pin, self._body(slot.body), (first, second))

    def _place(self, body: str, place: Place) -> Place:
        """A place in the body of the copy: turned about the pivot in those that turn with the driver."""
        if body not in self._turning:
            return place
        return moved(self._turned(moved(place, self._pivot, "-")), self._pivot, "+")

    def _turned(self, place: Place) -> Place:
        return turned(place, self._phase, self._key, self._structure.problems)
