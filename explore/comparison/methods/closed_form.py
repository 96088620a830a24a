"""The closed form of a mechanism's kernel, in which no large terms cancel, as a method."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from explore.comparison.methods.contract import Capability, Level, Motion, Outcome, Task
from explore.comparison.methods.geometry import geometric_outcome
from explore.model.quantities import FloatArray


@dataclass(frozen=True)
class ClosedForm:
    """The compiled kernel of the mechanism: of a four-bar, exactly rounded sums of lengths, no cancelling sums."""

    name: ClassVar[str] = "closed-form"
    summary: ClassVar[str] = "closed form without cancellation, compiled, as in a sweep"
    capabilities: ClassVar[Capability] = Capability.BATCHED | Capability.ANY_ANGLE | Capability.CHECKS_BRANCH

    def solve(self, task: Task) -> Motion:
        """Solve every crank angle independently."""
        motion = Motion.blank(task)
        with np.errstate(all="ignore"):  # values that are not finite become an outcome
            task.loop.fill_closed_form(task.parameters, task.branch, task.crank_angle, motion.signals)
        motion.evaluations[:] = task.crank_angle.shape[1]
        motion.outcome[:] = geometric_outcome(task.parameters, task.loop)
        has_nan = ~np.isfinite(motion.signals).all(axis=(0, 2))
        motion.outcome[has_nan & (motion.outcome == Outcome.OK)] = Outcome.NOT_FINITE
        return motion


def start_values(task: Task) -> FloatArray:
    """Both unknowns at the first crank angle, shape (n, 2): `Task.start`, or the exact values without it."""
    if task.start is not None:
        return task.start
    first = Task(task.parameters, task.branch, task.crank_angle[:, :1], Level.POSITIONS, loop=task.loop)
    return ClosedForm().solve(first).signals[:, :, 0].T


def initial_guess(task: Task) -> FloatArray:
    """Start values for an iteration, (n, 2); where the loop does not close, its own fallback."""
    start, fallback = start_values(task), np.outer(task.branch, task.loop.fallback)
    return np.where(np.isfinite(start), start, fallback)
