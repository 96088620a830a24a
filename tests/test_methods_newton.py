"""Newton's method, in NumPy and compiled: corrections, cost, and changes of branch."""

from dataclasses import replace

import numpy as np
import pytest
from loop_cases import four_bars, largest_gap
from test_methods import BENIGN, differences, turn

from explore.comparison.methods.closed_form import ClosedForm
from explore.comparison.methods.contract import Capability, Level, Outcome
from explore.comparison.methods.newton import Newton
from explore.comparison.methods.newton_compiled import CompiledNewton

in_both_languages = pytest.mark.parametrize("newton", [Newton, CompiledNewton])
#: Exponents k of Grashof margins 2**-k mm, which are exact because the lengths are dyadic.
EXPONENTS = np.arange(46)
NEAR_CHANGE_POINT = np.array([[150.0 - 2.0**-k, 1083.5, 541.75, 691.75] for k in EXPONENTS])
#: Crank, start angles of the published study, their gap in mm, and exact angles; all at a crank angle of 90 degrees.
PUBLISHED = [
    (150.0, (0.2442, 0.8373), 10.03, (0.2359565652503938, 0.8397051846065310)),
    (100.0, (0.2966, 0.8897), 5.35, (0.2985139259147518, 0.8832418337186799)),
    (200.0, (0.1744, 0.8024), 1.93, (0.1774195053439438, 0.8069493079893278)),
]


def from_published_start(crank, start):
    """A task of one crank angle with the rounded start angles."""
    lengths = np.array([[crank, 1083.4236, 541.7118, 691.7118]])
    return four_bars(lengths, 1.0, np.full((1, 1), np.pi / 2), Level.POSITIONS, np.array([start]))


@in_both_languages
@pytest.mark.parametrize(("crank", "start", "gap_length", "angles"), PUBLISHED)
def test_an_inexact_start_is_corrected(newton, crank, start, gap_length, angles):
    task = from_published_start(crank, start)
    gap = largest_gap(task, np.array(start)[:, None, None])
    # the angles are printed with four digits: 5e-5 of 1083 mm
    assert gap[0, 0] == pytest.approx(gap_length, abs=0.06)
    motion = newton(1e-12).solve(task)
    assert motion.outcome.tolist() == [Outcome.OK]
    assert motion.signals[:, 0, 0] == pytest.approx(angles, abs=1e-14)  # quadratic convergence: far below the tolerance


@in_both_languages
@pytest.mark.parametrize(("crank", "start", "gap_length", "angles"), PUBLISHED)
def test_each_correction_doubles_the_digits(newton, crank, start, gap_length, angles):
    task = from_published_start(crank, start)
    counts = [newton(tolerance).solve(task).iterations[0] for tolerance in (1e-3, 1e-6, 1e-12)]
    assert counts == [1, 2, 3]


@in_both_languages
@pytest.mark.parametrize("tolerance", [1e-2, 1e-4, 1e-8, 1e-12])
def test_the_loop_is_closed_to_the_tolerance(newton, tolerance):
    task = turn(BENIGN)
    motion = newton(tolerance).solve(task)
    gap = largest_gap(task, motion.signals)
    assert (gap <= tolerance * task.parameters.max(axis=1)[:, None]).all()
    assert (motion.evaluations == 2 * motion.iterations + 73).all()


def test_the_compiled_iteration_is_that_in_numpy():
    """The same corrections at every tolerance, also where the branches nearly meet; angles to a few roundings."""
    task = turn(np.vstack([BENIGN, NEAR_CHANGE_POINT[:10], [[200.0, 1083.4236, 541.7118, 691.7118]]]))
    for tolerance in (1e-4, 1e-8, 1e-12):
        in_numpy, compiled = Newton(tolerance).solve(task), CompiledNewton(tolerance).solve(task)
        turns = in_numpy.outcome == Outcome.OK
        assert np.array_equal(compiled.outcome, in_numpy.outcome)
        assert np.array_equal(compiled.evaluations[turns], in_numpy.evaluations[turns])
        assert np.array_equal(compiled.iterations[turns], in_numpy.iterations[turns])
        assert np.allclose(compiled.signals[:, :4], in_numpy.signals[:, :4], rtol=0, atol=1e-13)


@in_both_languages
def test_converged_designs_take_no_further_evaluations(newton):
    """Evaluations of a design do not depend on the others of the batch, and differ between designs."""
    lengths = np.vstack([BENIGN, NEAR_CHANGE_POINT[[0, 8]]])
    together = newton().solve(turn(lengths))
    alone = [newton().solve(turn(row)).evaluations[0] for row in lengths]
    assert together.evaluations.tolist() == alone
    assert len(set(alone)) > 2


@in_both_languages
def test_a_failed_design_keeps_its_signals_and_takes_no_further_evaluations(newton):
    task = turn([200.0, 1083.4236, 541.7118, 691.7118])
    motion = newton().solve(task)
    assert motion.outcome.tolist() == [Outcome.NOT_CONVERGED]
    undefined = np.isnan(motion.signals).any(axis=(0, 1))
    first = int(undefined.argmax())
    assert undefined[first:].all()
    # the crank is blocked from 35.5854 degrees before 360 on
    assert np.rad2deg(task.crank_angle[0, first]) == pytest.approx(360.0 - 35.5854, abs=5.0)
    # eight evaluations per angle that converges, then 20 corrections and 21 residuals at the angle that fails
    assert motion.evaluations[0] <= 8 * first + 41


@in_both_languages
def test_a_linkage_that_cannot_be_assembled_does_not_converge(newton):
    assert newton().solve(turn([100.0, 2000.0, 541.7118, 691.7118])).outcome.tolist() == [Outcome.NOT_CONVERGED]


@in_both_languages
def test_a_start_on_the_other_branch_is_detected(newton):
    mirrored_start = ClosedForm().solve(turn(BENIGN, -1.0)).signals[:2, :, 0].T
    task = replace(turn(BENIGN), start=mirrored_start)
    assert set(newton().solve(task).outcome) == {Outcome.WRONG_BRANCH}
    assert np.isnan(newton().solve(task).signals).all()
    assert set(Newton(check_branch=False).solve(task).outcome) == {Outcome.OK}
    assert Capability.CHECKS_BRANCH not in Newton(check_branch=False).capabilities


def wrong_velocities(method, task):
    """Outcome of each design, and whether it is reported ok with a velocity error above a thousandth."""
    motion, closed = method.solve(task), ClosedForm().solve(task)
    errors = np.abs(motion.signals[2:] - closed.signals[2:]).max(axis=(0, 2))
    return motion.outcome, (motion.outcome == Outcome.OK) & (errors > 1e-3)


#: Steps of a turn that starts at 90 degrees, and the smallest k whose margin 2**-k mm makes it change the branch.
#: With a multiple of four one crank angle is 360 degrees, where the branches nearly meet; other turns step across it.
BRANCH_CHANGES = {72: 13, 120: 16, 180: 18, 240: 26, 360: 22, 90: None, 91: None, 359: None}


@pytest.mark.parametrize(("steps", "exponent"), BRANCH_CHANGES.items())
@pytest.mark.parametrize("branch", [1.0, -1.0])
def test_the_sign_of_the_determinant_detects_a_wrong_branch(steps, exponent, branch):
    task = turn(NEAR_CHANGE_POINT, branch, steps + 1, Level.VELOCITIES)
    _, silent = wrong_velocities(Newton(check_branch=False), task)
    assert (EXPONENTS[silent.argmax()] if silent.any() else None) == exponent
    outcome, wrong = wrong_velocities(Newton(), task)
    assert not wrong.any()
    assert (outcome[silent] == Outcome.WRONG_BRANCH).all()


@in_both_languages
@pytest.mark.parametrize("first", [-np.pi, -np.pi / 2, 0.0, np.pi / 2])
def test_with_the_check_no_wrong_branch_is_reported_as_ok(newton, first):
    """Four starts, 8 step counts, 46 margins, both branches: every failure is reported."""
    outcomes = set()
    for steps in (24, 60, 72, 73, 100, 144, 181, 288):
        for branch in (1.0, -1.0):
            outcome, wrong = wrong_velocities(
                newton(), turn(NEAR_CHANGE_POINT, branch, steps + 1, Level.VELOCITIES, first)
            )
            assert not wrong.any(), (steps, branch)
            outcomes |= set(outcome)
    assert {Outcome.OK, Outcome.WRONG_BRANCH} <= outcomes <= {Outcome.OK, Outcome.WRONG_BRANCH, Outcome.NOT_CONVERGED}


def test_the_check_misses_branches_closer_than_the_tolerance():
    """At a margin of 2**-30 mm and 1e-6 rad beside 360 degrees the loop closes, but the velocity has an error."""
    task = turn(NEAR_CHANGE_POINT[[30]], 1.0, 73, Level.VELOCITIES, np.pi / 2 + 1e-6)
    motion, closed = Newton().solve(task), ClosedForm().solve(task)
    assert motion.outcome.tolist() == [Outcome.OK]
    positions, velocities = differences(motion, closed.signals)
    assert positions < 1e-6  # the square root of the tolerance
    assert 1e-3 < velocities < 1.0
