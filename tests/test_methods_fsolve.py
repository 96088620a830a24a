"""Cost of fsolve, its branch near the change point, and its outcomes."""

import numpy as np
import pytest
from test_methods import BENIGN, turn
from test_methods_newton import from_published_start

from explore.comparison.methods.closed_form import ClosedForm
from explore.comparison.methods.contract import Level, Outcome
from explore.comparison.methods.elimination import solve
from explore.comparison.methods.fsolve import Fsolve
from explore.comparison.methods.newton import Newton


def test_it_reports_ok_on_the_other_branch():
    """A turn of 72 steps contains 360 degrees, where at a margin of 2**-20 mm the branches nearly meet."""
    task = turn([150.0 - 2.0**-20, 1083.5, 541.75, 691.75], -1.0, 73, Level.VELOCITIES)
    motion, closed = Fsolve().solve(task), ClosedForm().solve(task)
    assert motion.outcome.tolist() == [Outcome.OK]
    own, other = (
        solve(about.columns, about.gap)[1]
        for about in (task.loop.about(task.upright, task.crank_angle, each.signals[:2]) for each in (closed, motion))
    )
    on_other_branch = own * other < 0.0
    assert on_other_branch.any()
    assert np.abs(motion.signals[2:] - closed.signals[2:]).max() > 0.1


def test_a_singular_system_gives_an_outcome():
    """All links are collinear at angles of exactly 0."""
    motion = Fsolve().solve(turn([1.0, 3.0, 1.0, 3.0], count=3, first=0.0))
    assert motion.outcome.tolist() == [Outcome.RAISED]
    assert Fsolve().solve(turn([1.0, 3.0, 1.0, 3.0], count=1, first=0.0, level=Level.POSITIONS)).outcome.tolist() == [
        Outcome.OK
    ]


def test_a_blocked_crank_does_not_converge():
    motion = Fsolve().solve(turn([200.0, 1083.4236, 541.7118, 691.7118]))
    assert motion.outcome.tolist() == [Outcome.NOT_CONVERGED]
    undefined = np.isnan(motion.signals).any(axis=(0, 1))
    assert undefined[undefined.argmax() :].all()


def test_an_inexact_start_is_corrected():
    """The start of the published study, whose angles are rounded degrees."""
    angles = Fsolve(1e-10).solve(from_published_start(100.0, (0.2966, 0.8897))).signals[:, 0, 0]
    assert angles == pytest.approx([0.2985139259147518, 0.8832418337186799], abs=1e-12)


def test_it_takes_more_evaluations_than_newton():
    """fsolve approximates the Jacobian and takes 708 to 737 evaluations, Newton to a gap of 1e-12 505 to 531."""
    fsolve, newton = Fsolve().solve(turn(BENIGN)), Newton().solve(turn(BENIGN))
    assert (newton.evaluations < fsolve.evaluations).all()
    assert (fsolve.evaluations < 11 * 73).all()
