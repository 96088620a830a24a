"""The package's own way: the closed form in which no large terms cancel."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from explore.compiling import compiled
from explore.mechanisms import four_bar
from explore.methods.contract import Capability, Level, Motion, Outcome, Task
from explore.methods.geometry import geometric_outcome
from explore.vocabulary import FloatArray

_NEEDS = {
    Level.POSITIONS: four_bar.ANGLES,
    Level.VELOCITIES: four_bar.ANGLES | four_bar.VELOCITIES,
    Level.ACCELERATIONS: four_bar.ANGLES | four_bar.ACCELERATIONS,
}
#: Rows of the kernel's scratch array, in the order of `Motion.signals`.
_ROWS = np.array([
    four_bar.COUPLER_ANGLE, four_bar.ROCKER_ANGLE, four_bar.COUPLER_VELOCITY, four_bar.ROCKER_VELOCITY,
    four_bar.COUPLER_ACCELERATION, four_bar.ROCKER_ACCELERATION,
])  # fmt: skip


@compiled(
    "void(float64[:, ::1], float64[::1], float64[:, ::1], float64[:, ::1], int64, int64[::1], float64[:, :, ::1])",
    allocates=True,
)
def _solve(lengths, branch, sine, cosine, needs, rows, signals):
    row, out = np.empty(four_bar.FOUR_BAR_SIZE), np.empty((four_bar.SIGNAL_ROWS, sine.shape[1]))
    for i in range(lengths.shape[0]):
        four_bar.prepare(lengths[i, 0], lengths[i, 1], lengths[i, 2], lengths[i, 3], branch[i], row)
        four_bar.fill(row, sine[i], cosine[i], sine.shape[1], needs, out)
        for k in range(signals.shape[0]):
            signals[k, i] = out[rows[k]]


@dataclass(frozen=True)
class ClosedForm:
    """`explore.mechanisms.four_bar`: exactly rounded sums of lengths, sums of non-negative terms, compiled."""

    name: ClassVar[str] = "closed-form"
    summary: ClassVar[str] = "closed form without cancellation, compiled: what a sweep uses"
    capabilities: ClassVar[Capability] = Capability.BATCHED | Capability.ANY_ANGLE | Capability.CHECKS_BRANCH

    def solve(self, task: Task) -> Motion:
        """Solve each crank angle for itself."""
        motion = Motion.blank(task)
        # contiguous and writable, as compiled for
        half = 0.5 * np.ascontiguousarray(task.crank_angle)
        lengths, branch = np.array(task.lengths, order="C"), np.array(task.branch)
        _solve(lengths, branch, np.sin(half), np.cos(half), _NEEDS[task.level], _ROWS, motion.signals)
        motion.evaluations[:] = task.crank_angle.shape[1]
        motion.outcome[:] = geometric_outcome(task.lengths)
        lost = ~np.isfinite(motion.signals).all(axis=(0, 2))
        motion.outcome[lost & (motion.outcome == Outcome.OK)] = Outcome.NOT_FINITE
        return motion


def exact_start(task: Task) -> FloatArray:
    """Coupler and rocker angle at the first crank angle, shape (n, 2): those given, or the exact ones."""
    if task.start is not None:
        return task.start
    first = Task(task.lengths, task.branch, task.crank_angle[:, :1], Level.POSITIONS)
    return ClosedForm().solve(first).signals[:, :, 0].T


def first_guess(task: Task) -> FloatArray:
    """The exact start for iterations, shape (n, 2); a right angle where there is none to try."""
    start, right_angle = exact_start(task), np.stack([0.0 * task.branch, 0.5 * np.pi * task.branch], axis=1)
    return np.where(np.isfinite(start), start, right_angle)
