"""The closed form of `explore.mechanisms.four_bar`, in which no large terms cancel, as a method."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from explore.mechanisms import four_bar
from explore.methods.contract import Capability, Level, Motion, Outcome, Task
from explore.methods.geometry import geometric_outcome
from explore.methods.kernels import solve_all
from explore.model.quantities import FloatArray

_NEEDS = {
    Level.POSITIONS: four_bar.ANGLES,
    Level.VELOCITIES: four_bar.ANGLES | four_bar.VELOCITIES,
    Level.ACCELERATIONS: four_bar.ANGLES | four_bar.ACCELERATIONS,
}
#: Rows of the kernel's scratch array, in the order of `Motion.signals`.
KERNEL_ROWS = np.array([
    four_bar.COUPLER_ANGLE, four_bar.ROCKER_ANGLE, four_bar.COUPLER_VELOCITY, four_bar.ROCKER_VELOCITY,
    four_bar.COUPLER_ACCELERATION, four_bar.ROCKER_ACCELERATION,
])  # fmt: skip


@dataclass(frozen=True)
class ClosedForm:
    """The compiled kernel of `explore.mechanisms.four_bar`: exactly rounded sums of lengths, no cancelling sums."""

    name: ClassVar[str] = "closed-form"
    summary: ClassVar[str] = "closed form without cancellation, compiled, as in a sweep"
    capabilities: ClassVar[Capability] = Capability.BATCHED | Capability.ANY_ANGLE | Capability.CHECKS_BRANCH

    def solve(self, task: Task) -> Motion:
        """Solve every crank angle independently."""
        motion = Motion.blank(task)
        # the compiled signature needs contiguous, writable arrays
        half = 0.5 * np.ascontiguousarray(task.crank_angle)
        lengths, branch = np.array(task.lengths, order="C"), np.array(task.branch)
        solve_all(lengths, branch, np.sin(half), np.cos(half), _NEEDS[task.level], KERNEL_ROWS, motion.signals)
        motion.evaluations[:] = task.crank_angle.shape[1]
        motion.outcome[:] = geometric_outcome(task.lengths)
        has_nan = ~np.isfinite(motion.signals).all(axis=(0, 2))
        motion.outcome[has_nan & (motion.outcome == Outcome.OK)] = Outcome.NOT_FINITE
        return motion


def start_angles(task: Task) -> FloatArray:
    """Coupler and rocker angle at the first crank angle, shape (n, 2): `Task.start`, or the exact angles without it."""
    if task.start is not None:
        return task.start
    first = Task(task.lengths, task.branch, task.crank_angle[:, :1], Level.POSITIONS)
    return ClosedForm().solve(first).signals[:, :, 0].T


def initial_guess(task: Task) -> FloatArray:
    """Start angles for an iteration, shape (n, 2); the rocker at a right angle where the linkage does not close."""
    start, right_angle = start_angles(task), np.stack([0.0 * task.branch, 0.5 * np.pi * task.branch], axis=1)
    return np.where(np.isfinite(start), start, right_angle)
