"""Verdicts of every method towards the change point, and the smallest margins at which each is accurate."""

import math

import numpy as np
import pytest

from explore.comparison.stability import map_stability, safe_margins, stability_runs
from explore.comparison.stability_cases import stability_case
from explore.comparison.verdicts import Verdict
from explore.methods.geometry import geometric_outcome

ACCURACY = 1e-6
CASE = stability_case("crank-rocker")


@pytest.fixture(scope="module")
def rows():
    return map_stability(CASE, ACCURACY)


def turning_rows(rows, setting, angles=72):
    """Rows of a setting whose crank turns, by descending margin."""
    turning = [row for row in rows if (row["setting"], row["angles"]) == (setting, angles) and row["margin"] > 0.0]
    return sorted(turning, key=lambda row: -row["margin"])


def test_every_method_is_judged_on_every_design(rows):
    assert len(rows) == len(stability_runs(CASE)) * len(CASE.margin)
    assert (np.diff(CASE.margin) < 0.0).all()
    has_motion = geometric_outcome(CASE.parameters) == 1
    assert np.array_equal(has_motion, CASE.margin > 0.0), "the margins are exact"


def test_the_closed_form_is_accurate_at_every_margin(rows):
    closed_form = turning_rows(rows, "closed-form")
    assert {row["verdict"] for row in closed_form} == {"accurate"}
    assert max(row["error"] for row in closed_form) < 1e-14  # rounding of a few operations
    without_motion = [row["verdict"] for row in rows if row["method"] == "closed-form" and row["margin"] <= 0.0]
    assert set(without_motion) == {"correctly rejected"}


def test_the_error_of_arccos_grows_like_the_reciprocal_margin(rows):
    """Its argument is rounded at 1e-16, so the error of the velocity grows like 1e-16 over the margin."""
    for row in turning_rows(rows, "textbook"):
        if 1e-13 < row["margin"] < 1e-3:
            assert row["error"] < 30.0 * 2.2e-16 / row["margin"]
    largest = max(row["error"] for row in turning_rows(rows, "textbook") if row["margin"] > 1e-9)
    assert largest > 1e-9, "seven of sixteen digits are lost"


def test_newton_changes_the_branch_silently_only_without_its_check(rows):
    wrong_branch = [row for row in rows if row["verdict"] == Verdict.WRONG_BRANCH.label]
    assert {row["method"] for row in wrong_branch} >= {"newton-unchecked"}
    assert not [row for row in wrong_branch if row["method"] == "newton"]


def test_integrators_fail_or_drift_at_the_toggle_position(rows):
    for setting in ("rk45(rtol=0.001)", "rk45(rtol=1e-06)"):
        near = [row["verdict"] for row in turning_rows(rows, setting) if row["margin"] < 1e-6]
        assert set(near) <= {"reported failure", "inaccurate", "wrong branch"}
        assert "reported failure" in near
    far = turning_rows(rows, "rk45(rtol=0.001)")[0]
    assert 1e-3 < far["error"] < 1e-1, "wrong in the third digit or before"


def test_safe_margins_of_constructed_rows():
    def row(margin, verdict):
        return {"method": "m", "setting": "m(1)", "angles": 72, "margin": margin, "verdict": verdict}

    accurate, wrong = "accurate", "inaccurate"
    (safe,) = safe_margins([row(1e-6, accurate), row(1e-2, accurate), row(1e-4, wrong), row(-1e-3, "false success")])
    assert (safe["smallest_accurate_margin"], safe["verdict_below"], safe["worst_verdict"]) == (
        1e-2,
        wrong,
        "false success",
    )
    (inaccurate,) = safe_margins([row(1e-2, wrong), row(1e-4, accurate)])
    assert math.isnan(inaccurate["smallest_accurate_margin"])
    (complete,) = safe_margins([row(1e-2, accurate), row(1e-4, accurate)])
    assert (complete["smallest_accurate_margin"], complete["verdict_below"]) == (1e-4, "")


def test_the_smallest_margin_may_be_the_only_inaccurate_one():
    rows = [
        {"method": "m", "setting": "m(1)", "angles": 72, "margin": margin, "verdict": verdict}
        for margin, verdict in ((1e-2, "accurate"), (1e-4, "inaccurate"))
    ]
    (safe,) = safe_margins(rows)
    assert (safe["smallest_accurate_margin"], safe["verdict_below"]) == (1e-2, "inaccurate")
