"""Integration of the velocities by the classical fourth-order Runge-Kutta method with fixed steps.

Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, section II.1, table 1.2.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from explore.methods import vector_loop
from explore.methods.closed_form import start_angles
from explore.methods.contract import Capability, Motion, Task
from explore.methods.loop_closure import mark_failures, project_onto_loop
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
        Whether Newton's corrections close the loop after each step; otherwise a gap at the start stays constant. The
        two loop equations determine both angles, so errors are then those of rounding.
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

    @property
    def summary(self) -> str:
        """Description in one line."""
        closing = ", with the loop closed after each" if self.projected else ""
        return f"integration of the velocities by the classical Runge-Kutta method in fixed steps{closing}"

    def solve(self, task: Task) -> Motion:
        """Integrate all designs together from the first crank angle to the last, each with its own step."""
        motion = Motion.blank(task)
        lengths, crank = np.ascontiguousarray(task.lengths.T), np.ascontiguousarray(task.crank_angle.T)
        angles = np.ascontiguousarray(start_angles(task).T)
        solutions = np.empty((2, *task.crank_angle.shape))
        with np.errstate(all="ignore"):  # values that are not finite become an outcome
            if self.projected:
                angles, corrections = project_onto_loop(lengths, crank[0], angles)
                motion.evaluations[:] += corrections
            solutions[:, :, 0] = angles
            for j in range(1, len(crank)):
                angles = self._advance(lengths, crank[j - 1], crank[j], angles, motion)
                solutions[:, :, j] = angles
        vector_loop.fill_signals(motion.signals, lengths[:, :, None], task.crank_angle, *solutions)
        mark_failures(task, motion, self.gap_tolerance)
        return motion

    def _advance(
        self, lengths: FloatArray, here: FloatArray, there: FloatArray, angles: FloatArray, motion: Motion
    ) -> FloatArray:
        """Integrate from one crank angle of each design to its next."""
        least = np.ceil((there - here) * (self.steps / (2.0 * np.pi)) - _STEP_ROUNDING)
        steps: npt.NDArray[np.int64] = np.where(least > 1.0, least, 1.0).astype(np.int64)
        step = (there - here) / steps
        motion.iterations[:] += steps
        motion.evaluations[:] += 4 * steps
        for k in range(int(steps.max(initial=0))):
            advanced = _step(lengths, here + k * step, angles, step)
            if self.projected:
                advanced, corrections = project_onto_loop(lengths, here + (k + 1) * step, advanced)
                motion.evaluations[:] += np.where(k < steps, corrections, 0)
            angles = np.where(k < steps, advanced, angles)
        return angles


def _step(lengths: FloatArray, crank: FloatArray, angles: FloatArray, step: FloatArray) -> FloatArray:
    half = 0.5 * step
    k1 = vector_loop.velocities(lengths, crank, *angles)
    k2 = vector_loop.velocities(lengths, crank + half, *(angles + half * k1))
    k3 = vector_loop.velocities(lengths, crank + half, *(angles + half * k2))
    k4 = vector_loop.velocities(lengths, crank + step, *(angles + step * k3))
    return np.asarray(angles + step / 6.0 * (k1 + 2.0 * (k2 + k3) + k4))
