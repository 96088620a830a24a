"""Velocities integrated with a fixed step by the classical fourth-order Runge-Kutta method, all designs at once.

Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, section II.1, table 1.2.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from explore.methods import loop
from explore.methods.closed_form import exact_start
from explore.methods.closure import mark_open, project
from explore.methods.contract import Capability, Motion, Task
from explore.vocabulary import FloatArray

#: Angles that a rounding error makes longer than a step do not ask for one more.
_ROUNDING = 1e-9


@dataclass(frozen=True)
class RungeKutta4:
    """The velocity equations from one crank angle of the task to the next, in equal steps.

    Parameters
    ----------
    steps
        Per turn, at least: crank angles of the task end a step, so steps between close ones are shorter.
    projected
        Whether Newton's corrections close the loop after each step. A gap at the start otherwise stays for ever. Two
        equations fix two angles, so the errors are then those of rounding: the step only guesses for Newton.
    gap_tolerance
        Widest gap in the loop that still counts as ok, in longest links; who integrates by hand has no such check.
        SciPy's default tolerances leave gaps of 0.015 on benign linkages, so only what is beyond dispute is refused.
    """

    steps: int = 360
    projected: bool = field(default=False, repr=False)
    gap_tolerance: float = field(default=1e-1, repr=False)
    capabilities: ClassVar[Capability] = Capability.BATCHED | Capability.CHECKS_BRANCH

    @property
    def name(self) -> str:
        """The key in the list of methods."""
        return "rk4-projected" if self.projected else "rk4"

    @property
    def summary(self) -> str:
        """What it is, in a line."""
        closing = ", the loop closed again after each" if self.projected else ""
        return f"velocities integrated by the classical Runge-Kutta method in fixed steps{closing}"

    def solve(self, task: Task) -> Motion:
        """Integrate from the first crank angle to the last; all designs go together, each with steps of its own."""
        motion = Motion.blank(task)
        lengths, crank = np.ascontiguousarray(task.lengths.T), np.ascontiguousarray(task.crank_angle.T)
        angles = np.ascontiguousarray(exact_start(task).T)
        found = np.empty((2, *task.crank_angle.shape))
        with np.errstate(all="ignore"):  # what is not finite becomes an outcome
            if self.projected:
                angles, corrections = project(lengths, crank[0], angles)
                motion.evaluations[:] += corrections
            found[:, :, 0] = angles
            for j in range(1, len(crank)):
                angles = self._advance(lengths, crank[j - 1], crank[j], angles, motion)
                found[:, :, j] = angles
        loop.fill_rates(motion.signals, lengths[:, :, None], task.crank_angle, *found)
        mark_open(task, motion, self.gap_tolerance)
        return motion

    def _advance(
        self, lengths: FloatArray, here: FloatArray, there: FloatArray, angles: FloatArray, motion: Motion
    ) -> FloatArray:
        """From one crank angle of each design to its next."""
        wanted = np.ceil((there - here) * (self.steps / (2.0 * np.pi)) - _ROUNDING)
        steps: npt.NDArray[np.int64] = np.where(wanted > 1.0, wanted, 1.0).astype(np.int64)
        step = (there - here) / steps
        motion.iterations[:] += steps
        motion.evaluations[:] += 4 * steps
        for k in range(int(steps.max(initial=0))):
            moved = _step(lengths, here + k * step, angles, step)
            if self.projected:
                moved, corrections = project(lengths, here + (k + 1) * step, moved)
                motion.evaluations[:] += np.where(k < steps, corrections, 0)
            angles = np.where(k < steps, moved, angles)
        return angles


def _step(lengths: FloatArray, crank: FloatArray, angles: FloatArray, step: FloatArray) -> FloatArray:
    half = 0.5 * step
    k1 = loop.velocities(lengths, crank, *angles)
    k2 = loop.velocities(lengths, crank + half, *(angles + half * k1))
    k3 = loop.velocities(lengths, crank + half, *(angles + half * k2))
    k4 = loop.velocities(lengths, crank + step, *(angles + step * k3))
    return np.asarray(angles + step / 6.0 * (k1 + 2.0 * (k2 + k3) + k4))
