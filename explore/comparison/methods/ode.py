"""Integration of the velocities by SciPy's adaptive solvers, design by design."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal

import numpy as np
from scipy.integrate import DOP853, RK45, Radau

from explore.comparison.methods.closed_form import start_values
from explore.comparison.methods.contract import Capability, Motion, Outcome, Task
from explore.comparison.methods.loop_closure import mark_failures, project_onto_loop
from explore.comparison.methods.vector_loop import VectorLoop
from explore.model.quantities import FloatArray

#: Names of the solvers.
AdaptiveSolver = Literal["RK45", "DOP853", "Radau"]
#: Solvers of SciPy by name.
_SOLVERS: dict[AdaptiveSolver, Any] = {"RK45": RK45, "DOP853": DOP853, "Radau": Radau}
#: Absolute over relative tolerance, as SciPy's defaults; a constant one of 1e-6 would dominate finer ones.
_ATOL_BY_RTOL = 1e-3


@dataclass(frozen=True)
class VelocityIntegration:
    """Adaptive integration of the velocity equations; angles between the steps come from the solver's interpolation.

    Parameters
    ----------
    solver
        Runge-Kutta 5(4) or 8(5,3) of Dormand and Prince, or the implicit Radau IIA of order 5.
    rtol
        Relative tolerance; the absolute tolerance is a thousandth of it, so that 1e-3 gives SciPy's defaults.
    projected
        Whether Newton's corrections close the loop after each step and at each crank angle of the task. The two loop
        equations determine both angles, so errors are then those of rounding at any tolerance, and the integrator only
        provides the initial guess.
    max_steps
        Most steps before the outcome GAVE_UP: near a toggle position the steps shrink, and 2500 take 0.2 s to 2 s.
    gap_tolerance
        Largest gap of a closed loop, relative to the longest link. It is wide because SciPy's default tolerances
        leave gaps of 0.015 even far from the change point.
    """

    solver: AdaptiveSolver = field(repr=False)
    rtol: float = 1e-6
    projected: bool = field(default=False, repr=False)
    max_steps: int = field(default=2500, repr=False)
    gap_tolerance: float = field(default=1e-1, repr=False)
    capabilities: ClassVar[Capability] = Capability.CHECKS_BRANCH

    @property
    def name(self) -> str:
        """Key in the registry."""
        return self.solver.lower() + ("-projected" if self.projected else "")

    @property
    def summary(self) -> str:
        """Description in one line."""
        closing = ", with the loop closed after each step" if self.projected else ""
        return f"integration of the velocities by SciPy's {self.solver} with adaptive steps{closing}"

    def solve(self, task: Task) -> Motion:
        """Integrate each design from its first crank angle to its last."""
        motion = Motion.blank(task)
        start, unknowns = start_values(task), np.full((2, *task.crank_angle.shape), np.nan)
        for i in range(len(task)):
            equations = LoopEquations(task.loop, task.parameters[i])
            if not all(np.isfinite(values).all() for values in (task.parameters[i], task.crank_angle[i], start[i])):
                motion.outcome[i] = Outcome.NOT_FINITE
                continue
            try:
                with np.errstate(divide="raise", over="raise", invalid="raise"):
                    motion.outcome[i] = self._integrate(equations, task.crank_angle[i], start[i], unknowns[:, i])
            except ArithmeticError:
                motion.outcome[i] = Outcome.NOT_FINITE
            motion.evaluations[i], motion.iterations[i] = equations.evaluations, equations.steps
        task.loop.fill_signals(motion.signals, task.parameters.T[:, :, None], task.crank_angle, *unknowns)
        mark_failures(task, motion, self.gap_tolerance)
        return motion

    def _integrate(
        self, equations: LoopEquations, crank: FloatArray, start: FloatArray, unknowns: FloatArray
    ) -> Outcome:
        """Integrate one design and fill its ``unknowns[2, t]`` up to where the solver stops."""
        if self.projected:
            start = equations.project(crank[0], start)
        solver = _SOLVERS[self.solver](
            equations.rates, crank[0], start, crank[-1], rtol=self.rtol,
            atol=_ATOL_BY_RTOL * self.rtol * equations.scales,
        )  # fmt: skip
        filled = int(np.searchsorted(crank, crank[0], side="right"))
        unknowns[:, :filled] = start[:, None]
        while solver.t < crank[-1]:
            solver.step()
            if solver.status == "failed" or equations.steps == self.max_steps:
                return Outcome.GAVE_UP
            equations.steps += 1
            reached = int(np.searchsorted(crank, solver.t, side="right"))
            if reached > filled:
                interpolated = solver.dense_output()(crank[filled:reached])
                unknowns[:, filled:reached] = (
                    equations.project(crank[filled:reached], interpolated) if self.projected else interpolated
                )
            if self.projected:
                solver.y = equations.project(solver.t, solver.y)
                solver.f = np.array(
                    equations.rates(solver.t, solver.y)
                )  # the first stage of the next step in all three solvers
            filled = reached
        return Outcome.OK


class LoopEquations:
    """Velocity equations of one design in Python floats, with counters of evaluations and steps."""

    def __init__(self, loop: VectorLoop, parameters: FloatArray) -> None:
        self.loop, self.parameters, self.scales = loop, parameters, loop.scales(parameters)
        self._floats = parameters.tolist()
        self.evaluations = self.steps = 0

    def rates(self, crank: float, unknowns: FloatArray) -> tuple[float, float]:
        """`VectorLoop.rates` of one pair of unknowns; ArithmeticError if not finite."""
        self.evaluations += 1
        x, y = unknowns.tolist()
        first, second = self.loop.rates(self._floats, crank, x, y, math)
        if not math.isfinite(first + second):
            raise FloatingPointError("the rates are not finite")
        return first, second

    def project(self, crank: float | FloatArray, unknowns: FloatArray) -> FloatArray:
        """Project both unknowns, first axis 2, onto the closed loop."""
        parameters = self.parameters.reshape(-1, *[1] * (unknowns.ndim - 1))
        unknowns, corrections = project_onto_loop(self.loop, parameters, np.asarray(crank), unknowns)
        self.evaluations += int(corrections.sum())
        return unknowns
