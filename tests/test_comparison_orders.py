"""Observed order: that of every integrator, exact power laws, rounding, coarse steps, and SciPy's regression."""

import mpmath
import numpy as np
import pytest
from scipy.stats import linregress

from explore.comparison.convergence import fit_order, measure_orders
from explore.comparison.stability import declared_case

STEPS = 2.0 ** -np.arange(1.0, 13.0)


@pytest.mark.parametrize("order", [1.0, 4.0, 8.0])
def test_a_power_law_gives_its_power(order):
    order_fit = fit_order(STEPS, 3.0 * STEPS**order)
    assert order_fit.slope == pytest.approx(order, abs=1e-12)
    assert order_fit.standard_error < 1e-12
    assert order_fit.included.sum() >= 4


@pytest.mark.parametrize("order", [2.0, 4.0])
def test_rounding_is_left_out(order):
    floor = STEPS[6] ** order
    rng = np.random.default_rng(7)
    errors = STEPS**order + floor * rng.uniform(0.5, 1.5, len(STEPS))
    order_fit = fit_order(STEPS, errors)
    assert not order_fit.included[6:].any()
    # the remaining errors are at least 15 times the floor, which changes the smallest by a tenth or less
    assert order_fit.slope == pytest.approx(order, abs=0.1)
    slope_of_all = np.polyfit(np.log(STEPS), np.log(errors), 1)[0]
    assert slope_of_all < order - 0.7


def test_coarse_steps_before_the_asymptotic_range_are_left_out():
    errors = STEPS**4 * (1.0 + (6.0 * STEPS) ** 3)  # seventh order where steps are coarse
    order_fit = fit_order(STEPS, errors)
    assert not order_fit.included[:4].any()
    assert order_fit.slope == pytest.approx(4.0, abs=0.02)
    assert np.polyfit(np.log(STEPS), np.log(errors), 1)[0] > 4.2


def test_slope_and_standard_error_are_those_of_regression():
    rng = np.random.default_rng(3)
    errors = STEPS**5 * np.exp(rng.normal(0.0, 0.3, len(STEPS)))
    order_fit = fit_order(STEPS, errors)
    line = linregress(np.log(STEPS[order_fit.included]), np.log(errors[order_fit.included]))
    assert order_fit.slope == pytest.approx(line.slope, rel=1e-12)
    assert order_fit.standard_error == pytest.approx(line.stderr, rel=1e-9)
    assert abs(order_fit.slope - 5.0) < 4.0 * order_fit.standard_error


def test_the_order_and_scale_of_the_points_do_not_matter():
    errors = STEPS**4 + 1e-12
    plain, reversed_ = fit_order(STEPS, errors), fit_order(100.0 * STEPS[::-1], 7.0 * errors[::-1])
    assert plain.slope == pytest.approx(reversed_.slope, rel=1e-12)
    assert plain.included.tolist() == reversed_.included[::-1].tolist()


def test_undefined_and_zero_errors_are_left_out():
    errors = STEPS**4
    errors[[2, 5]], errors[11] = np.nan, 0.0
    order_fit = fit_order(STEPS, errors)
    assert order_fit.slope == pytest.approx(4.0, abs=1e-12)
    assert not order_fit.included[[2, 5, 11]].any()


@pytest.mark.parametrize(
    ("steps", "errors"),
    [
        (STEPS[:4], STEPS[:4] ** 4),  # the smallest error and its neighbours count as rounding
        (STEPS, np.full(12, np.nan)),
        (STEPS, np.full(12, 1e-15)),
        (np.array([0.5, 0.1, 0.1, 0.1, 0.1, 0.01]), np.array([2.0, 1.0, 1.0, 1.0, 1.0, 1e-3])),
        ([], []),
    ],
)
def test_too_few_points_are_refused(steps, errors):
    with pytest.raises(ValueError, match="an order needs 4 errors at different steps"):
        fit_order(steps, errors)


def test_a_small_standard_error_is_not_lost_to_cancellation():
    """Against 50 digits; scipy.stats.linregress, by 1 - r^2, gives 0 here."""
    errors = STEPS**5 * np.exp(np.random.default_rng(3).normal(0.0, 1e-9, len(STEPS)))
    order = fit_order(STEPS, errors)
    with mpmath.workdps(50):
        x, y = ([mpmath.mpf(float(value)) for value in np.log(row[order.included])] for row in (STEPS, errors))
        x, y = ([value - mpmath.fsum(row) / len(row) for value in row] for row in (x, y))
        slope = mpmath.fdot(x, y) / mpmath.fdot(x, x)
        residuals = [b - slope * a for a, b in zip(x, y, strict=True)]
        expected = mpmath.sqrt(mpmath.fdot(residuals, residuals) / (len(x) - 2) / mpmath.fdot(x, x))
    # an error of 1e-15 in logarithms of size 1 to 40, over residuals of 1e-9
    assert order.standard_error == pytest.approx(float(expected), rel=1e-5)


#: Largest deviation of the measured order from theory. Adaptive solvers take a whole number of steps, spend the first
#: ones on finding the step size, and Radau updates its Jacobian at some steps only; all of this scatters the errors.
MAX_DEVIATIONS = {
    ("rk4", "equal"): 0.2,
    ("rk45", "equal"): 0.4,
    ("dop853", "equal"): 0.3,
    ("rk45", "by tolerance"): 1.0,
    ("dop853", "by tolerance"): 3.0,
    ("radau", "by tolerance"): 1.0,
}


def test_every_integrator_has_its_order():
    case = declared_case("crank-rocker")
    rows = measure_orders(case.loop, case.smooth)
    assert {(row["method"], row["steps"]) for row in rows} == set(MAX_DEVIATIONS)
    for row in rows:
        max_deviation = MAX_DEVIATIONS[row["method"], row["steps"]]
        assert row["measured"] == pytest.approx(row["theory"], abs=max_deviation), row
        assert row["points"] >= 4
        assert row["deviation"] < max_deviation
