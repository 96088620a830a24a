"""Errors of targets in balls: of functions, of paths with crank angles, and of paths and poses at nearest places."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, reduce
from typing import Any, cast

import numpy as np
from flint import arb, fmpq

from explore.analysis.certifying.balls import Enclosure, UndecidedError, UnprovedError, exact
from explore.analysis.certifying.dwells import Dwell
from explore.analysis.certifying.motion import Motion
from explore.analysis.certifying.nearest import Curve, Nearest, Point, PoseSquares, Squares, only_least
from explore.mechanisms.linkages.motions import TableMotion
from explore.mechanisms.targets.dwell_errors.measuring import VALUE
from explore.mechanisms.targets.dwell_errors.metrics import measure_dwell
from explore.mechanisms.targets.measures import TargetMeasure
from explore.mechanisms.targets.path_errors.metrics import measure_paths
from explore.mechanisms.targets.pose_errors.metrics import measure_posed
from explore.model.drawing import PLACE
from explore.model.quantities import AnyMetric, DerivedMetric, FloatArray, Formula, Parameter
from explore.model.target_kinds import STARTS
from explore.model.targets import FunctionTarget, PathTarget, PosesTarget, Target

Numbers = Mapping[str, float | fmpq]


def is_searched(metric: AnyMetric | Parameter) -> bool:
    """Whether the turn is searched for each point of a target, which takes tenths of a second."""
    function = metric.formula.function if isinstance(metric, DerivedMetric) else None
    measure = function if isinstance(function, TargetMeasure) else None
    target = measure.target if measure else None
    is_timed = isinstance(target, PathTarget) and target.angles_from == "frame"
    is_own = (isinstance(target, PosesTarget | PathTarget) and not is_timed) or bool(measure and _is_of_dwell(measure))
    return is_own or (isinstance(metric, DerivedMetric) and any(map(is_searched, metric.inputs)))


def _is_of_dwell(measure: TargetMeasure) -> bool:
    return measure.measures is measure_dwell


class TargetErrors:
    """Errors of the targets of a design, at the precision that is set."""

    def __init__(self, motion: Motion, parameters: Numbers) -> None:
        self._motion, self._parameters = motion, parameters
        self._known: dict[Target, _Path | _Poses] = {}
        self._longest: arb | None = None

    def enclose(self, formula: Formula) -> Enclosure | None:
        """A metric of a target; None where it is undefined, `UnprovedError` where no enclosure is implemented."""
        measure = formula.function
        if isinstance(measure, TargetMeasure) and isinstance(measure.target, FunctionTarget):
            start = self._parameters[STARTS[0].name]
            if any(self._motion.misses(_radians(start, turned)) for turned, _ in measure.target.table):
                return None
        found = self._find(formula, measure) if isinstance(measure, TargetMeasure) else None
        if found is None or formula.scale is None:
            raise UnprovedError(f"{formula.name} cannot be certified: no enclosure is implemented")
        (scale,) = formula.scale(*self._columns(formula))
        return Enclosure(found * (180 / arb.pi() if formula.unit == "deg" else 1), arb(float(scale)))

    def _find(self, formula: Formula, measure: TargetMeasure) -> arb | None:
        """A metric in mm or rad; None where no enclosure is implemented."""
        target, known = measure.target, self._parameters
        if isinstance(target, FunctionTarget):
            return _statistic(formula.name, self._errors_of_output(target))
        if _is_of_dwell(measure):
            return self._of_dwell(formula, measure)
        if target not in self._known and isinstance(target, PathTarget):
            angles = _balls(measure_paths(measure.motion, target, tuple(self._columns(formula)))[1][0])
            self._known[target] = _Path(target, Curve(self._motion.place(target.point)), _placed(target, known), angles)
        elif target not in self._known and isinstance(target, PosesTarget):
            angles = _balls(measure_posed(measure.motion, target, tuple(self._columns(formula)))[1][0])
            curve = Curve(self._motion.place(target.point, cast(TableMotion, measure.motion).link))
            self._known[target] = _Poses(target, curve, known, angles)
        return self._known[target].metric(formula.name) if target in self._known else None

    def _of_dwell(self, formula: Formula, measure: TargetMeasure) -> arb:
        """The travel in a dwell, its angle or its start."""
        (target, turns), motion = measure.target, self._motion
        dwell = Dwell(motion.function(motion.output_place), [angle for angle, _ in motion.reversals])
        if target.angle:
            angle = _radians(target.angle)
            return dwell.start(angle) if formula.name == "dwell_start" else dwell.least_travel(angle)
        if self._longest is None:
            guess = measure_dwell(measure.motion, measure.target, tuple(self._columns(formula)))[0][0, VALUE]
            self._longest = dwell.longest_rest(_radians(target.travel) if turns else arb(target.travel), float(guess))
        return dwell.start(self._longest) if formula.name == "dwell_start" else self._longest

    def _columns(self, formula: Formula) -> list[Any]:
        """The inputs of a formula as columns of one design; a metric tells that the crank turns, as it does here."""
        known = self._parameters
        return [np.array([float(exact(known[name])) if name in known else 0.0]) for name in formula.inputs]

    def _errors_of_output(self, target: FunctionTarget) -> list[arb]:
        """The squared errors of the output's angle at the pairs of a function, rad."""
        output, squares = self._motion.function(self._motion.output_place), []
        input_start, output_start = (self._parameters[parameter.name] for parameter in STARTS)
        for turned, asked in target.table:
            error = output.value(_radians(input_start, turned)) - _radians(output_start, asked)
            turns = (error / (2 * arb.pi()) + arb(0.5)).floor().unique_fmpz()
            if turns is None:
                raise UndecidedError
            error = error - 2 * arb.pi() * int(turns)
            squares.append(error * error)
        return squares


def _balls(numbers: FloatArray) -> list[arb]:
    return [arb(number) for number in numbers.tolist()]


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


def _placed(target: PathTarget, parameters: Numbers) -> list[Point]:
    """The points of a path as the linkage has them in its own frame."""
    x, y, turned = (arb(exact(parameters[name])) for name in PLACE)
    sine, cosine = (turned * arb.pi() / 180).sin_cos()
    moved = [(arb(a) - x, arb(b) - y) for a, b in target.points]
    return [(cosine * a + sine * b, cosine * b - sine * a) for a, b in moved]


@dataclass
class _Path:
    """The errors of a path: its points in the frame of the linkage, and crank angles near the best ones, rad."""

    target: PathTarget
    curve: Curve
    points: Sequence[Point]
    angles: Sequence[arb]

    def metric(self, name: str) -> arb | None:
        """A metric in mm or rad; None where no enclosure is implemented."""
        if name == "path_crank_span":
            return self._span
        return _statistic(name, self._squares, self._weights) if name in ("path_error_rms", "path_error_max") else None

    @cached_property
    def _weights(self) -> list[arb]:
        return [arb(weight) for weight in self.target.weights or [1.0] * len(self.points)]

    @cached_property
    def _nearest(self) -> Nearest:
        singles = [Squares(self.curve, [point], [arb(1)], [arb(0)]) for point in self.points]
        return Nearest(singles, self._weights, self.angles, is_ordered=True)

    @cached_property
    def _given(self) -> list[arb]:
        return [_radians(angle) for angle in self.target.crank_angles]

    @cached_property
    def _squares(self) -> list[arb]:
        """The squared distances of the points at the best crank angles."""
        if not self.target.crank_angles:
            return self._nearest.squares
        angles = self._given
        if self.target.angles_from == "free":
            shift = only_least(Squares(self.curve, self.points, self._weights, angles), self.angles[0] - angles[0])
            angles = [angle + shift for angle in angles]
        places = [self.curve.function.at(angle) for angle in angles]
        gaps = [(x - px, y - py) for (x, y), (px, py) in zip(places, self.points, strict=True)]
        return [x * x + y * y for x, y in gaps]

    @property
    def _span(self) -> arb:
        """The turn of the crank from the first to the last point."""
        if self.target.closed:
            return 2 * arb.pi()
        if self.target.crank_angles:
            return reduce(arb.max, self._given) - reduce(arb.min, self._given)
        return abs(self._nearest.places[-1] - self._nearest.places[0])


class _Poses:
    """The errors of poses, with a curve that has the direction of the link, too."""

    def __init__(self, target: PosesTarget, curve: Curve, parameters: Numbers, angles: Sequence[arb]) -> None:
        turned = parameters[PLACE[2]], parameters["body_angle"]
        own = [_radians(angle, *(-exact(each) for each in turned)) for _, _, angle in target.poses]
        points = _placed(target.path, parameters)
        self._singles = [PoseSquares(curve, *pose, arb(target.length)) for pose in zip(points, own, strict=True)]
        weights = [arb(1)] * len(own)
        self._nearest = Nearest(self._singles, weights, angles, is_ordered=target.order == "given")

    def metric(self, name: str) -> arb:
        """A metric in mm or rad."""
        if name == "pose_error_rms":
            return _statistic(name, self._nearest.squares)
        places = self._nearest.places
        if name == "pose_crank_span":
            return reduce(arb.max, places) - reduce(arb.min, places)
        gaps = [single.gaps(place) for single, place in zip(self._singles, places, strict=True)]
        return reduce(arb.max, (gap[int(name == "angle_error_max")] for gap in gaps))
