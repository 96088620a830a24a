"""Silent errors of pylinkage, and its outcomes."""

import sys

import numpy as np
import pytest
from loop_cases import four_bars
from test_methods import BENIGN, SKIPS, differences, turn
from test_methods_newton import EXPONENTS, NEAR_CHANGE_POINT, wrong_velocities

from explore.base.errors import RequestError
from explore.comparison.methods.closed_form import ClosedForm
from explore.comparison.methods.contract import Level, Outcome
from explore.comparison.methods.dyads import PylinkageDyads

pytestmark = SKIPS["pylinkage"]


def test_unequal_steps_are_solved_one_by_one():
    angles = np.sort(np.random.default_rng(3).uniform(0.0, 6.0, (len(BENIGN), 40)), axis=1)
    task = four_bars(BENIGN, 1.0, angles)
    errors = differences(PylinkageDyads().solve(task), ClosedForm().solve(task).signals)
    assert max(errors) < 1e-14  # rounding accumulates over 40 angles; the bound for equal steps is for 73


def test_a_task_of_one_angle():
    task = turn(BENIGN, count=1)
    assert max(differences(PylinkageDyads().solve(task), ClosedForm().solve(task).signals)) < 1e-14


def test_the_nearest_intersection_is_on_the_wrong_branch():
    """A turn of 73 steps crosses 360 degrees; on branch -1 the other branch is nearer at margins up to 2**-5 mm."""
    outcome, wrong = wrong_velocities(PylinkageDyads(), turn(NEAR_CHANGE_POINT, -1.0, 74, Level.VELOCITIES))
    assert (outcome == Outcome.OK).all()
    assert EXPONENTS[wrong].tolist() == list(range(5, 46))


def test_circles_that_nearly_touch_have_no_velocity():
    """A turn of 72 steps contains 360 degrees; at margins up to 2**-30 mm the velocity is NaN there, and reported."""
    outcome, wrong = wrong_velocities(PylinkageDyads(), turn(NEAR_CHANGE_POINT, 1.0, 73, Level.VELOCITIES))
    assert (outcome == np.where(EXPONENTS < 30, Outcome.OK, Outcome.NOT_FINITE)).all()
    assert not wrong.any()


def test_circles_that_coincide_do_not_raise():
    """Crank and ground are equal, coupler and rocker too: at crank angle 0 both circles coincide."""
    assert PylinkageDyads().solve(turn([1.0, 2.0, 2.0, 1.0], count=3, first=0.0)).outcome.tolist() == [
        Outcome.NOT_FINITE
    ]


def test_a_missing_package_is_a_request_error(monkeypatch):
    monkeypatch.setitem(sys.modules, "pylinkage", None)  # makes the import fail
    with pytest.raises(RequestError, match=r"pylinkage is not installed; pip install 'linkage-explore\[peers\]'"):
        PylinkageDyads().solve(turn(BENIGN))
