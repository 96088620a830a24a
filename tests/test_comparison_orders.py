"""Observed order: exact power laws, the floor, the coarse end, and SciPy's regression."""

import numpy as np
import pytest
from scipy.stats import linregress

from explore.comparison.orders import observed_order

STEPS = 2.0 ** -np.arange(1.0, 13.0)


@pytest.mark.parametrize("order", [1.0, 4.0, 8.0])
def test_a_power_law_gives_its_power(order):
    found = observed_order(STEPS, 3.0 * STEPS**order)
    assert found.slope == pytest.approx(order, abs=1e-12)
    assert found.standard_error < 1e-12
    assert found.used.sum() >= 4


@pytest.mark.parametrize("order", [2.0, 4.0])
def test_rounding_is_left_out(order):
    floor = STEPS[6] ** order
    rng = np.random.default_rng(7)
    errors = STEPS**order + floor * rng.uniform(0.5, 1.5, len(STEPS))
    found = observed_order(STEPS, errors)
    assert not found.used[6:].any()
    # what stays is 30 times half the floor at least, so the floor bends the last point by a tenth or less
    assert found.slope == pytest.approx(order, abs=0.1)
    naive = np.polyfit(np.log(STEPS), np.log(errors), 1)[0]
    assert naive < order - 0.7


def test_coarse_steps_that_do_not_follow_the_law_are_left_out():
    errors = STEPS**4 * (1.0 + (6.0 * STEPS) ** 3)  # seventh order where steps are coarse
    found = observed_order(STEPS, errors)
    assert not found.used[:4].any()
    assert found.slope == pytest.approx(4.0, abs=0.02)
    assert np.polyfit(np.log(STEPS), np.log(errors), 1)[0] > 4.2


def test_slope_and_standard_error_are_those_of_regression():
    rng = np.random.default_rng(3)
    errors = STEPS**5 * np.exp(rng.normal(0.0, 0.3, len(STEPS)))
    found = observed_order(STEPS, errors)
    line = linregress(np.log(STEPS[found.used]), np.log(errors[found.used]))
    assert found.slope == pytest.approx(line.slope, rel=1e-12)
    assert found.standard_error == pytest.approx(line.stderr, rel=1e-9)
    assert abs(found.slope - 5.0) < 4.0 * found.standard_error


def test_the_sequence_and_scale_of_points_do_not_matter():
    errors = STEPS**4 + 1e-12
    one, two = observed_order(STEPS, errors), observed_order(100.0 * STEPS[::-1], 7.0 * errors[::-1])
    assert one.slope == pytest.approx(two.slope, rel=1e-12)
    assert one.used.tolist() == two.used[::-1].tolist()


def test_failures_and_exact_hits_are_no_points():
    errors = STEPS**4
    errors[[2, 5]], errors[11] = np.nan, 0.0
    found = observed_order(STEPS, errors)
    assert found.slope == pytest.approx(4.0, abs=1e-12)
    assert not found.used[[2, 5, 11]].any()


@pytest.mark.parametrize(
    ("steps", "errors"),
    [
        (STEPS[:4], STEPS[:4] ** 4),  # the least error and its neighbours count as floor
        (STEPS, np.full(12, np.nan)),
        (STEPS, np.full(12, 1e-15)),
        (np.array([0.5, 0.1, 0.1, 0.1, 0.1, 0.01]), np.array([2.0, 1.0, 1.0, 1.0, 1.0, 1e-3])),
        ([], []),
    ],
)
def test_too_little_is_refused(steps, errors):
    with pytest.raises(ValueError, match="an order needs 4 errors at different steps"):
        observed_order(steps, errors)
