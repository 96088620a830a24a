"""How mechanisms meet targets: the metrics of each kind, and the parameters of a pose in the plane of a target."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from explore.model.drawing import PLACE
from explore.model.quantities import Formula, Parameter

_MEANINGS = (
    ("mm", "x of the crank's pivot in the plane of the target"),
    ("mm", "y of the crank's pivot in the plane of the target"),
    ("deg", "angle of the linkage's own x axis in the plane of the target"),
)
#: Parameters of the linkage's pose in the plane of the target: designs that differ only in them share a motion.
POSE = tuple(
    Parameter(name, unit, meaning, 0.0, -float("inf"), affects="target")
    for name, (unit, meaning) in zip(PLACE, _MEANINGS, strict=True)
)
#: Parameters of `POSE`, and the angle of the body of poses from the link that carries it.
BODY_POSE = (
    *POSE,
    Parameter("body_angle", "deg", "angle of the body from the link that carries it", 0.0, -float("inf"),
              affects="target"),
)  # fmt: skip
#: Parameters of the start of a function: designs that differ only in them share a motion.
STARTS = tuple(
    Parameter(name, "deg", f"{side} angle at the start of the function, from the ground", 0.0, -float("inf"),
              affects="target")
    for name, side in (("input_start", "input"), ("output_start", "output"))
)  # fmt: skip


@dataclass(frozen=True)
class TargetKind:
    """How a mechanism meets targets of a kind.

    Attributes
    ----------
    formulas
        The metrics of the error of a target of the kind.
    defaults
        Names of those that a study computes which names no metrics.
    objectives
        Default objectives.
    parameters
        Those that a target of the kind adds: designs that differ only in them share a motion.
    alternatives
        Metrics among the defaults and objectives of which a target has one.
    points
        Names of the points that can meet a target of the kind; empty for those that a study names.
    """

    formulas: Callable[[Any], tuple[Formula, ...]]
    defaults: tuple[str, ...]
    objectives: tuple[str, ...]
    parameters: tuple[Parameter, ...] = POSE
    points: tuple[str, ...] = ()
    alternatives: tuple[str, ...] = ()
