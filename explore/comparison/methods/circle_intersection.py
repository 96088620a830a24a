"""The intersection of two circles by Heron's formula, in NumPy."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from explore.comparison.methods.contract import Capability, Motion, Outcome, Task
from explore.model.quantities import FloatArray


@dataclass(frozen=True)
class CircleIntersection:
    """The coupler joint as intersection of the circles of coupler and rocker, rates as quotients of dot products.

    What a careful user of NumPy writes: Heron's formula in factors, and no trigonometric function but those of the
    crank and two arctangents. Near the change point a factor is the small difference of a rounded diagonal and links.
    """

    name: ClassVar[str] = "circles"
    summary: ClassVar[str] = "intersection of two circles by Heron's formula in factors, in NumPy"
    capabilities: ClassVar[Capability] = Capability.BATCHED | Capability.ANY_ANGLE | Capability.FOUR_BAR_ONLY

    def solve(self, task: Task) -> Motion:
        """Solve every crank angle independently; NOT_FINITE where the circles do not meet or touch."""
        motion = Motion.blank(task)
        r1, r2, r3, r4 = task.parameters.T[:, :, None]
        with np.errstate(all="ignore"):  # values that are not finite become an outcome
            pin = r1 * np.stack([np.cos(task.crank_angle), np.sin(task.crank_angle)])
            dx, dy = r4 - pin[0], -pin[1]
            square = dx * dx + dy * dy
            diagonal = np.sqrt(square)
            factors = (r2 + r3 + diagonal) * (r2 + r3 - diagonal) * (diagonal + r2 - r3) * (diagonal - r2 + r3)
            twice_area = 0.5 * task.branch[:, None] * np.sqrt(factors)
            along, across = 0.5 + 0.5 * (r2 - r3) * (r2 + r3) / square, twice_area / square
            coupler = np.stack([along * dx - across * dy, along * dy + across * dx])
            _fill_signals(motion.signals, pin, coupler, coupler - np.stack([dx, dy]), twice_area)
        motion.evaluations[:] = task.crank_angle.shape[1]
        motion.outcome[~np.isfinite(motion.signals).all(axis=(0, 2))] = Outcome.NOT_FINITE
        return motion


def _fill_signals(
    signals: FloatArray, pin: FloatArray, coupler: FloatArray, rocker: FloatArray, twice_area: FloatArray
) -> None:
    """Fill ``signals[2 level, n, t]`` from the vectors of crank, coupler and rocker, each of shape (2, n, t).

    Crank plus coupler minus rocker is the constant ground: the product of a derivative of this sum with the vector of
    one link gives the rate of the other.
    """
    signals[0], signals[1] = np.arctan2(coupler[1], coupler[0]), np.arctan2(rocker[1], rocker[0])
    if len(signals) > 2:
        signals[2], signals[3] = _cross(rocker, pin) / twice_area, _cross(coupler, pin) / twice_area
    if len(signals) > 4:
        inward = pin + signals[2] ** 2 * coupler - signals[3] ** 2 * rocker
        signals[4], signals[5] = _dot(inward, rocker) / twice_area, _dot(inward, coupler) / twice_area


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(a[0] * b[0] + a[1] * b[1])


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(a[0] * b[1] - a[1] * b[0])
