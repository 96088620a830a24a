"""Velocities integrated by SciPy's adaptive solvers, as `scipy.integrate.solve_ivp` does it, design by design."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal

import numpy as np
from scipy.integrate import DOP853, RK45, Radau

from explore.methods import loop
from explore.methods.closed_form import exact_start
from explore.methods.closure import mark_open, project
from explore.methods.contract import Capability, Motion, Outcome, Task
from explore.vocabulary import FloatArray

_SOLVERS: dict[str, Any] = {"RK45": RK45, "DOP853": DOP853, "Radau": Radau}
#: Absolute tolerance by relative tolerance: that of SciPy's defaults, 1e-6 and 1e-3. Left at 1e-6, as users leave it,
#: it would hide all finer relative tolerances from angles of about 1.
_ATOL_BY_RTOL = 1e-3


@dataclass(frozen=True)
class VelocityIntegration:
    """The velocity equations with steps chosen by the solver, angles at the task's crank angles by its interpolation.

    Parameters
    ----------
    solver
        Runge-Kutta 5(4) of Dormand and Prince, 8(5,3) of the same, or the implicit Radau IIA of order 5.
    rtol
        Relative tolerance; the absolute one is a thousandth of it, so that 1e-3 means SciPy's defaults.
    projected
        Whether Newton's corrections close the loop after each accepted step and at each crank angle of the task. Two
        equations fix two angles, so the errors are then those of rounding at any tolerance: the integrator only
        guesses for Newton, and the tolerance buys no more than the branch.
    max_steps
        Gives up after so many: at a toggle the steps become ever smaller, and 2500 take 0.2 s to 2 s.
    gap_tolerance
        Widest gap in the loop that still counts as ok, in longest links; who integrates by hand has no such check.
        SciPy's default tolerances leave gaps of 0.015 on benign linkages, so only what is beyond dispute is refused.
    """

    solver: Literal["RK45", "DOP853", "Radau"] = field(repr=False)
    rtol: float = 1e-6
    projected: bool = field(default=False, repr=False)
    max_steps: int = field(default=2500, repr=False)
    gap_tolerance: float = field(default=1e-1, repr=False)
    capabilities: ClassVar[Capability] = Capability.CHECKS_BRANCH

    @property
    def name(self) -> str:
        """The key in the list of methods."""
        return self.solver.lower() + ("-projected" if self.projected else "")

    @property
    def summary(self) -> str:
        """What it is, in a line."""
        closing = ", the loop closed again after each step" if self.projected else ""
        return f"velocities integrated by SciPy's {self.solver} with steps of its choice{closing}"

    def solve(self, task: Task) -> Motion:
        """Integrate each design from its first crank angle to its last."""
        motion = Motion.blank(task)
        start, found = exact_start(task), np.full((2, *task.crank_angle.shape), np.nan)
        for i in range(len(task)):
            equations = LoopEquations(task.lengths[i])
            if not all(np.isfinite(values).all() for values in (task.lengths[i], task.crank_angle[i], start[i])):
                motion.outcome[i] = Outcome.NOT_FINITE
                continue
            try:
                with np.errstate(divide="raise", over="raise", invalid="raise"):
                    motion.outcome[i] = self._integrate(equations, task.crank_angle[i], start[i], found[:, i])
            except ArithmeticError:
                motion.outcome[i] = Outcome.NOT_FINITE
            motion.evaluations[i], motion.iterations[i] = equations.evaluations, equations.steps
        loop.fill_rates(motion.signals, task.lengths.T[:, :, None], task.crank_angle, *found)
        mark_open(task, motion, self.gap_tolerance)
        return motion

    def _integrate(self, equations: LoopEquations, crank: FloatArray, start: FloatArray, found: FloatArray) -> Outcome:
        """One design: fill its angles ``found[2, t]`` as far as the solver comes."""
        if self.projected:
            start = equations.close(crank[0], start)
        solver = _SOLVERS[self.solver](
            equations.rates, crank[0], start, crank[-1], rtol=self.rtol, atol=_ATOL_BY_RTOL * self.rtol
        )
        done = int(np.searchsorted(crank, crank[0], side="right"))
        found[:, :done] = start[:, None]
        while solver.t < crank[-1]:
            solver.step()
            if solver.status == "failed" or equations.steps == self.max_steps:
                return Outcome.GAVE_UP
            equations.steps += 1
            reached = int(np.searchsorted(crank, solver.t, side="right"))
            if reached > done:
                between = solver.dense_output()(crank[done:reached])
                found[:, done:reached] = equations.close(crank[done:reached], between) if self.projected else between
            if self.projected:
                solver.y = equations.close(solver.t, solver.y)
                solver.f = np.array(equations.rates(solver.t, solver.y))  # all three begin the next step with it
            done = reached
        return Outcome.OK


class LoopEquations:
    """The equations of one linkage for the solvers, in plain floats, and how much work they were."""

    def __init__(self, lengths: FloatArray) -> None:
        self.lengths = lengths
        self.crank, self.coupler, self.rocker, _ = lengths.tolist()
        self.evaluations = self.steps = 0

    def rates(self, crank: float, angles: FloatArray) -> tuple[float, float]:
        """`loop.velocities`, twenty times faster for one pair of angles; ArithmeticError where not finite."""
        self.evaluations += 1
        coupler, rocker = angles.tolist()
        across = math.sin(coupler - rocker)
        w2 = self.crank * math.sin(rocker - crank) / (self.coupler * across)
        w3 = self.crank * math.sin(coupler - crank) / (self.rocker * across)
        if not math.isfinite(w2 + w3):
            raise FloatingPointError("the rates are not finite")
        return w2, w3

    def close(self, crank: float | FloatArray, angles: FloatArray) -> FloatArray:
        """Angles, first axis 2, put back onto the closed loop."""
        lengths = self.lengths.reshape(4, *[1] * (angles.ndim - 1))
        angles, corrections = project(lengths, np.asarray(crank), angles)
        self.evaluations += int(corrections.sum())
        return angles
