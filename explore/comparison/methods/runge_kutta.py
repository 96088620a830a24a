"""Integration of the velocities by the classical fourth-order Runge-Kutta method with fixed steps.

Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, section II.1, table 1.2.
"""

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from explore.comparison.methods.closed_form import start_values
from explore.comparison.methods.contract import Capability, Motion, Task
from explore.comparison.methods.elimination import solve
from explore.comparison.methods.loop_closure import mark_failures, project_onto_loop
from explore.model.quantities import FloatArray

#: Excess over a whole number of steps, from rounding of the angles, that needs no further step.
_STEP_ROUNDING = 1e-9


@dataclass(frozen=True)
class RungeKutta4:
    """Integration of the velocity equations in equal steps between the crank angles of the task.

    Parameters
    ----------
    steps
        Fewest per turn; every crank angle of the task ends a step, so that there may be more.
    projected
        Whether Newton's corrections close the loop after each step; otherwise a gap at the start stays constant. These
        determine the unknowns, so errors are then those of rounding.
    gap_tolerance
        Largest gap of a closed loop, relative to the longest link. It is wide because SciPy's default tolerances
        leave gaps of 0.015 even far from the change point.
    """

    steps: int = 360
    projected: bool = field(default=False, repr=False)
    gap_tolerance: float = field(default=1e-1, repr=False)
    capabilities: ClassVar[Capability] = Capability.BATCHED | Capability.CHECKS_BRANCH

    @property
    def name(self) -> str:
        """Key in the registry."""
        return "rk4-projected" if self.projected else "rk4"

    def solve(self, task: Task) -> Motion:
        """Integrate all designs together from the first crank angle to the last, each with its own step."""
        motion, loop, crank = Motion.blank(task), task.loop, np.ascontiguousarray(task.crank_angle.T)
        unknowns = np.ascontiguousarray(start_values(task).T)
        solutions = np.empty((loop.count, *task.crank_angle.shape))
        with np.errstate(all="ignore"):  # values that are not finite become an outcome
            if self.projected:
                unknowns, corrections = project_onto_loop(loop, task.columns, crank[0], unknowns)
                motion.evaluations[:] += corrections
            solutions[:, :, 0] = unknowns
            for j in range(1, len(crank)):
                unknowns = self._advance(task, crank[j - 1 : j + 1], unknowns, motion)
                solutions[:, :, j] = unknowns
        loop.fill_signals(motion.signals, task.upright, task.crank_angle, solutions)
        mark_failures(task, motion, self.gap_tolerance)
        return motion

    def _advance(self, task: Task, crank: FloatArray, unknowns: FloatArray, motion: Motion) -> FloatArray:
        """Integrate from one crank angle of each design to its next, both in `crank`, shape (2, n)."""
        here, there = crank
        least = np.ceil((there - here) * (self.steps / (2.0 * np.pi)) - _STEP_ROUNDING)
        steps: npt.NDArray[np.int64] = np.where(least > 1.0, least, 1.0).astype(np.int64)
        step = (there - here) / steps
        motion.iterations[:] += steps
        motion.evaluations[:] += 4 * steps
        for k in range(int(steps.max(initial=0))):
            advanced = _step(task, here + k * step, unknowns, step)
            if self.projected:
                end = here + (k + 1) * step
                advanced, corrections = project_onto_loop(task.loop, task.columns, end, advanced)
                motion.evaluations[:] += np.where(k < steps, corrections, 0)
            unknowns = np.where(k < steps, advanced, unknowns)
        return unknowns


def _step(task: Task, crank: FloatArray, unknowns: FloatArray, step: FloatArray) -> FloatArray:
    half = 0.5 * step
    k1 = _rates(task, crank, unknowns)
    k2 = _rates(task, crank + half, unknowns + half * k1)
    k3 = _rates(task, crank + half, unknowns + half * k2)
    k4 = _rates(task, crank + step, unknowns + step * k3)
    return np.asarray(unknowns + step / 6.0 * (k1 + 2.0 * (k2 + k3) + k4))


def _rates(task: Task, crank: FloatArray, unknowns: FloatArray) -> FloatArray:
    given = task.loop.given(task.columns, crank, np)
    about = task.loop.linearise(task.numbers, crank, unknowns, given)
    return np.stack(solve(about.columns, about.rate_terms(given))[0])
