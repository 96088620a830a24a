"""Groups of four links that no dyad solves: two links with a bar between them, or to a known point, and one more."""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from itertools import permutations

from explore.mechanisms.linkages.table import Body


@dataclass(frozen=True)
class Bar:
    """A link that keeps two points, its ends, at their distance."""

    link: str
    start: str
    end: str


@dataclass(frozen=True)
class PoseGroup:
    """The poses of two links from two bars.

    The first link turns about a known pin. The second one does as well, or about a point of the first. Each bar joins
    the second link with the first one or with a known point. `on_first` are the points that move with the first link.
    """

    first: str
    first_pin: str
    second: str
    second_pin: str
    bars: tuple[Bar, Bar]
    on_first: frozenset[str]

    def carries(self, point: str) -> bool:
        """Whether a point moves with the first link."""
        return point in self.on_first


def groups_of(steps: Iterable[object]) -> list[PoseGroup]:
    """The groups among the steps that solve a linkage, in their order."""
    return [step for step in steps if isinstance(step, PoseGroup)]


def find_group(free: Sequence[Body], known: Collection[str]) -> PoseGroup | None:
    """A group of links that are not posed yet, from known points; None if there is none."""
    for first, second in permutations(free, 2):
        hung = [point for point in first.place_of if point in known]
        pins = [point for point in second.place_of if point in known or point in first.place_of]
        if len(hung) != 1 or len(pins) != 1:
            continue
        others = [body for body in free if body not in (first, second)]
        bars = [bar for body in others if (bar := _bar_between(body, first, second, pins[0], known))]
        if len(bars) == 2:
            carried = frozenset(first.place_of) - {hung[0]}
            return PoseGroup(first.name, hung[0], second.name, pins[0], (bars[0], bars[1]), carried)
    return None


def _bar_between(body: Body, first: Body, second: Body, pin: str, known: Collection[str]) -> Bar | None:
    """The link as a bar from the first link, or from a known point, to the second one."""
    ends = [point for point in body.place_of if point in second.place_of and point != pin]
    starts = [point for point in body.place_of if point in known or point in first.place_of]
    starts = [point for point in starts if point not in second.place_of]
    return Bar(body.name, starts[0], ends[0]) if len(starts) == 1 and len(ends) == 1 else None
