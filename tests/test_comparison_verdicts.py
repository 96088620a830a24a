"""Verdicts on motions made up for the purpose: each kind of failure is seen for what it is."""

import numpy as np
import pytest

from explore.comparison.reference import exact_motion
from explore.comparison.verdicts import Verdict, judge
from explore.methods.closed_form import ClosedForm
from explore.methods.contract import Level, Motion, Outcome, Task

LENGTHS = np.array([[100.0, 1083.4236, 541.7118, 691.7118]])
BLOCKED = np.array([[200.0, 1083.4236, 541.7118, 691.7118]])
ANGLES = np.linspace(0.0, 6.0, 13)[None, :]


def task(lengths=LENGTHS, branch=1.0):
    return Task(lengths, np.array([branch]), ANGLES, Level.VELOCITIES)


@pytest.fixture(scope="module")
def exact():
    return exact_motion(LENGTHS, np.ones(1), ANGLES)


def motion(signals, outcome=Outcome.OK):
    zero = np.zeros(1, dtype=np.int64)
    return Motion(signals, np.array([outcome], dtype=np.int8), zero, zero)


def verdict(of, exact, lengths=LENGTHS, goal=1e-6):
    return Verdict(int(judge(task(lengths), of, exact, goal).verdict[0]))


def test_the_exact_motion_is_right_without_error(exact):
    judgement = judge(task(), motion(exact[:4].copy()), exact, 1e-15)
    assert judgement.verdict.tolist() == [Verdict.RIGHT]
    assert judgement.largest.tolist() == judgement.rms.tolist() == [[0.0], [0.0]]


def test_errors_are_those_put_in(exact):
    wrong = exact[:4].copy()
    wrong[1, 0, 3] += 2e-5 + 2.0 * np.pi  # angles are compared modulo a turn
    wrong[2, 0, 5] += 3e-4 * np.abs(exact[2]).max()
    judgement = judge(task(), motion(wrong), exact, 1e-6)
    assert judgement.verdict.tolist() == [Verdict.INACCURATE]
    assert judgement.largest[:, 0] == pytest.approx([2e-5, 3e-4], rel=1e-9)
    # one of thirteen angles is wrong
    assert judgement.rms[:, 0] == pytest.approx([2e-5 / np.sqrt(13), 3e-4 / np.sqrt(13)], rel=1e-9)
    assert judge(task(), motion(wrong), exact, 1e-3).verdict.tolist() == [Verdict.RIGHT]


def test_a_jump_to_the_mirrored_branch_is_seen(exact):
    other = ClosedForm().solve(task(branch=-1.0)).signals
    wrong = exact[:4].copy()
    wrong[:, 0, 6:] = other[:, 0, 6:]
    assert verdict(motion(wrong), exact) is Verdict.WRONG_BRANCH


def test_what_is_said_counts_before_what_is_found(exact):
    wrong = exact[:4] + 0.5
    assert verdict(motion(wrong, Outcome.NOT_CONVERGED), exact) is Verdict.NOTICED
    assert verdict(motion(wrong, Outcome.RAISED), exact) is Verdict.RAISED
    lost = exact[:4].copy()
    lost[3, 0, 2] = np.nan
    assert verdict(motion(lost), exact) is Verdict.SILENT_NAN
    assert verdict(motion(lost, Outcome.NOT_FINITE), exact) is Verdict.NOTICED


def test_where_there_is_no_motion_only_refusing_is_right(exact):
    none = np.full_like(exact, np.nan)
    assert verdict(motion(exact[:4].copy()), none, BLOCKED) is Verdict.FALSE_OK
    assert verdict(motion(none[:4], Outcome.GAVE_UP), none, BLOCKED) is Verdict.REFUSED
    assert verdict(motion(none[:4], Outcome.RAISED), none, BLOCKED) is Verdict.RAISED
