"""Theoretical and measured order of convergence of each integrator.

Errors are taken 4 rad from the start: after a full turn the leading error terms almost cancel, and a fourth-order
method appears to be of fifth order.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.integrate import DOP853, RK45

from explore.comparison.methods.closed_form import ClosedForm
from explore.comparison.methods.contract import Level, Task
from explore.comparison.methods.design_equations import DesignEquations
from explore.comparison.methods.loop import Loop
from explore.comparison.methods.ode import AdaptiveSolver, VelocityIntegration
from explore.comparison.methods.runge_kutta import RungeKutta4
from explore.model.quantities import FloatArray

#: Factor on the smallest error within which errors are rounding.
_ROUNDING_FACTOR = 30.0
#: Least number of points for a slope and its standard error.
_MIN_POINTS = 4
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


@dataclass(frozen=True)
class ObservedOrder:
    """A regression line through log error on log step: its slope and standard error, and the points included."""

    slope: float
    standard_error: float
    included: npt.NDArray[np.bool_]


def fit_order(steps: FloatArray, errors: FloatArray) -> ObservedOrder:
    """Fit the order of a method to its errors at several step sizes, (n,) each, or at anything proportional to these.

    The fit excludes errors that are NaN or 0, errors within 30 times the smallest, which rounding dominates, and the
    coarsest steps, where the error does not yet follow the power law: as many of them as minimise the standard error
    of the slope. Raises `ValueError` if fewer than four points remain, or the last four have the same step size.
    """
    steps, errors = np.asarray(steps, dtype=float), np.asarray(errors, dtype=float)
    is_usable = np.isfinite(errors) & (errors > 0.0)
    is_usable &= errors > _ROUNDING_FACTOR * errors[is_usable].min(initial=np.inf)
    candidates = np.flatnonzero(is_usable)
    candidates = candidates[np.argsort(-steps[candidates], kind="stable")]
    if len(candidates) < _MIN_POINTS or np.ptp(steps[candidates[-_MIN_POINTS:]]) == 0.0:
        raise ValueError(
            f"an order needs {_MIN_POINTS} errors at different steps, above {_ROUNDING_FACTOR:g} times the smallest; "
            f"{len(candidates)} of {len(errors)} qualify"
        )
    x, y = np.log(steps[candidates]), np.log(errors[candidates])
    lines = [_fit_line(x[k:], y[k:]) for k in range(len(x) - _MIN_POINTS + 1)]
    best = min(range(len(lines)), key=lambda k: lines[k][1])
    included = np.zeros(len(errors), dtype=bool)
    included[candidates[best:]] = True
    return ObservedOrder(*lines[best], included)


def _fit_line(x: FloatArray, y: FloatArray) -> tuple[float, float]:
    """Slope of the least-squares line, and its standard error."""
    # scipy.stats.linregress takes the standard error from 1 - r^2, which cancels: 0 for a scatter of 1e-9.
    x, y = x - x.mean(), y - y.mean()
    slope = float(x @ y / (x @ x))
    residual = y - slope * x
    return slope, float(np.sqrt(residual @ residual / (len(x) - 2) / (x @ x)))


def measure_orders(loop: Loop, design: FloatArray) -> list[dict[str, Any]]:
    """Measure the order of every integrator on a design, at equal steps and at steps that the solver chooses.

    Rows with the keys method, steps ("equal" or "by tolerance"), theory, measured, deviation (its standard error),
    points.
    """
    rows = [_row("rk4", "equal", 4, *_runge_kutta_errors(loop, design))]
    for solver, (theory, counts) in _EXPLICIT.items():
        errors = [_equal_step_error(loop, design, solver, count) for count in counts]
        rows.append(_row(solver.__name__.lower(), "equal", theory, 1.0 / np.array(counts), np.array(errors)))
    for name, (theory, exponents) in _ADAPTIVE.items():
        # three more turns: with few steps, rounding their number to an integer would distort the slope
        task = _start_and_end(loop, design, _END + 6.0 * np.pi)
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


def _start_and_end(loop: Loop, design: FloatArray, end: float) -> Task:
    """A task with only the first and the last crank angle, so that no output is interpolated."""
    return Task(loop, design[None], 0.5 * np.pi + np.array([[0.0, end]]), Level.POSITIONS)


def _runge_kutta_errors(loop: Loop, design: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Step sizes and errors of `RungeKutta4`."""
    task = _start_and_end(loop, design, _END)
    exact = ClosedForm().solve(task).signals[:, 0, 1]
    motions = [RungeKutta4(steps).solve(task) for steps in _RK4_STEPS]
    sizes = np.array([1.0 / motion.iterations[0] for motion in motions])
    return sizes, np.array([np.abs(motion.signals[:, 0, 1] - exact).max() for motion in motions])


def _equal_step_error(loop: Loop, design: FloatArray, solver: Any, count: int) -> float:
    """Error of a SciPy solver with a tolerance so large that it rejects no step."""
    task = _start_and_end(loop, design, _END)
    (start, exact), (first, last) = ClosedForm().solve(task).signals[:, 0].T, task.crank_angle[0]
    step = _END / count
    rates = DesignEquations(loop, design).rates
    run = solver(rates, first, start, last, max_step=step, first_step=step, rtol=1.0, atol=1.0)
    while run.status == "running":
        run.step()
    return float(np.abs(run.y - exact).max())
