"""Groups of links that no dyad solves: two links that two ties hold to each other or to known bodies, bars or slots."""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from itertools import permutations

from explore.mechanisms.linkages.table import Body, Slot


@dataclass(frozen=True)
class Bar:
    """A link that keeps two points, its ends, at their distance."""

    link: str
    start: str
    end: str


@dataclass(frozen=True)
class PoseGroup:
    """The poses of two links from two ties.

    The first link turns about a known pin. The second one does as well, or about a point of the first. Each tie is a
    bar that joins the second link with the first one or with a known point, or a slot that one of these has and whose
    pin another one has. `on_first` are the points that move with the first link, `on_second` the others of the second.
    """

    first: str
    first_pin: str
    second: str
    second_pin: str
    ties: tuple[Bar | Slot, Bar | Slot]
    on_first: frozenset[str]
    on_second: frozenset[str]

    def carries(self, point: str) -> bool:
        """Whether a point moves with the first link."""
        return point in self.on_first

    def body_of(self, point: str) -> str:
        """The link of the group that a point moves with; empty for a known point."""
        return self.first if point in self.on_first else self.second if point in self.on_second else ""

    @property
    def joint(self) -> str:
        """The joint that is named where the group does not assemble."""
        tie = self.ties[0]
        return tie.end if isinstance(tie, Bar) else tie.name

    def rests_on_first(self, tie: Bar | Slot) -> bool:
        """Whether a tie alone holds the second link to the first one, on which it is pinned."""
        start, body = (tie.start, "") if isinstance(tie, Bar) else (tie.pin, tie.body)
        is_on_first = body == self.first or start == self.first_pin or self.carries(start)
        return self.carries(self.second_pin) and is_on_first


def groups_of(steps: Iterable[object]) -> list[PoseGroup]:
    """The groups among the steps that solve a linkage, in their order."""
    return [step for step in steps if isinstance(step, PoseGroup)]


def find_group(
    free: Sequence[Body], slots: Sequence[Slot], known: Collection[str], bodies: Collection[str]
) -> PoseGroup | None:  # fmt: skip
    """A group of links that are not posed yet, from slots and known points and bodies; None if there is none."""
    for first, second in permutations(free, 2):
        hung = [point for point in first.place_of if point in known]
        pins = [point for point in second.place_of if point in known or point in first.place_of]
        if len(hung) != 1 or len(pins) != 1:
            continue
        others = [body for body in free if body not in (first, second)]
        on_first, on_second = ({*link.place_of} - {pin} for link, pin in ((first, hung[0]), (second, pins[0])))
        bars = [bar for body in others if (bar := _bar_between(body, first, second, pins[0], known))]
        held = [slot for slot in slots if _holds(slot, first, second, known, bodies)]
        ties: list[Bar | Slot] = [*bars, *held]
        if len(ties) == 2:
            points = frozenset(on_first), frozenset(on_second)
            group = PoseGroup(first.name, hung[0], second.name, pins[0], (ties[0], ties[1]), *points)
            if not all(map(group.rests_on_first, ties)):
                return group
    return None


def _holds(slot: Slot, first: Body, second: Body, known: Collection[str], bodies: Collection[str]) -> bool:
    """Whether a slot holds the second link to the first one or to a known body."""
    if slot.body == second.name:
        return slot.pin not in second.place_of and (slot.pin in known or slot.pin in first.place_of)
    return slot.body in (first.name, *bodies) and slot.pin in second.place_of and slot.pin not in known


def _bar_between(body: Body, first: Body, second: Body, pin: str, known: Collection[str]) -> Bar | None:
    """The link as a bar from the first link, or from a known point, to the second one."""
    ends = [point for point in body.place_of if point in second.place_of and point != pin]
    starts = [point for point in body.place_of if point in known or point in first.place_of]
    starts = [point for point in starts if point not in second.place_of]
    return Bar(body.name, starts[0], ends[0]) if len(starts) == 1 and len(ends) == 1 else None
