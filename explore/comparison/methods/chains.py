"""The closed chains of a linkage: a way from the frame to each body, and a chain for each joint that is not on one."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

from explore.mechanisms.linkages.coordinate import ZERO, Place
from explore.mechanisms.linkages.table import FRAME, LinkageTable, carrier

#: The origin of a body.
ORIGIN: Place = (ZERO, ZERO)


class Term(NamedTuple):
    """A vector of a chain.

    Attributes
    ----------
    angle
        Number of the angle that it turns with; None for the frame.
    length
        Number of the length that its unit vector is multiplied by; None for a vector of constant length.
    places
        Signed places in the body that the vector is the sum of; of a line its end and its start.
    sign
        Sign of a line.
    """

    angle: int | None
    length: int | None
    places: tuple[tuple[int, Place], ...]
    sign: int = 1

    @property
    def line(self) -> bool:
        """Whether its length is variable."""
        return self.length is not None


Chain = tuple[Term, ...]


@dataclass(frozen=True)
class Chains:
    """The chains, and the names of their unknowns; the given angle or length is the last of its kind.

    Attributes
    ----------
    carriers
        Number of the angle that each length turns with; None for the frame.
    """

    chains: tuple[Chain, ...]
    angles: tuple[str, ...]
    lengths: tuple[str, ...]
    carriers: tuple[int | None, ...]


class _Joint(NamedTuple):
    """A place of one body is a place of another, or on a line of it; slots and slides have names."""

    first: str
    place: Place
    second: str
    origin: Place
    name: str = ""
    line: tuple[Place, Place] = (ORIGIN, ORIGIN)


#: A vector with its sign: the body and a place in it, or the name of the slot or slide.
_Step = tuple[int, str, Place | str]


def find_chains(table: LinkageTable, given: str = "") -> Chains:
    """The chains of a linkage; `given` is a slot whose position is given beside the driver's angle."""
    driven = table.driven_slot.name if table.driven_slot else given
    turning = {body.name: carrier(body.name, table.slides) for body in table.bodies}
    free = [link.name for link in table.links if turning[link.name] == link.name and link.name != table.driver]
    joints = list(_joints(table))
    lines = {joint.name: joint for joint in joints if joint.name}
    unknown = [name for name in lines if name != driven]
    numbers: dict[str, int | None] = {name: k for k, name in enumerate([*free, table.driver])}
    numbers |= {FRAME: None}
    names = [*unknown, *([driven] if driven else [])]

    def terms(steps: list[_Step]) -> Iterator[Term]:
        fixed: dict[int | None, list[tuple[int, Place]]] = {}
        for sign, body, what in steps:
            angle = numbers[turning[body]]
            if isinstance(what, str):
                start, end = lines[what].line
                yield Term(angle, names.index(what), ((1, end), (-1, start)), sign)
            elif (-sign, what) in fixed.setdefault(angle, []):
                fixed[angle].remove((-sign, what))
            elif what != ORIGIN:
                fixed[angle].append((sign, what))
        yield from (Term(angle, None, tuple(places)) for angle, places in fixed.items() if places)

    chains = [tuple(terms(steps)) for steps in _closed(joints)]
    carriers = tuple(numbers[turning[lines[name].second]] for name in names)
    return Chains(tuple(chains), tuple(free), tuple(unknown), carriers)


def _joints(table: LinkageTable) -> Iterator[_Joint]:
    """The joints: pins between pairs of bodies, slots, and slides."""
    for point in table.points:
        for first, second in pairwise(table.bodies_at(point)):
            yield _Joint(first.name, first.place_of[point], second.name, second.place_of[point])
    for slot in table.slots:
        pinned, places = table.bodies_at(slot.pin)[0], table.body_of[slot.body].place_of
        start, end = (places[end] if isinstance(end, str) else end for end in slot.along)
        yield _Joint(pinned.name, pinned.place_of[slot.pin], slot.body, start, slot.name, (start, end))
    for slide in table.slides:
        yield _Joint(slide.link, ORIGIN, slide.body, ORIGIN, slide.link, (ORIGIN, slide.direction))


def _closed(joints: list[_Joint]) -> Iterator[list[_Step]]:
    """The vectors of a chain for each joint that is not on the ways from the frame, which are as short as can be."""
    ways: dict[str, list[_Step]] = {FRAME: []}
    rest, bodies = list(joints), [FRAME]
    for body in bodies:
        for joint in [joint for joint in rest if body in (joint.first, joint.second)]:
            other = joint.second if body == joint.first else joint.first
            if other not in ways:
                sign = 1 if body == joint.first else -1
                ways[other] = _cancel([*ways[body], *_across(joint, sign)])
                bodies.append(other)
                rest.remove(joint)
    for joint in rest:
        back = [(-sign, body, what) for sign, body, what in ways[joint.second]]
        yield _cancel([*ways[joint.first], *_across(joint, 1), *back])


def _across(joint: _Joint, sign: int) -> list[_Step]:
    """From the origin of the first body of a joint to that of the second, or back."""
    line: list[_Step] = [(-sign, joint.second, joint.name)] if joint.name else []
    return [(sign, joint.first, joint.place), *line, (-sign, joint.second, joint.origin)]


def _cancel(steps: list[_Step]) -> list[_Step]:
    """The steps without those that are taken there and back."""
    result: list[_Step] = []
    for sign, body, what in steps:
        if (-sign, body, what) in result:
            result.remove((-sign, body, what))
        else:
            result.append((sign, body, what))
    return result
