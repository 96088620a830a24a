"""Errors of targets in balls: of functions, and of paths with crank angles or whose order the nearest places have.

A path in order has a least sum of squares that no order allows to be below the sum of the squares of the distances of
the points from the whole curve, and that is not above the sum at any crank angles in order. Both are the same where the
places that are nearest to the points are in order themselves.
"""

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, reduce
from itertools import pairwise
from typing import Any

import numpy as np
from flint import arb, ctx, fmpq

from explore.analysis.certifying.arcs import full_turn
from explore.analysis.certifying.ball_graph import Function
from explore.analysis.certifying.ball_programs import coefficients
from explore.analysis.certifying.balls import Enclosure, UndecidedError, UnprovedError, exact
from explore.analysis.certifying.motion import Motion
from explore.analysis.certifying.subdivision import least_between, over_cell
from explore.mechanisms.targets.measures import TargetMeasure
from explore.mechanisms.targets.path_errors.metrics import measure_paths
from explore.model.drawing import PLACE
from explore.model.quantities import AnyMetric, DerivedMetric, Formula, Parameter
from explore.model.target_kinds import STARTS
from explore.model.targets import FunctionTarget, PathTarget

#: Name in sentences of what is searched for its least value.
_NAME = "the distance from the path"
#: Sentence of what is not proved where the best angles in order are no nearest places.
_AGAINST_ORDER = "the path cannot be certified: the order keeps points from where the curve is nearest"
#: Least difference of sums that is none of rounding, relative.
_APART = 1e-9
#: Longest step from a crank angle in doubles to the best one, rad.
_NEAR = 1e-6
#: Half-width of the widest cell in which a nearest place is shown to be the only one, rad.
_WIDE = 2.0**-4
#: Half-width of the narrowest one, rad.
_NARROW = 2.0**-30

Numbers = Mapping[str, float | fmpq]
#: A point in the frame of the linkage, mm.
Point = tuple[arb, arb]


def is_searched(metric: AnyMetric | Parameter) -> bool:
    """Whether the turn is searched for each point of a target, which takes tenths of a second."""
    function = metric.formula.function if isinstance(metric, DerivedMetric) else None
    target = function.target if isinstance(function, TargetMeasure) else None
    is_path = isinstance(target, PathTarget) and target.angles_from != "frame"
    return is_path or (isinstance(metric, DerivedMetric) and any(map(is_searched, metric.inputs)))


class TargetErrors:
    """Errors of the targets of a design, at the precision that is set."""

    def __init__(self, motion: Motion, parameters: Numbers) -> None:
        self._motion, self._parameters = motion, parameters
        self._paths: dict[PathTarget, _Path] = {}

    def enclose(self, formula: Formula) -> Enclosure:
        """A metric of a target; `UnprovedError` where no enclosure is implemented."""
        measure, name, found, unit = formula.function, formula.name, None, arb(1)
        if isinstance(measure, TargetMeasure) and isinstance(measure.target, FunctionTarget):
            found, unit = _statistic(name, self._errors_of_output(measure.target)), 180 / arb.pi()
        elif isinstance(measure, TargetMeasure) and isinstance(measure.target, PathTarget):
            found, unit = self._of_path(formula, measure)
        if found is None or formula.scale is None:
            raise UnprovedError(f"{name} cannot be certified: no enclosure is implemented")
        (scale,) = formula.scale(*self._columns(formula))
        return Enclosure(found * unit, arb(float(scale)))

    def _columns(self, formula: Formula) -> list[Any]:
        """The inputs of a formula as columns of one design; a metric tells that the crank turns, as it does here."""
        known = self._parameters
        return [np.array([float(exact(known[name])) if name in known else 0.0]) for name in formula.inputs]

    def _errors_of_output(self, target: FunctionTarget) -> list[arb]:
        """The squared errors of the output's angle at the pairs of a function, rad."""
        output, squares = self._motion.output_angle, []
        input_start, output_start = (self._parameters[parameter.name] for parameter in STARTS)
        for turned, asked in target.table:
            error = output.value(_radians(input_start, turned)) - _radians(output_start, asked)
            turns = (error / (2 * arb.pi()) + arb(0.5)).floor().unique_fmpz()
            if turns is None:
                raise UndecidedError
            error = error - 2 * arb.pi() * int(turns)
            squares.append(error * error)
        return squares

    def _of_path(self, formula: Formula, measure: TargetMeasure) -> tuple[arb | None, arb]:
        """A metric of a path in radians or mm, and its unit; None where no enclosure is implemented."""
        target: PathTarget = measure.target
        if target not in self._paths:
            points, curve = _placed(target, self._parameters), _Curve(self._motion.place(target.point))
            angles = measure_paths(measure.motion, target, tuple(self._columns(formula)))[1][0]
            self._paths[target] = _Path(target, curve, points, [arb(angle) for angle in angles])
        path = self._paths[target]
        if formula.name == "path_crank_span":
            return path.span, 180 / arb.pi()
        is_known = formula.name in ("path_error_rms", "path_error_max")
        return _statistic(formula.name, path.squares, path.weights) if is_known else None, arb(1)


def _statistic(name: str, squares: Sequence[arb], weights: Sequence[arb] = ()) -> arb:
    """The root mean square, or the largest of errors, from their squares."""
    if name.endswith("_max"):
        return reduce(arb.max, squares).nonnegative_part().sqrt()
    weights = weights or [arb(1)] * len(squares)
    total = sum((w * square for w, square in zip(weights, squares, strict=True)), arb(0))
    return (total / sum(weights, arb(0))).nonnegative_part().sqrt()


def _radians(*degrees: float | fmpq) -> arb:
    """The sum of angles."""
    return arb(sum(map(exact, degrees), fmpq(0))) * arb.pi() / 180


# paths


@dataclass
class _Curve:
    """The curve of a point, of which series over cells are kept: all points have the same first cells."""

    function: Function
    kept: dict[Hashable, Any] = field(default_factory=dict)

    def over(self, middle: arb, half: arb) -> Any:
        """The coordinates as power series about the middle of a cell, and about all of its angles."""
        key = tuple(part.man_exp() for ball in (middle, half) for part in (ball.mid(), ball.rad()))
        if key not in self.kept:
            self.kept[key] = self.function.pairs_over(middle, half)
        return self.kept[key]


@dataclass(frozen=True)
class _Squares:
    """The sum of weighted squares of distances of points, each at a crank angle that is ahead of that of the sum."""

    curve: _Curve
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


@dataclass
class _Path:
    """The errors of a path: its points in the frame of the linkage, and crank angles near the best ones, rad."""

    target: PathTarget
    curve: _Curve
    points: Sequence[Point]
    angles: Sequence[arb]

    @cached_property
    def weights(self) -> list[arb]:
        """The weights of the squares."""
        return [arb(weight) for weight in self.target.weights or [1.0] * len(self.points)]

    @cached_property
    def squares(self) -> list[arb]:
        """The squared distances of the points at the best crank angles."""
        if not self.target.crank_angles:
            return self._in_order
        angles = self._given
        if self.target.angles_from == "free":
            shifted = _Squares(self.curve, self.points, self.weights, angles)
            shift = _only_least(shifted, self.angles[0] - angles[0])
            angles = [angle + shift for angle in angles]
        return self._squares_at(angles)

    @cached_property
    def _given(self) -> list[arb]:
        return [_radians(angle) for angle in self.target.crank_angles]

    @cached_property
    def _singles(self) -> list[_Squares]:
        return [_Squares(self.curve, [point], [arb(1)], [arb(0)]) for point in self.points]

    @cached_property
    def span(self) -> arb | None:
        """The turn of the crank from the first to the last point, rad; None where no enclosure is implemented."""
        if self.target.closed:
            return 2 * arb.pi()
        if self.target.crank_angles:
            return reduce(arb.max, self._given) - reduce(arb.min, self._given)
        if len(self.points) < 3:
            return None  # either sense of the crank has this order
        places = [_only_least(*each) for each in zip(self._singles, self._best, strict=True)]
        is_ordered = all(a < b for a, b in pairwise(places)) or all(a > b for a, b in pairwise(places))
        span = abs(places[-1] - places[0])
        return span if is_ordered and span < 2 * arb.pi() else None

    def _squares_at(self, angles: Sequence[arb]) -> list[arb]:
        places = [self.curve.function.at(angle) for angle in angles]
        gaps = [(x - px, y - py) for (x, y), (px, py) in zip(places, self.points, strict=True)]
        return [x * x + y * y for x, y in gaps]

    @cached_property
    def _best(self) -> list[arb]:
        """Crank angles in order, each near where the curve is nearest to its point."""
        best = [_improved(*each) for each in zip(self._singles, self.angles, strict=True)]
        ascending = best if self.angles[-1] >= self.angles[0] else best[::-1]
        if not (all(a <= b for a, b in pairwise(ascending)) and ascending[-1] - ascending[0] <= 2 * arb.pi()):
            raise UnprovedError(_AGAINST_ORDER)
        return best

    @cached_property
    def _in_order(self) -> list[arb]:
        """The squared distances of points at the best crank angles in order."""
        high = self._squares_at(self._best)
        low = [_least(single).nonnegative_part() for single in self._singles]
        excess = sum((w * (b - a) for w, a, b in zip(self.weights, low, high, strict=True)), arb(0))
        if excess > _APART * sum(high, arb(0)):
            raise UnprovedError(_AGAINST_ORDER)
        # no square is further above its least than all of them, over its weight
        return [a.union(a + excess.abs_upper() / w) for a, w in zip(low, self.weights, strict=True)]


def _placed(target: PathTarget, parameters: Numbers) -> list[Point]:
    """The points of a path as the linkage has them in its own frame."""
    x, y, turned = (arb(exact(parameters[name])) for name in PLACE)
    sine, cosine = (turned * arb.pi() / 180).sin_cos()
    moved = [(arb(a) - x, arb(b) - y) for a, b in target.points]
    return [(cosine * a + sine * b, cosine * b - sine * a) for a, b in moved]


def _least(squares: _Squares) -> arb:
    """The least sum over a turn."""
    turn = full_turn()
    return least_between(squares, _NAME, turn.start, turn.stop, is_turn=True)


def _only_least(squares: _Squares, angle: arb) -> arb:
    """The angle near a given one where a sum is least in the turn; `UnprovedError` if it may be another one."""
    angle, half = _improved(squares, angle), arb(_WIDE)
    while half > _NARROW:
        bend = over_cell(squares.series_over(angle, half)[0], half)[2]
        value, slope, *_ = squares.series(angle)[0]
        place = angle - slope / bend if bend > 0 else None
        if place is not None and place > angle - half and place < angle + half:
            beyond = least_between(squares, _NAME, angle + half, angle + 2 * arb.pi() - half)
            if value < beyond:
                return place
            break
        half = half / 4
    raise UnprovedError("the path cannot be certified: another place may be as near")


def _improved(squares: _Squares, angle: arb) -> arb:
    """An angle nearer to where a square is least, by Newton's method; without its error."""
    for _ in range(ctx.prec.bit_length()):
        _, slope, bend, *_ = squares.series(angle)[0]
        step = (slope / (2 * bend)).mid()
        if not (bend > 0 and abs(step) < _NEAR):
            break
        angle = (angle - step).mid()
    return angle
