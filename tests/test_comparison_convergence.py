"""The orders of convergence that `explore stability` prints agree with theory."""

import pytest

from explore.comparison.convergence import measure_orders
from explore.comparison.stability import declared_case

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
