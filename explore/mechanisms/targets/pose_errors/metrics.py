"""The metrics of poses as a target: a mechanism gives the curve of its point, everything else is here."""

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
from explore.mechanisms.targets.pose_errors.measuring import (
    N_MEASURES,
    PLACE,
    PLACE_ROUNDING,
    RMS,
    RMS_ROUNDING,
    SIZE,
    SPAN,
    SPAN_ROUNDING,
    TURNED,
    TURNED_ROUNDING,
    measure_poses,
)
from explore.model.drawing import PLACE as POSE_NAMES
from explore.model.quantities import FloatArray, Formula, Parameter
from explore.model.target_kinds import BODY_POSE, TargetKind
from explore.model.targets import PosesTarget

_DEGREES = 180.0 / np.pi
_ABOUT = {
    "position_error_max": ("mm", "largest distance of {} from its places at the poses", PLACE, PLACE_ROUNDING),
    "angle_error_max": ("deg", "largest error of the body's angle at the poses", TURNED, TURNED_ROUNDING),
    "pose_error_rms": (
        "mm",
        "rms of the distances of {} and of the errors of the angle at the lever",
        RMS,
        RMS_ROUNDING,
    ),
}
#: Metric that exists only where the poses have an order.
_ABOUT_SPAN = {"pose_crank_span": ("deg", "turn of the crank from the first to the last pose", SPAN, SPAN_ROUNDING)}


@keep_last
def measure_posed(motion: Motion, target: PosesTarget, table: FloatArray) -> Measures:
    """Measures, shape (n, N_MEASURES), and crank angles of designs: inputs of the motion, then poses."""
    designs = np.hstack(shapes_and_rest(motion, table))
    found = np.empty((len(designs), N_MEASURES)), np.empty((len(designs), len(target.poses)))
    functions, in_order = (motion.function(), motion.function_of_rows()), target.order == "given"
    measure_poses(*functions, designs, _poses(target), target.length, in_order, *found)
    return found


@lru_cache(maxsize=8)
def _poses(target: PosesTarget) -> FloatArray:
    """Places and angles, mm and rad, shape (m, 3)."""
    return np.array(target.poses, dtype=np.float64) * [1.0, 1.0, 1.0 / _DEGREES]


def declare_poses(
    motion_of: Callable[[str], Motion],
    objectives: tuple[str, ...],
    pose: tuple[Parameter, ...] = BODY_POSE,
    points: tuple[str, ...] = (),
) -> TargetKind:
    """Declare that a mechanism meets poses; see `mechanisms.targets.path_errors.metrics.declare_paths`."""
    return TargetKind(PoseFormulas(motion_of), tuple(_ABOUT), objectives, pose, points)


@dataclass(frozen=True)
class PoseFormulas:
    """The metrics of poses as the target of a mechanism, from the motions of its points by their names."""

    motion_of: Callable[[str], Motion]

    def __call__(self, target: PosesTarget) -> tuple[Formula, ...]:
        """The metrics of the errors of a target."""
        motion = self.motion_of(target.point)
        inputs = (*motion.inputs, *POSE_NAMES, "body_angle")
        about = _ABOUT | (_ABOUT_SPAN if target.order == "given" else {})

        def measure(row: int, unit: str) -> TargetMeasure:
            return TargetMeasure(measure_posed, motion, target, row, _DEGREES if unit == "deg" else 1.0)

        return tuple(
            Formula(name, unit, text.format(target.point), None if row == SPAN else "min", inputs, measure(row, unit),
                    rounding=measure(rounding, unit),
                    scale=measure(SIZE, unit) if unit == "mm" else ConstantScale(360.0 if row == SPAN else _DEGREES),
                    needs_turn=motion.needs_turn)
            for name, (unit, text, row, rounding) in about.items()
        )  # fmt: skip
