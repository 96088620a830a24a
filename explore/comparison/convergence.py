"""Theoretical and measured order of convergence of each integrator.

Errors are taken 4 rad from the start: after a full turn the leading error terms almost cancel, and a fourth-order
method appears to be of fifth order.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.integrate import DOP853, RK45

from explore.comparison.methods.closed_form import ClosedForm
from explore.comparison.methods.contract import Level, Task
from explore.comparison.methods.four_bar_loop import FOUR_BAR
from explore.comparison.methods.ode import AdaptiveSolver, LoopEquations, VelocityIntegration
from explore.comparison.methods.runge_kutta import RungeKutta4
from explore.comparison.orders import fit_order
from explore.model.quantities import FloatArray

#: Crank-rocker far from its change point: crank, coupler, rocker, ground, mm.
LENGTHS = np.array([[20.0, 50.0, 45.0, 40.0]])
#: Crank angle to which methods integrate, rad.
_END = 4.0
#: Steps per turn of the Runge-Kutta method.
_RK4_STEPS = (12, 18, 24, 36, 48, 72, 96, 144, 192, 288, 384, 768)
#: Theoretical order, and step counts from the start of the asymptotic range to where rounding dominates.
_EXPLICIT = {
    RK45: (5, (16, 24, 32, 48, 64, 96, 128, 192)),
    DOP853: (8, (10, 12, 14, 16, 20, 24, 28, 32, 40)),
}
#: Theoretical order, and exponents x of the relative tolerances 10^-x.
_ADAPTIVE: dict[AdaptiveSolver, tuple[int, FloatArray]] = {
    "RK45": (5, np.arange(5.0, 11.6, 0.5)),
    "DOP853": (8, np.arange(5.0, 12.1, 0.5)),
    "Radau": (5, np.arange(3.0, 8.1, 0.5)),
}


def measure_orders() -> list[dict[str, Any]]:
    """Measure the order of every integrator, at equal steps and at steps that the solver chooses.

    Rows with the keys method, steps ("equal" or "by tolerance"), theory, measured, deviation (its standard error),
    points.
    """
    rows = [_row("rk4", "equal", 4, *_runge_kutta_errors())]
    for solver, (theory, counts) in _EXPLICIT.items():
        errors = [_equal_step_error(solver, count) for count in counts]
        rows.append(_row(solver.__name__.lower(), "equal", theory, 1.0 / np.array(counts), np.array(errors)))
    for name, (theory, exponents) in _ADAPTIVE.items():
        # three more turns: with few steps, rounding their number to an integer would distort the slope
        task = _start_and_end(_END + 6.0 * np.pi)
        exact = ClosedForm().solve(task).signals[:, 0, 1]
        motions = [VelocityIntegration(name, float(rtol)).solve(task) for rtol in 10.0**-exponents]
        errors = [float(np.abs(motion.signals[:, 0, 1] - exact).max()) for motion in motions]
        sizes = np.array([1.0 / motion.iterations[0] for motion in motions])
        rows.append(_row(name.lower(), "by tolerance", theory, sizes, np.array(errors)))
    return rows


def _row(method: str, steps: str, theory: int, sizes: FloatArray, errors: FloatArray) -> dict[str, Any]:
    order = fit_order(sizes, errors)
    return {
        "method": method,
        "steps": steps,
        "theory": theory,
        "measured": order.slope,
        "deviation": order.standard_error,
        "points": int(order.included.sum()),
    }


def _start_and_end(end: float) -> Task:
    """A task with only the first and the last crank angle, so that no output is interpolated."""
    return Task(LENGTHS, np.ones(1), 0.5 * np.pi + np.array([[0.0, end]]), Level.POSITIONS)


def _runge_kutta_errors() -> tuple[FloatArray, FloatArray]:
    """Step sizes and errors of `RungeKutta4`."""
    task = _start_and_end(_END)
    exact = ClosedForm().solve(task).signals[:, 0, 1]
    motions = [RungeKutta4(steps).solve(task) for steps in _RK4_STEPS]
    sizes = np.array([1.0 / motion.iterations[0] for motion in motions])
    return sizes, np.array([np.abs(motion.signals[:, 0, 1] - exact).max() for motion in motions])


def _equal_step_error(solver: Any, count: int) -> float:
    """Error of a SciPy solver with a tolerance so large that it rejects no step."""
    task = _start_and_end(_END)
    (start, exact), (first, last) = ClosedForm().solve(task).signals[:, 0].T, task.crank_angle[0]
    step = _END / count
    rates = LoopEquations(FOUR_BAR, LENGTHS[0]).rates
    run = solver(rates, first, start, last, max_step=step, first_step=step, rtol=1.0, atol=1.0)
    while run.status == "running":
        run.step()
    return float(np.abs(run.y - exact).max())
