"""The textbook formula and the intersection of circles lose digits; the closed form does not."""

import numpy as np
import pytest
from loop_cases import four_bars
from test_methods import differences, exact, turn

from explore.comparison.methods.circle_intersection import CircleIntersection
from explore.comparison.methods.closed_form import ClosedForm
from explore.comparison.methods.contract import Level, Outcome
from explore.comparison.methods.textbook import TextbookArccos

#: Dyadic lengths, so that the Grashof margin of 2**-20 mm is exact.
NEAR = [150.0 - 2.0**-20, 1083.5, 541.75, 691.75]


def test_digits_are_lost_beside_the_toggle_position():
    """The diagonal is rounded at 1e-13 mm, of a factor that 0.01 deg away is 3e-6 mm: about eight digits remain."""
    task = four_bars(np.array([NEAR]), 1.0, np.array([[np.deg2rad(0.01)]]), Level.VELOCITIES)
    reference = exact(task)
    assert 1e-10 < max(differences(CircleIntersection().solve(task), reference)) < 1e-6
    assert max(differences(ClosedForm().solve(task), reference)) < 2e-15


def test_nothing_is_rounded_in_the_toggle_position_itself():
    """At crank angle 0 pin and pivots are in one line, and lengths of few digits have exact differences."""
    task = four_bars(np.array([NEAR]), 1.0, np.zeros((1, 1)), Level.VELOCITIES)
    assert max(differences(CircleIntersection().solve(task), exact(task))) < 2e-15


@pytest.mark.parametrize(
    ("exponent", "at_least", "at_most"),
    [(10, 1e-13, 2e-11), (20, 1e-10, 2e-8), (30, 1e-7, 2e-5)],
)
def test_digits_are_lost_towards_the_change_point(exponent, at_least, at_most):
    """The error of the velocity grows like 1 / margin: measured 1.5e-12, 9.1e-9 and 8.9e-6 against 60 digits."""
    # the lengths are dyadic, so the margin is exact
    task = turn([150.0 - 2.0**-exponent, 1083.5, 541.75, 691.75], level=Level.VELOCITIES)
    reference = exact(task)
    _, velocity_error = differences(TextbookArccos().solve(task), reference)
    assert at_least < velocity_error < at_most
    assert max(differences(ClosedForm().solve(task), reference)) < 1e-15


@pytest.mark.parametrize(
    ("method", "branch"), [(CircleIntersection(), 1.0), (CircleIntersection(), -1.0), (TextbookArccos(), 1.0)]
)
def test_a_blocked_crank_gives_an_outcome(method, branch):
    """Around 0 the root, or the arccos, is NaN, elsewhere a number, and the method reports it."""
    motion = method.solve(turn([200.0, 1083.4236, 541.7118, 691.7118], branch))
    assert motion.outcome.tolist() == [Outcome.NOT_FINITE]
    assert 0 < np.isnan(motion.signals[0, 0]).sum() < 73
