"""Verdicts on constructed motions and of every method towards the change point, and the smallest accurate margins."""

import math
from contextlib import contextmanager, nullcontext

import numpy as np
import pandas as pd
import pytest
from few_methods import only
from loop_cases import four_bars

from explore.comparison import stability
from explore.comparison.methods.closed_form import ClosedForm, geometric_outcome
from explore.comparison.methods.contract import Level, Motion, Outcome
from explore.comparison.reference import exact_motion
from explore.comparison.stability import declared_case, map_stability, safe_margins, stability_runs, trace_turn
from explore.comparison.verdicts import Verdict, judge
from explore.figures.charts.stability import stability_chart, turn_chart

ACCURACY = 1e-6
CASE = declared_case("crank-rocker")


@pytest.fixture(scope="module", params=["few methods", pytest.param("all methods", marks=pytest.mark.slow)])
def rows(request):
    names = ("closed-form", "textbook", "newton", "newton-unchecked", "rk45")
    with few(*names) if request.param == "few methods" else nullcontext():
        return map_all(CASE)


def map_all(case):
    """The rows of a case, one for each run and design."""
    rows = map_stability(case, ACCURACY)
    assert len(rows) == len(stability_runs(case)) * len(case.margin)
    return rows


@contextmanager
def few(*names):
    """These methods at few angles, rk45 at its two coarsest settings."""
    with only(*names) as methods, pytest.MonkeyPatch.context() as patch:
        methods["rk45"] = methods["rk45"][:2]
        patch.setattr(stability, "STEP_COUNTS", (24, stability.DEFAULT_STEP_COUNT))
        yield


def turning_rows(rows, setting, angles=72):
    """Rows of a setting whose crank turns, by descending margin."""
    turning = [row for row in rows if (row["setting"], row["angles"]) == (setting, angles) and row["margin"] > 0.0]
    return sorted(turning, key=lambda row: -row["margin"])


def test_margins_of_the_crank_rocker_are_exact():
    assert (np.diff(CASE.margin) < 0.0).all()
    has_motion = geometric_outcome(CASE.task(24)) == 1
    assert np.array_equal(has_motion, CASE.margin > 0.0)


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


@pytest.fixture(scope="module")
def slicer_rows():
    """Rows of the variable crank by four methods."""
    case, names = declared_case("variable-crank"), ("closed-form", "textbook", "newton-compiled", "rk45")
    with few(*names):
        rows = map_all(case)
    with only(*names):
        return rows, trace_turn(case)


def test_at_the_singular_angle_only_the_closed_form_is_left(slicer_rows):
    rows, _ = slicer_rows
    at_angle = {row["setting"]: row["verdict"] for row in rows if row["margin"] == 0.0 and row["angles"] == 72}
    assert at_angle.pop("closed-form") == "accurate"
    assert "accurate" not in at_angle.values()
    closed_form = [row["error"] for row in rows if row["method"] == "closed-form"]
    assert max(closed_form) < 2e-14, "its series has no singularity"


def test_the_textbook_loses_two_digits_of_the_velocity_with_each_of_the_distance(slicer_rows):
    """The root of a difference is as wrong as its rounding over itself, its derivative by that over the root again."""
    rows, _ = slicer_rows
    for row in turning_rows(rows, "textbook"):
        if 1e-5 < row["margin"] < 1.0:
            distance = np.deg2rad(row["margin"])
            assert row["error"] < 30.0 * 2.2e-16 / distance**2
    (middle,) = [row["error"] for row in rows if row["method"] == "textbook" and row["margin"] == 1e-4]
    assert middle > 1e-5


def test_adaptive_integration_ends_at_the_singular_angle_at_every_distance(slicer_rows):
    rows, turn = slicer_rows
    verdicts = {
        row["verdict"] for row in rows if row["setting"].startswith("rk45") and row["setting"] != "rk45(rtol=0.001)"
    }
    assert verdicts == {"reported failure"}
    regular = float(np.rad2deg(declared_case("variable-crank").singular_angles[0]))
    solved = [row["crank_angle"] for row in turn if row["method"] == "rk45" and not math.isnan(row["error"])]
    assert regular - 2.0 < max(solved) < regular


def test_the_turn_of_the_closed_form_is_accurate_throughout(slicer_rows):
    _, turn = slicer_rows
    errors = [row["error"] for row in turn if row["method"] == "closed-form"]
    assert len(errors) == 361
    assert max(errors) < 2e-14


def test_the_figures_name_the_singular_angle(slicer_rows):
    case, (rows, turn) = declared_case("variable-crank"), slicer_rows
    figure = stability_chart(pd.DataFrame(rows), ACCURACY, case.distance, case.beyond)
    labels = {panel.get_xlabel().replace("\n", " ") for panel in figure.axes} - {""}
    assert labels == {"distance of a crank angle from the singular one, deg; right of the bar it is the singular angle"}
    angles = [math.degrees(angle) for angle in case.singular_angles]
    (panel,) = turn_chart(pd.DataFrame(turn), angles, "title").axes
    assert [text.get_text() for text in panel.texts] == [" 81.41\N{DEGREE SIGN}", " 278.59\N{DEGREE SIGN}"]


def test_margins_of_the_slider_crank_are_exact():
    case = declared_case("slider-crank")
    outcome = geometric_outcome(case.task(24))
    assert np.array_equal(outcome == Outcome.OK, case.margin > 0.0)
    assert outcome[case.margin == 0.0].tolist() == [Outcome.CHANGE_POINT]
    assert set(outcome[case.margin < 0.0].tolist()) == {Outcome.CRANK_BLOCKED}


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
