"""The map of failures reproduces what is known of each method, and the table of safe margins follows from it."""

import math

import numpy as np
import pytest

from explore.comparison.stability import grid, map_stability, runs, safe_margins
from explore.comparison.verdicts import Verdict
from explore.methods.geometry import geometric_outcome

GOAL = 1e-6


@pytest.fixture(scope="module")
def rows():
    return map_stability(GOAL)


def line(rows, setting, angles=72):
    """Rows of a setting whose crank turns, from far to near."""
    found = [row for row in rows if (row["setting"], row["angles"]) == (setting, angles) and row["margin"] > 0.0]
    return sorted(found, key=lambda row: -row["margin"])


def test_every_run_meets_every_design(rows):
    designs = grid()
    assert len(rows) == len(runs()) * len(designs.margin)
    assert (np.diff(designs.margin) < 0.0).all()
    turns = geometric_outcome(designs.lengths) == 1
    assert np.array_equal(turns, designs.margin > 0.0), "the margins are exact"


def test_the_closed_form_is_right_everywhere(rows):
    of_ours = line(rows, "closed-form")
    assert {row["verdict"] for row in of_ours} == {"right"}
    assert max(row["error"] for row in of_ours) < 1e-14  # rounding of a few operations
    refused = [row["verdict"] for row in rows if row["method"] == "closed-form" and row["margin"] <= 0.0]
    assert set(refused) == {"rightly refused"}


def test_arccos_loses_half_its_digits_at_half_the_distance_and_the_rest_behind(rows):
    """Its argument is rounded at 1e-16, so the velocity's error grows like 1e-16 over the margin."""
    for row in line(rows, "textbook"):
        if 1e-13 < row["margin"] < 1e-3:
            assert row["error"] < 30.0 * 2.2e-16 / row["margin"]
    worst = max(row["error"] for row in line(rows, "textbook") if row["margin"] > 1e-9)
    assert worst > 1e-9, "eight of sixteen digits"


def test_newton_is_silent_on_the_wrong_branch_only_without_its_check(rows):
    silent = [row for row in rows if row["verdict"] == Verdict.WRONG_BRANCH.label]
    assert {row["method"] for row in silent} >= {"newton-unchecked"}
    assert not [row for row in silent if row["method"] == "newton"]


def test_integrators_collapse_or_drift_at_the_toggle(rows):
    for setting in ("rk45(rtol=0.001)", "rk45(rtol=1e-06)"):
        near = [row["verdict"] for row in line(rows, setting) if row["margin"] < 1e-6]
        assert set(near) <= {"gave up and said so", "inaccurate", "wrong branch"}
        assert "gave up and said so" in near
    far = line(rows, "rk45(rtol=0.001)")[0]
    assert 1e-3 < far["error"] < 1e-1, "wrong in the third digit or before"


def test_safe_margins_by_hand():
    def row(margin, verdict):
        return {"method": "m", "setting": "m(1)", "angles": 72, "margin": margin, "verdict": verdict}

    right, wrong = "right", "inaccurate"
    (safe,) = safe_margins([row(1e-6, right), row(1e-2, right), row(1e-4, wrong), row(-1e-3, "ok where none is")])
    assert (safe["safe_down_to"], safe["then"], safe["worst"]) == (1e-2, wrong, "ok where none is")
    (never,) = safe_margins([row(1e-2, wrong), row(1e-4, right)])
    assert math.isnan(never["safe_down_to"])
    (always,) = safe_margins([row(1e-2, right), row(1e-4, right)])
    assert (always["safe_down_to"], always["then"]) == (1e-4, "")
