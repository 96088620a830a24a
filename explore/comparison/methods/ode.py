"""Integration of the velocities by SciPy's adaptive solvers, design by design."""

from dataclasses import dataclass, field
from typing import ClassVar, Literal

import numpy as np
import scipy  # whose parts are imported on first use

from explore.comparison.methods.closed_form import start_values
from explore.comparison.methods.contract import Capability, Motion, Outcome, Task
from explore.comparison.methods.design_equations import DesignEquations
from explore.comparison.methods.loop_closure import mark_failures
from explore.model.quantities import FloatArray

#: Names of the solvers.
AdaptiveSolver = Literal["RK45", "DOP853", "Radau"]
#: Absolute over relative tolerance, as SciPy's defaults; a constant one of 1e-6 would dominate finer ones.
_ATOL_BY_RTOL = 1e-3
#: Largest number of steps before the outcome GAVE_UP: near a toggle position they shrink, and take 0.2 s to 2 s.
_MOST_STEPS = 2500


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
        Whether Newton's corrections close the loop after each step and at each crank angle of the task. These
        determine the unknowns, so errors are then those of rounding at any tolerance, and the integrator only provides
        the initial guess.
    gap_tolerance
        Largest gap of a closed loop, relative to the longest link. It is wide because SciPy's default tolerances
        leave gaps of 0.015 even far from the change point.
    """

    solver: AdaptiveSolver = field(repr=False)
    rtol: float = 1e-6
    projected: bool = field(default=False, repr=False)
    gap_tolerance: float = field(default=1e-1, repr=False)
    capabilities: ClassVar[Capability] = Capability.CHECKS_BRANCH

    @property
    def name(self) -> str:
        """Key in the registry."""
        return self.solver.lower() + ("-projected" if self.projected else "")

    def solve(self, task: Task) -> Motion:
        """Integrate each design from its first crank angle to its last."""
        motion = Motion.blank(task)
        start, unknowns = start_values(task), np.full((task.loop.count, *task.crank_angle.shape), np.nan)
        for i in range(len(task)):
            equations = DesignEquations(task.loop, task.parameters[i])
            if not all(np.isfinite(values).all() for values in (task.parameters[i], task.crank_angle[i], start[i])):
                motion.outcome[i] = Outcome.NOT_FINITE
                continue
            try:
                with np.errstate(divide="raise", over="raise", invalid="raise"):
                    motion.outcome[i] = self._integrate(equations, task.crank_angle[i], start[i], unknowns[:, i])
            except ArithmeticError:
                motion.outcome[i] = Outcome.NOT_FINITE
            motion.evaluations[i], motion.iterations[i] = equations.evaluations, equations.steps
        task.loop.fill_signals(motion.signals, task.upright, task.crank_angle, unknowns)
        mark_failures(task, motion, self.gap_tolerance)
        return motion

    def _integrate(
        self, equations: DesignEquations, crank: FloatArray, start: FloatArray, unknowns: FloatArray
    ) -> Outcome:
        """Integrate one design and fill its ``unknowns[m, t]`` up to where the solver stops."""
        if self.projected:
            start = equations.project(crank[0], start)
        solver = getattr(scipy.integrate, self.solver)(
            equations.rates, crank[0], start, crank[-1], rtol=self.rtol,
            atol=_ATOL_BY_RTOL * self.rtol * equations.scales,
        )  # fmt: skip
        filled = int(np.searchsorted(crank, crank[0], side="right"))
        unknowns[:, :filled] = start[:, None]
        while solver.t < crank[-1]:
            solver.step()
            if solver.status == "failed" or equations.steps == _MOST_STEPS:
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
                # the first stage of the next step in all three solvers
                solver.f = equations.rates(solver.t, solver.y)
            filled = reached
        return Outcome.OK
