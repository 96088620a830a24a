"""The metrics of poses as a target: a mechanism gives the curve of its point, everything else is here."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from explore.mechanisms.targets.measures import FindFunction, Measures, TargetMeasure, keep_last, moving_designs
from explore.mechanisms.targets.pose_errors.measuring import N_MEASURES, PLACE, RMS, SPAN, TURNED, measure_poses
from explore.model.drawing import PLACE as POSE_NAMES
from explore.model.points import COORDINATES
from explore.model.quantities import FloatArray, Formula
from explore.model.targets import BODY_POSE, PosesTarget, TargetKind

_DEGREES = 180.0 / np.pi
_ABOUT = {
    "position_error_max": ("mm", "largest distance of {} from its places at the poses", PLACE, 1.0),
    "angle_error_max": ("deg", "largest error of the body's angle at the poses", TURNED, _DEGREES),
    "pose_error_rms": ("mm", "rms of the distances of {} and of the errors of the angle at the lever", RMS, 1.0),
}
#: Metric that exists only where the poses have an order.
_ABOUT_SPAN = {"pose_crank_span": ("deg", "turn of the crank from the first to the last pose", SPAN, _DEGREES)}


@keep_last
def measure_posed(curve: FindFunction, target: PosesTarget, table: FloatArray) -> Measures:
    """Measures, shape (n, N_MEASURES), and crank angles of designs: their shape and pose, and what `turns` is."""
    designs = moving_designs(table)
    found = np.empty((len(designs), N_MEASURES)), np.empty((len(designs), len(target.poses)))
    measure_poses(curve(), designs, _poses(target), target.length, target.order == "given", *found)
    return found


@lru_cache(maxsize=8)
def _poses(target: PosesTarget) -> FloatArray:
    """Places and angles, mm and rad, shape (m, 3)."""
    return np.array(target.poses, dtype=np.float64) * [1.0, 1.0, 1.0 / _DEGREES]


def declare_poses(curve: FindFunction, shape: tuple[str, ...], turns: str) -> TargetKind:
    """Declare that a mechanism meets poses; see `mechanisms.targets.path_errors.metrics.declare_paths`.

    The first name of the shape is the crank's.
    """
    objectives = ("position_error_max", "angle_error_max", f"{turns}:max")
    return TargetKind(PoseFormulas(curve, shape, turns), tuple(_ABOUT), objectives, BODY_POSE)


@dataclass(frozen=True)
class PoseFormulas:
    """The metrics of poses as the target of a mechanism; see `declare_poses`."""

    curve: FindFunction
    shape: tuple[str, ...]
    turns: str

    def __call__(self, target: PosesTarget) -> tuple[Formula, ...]:
        """The metrics of the errors of a target."""
        place = tuple(f"{target.point}_{coordinate}" for coordinate in COORDINATES)
        inputs = (*self.shape, *place, *POSE_NAMES, "body_angle", self.turns)
        about = _ABOUT | (_ABOUT_SPAN if target.order == "given" else {})
        return tuple(
            Formula(name, unit, text.format(target.point), None if row == SPAN else "min", inputs,
                    TargetMeasure(measure_posed, self.curve, target, row, factor))
            for name, (unit, text, row, factor) in about.items()
        )  # fmt: skip
