"""What pylinkage does where the product's own methods speak up."""

import sys

import numpy as np
import pytest
from test_methods import BENIGN, NEEDS, differences, turn

from explore.errors import RequestError
from explore.methods.closed_form import ClosedForm
from explore.methods.contract import Level, Outcome, Task
from explore.methods.dyads import PylinkageDyads

pytestmark = NEEDS["pylinkage"]
#: Exponents k of margins 2**-k mm; lengths exact in binary, so that the margin is what it says.
EXPONENTS = np.arange(46)
NEAR_CHANGE_POINT = np.array([[150.0 - 2.0**-k, 1083.5, 541.75, 691.75] for k in EXPONENTS])


def silently_wrong(task):
    """Outcomes, and which designs are said to be ok with velocities off by more than a thousandth."""
    motion, closed = PylinkageDyads().solve(task), ClosedForm().solve(task)
    off = np.abs(motion.signals[2:] - closed.signals[2:]).max(axis=(0, 2))
    return motion.outcome, (motion.outcome == Outcome.OK) & (off > 1e-3)


def test_unequal_steps_are_made_one_by_one():
    angles = np.sort(np.random.default_rng(3).uniform(0.0, 6.0, (len(BENIGN), 40)), axis=1)
    task = Task(BENIGN, np.ones(len(BENIGN)), angles)
    errors = differences(PylinkageDyads().solve(task), ClosedForm().solve(task).signals)
    assert max(errors) < 1e-14  # 40 angles added up; the bound for equal steps is for 73


def test_one_angle_is_enough():
    task = turn(BENIGN, count=1)
    assert max(differences(PylinkageDyads().solve(task), ClosedForm().solve(task).signals)) < 1e-14


def test_the_nearest_intersection_is_the_wrong_one():
    """A turn of 73 steps from 90 degrees steps over 360; on branch -1 the other side is nearer from 2**-5 mm on."""
    outcome, wrong = silently_wrong(turn(NEAR_CHANGE_POINT, -1.0, 74, Level.VELOCITIES))
    assert (outcome == Outcome.OK).all()
    assert EXPONENTS[wrong].tolist() == list(range(5, 46))


def test_circles_that_nearly_touch_have_no_velocity():
    """A turn of 72 steps falls on 360; within 1e-12 of 1083.5 mm, from 2**-30 on, the velocity is NaN and is told."""
    outcome, wrong = silently_wrong(turn(NEAR_CHANGE_POINT, 1.0, 73, Level.VELOCITIES))
    assert (outcome == np.where(EXPONENTS < 30, Outcome.OK, Outcome.NOT_FINITE)).all()
    assert not wrong.any()


def test_circles_that_coincide_do_not_raise():
    """Crank as long as the ground, coupler as long as the rocker: at 0 both circles are the same."""
    assert PylinkageDyads().solve(turn([1.0, 2.0, 2.0, 1.0], count=3, first=0.0)).outcome.tolist() == [
        Outcome.NOT_FINITE
    ]


def test_a_missing_package_is_said_in_one_line(monkeypatch):
    monkeypatch.setitem(sys.modules, "pylinkage", None)  # as Python marks a package that cannot be imported
    with pytest.raises(RequestError, match=r"pylinkage is not installed; pip install 'linkage-explore\[peers\]'"):
        PylinkageDyads().solve(turn(BENIGN))
