"""Verdicts on constructed motions, one for each kind of failure."""

import numpy as np
import pytest
from loop_cases import four_bars

from explore.comparison.methods.closed_form import ClosedForm
from explore.comparison.methods.contract import Level, Motion, Outcome
from explore.comparison.reference import exact_motion
from explore.comparison.verdicts import Verdict, judge

LENGTHS = np.array([[100.0, 1083.4236, 541.7118, 691.7118]])
BLOCKED = np.array([[200.0, 1083.4236, 541.7118, 691.7118]])
ANGLES = np.linspace(0.0, 6.0, 13)[None, :]


def task(lengths=LENGTHS, branch=1.0):
    return four_bars(lengths, branch, ANGLES, Level.VELOCITIES)


@pytest.fixture(scope="module")
def exact():
    return exact_motion(task())


def motion(signals, outcome=Outcome.OK):
    zero = np.zeros(1, dtype=np.int64)
    return Motion(signals, np.array([outcome], dtype=np.int8), zero, zero)


def verdict(motion, exact, lengths=LENGTHS, goal=1e-6):
    return Verdict(int(judge(task(lengths), motion, exact, goal).verdict[0]))


def test_the_exact_motion_is_accurate_with_error_0(exact):
    judgement = judge(task(), motion(exact[:4].copy()), exact, 1e-15)
    assert judgement.verdict.tolist() == [Verdict.ACCURATE]
    assert judgement.max_error.tolist() == judgement.rms_error.tolist() == [[0.0], [0.0]]


def test_errors_are_those_of_the_constructed_motion(exact):
    wrong = exact[:4].copy()
    wrong[1, 0, 3] += 2e-5 + 2.0 * np.pi  # angles are compared modulo a turn
    wrong[2, 0, 5] += 3e-4 * np.abs(exact[2]).max()
    judgement = judge(task(), motion(wrong), exact, 1e-6)
    assert judgement.verdict.tolist() == [Verdict.INACCURATE]
    assert judgement.max_error[:, 0] == pytest.approx([2e-5, 3e-4], rel=1e-9)
    # one of thirteen angles is wrong
    assert judgement.rms_error[:, 0] == pytest.approx([2e-5 / np.sqrt(13), 3e-4 / np.sqrt(13)], rel=1e-9)
    assert judge(task(), motion(wrong), exact, 1e-3).verdict.tolist() == [Verdict.ACCURATE]


def test_a_jump_to_the_mirrored_branch_is_detected(exact):
    mirrored = ClosedForm().solve(task(branch=-1.0)).signals
    wrong = exact[:4].copy()
    wrong[:, 0, 6:] = mirrored[:, 0, 6:]
    assert verdict(motion(wrong), exact) is Verdict.WRONG_BRANCH


def test_a_reported_failure_takes_precedence_over_errors(exact):
    wrong = exact[:4] + 0.5
    assert verdict(motion(wrong, Outcome.NOT_CONVERGED), exact) is Verdict.REPORTED
    assert verdict(motion(wrong, Outcome.RAISED), exact) is Verdict.RAISED
    with_nan = exact[:4].copy()
    with_nan[3, 0, 2] = np.nan
    assert verdict(motion(with_nan), exact) is Verdict.UNREPORTED_NAN
    assert verdict(motion(with_nan, Outcome.NOT_FINITE), exact) is Verdict.REPORTED


def test_without_a_motion_only_rejection_is_correct(exact):
    no_motion = np.full_like(exact, np.nan)
    assert verdict(motion(exact[:4].copy()), no_motion, BLOCKED) is Verdict.FALSE_SUCCESS
    assert verdict(motion(no_motion[:4], Outcome.GAVE_UP), no_motion, BLOCKED) is Verdict.REJECTED
    assert verdict(motion(no_motion[:4], Outcome.RAISED), no_motion, BLOCKED) is Verdict.RAISED
