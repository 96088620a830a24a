"""The metrics of a path as a target: a mechanism gives the curve of its point, everything else is here."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from explore.mechanisms.targets.measures import (
    ConstantScale,
    Measures,
    Motion,
    TargetMeasure,
    keep_last,
    shapes_and_rest,
)
from explore.mechanisms.targets.path_errors.measuring import (
    LARGEST,
    LARGEST_ROUNDING,
    N_MEASURES,
    RMS,
    RMS_ROUNDING,
    SIZE,
    SPAN,
    SPAN_ROUNDING,
    measure_ordered,
)
from explore.mechanisms.targets.path_errors.shapes import CHAMFER, HAUSDORFF, N_SHAPES, measure_shapes
from explore.mechanisms.targets.path_errors.timing import measure_timed
from explore.model.drawing import PLACE
from explore.model.quantities import FloatArray, Formula, Parameter
from explore.model.target_kinds import POSE, TargetKind
from explore.model.targets import PathTarget

_DEGREES = 180.0 / np.pi
_ABOUT = {
    "path_error_rms": ("rms distance of the target's points to the path of {}, in their order", RMS, RMS_ROUNDING),
    "path_error_max": ("largest of the distances of the target's points to the path of {}", LARGEST, LARGEST_ROUNDING),
}
_ABOUT_SPAN = "turn of the crank from the first to the last point of the target"
_ABOUT_SHAPES = {
    "path_error_hausdorff": ("largest distance of the traced path of {} and the target's polygon from each other",
                             HAUSDORFF),
    "path_error_chamfer": ("mean distance of the traced path of {} and the target's polygon from each other", CHAMFER),
}  # fmt: skip


@keep_last
def measure_paths(motion: Motion, target: PathTarget, table: FloatArray) -> Measures:
    """Measures, shape (n, N_MEASURES), crank angles, and shapes with poses, of inputs of the motion with poses."""
    points, weights, given = _arrays(target)
    curve, designs = motion.function(), np.hstack(shapes_and_rest(motion, table))
    found = np.empty((len(designs), N_MEASURES)), np.empty((len(designs), len(points)))
    if target.crank_angles:
        measure_timed(curve, designs, points, weights, given, target.angles_from == "free", *found)
        if target.closed:
            found[0][~np.isnan(found[0][:, SPAN]), SPAN] = 2.0 * np.pi
    else:
        measure_ordered(curve, motion.function_of_rows(), designs, points, weights, target.closed, *found)
    return *found, designs


@keep_last
def _measure_traced(motion: Motion, target: PathTarget, table: FloatArray) -> Measures:
    """Measures of the curves that designs trace against the polygon of a target, shape (n, N_SHAPES), and angles."""
    _, angles, designs = measure_paths(motion, target, tuple(table.T))
    found = np.empty((len(angles), N_SHAPES))
    measure_shapes(motion.function_of_rows(), designs, _arrays(target)[0], target.closed, angles, found)
    return found, angles


@lru_cache(maxsize=8)
def _arrays(target: PathTarget) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Points, weights, and crank angles, rad."""
    points = np.array(target.points, dtype=np.float64).reshape(-1, 2)
    weights = np.array(target.weights or np.ones(len(points)), dtype=np.float64)
    return points, weights, np.radians(np.array(target.crank_angles, dtype=np.float64))


def declare_paths(
    motion_of: Callable[[str], Motion],
    objectives: tuple[str, ...],
    pose: tuple[Parameter, ...] = POSE,
    points: tuple[str, ...] = (),
) -> TargetKind:
    """Declare that a mechanism meets paths; see `explore.model.targets.TargetKind`.

    The function of the motion of a point is a curve, of the signature
    `mechanisms.targets.path_errors.curve.CURVE_SIGNATURE`.
    """
    return TargetKind(PathFormulas(motion_of), (*_ABOUT, "path_crank_span"), objectives, pose, points)


@dataclass(frozen=True)
class PathFormulas:
    """The metrics of a path as the target of a mechanism, from the motions of its points by their names."""

    motion_of: Callable[[str], Motion]

    def __call__(self, target: PathTarget) -> tuple[Formula, ...]:
        """The metrics of the error of a target."""
        motion = self.motion_of(target.point)
        inputs = (*motion.inputs, *PLACE)

        def measure(row: int, unit: float = 1.0) -> TargetMeasure:
            return TargetMeasure(measure_paths, motion, target, row, unit)

        measures = tuple(
            Formula(name, "mm", about.format(target.point), "min", inputs, measure(row), rounding=measure(rounding),
                    scale=measure(SIZE), needs_turn=motion.needs_turn)
            for name, (about, row, rounding) in _ABOUT.items()
        )  # fmt: skip
        span = Formula("path_crank_span", "deg", _ABOUT_SPAN, None, inputs, measure(SPAN, _DEGREES),
                       rounding=measure(SPAN_ROUNDING, _DEGREES), scale=ConstantScale(360.0),
                       needs_turn=motion.needs_turn)  # fmt: skip
        shapes = tuple(
            Formula(name, "mm", about.format(target.point), "min", inputs,
                    TargetMeasure(_measure_traced, motion, target, row), rounding=measure(LARGEST_ROUNDING),
                    scale=measure(SIZE), needs_turn=motion.needs_turn)
            for name, (about, row) in _ABOUT_SHAPES.items()
        )  # fmt: skip
        return (*measures, span, *shapes)
