"""Places of a curve that are nearest to points or poses, in balls: each by itself over the turn, and in order.

The least sum of squares in order is not below the sum of the squares of the distances from the whole curve, and not
above the sum at any crank angles in order. Both are the same where the nearest places are in order themselves.
"""

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import Any

from flint import arb, ctx

from explore.analysis.certifying.analytic import TERMS, angle_series, coefficients
from explore.analysis.certifying.arcs import full_turn
from explore.analysis.certifying.ball_graph import Function
from explore.analysis.certifying.balls import UnprovedError
from explore.analysis.certifying.subdivision import Expandable, ExtremeSearch, over_cell

#: Name in sentences of what is searched for its least value.
_NAME = "the distance from the target"
#: Sentence of what is not proved where the best angles in order are no nearest places.
_AGAINST_ORDER = "the target cannot be certified: its order keeps it from where the curve is nearest"
#: Sentence of what is not proved where the best angles are not the only ones.
_NOT_ALONE = "the target cannot be certified: another place may be as near"
#: Least difference of sums that is none of rounding, relative.
_APART = 1e-9
#: Longest step from a crank angle in doubles to the best one, rad.
_NEAR = 1e-6
#: Half-width of the widest cell in which a nearest place is shown to be the only one, rad.
_WIDE = 2.0**-4
#: Half-width of the narrowest one, rad.
_NARROW = 2.0**-30

#: A point in the frame of the linkage, mm.
Point = tuple[arb, arb]


@dataclass
class Curve:
    """Coordinates of a point, of which series over cells are kept: all sums have the same first cells."""

    function: Function
    kept: dict[Hashable, Any] = field(default_factory=dict)

    def over(self, middle: arb, half: arb) -> Any:
        """The coordinates as power series about the middle of a cell, and about all of its angles."""
        key = tuple(part.man_exp() for ball in (middle, half) for part in (ball.mid(), ball.rad()))
        if key not in self.kept:
            self.kept[key] = self.function.pairs_over(middle, half)
        return self.kept[key]


@dataclass(frozen=True)
class Squares(Expandable):
    """The sum of weighted squares of distances of points, each at a crank angle that is ahead of that of the sum."""

    curve: Curve
    points: Sequence[Point]
    weights: Sequence[arb]
    ahead: Sequence[arb]

    def series(self, angle: arb) -> list[list[arb]]:
        """Taylor coefficients about an angle."""
        return [coefficients(self._sum([self.curve.function.expanded(angle + each) for each in self.ahead]))]

    def series_over(self, middle: arb, half: arb) -> list[list[arb]]:
        """The same about the middle of a cell; the last one is that about all angles of the cell."""
        pairs = [self.curve.over(middle + each, half) for each in self.ahead]
        about, over = ([tuple(pair[k] for pair in both) for both in pairs] for k in range(2))
        return [[*coefficients(self._sum(about))[:-1], coefficients(self._sum(over))[-1]]]

    def _sum(self, places: Sequence[Any]) -> Any:
        total = arb(0)
        for (x, y), (px, py), weight in zip(places, self.points, self.weights, strict=True):
            total = total + ((x - px) * (x - px) + (y - py) * (y - py)) * weight
        return total


@dataclass(frozen=True)
class PoseSquares(Expandable):
    """The square of the distance of a pose, whose angle counts at the end of a lever.

    The curve has the coordinates of the point, then those of the direction of its link.
    """

    curve: Curve
    point: Point
    angle: arb
    lever: arb

    def series(self, angle: arb) -> list[list[arb]]:
        """Taylor coefficients about an angle."""
        return [coefficients(self._sum(self.curve.function.expanded(angle)))]

    def series_over(self, middle: arb, half: arb) -> list[list[arb]]:
        """The same about the middle of a cell; the last one is that about all angles of the cell.

        Where the link points away from the pose, a bound below: there the angle jumps.
        """
        pairs = self.curve.over(middle, half)
        about, over = (tuple(pair[k] for pair in pairs) for k in range(2))
        if coefficients(self._turned(over)[1])[0] < 0:
            bound = self.lever * arb.pi() / 2
            return [[bound * bound] + [arb(0)] * (TERMS - 1)]
        return [[*coefficients(self._sum(about))[:-1], coefficients(self._sum(over))[-1]]]

    def gaps(self, angle: arb) -> tuple[arb, arb]:
        """The distance of the point, and the error of the angle, rad."""
        x, y, *direction = self.curve.function.at(angle)
        dx, dy = x - self.point[0], y - self.point[1]
        return (dx * dx + dy * dy).sqrt(), abs(arb.atan2(*self._turned((x, y, *direction))))

    def _turned(self, place: Sequence[Any]) -> tuple[Any, Any]:
        """Sine and cosine of the error of the angle, times a positive number."""
        sine, cosine = self.angle.sin_cos()
        along, across = place[2:]
        return across * cosine - along * sine, along * cosine + across * sine

    def _sum(self, place: Sequence[Any]) -> Any:
        dx, dy, turned = place[0] - self.point[0], place[1] - self.point[1], angle_series(*self._turned(place))
        return dx * dx + dy * dy + turned * turned * (self.lever * self.lever)


@dataclass
class Nearest:
    """Where a curve is nearest to points or poses: crank angles near given ones in doubles, perhaps in order."""

    singles: Sequence[Expandable]
    weights: Sequence[arb]
    angles: Sequence[arb]
    is_ordered: bool

    @cached_property
    def _best(self) -> list[arb]:
        """Crank angles, in order if they must be."""
        best = [improved(*each) for each in zip(self.singles, self.angles, strict=True)]
        ascending = best if self.angles[-1] >= self.angles[0] else best[::-1]
        keeps_order = all(a <= b for a, b in pairwise(ascending)) and ascending[-1] - ascending[0] <= 2 * arb.pi()
        if self.is_ordered and not keeps_order:
            raise UnprovedError(_AGAINST_ORDER)
        return best

    @cached_property
    def squares(self) -> list[arb]:
        """The squares at the best crank angles."""
        high = [single.series(angle)[0][0] for single, angle in zip(self.singles, self._best, strict=True)]
        low = [least(single).nonnegative_part() for single in self.singles]
        excess = sum((w * (b - a) for w, a, b in zip(self.weights, low, high, strict=True)), arb(0))
        if excess > _APART * sum(high, arb(0)):
            raise UnprovedError(_AGAINST_ORDER)
        # no square is further above its least than all of them, over its weight
        return [a.union(a + excess.abs_upper() / w) for a, w in zip(low, self.weights, strict=True)]

    @cached_property
    def places(self) -> list[arb]:
        """The best crank angles, which are the only ones."""
        places = [only_least(*each) for each in zip(self.singles, self._best, strict=True)]
        is_strict = all(a < b for a, b in pairwise(places)) or all(a > b for a, b in pairwise(places))
        # of two points either sense of the crank has the order
        if self.is_ordered and not (is_strict and len(places) > 2 and abs(places[-1] - places[0]) < 2 * arb.pi()):
            raise UnprovedError(_NOT_ALONE)
        return places


def least(squares: Expandable) -> arb:
    """The least sum over a turn."""
    turn = full_turn()
    return -ExtremeSearch(squares, _NAME, turn.start, turn.stop, is_turn=True).largest(-1)


def only_least(squares: Expandable, angle: arb) -> arb:
    """The angle near a given one where a sum is least in the turn; `UnprovedError` if it may be another one."""
    angle, half = improved(squares, angle), arb(_WIDE)
    while half > _NARROW:
        bend = over_cell(squares.series_over(angle, half)[0], half)[2]
        value, slope, *_ = squares.series(angle)[0]
        place = angle - slope / bend if bend > 0 else None
        if place is not None and place > angle - half and place < angle + half:
            beyond = -ExtremeSearch(squares, _NAME, angle + half, angle + 2 * arb.pi() - half).largest(-1)
            if value < beyond:
                return place
            break
        half = half / 4
    raise UnprovedError(_NOT_ALONE)


def improved(squares: Expandable, angle: arb) -> arb:
    """An angle nearer to where a square is least, by Newton's method; without its error."""
    for _ in range(ctx.prec.bit_length()):
        _, slope, bend, *_ = squares.series(angle)[0]
        step = (slope / (2 * bend)).mid()
        if not (bend > 0 and abs(step) < _NEAR):
            break
        angle = (angle - step).mid()
    return angle
