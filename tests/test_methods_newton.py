"""Newton's method: what it corrects, what it costs, where it leaves its branch and who notices."""

import numpy as np
import pytest
from test_methods import BENIGN, differences, turn

from explore.methods import loop
from explore.methods.closed_form import ClosedForm
from explore.methods.contract import Capability, Level, Outcome, Task
from explore.methods.newton import Newton

#: Exponents k of margins 2**-k; lengths exact in binary, so that the margin is what it says.
EXPONENTS = np.arange(46)
NEAR_CHANGE_POINT = np.array([[150.0 - 2.0**-k, 1083.5, 541.75, 691.75] for k in EXPONENTS])
#: Crank, start angles of the published study, misfit in mm and exact angles at a crank angle of 90 degrees.
PUBLISHED = [
    (150.0, (0.2442, 0.8373), 10.03, (0.2359565652503938, 0.8397051846065310)),
    (100.0, (0.2966, 0.8897), 5.35, (0.2985139259147518, 0.8832418337186799)),
    (200.0, (0.1744, 0.8024), 1.93, (0.1774195053439438, 0.8069493079893278)),
]


def from_published_start(crank, start):
    """One crank angle and the rounded start angles."""
    lengths = np.array([[crank, 1083.4236, 541.7118, 691.7118]])
    return Task(lengths, np.ones(1), np.full((1, 1), np.pi / 2), Level.POSITIONS, np.array([start]))


@pytest.mark.parametrize(("crank", "start", "misfit", "angles"), PUBLISHED)
def test_a_rough_start_is_corrected(crank, start, misfit, angles):
    task = from_published_start(crank, start)
    gap = loop.residual(task.lengths[0], np.pi / 2, *start)
    # the angles are printed with four digits: 5e-5 of 1083 mm
    assert np.hypot(*gap) == pytest.approx(misfit, abs=0.06)
    motion = Newton(1e-12).solve(task)
    assert motion.outcome.tolist() == [Outcome.OK]
    assert motion.signals[:, 0, 0] == pytest.approx(angles, abs=1e-14)  # quadratic: far below the tolerance


@pytest.mark.parametrize(("crank", "start", "misfit", "angles"), PUBLISHED)
def test_each_correction_doubles_the_digits(crank, start, misfit, angles):
    task = from_published_start(crank, start)
    counts = [Newton(tolerance).solve(task).iterations[0] for tolerance in (1e-3, 1e-6, 1e-12)]
    assert counts == [1, 2, 3]


@pytest.mark.parametrize("tolerance", [1e-2, 1e-4, 1e-8, 1e-12])
def test_the_loop_is_closed_to_the_tolerance(tolerance):
    task = turn(BENIGN)
    motion = Newton(tolerance).solve(task)
    gap = np.hypot(*loop.residual(task.lengths.T[:, :, None], task.crank_angle, *motion.signals[:2]))
    assert (gap <= tolerance * task.lengths.max(axis=1)[:, None]).all()
    assert (motion.evaluations == 2 * motion.iterations + 73).all()


def test_settled_designs_leave_the_working_set():
    """What one design costs does not depend on its neighbours, and differs between them."""
    lengths = np.vstack([BENIGN, NEAR_CHANGE_POINT[[0, 8]]])
    together = Newton().solve(turn(lengths))
    alone = [Newton().solve(turn(row)).evaluations[0] for row in lengths]
    assert together.evaluations.tolist() == alone
    assert len(set(alone)) > 2


def test_a_design_that_failed_keeps_what_it_had_and_costs_no_more():
    task = turn([200.0, 1083.4236, 541.7118, 691.7118])
    motion = Newton().solve(task)
    assert motion.outcome.tolist() == [Outcome.NOT_CONVERGED]
    lost = np.isnan(motion.signals).any(axis=(0, 1))
    first = int(lost.argmax())
    assert lost[first:].all()
    # the crank is blocked from 35.5854 degrees before 360 on
    assert np.rad2deg(task.crank_angle[0, first]) == pytest.approx(360.0 - 35.5854, abs=5.0)
    # eight evaluations an angle where it goes well, then 20 corrections and 21 residuals at the one that fails
    assert motion.evaluations[0] <= 8 * first + 41


def test_it_cannot_tell_what_cannot_be_assembled_from_what_did_not_converge():
    assert Newton().solve(turn([100.0, 2000.0, 541.7118, 691.7118])).outcome.tolist() == [Outcome.NOT_CONVERGED]


def test_a_start_on_the_other_side_is_noticed():
    other = ClosedForm().solve(turn(BENIGN, -1.0)).signals[:2, :, 0].T
    right = turn(BENIGN)
    task = Task(right.lengths, right.branch, right.crank_angle, right.level, other)
    assert set(Newton().solve(task).outcome) == {Outcome.WRONG_BRANCH}
    assert np.isnan(Newton().solve(task).signals).all()
    assert set(Newton(check_branch=False).solve(task).outcome) == {Outcome.OK}
    assert Capability.CHECKS_BRANCH not in Newton(check_branch=False).capabilities


def wrong_velocities(method, task):
    """Of all designs: the outcome, and which are said to be ok with velocities off by more than a thousandth."""
    motion, closed = method.solve(task), ClosedForm().solve(task)
    off = np.abs(motion.signals[2:] - closed.signals[2:]).max(axis=(0, 2))
    return motion.outcome, (motion.outcome == Outcome.OK) & (off > 1e-3)


#: Steps of a turn that starts at 90 degrees, and the largest margin 2**-k mm of those here at which it jumps. With a
#: multiple of four a crank angle falls on 360 degrees, where the branches nearly meet; the other turns step over it.
JUMPS = {72: 13, 120: 16, 180: 18, 240: 26, 360: 22, 90: None, 91: None, 359: None}


@pytest.mark.parametrize(("steps", "largest"), JUMPS.items())
@pytest.mark.parametrize("branch", [1.0, -1.0])
def test_only_the_sign_of_the_determinant_tells_a_wrong_branch(steps, largest, branch):
    task = turn(NEAR_CHANGE_POINT, branch, steps + 1, Level.VELOCITIES)
    _, silent = wrong_velocities(Newton(check_branch=False), task)
    assert (EXPONENTS[silent.argmax()] if silent.any() else None) == largest
    outcome, wrong = wrong_velocities(Newton(), task)
    assert not wrong.any()
    assert (outcome[silent] == Outcome.WRONG_BRANCH).all()


@pytest.mark.parametrize("first", [-np.pi, -np.pi / 2, 0.0, np.pi / 2])
def test_with_the_check_it_is_never_ok_and_wrong(first):
    """Four starts, 8 step counts, 46 margins, both branches: some fail, and all of them say so."""
    outcomes = set()
    for steps in (24, 60, 72, 73, 100, 144, 181, 288):
        for branch in (1.0, -1.0):
            outcome, wrong = wrong_velocities(
                Newton(), turn(NEAR_CHANGE_POINT, branch, steps + 1, Level.VELOCITIES, first)
            )
            assert not wrong.any(), (steps, branch)
            outcomes |= set(outcome)
    assert {Outcome.OK, Outcome.WRONG_BRANCH} <= outcomes <= {Outcome.OK, Outcome.WRONG_BRANCH, Outcome.NOT_CONVERGED}


def test_the_limit_of_the_check_is_the_tolerance():
    """A node 1e-6 rad beside the line at a margin of 2**-30 mm: the gap closes, the velocity is off, as documented."""
    task = turn(NEAR_CHANGE_POINT[[30]], 1.0, 73, Level.VELOCITIES, np.pi / 2 + 1e-6)
    motion, closed = Newton().solve(task), ClosedForm().solve(task)
    assert motion.outcome.tolist() == [Outcome.OK]
    positions, velocities = differences(motion, closed.signals)
    assert positions < 1e-6  # the square root of the tolerance
    assert 1e-3 < velocities < 1.0
