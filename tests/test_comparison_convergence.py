"""The table of orders that `explore stability` prints: theory and measurement agree."""

import pytest

from explore.comparison.convergence import measure_orders

#: How far the measured order may be from theory. Steps chosen by a solver come in whole numbers, the first ones spent
#: on finding their size, and Radau keeps its Jacobian or takes it anew, which scatters the errors.
BANDS = {
    ("rk4", "equal"): 0.2,
    ("rk45", "equal"): 0.4,
    ("dop853", "equal"): 0.3,
    ("rk45", "by tolerance"): 1.0,
    ("dop853", "by tolerance"): 3.0,
    ("radau", "by tolerance"): 1.0,
}


def test_every_integrator_shows_its_order():
    rows = measure_orders()
    assert {(row["method"], row["steps"]) for row in rows} == set(BANDS)
    for row in rows:
        band = BANDS[row["method"], row["steps"]]
        assert row["measured"] == pytest.approx(row["theory"], abs=band), row
        assert row["points"] >= 4
        assert row["deviation"] < band
