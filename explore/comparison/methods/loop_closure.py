"""Projection onto the closed loop, and detection of open loops, for the integrators."""

import numpy as np
import numpy.typing as npt

from explore.comparison.methods.contract import Motion, Outcome, Task
from explore.comparison.methods.vector_loop import VectorLoop
from explore.model.quantities import FloatArray

#: Size of a correction after which the next is below rounding, rad or over the longest link.
_LAST_CORRECTION = 1e-8
#: Largest number of corrections; from the values of an accepted step one to three suffice.
_MAX_CORRECTIONS = 6


def project_onto_loop(
    loop: VectorLoop, parameters: FloatArray, crank: FloatArray, unknowns: FloatArray
) -> tuple[FloatArray, npt.NDArray[np.int64]]:
    """Project both unknowns, first axis 2, onto the closed loop by Newton's corrections, and count these.

    Unknowns are meaningless where the iteration diverges, which `mark_failures` detects.
    """
    corrections = np.zeros(unknowns.shape[1:], dtype=np.int64)
    active = np.ones(unknowns.shape[1:], dtype=bool)
    last = _LAST_CORRECTION * loop.scales(parameters)
    for _ in range(_MAX_CORRECTIONS):
        step = np.stack(loop.linearise(parameters, crank, *unknowns).correction())
        unknowns = np.where(active, unknowns + step, unknowns)
        corrections += active
        active &= ~(np.abs(step) <= last).all(axis=0)
        if not active.any():
            break
    return unknowns, corrections


def mark_failures(task: Task, motion: Motion, gap_tolerance: float) -> None:
    """Mark designs that are still OK but not finite, on the other branch, or with an open loop.

    The loop is open if its gap exceeds `gap_tolerance` times the longest link at any crank angle of the task.
    """
    parameters = task.parameters.T[:, :, None]
    with np.errstate(all="ignore"):  # values that are not finite become an outcome
        is_finite = np.isfinite(motion.signals).all(axis=(0, 2))
        loop = task.loop.linearise(parameters, task.crank_angle, *motion.signals[:2])
        gap = np.hypot(*loop.gap).max(axis=1)
        is_other_branch = on_other_branch(task, loop.determinant, task.crank_angle).any(axis=1)
        is_open = gap > gap_tolerance * task.loop.size(task.parameters.T)
    still_ok = motion.outcome == Outcome.OK
    motion.outcome[still_ok & is_other_branch] = Outcome.WRONG_BRANCH
    motion.outcome[still_ok & is_open] = Outcome.OPEN_LOOP
    motion.outcome[still_ok & ~is_finite] = Outcome.NOT_FINITE


def on_other_branch(task: Task, determinant: FloatArray, crank: FloatArray) -> npt.NDArray[np.bool_]:
    """Whether a determinant of the Jacobian, shape (n, t), has the sign of the other branch at crank angles (n, t)."""
    orientation = task.loop.orientation(task.parameters.T[:, :, None], crank)
    return np.asarray(determinant * orientation * task.branch[:, None] < 0.0)
