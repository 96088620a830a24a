"""Newton's method of `explore.methods.newton`, compiled: the same iteration, one linkage after the other."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from explore.compiling import compiled
from explore.methods.closed_form import initial_guess
from explore.methods.contract import Capability, Motion, Outcome, Task
from explore.subroutines import subroutine

_OK, _NOT_CONVERGED, _WRONG_BRANCH = int(Outcome.OK), int(Outcome.NOT_CONVERGED), int(Outcome.WRONG_BRANCH)


@dataclass(frozen=True)
class CompiledNewton:
    """The iteration of `Newton` compiled by Numba; sines and cosines of the last residual also give the rates.

    The difference in time to `Newton` is mostly that of the language, the difference to the closed form that of the
    method.

    Attributes
    ----------
    tolerance
        Largest gap of a closed loop, relative to the longest link.
    max_iterations
        Most corrections at one crank angle.
    """

    tolerance: float = 1e-12
    max_iterations: int = field(default=20, repr=False)
    name: ClassVar[str] = "newton-compiled"
    summary: ClassVar[str] = "Newton's method from angle to angle, compiled"
    capabilities: ClassVar[Capability] = Capability.BATCHED | Capability.FOLLOWS_ANGLES | Capability.CHECKS_BRANCH

    def solve(self, task: Task) -> Motion:
        """Solve angle by angle; a design that fails keeps its signals before the crank angle of the failure.

        Evaluations are those of residuals and corrections; the rates, once per angle, are not counted.
        """
        motion = Motion.blank(task)
        _solve_all(
            np.array(task.lengths, order="C"),
            np.array(task.branch),
            np.array(task.crank_angle, order="C"),
            np.array(initial_guess(task), order="C"),
            self.tolerance,
            self.max_iterations,
            motion.signals,
            motion.outcome,
            motion.evaluations,
            motion.iterations,
        )
        is_ok = motion.outcome == Outcome.OK
        motion.outcome[is_ok & ~np.isfinite(motion.signals).all(axis=(0, 2))] = Outcome.NOT_FINITE
        not_converged = motion.outcome == Outcome.NOT_CONVERGED
        motion.outcome[not_converged & ~np.isfinite(task.lengths).all(axis=1)] = Outcome.NOT_FINITE
        return motion


# compiled for the types of the first call, which only a comparison makes
@compiled()
def _solve_all(
    lengths, branch, crank_angle, start, tolerance, max_iterations, signals, outcome, evaluations, iterations
):
    """Follow each linkage from angle to angle until it fails."""
    for i in range(lengths.shape[0]):
        r1, r2, r3, r4 = lengths[i, 0], lengths[i, 1], lengths[i, 2], lengths[i, 3]
        max_gap = tolerance * max(r1, r2, r3, r4)
        coupler, rocker = start[i, 0], start[i, 1]
        for j in range(crank_angle.shape[1]):
            px, py = r1 * math.cos(crank_angle[i, j]), r1 * math.sin(crank_angle[i, j])
            coupler, rocker, ux, uy, vx, vy, corrections, is_closed = _close_loop(
                px, py, r2, r3, r4, coupler, rocker, max_gap, max_iterations
            )
            iterations[i] += corrections
            evaluations[i] += 2 * corrections + 1
            if not is_closed:
                outcome[i] = _NOT_CONVERGED
            elif (uy * vx - ux * vy) * branch[i] > 0.0:
                outcome[i] = _WRONG_BRANCH
            if outcome[i] != _OK:
                break
            signals[0, i, j], signals[1, i, j] = coupler, rocker
            _fill_rates(signals[2:, i, j], px, py, ux, uy, vx, vy)


@subroutine()
def _close_loop(px, py, r2, r3, r4, coupler, rocker, max_gap, max_iterations):
    """Correct both angles until the gap is small enough.

    Returns the angles, the vectors u of the coupler and v of the rocker, the number of corrections, and whether the
    loop is closed.
    """
    corrections = 0
    while True:
        ux, uy = r2 * math.cos(coupler), r2 * math.sin(coupler)
        vx, vy = r3 * math.cos(rocker), r3 * math.sin(rocker)
        x, y = px + ux - r4 - vx, py + uy - vy
        is_closed = math.hypot(x, y) <= max_gap  # false for NaN
        if is_closed or corrections == max_iterations:
            return coupler, rocker, ux, uy, vx, vy, corrections, is_closed
        determinant = uy * vx - ux * vy
        coupler += (vx * x + vy * y) / determinant
        rocker += (ux * x + uy * y) / determinant
        corrections += 1


@subroutine()
def _fill_rates(rates, px, py, ux, uy, vx, vy):
    """Fill none, the velocities, or velocities and accelerations, from the vectors of crank, coupler and rocker.

    These are the quotients of `explore.methods.vector_loop` with products of lengths and sines as cross products.
    """
    determinant = uy * vx - ux * vy
    if len(rates) > 0:
        rates[0], rates[1] = (px * vy - py * vx) / determinant, (px * uy - py * ux) / determinant
    if len(rates) > 2:
        qx = px + rates[0] ** 2 * ux - rates[1] ** 2 * vx
        qy = py + rates[0] ** 2 * uy - rates[1] ** 2 * vy
        rates[2], rates[3] = -(qx * vx + qy * vy) / determinant, -(qx * ux + qy * uy) / determinant
