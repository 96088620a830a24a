"""Projection onto the closed loops, and detection of open ones, for the integrators."""

import numpy as np
import numpy.typing as npt

from explore.comparison.methods.closed_form import find_sides
from explore.comparison.methods.contract import Motion, Outcome, Task
from explore.comparison.methods.elimination import solve
from explore.comparison.methods.loop import Loop
from explore.mechanisms.loops import Columns
from explore.model.quantities import FloatArray

#: Size of a correction after which the next is below rounding, rad or over the longest link.
_LAST_CORRECTION = 1e-8
#: Largest number of corrections; from the values of an accepted step one to three suffice.
_MAX_CORRECTIONS = 6


def project_onto_loop(
    loop: Loop, columns: Columns, crank: FloatArray, unknowns: FloatArray
) -> tuple[FloatArray, npt.NDArray[np.int64]]:
    """Project the unknowns, first axis m, onto the closed loops by Newton's corrections, and count these.

    Unknowns are meaningless where the iteration diverges, which `mark_failures` detects.
    """
    corrections = np.zeros(unknowns.shape[1:], dtype=np.int64)
    active = np.ones(unknowns.shape[1:], dtype=bool)
    last = _LAST_CORRECTION * np.array(np.broadcast_arrays(*loop.scales(columns), crank)[:-1])
    for _ in range(_MAX_CORRECTIONS):
        about = loop.about(columns, crank, unknowns)
        step = np.stack(solve(about.columns, about.gap)[0])
        unknowns = np.where(active, unknowns - step, unknowns)
        corrections += active
        active &= ~(np.abs(step) <= last).all(axis=0)
        if not active.any():
            break
    return unknowns, corrections


def mark_failures(task: Task, motion: Motion, gap_tolerance: float) -> None:
    """Mark designs that are still OK but not finite, in another assembly, or with an open loop.

    The loop is open if its gap exceeds `gap_tolerance` times the longest link at any crank angle of the task.
    """
    with np.errstate(all="ignore"):  # values that are not finite become an outcome
        is_finite = np.isfinite(motion.signals).all(axis=(0, 2))
        about = task.loop.about(task.upright, task.crank_angle, motion.signals[: task.loop.count])
        gap = np.abs(np.stack(about.gap)).max(axis=(0, 2))
        determinant = solve(about.columns, about.gap)[1]
        is_other = (determinant * find_sides(task) < 0.0).any(axis=1)
        is_open = gap > gap_tolerance * task.size
    still_ok = motion.outcome == Outcome.OK
    motion.outcome[still_ok & is_other] = Outcome.WRONG_BRANCH
    motion.outcome[still_ok & is_open] = Outcome.OPEN_LOOP
    motion.outcome[still_ok & ~is_finite] = Outcome.NOT_FINITE
