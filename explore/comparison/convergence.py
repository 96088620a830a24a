"""The order of convergence of each integrator: theory against what is measured.

Measured 4 rad from the start and not after a turn, where the leading terms of the error almost cancel and a method of
fourth order looks like one of fifth.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.integrate import DOP853, RK45

from explore.comparison.orders import observed_order
from explore.methods.closed_form import ClosedForm
from explore.methods.contract import Level, Task
from explore.methods.ode import LoopEquations, VelocityIntegration
from explore.methods.runge_kutta import RungeKutta4
from explore.vocabulary import FloatArray

#: A benign crank-rocker.
LENGTHS = np.array([[20.0, 50.0, 45.0, 40.0]])
_END = 4.0
_RK4_STEPS = (12, 18, 24, 36, 48, 72, 96, 144, 192, 288, 384, 768)
#: Theoretical order, and numbers of equal steps between the first useful and the floor of rounding.
_EXPLICIT = {
    RK45: (5, (16, 24, 32, 48, 64, 96, 128, 192)),
    DOP853: (8, (10, 12, 14, 16, 20, 24, 28, 32, 40)),
}
#: Theoretical order, and tolerances 10^-x at which the solver chooses its steps.
_ADAPTIVE = {
    "RK45": (5, np.arange(5.0, 11.6, 0.5)),
    "DOP853": (8, np.arange(5.0, 12.1, 0.5)),
    "Radau": (5, np.arange(3.0, 8.1, 0.5)),
}


def measure_orders() -> list[dict[str, Any]]:
    """Order by regression, a row for each integrator and way of choosing steps: theory, measured, its deviation."""
    rows = [_row("rk4", "equal", 4, *_classical())]
    for solver, (theory, counts) in _EXPLICIT.items():
        errors = [_at_equal_steps(solver, count) for count in counts]
        rows.append(_row(solver.__name__.lower(), "equal", theory, 1.0 / np.array(counts), np.array(errors)))
    for name, (theory, exponents) in _ADAPTIVE.items():
        # three turns more, so that the whole number of steps says enough
        task = _two_angles(_END + 6.0 * np.pi)
        exact = ClosedForm().solve(task).signals[:, 0, 1]
        motions = [VelocityIntegration(name, float(rtol)).solve(task) for rtol in 10.0**-exponents]  # type: ignore[arg-type]
        errors = [float(np.abs(motion.signals[:, 0, 1] - exact).max()) for motion in motions]
        sizes = np.array([1.0 / motion.iterations[0] for motion in motions])
        rows.append(_row(name.lower(), "by tolerance", theory, sizes, np.array(errors)))
    return rows


def _row(method: str, steps: str, theory: int, sizes: FloatArray, errors: FloatArray) -> dict[str, Any]:
    order = observed_order(sizes, errors)
    return {
        "method": method,
        "steps": steps,
        "theory": theory,
        "measured": order.slope,
        "deviation": order.standard_error,
        "points": int(order.used.sum()),
    }


def _two_angles(end: float) -> Task:
    """Only the start, exact, and the end: nothing is interpolated."""
    return Task(LENGTHS, np.ones(1), 0.5 * np.pi + np.array([[0.0, end]]), Level.POSITIONS)


def _classical() -> tuple[FloatArray, FloatArray]:
    task = _two_angles(_END)
    exact = ClosedForm().solve(task).signals[:, 0, 1]
    motions = [RungeKutta4(steps).solve(task) for steps in _RK4_STEPS]
    sizes = np.array([1.0 / motion.iterations[0] for motion in motions])
    return sizes, np.array([np.abs(motion.signals[:, 0, 1] - exact).max() for motion in motions])


def _at_equal_steps(solver: Any, count: int) -> float:
    """Error of a SciPy solver whose tolerance is so large that no step is refused."""
    task = _two_angles(_END)
    (start, exact), (first, last) = ClosedForm().solve(task).signals[:, 0].T, task.crank_angle[0]
    step = _END / count
    rates = LoopEquations(LENGTHS[0]).rates
    run = solver(rates, first, start, last, max_step=step, first_step=step, rtol=1.0, atol=1.0)
    while run.status == "running":
        run.step()
    return float(np.abs(run.y - exact).max())
