"""Rules of averaging against the exact averages: published figures, rates of convergence, and where each rule fails."""

import math
from dataclasses import fields
from itertools import pairwise

import norms
import numpy as np
import pytest

from explore.comparison.averages import RULES, GaussPieces, Graded, OnePass, Published, Trapezoid, errors
from explore.comparison.reference import SIGNALS, STATISTICS, WINDOWS, exact_statistics
from explore.comparison.scenes import bundled_scenes, load_scene
from explore.methods.contract import Outcome
from explore.methods.driver import geometric_outcome

SCENES = {name: load_scene(path) for name, path in bundled_scenes().items()}
TURNING = [name for name, scene in SCENES.items() if (geometric_outcome(scene.lengths) == Outcome.OK).any()]
ONE = np.ones(1)
#: 1 um from the change point.
NEAR = np.array([[150.0, 1083.4236, 541.7118, 691.7128]])
ANGLE, VELOCITY, ACCELERATION = range(3)
MEAN, VARIANCE, CV, MIN, MAX = range(5)
EVERY = [pytest.param(rule, id=repr(rule)) for rules in RULES.values() for rule in rules]
FINEST = [pytest.param(rules[-1], id=name) for name, rules in RULES.items()]


@pytest.fixture(scope="module")
def exact():
    """Exact statistics of a scene's linkages over a window, computed once."""
    kept = {}

    def statistics(name, window):
        if (name, window) not in kept:
            lengths, branch = designs(name)
            kept[name, window] = lengths, branch, exact_statistics(lengths, branch, window)
        return kept[name, window]

    return statistics


def designs(name):
    """Lengths and branch, of the large block enough of them to have the bad one among others."""
    scene = SCENES[name]
    which = slice(None, None, 16 if len(scene.lengths) > 100 else 1)
    return scene.lengths[which], scene.branch[which]


def error(rule, name, window, exact):
    """Errors of a rule, shape (3, 5, n)."""
    lengths, branch, expected = exact(name, window)
    return errors(rule.average(lengths, branch, window), expected)


def test_equispaced_samples_alias_as_published_tools_do():
    """The deviation of the acceleration reads 250.4 or 15.5 rad/s^2, by where the grid starts, and is 117.13."""

    def deviation(values):
        return math.sqrt(values[ACCELERATION, VARIANCE, 0]) * 4.2735**2

    assert deviation(exact_statistics(NEAR, ONE, "cycle")) == pytest.approx(117.13, abs=0.005)
    assert deviation(Trapezoid(360).average(NEAR, ONE, "cycle").values) == pytest.approx(250.4, abs=0.05)
    assert deviation(Trapezoid(360, 0.5).average(NEAR, ONE, "cycle").values) == pytest.approx(15.5, abs=0.05)
    assert deviation(Graded(1e-9).average(NEAR, ONE, "cycle").values) == pytest.approx(117.13, abs=0.005)


def test_the_published_cv_of_the_published_optimum(exact):
    lengths, branch, expected = exact("published_optimum", "drive")
    assert Published().average(lengths, branch, "drive").values[VELOCITY, CV, 0] == pytest.approx(0.47771, abs=5e-6)
    assert expected[VELOCITY, CV, 0] == pytest.approx(0.473262099318, abs=5e-13)


def test_the_trapezoidal_rule_converges_at_the_rate_of_the_nearest_singularity(exact):
    """The squared velocity has simple poles at +-0.87679 i, so the error is C exp(-0.87679 N) without other factor."""
    r1, r2, r3, r4 = SCENES["smooth"].lengths[0]
    rate = math.acosh((r4**2 + r1**2 - (r2 - r3) ** 2) / (2.0 * r1 * r4))
    assert rate == pytest.approx(0.87679, abs=5e-6)
    counts = np.arange(15, 29)
    measured = [error(Trapezoid(int(n)), "smooth", "cycle", exact)[VELOCITY, VARIANCE, 0] for n in counts]
    # the next term is exp(-rate 15) = 2e-6 of the first, rounding at 28 nodes 1e-6
    assert -np.polyfit(counts, np.log(measured), 1)[0] == pytest.approx(rate, rel=1e-6)


def test_gauss_legendre_converges_geometrically_on_a_stroke(exact):
    """Each doubling of the nodes squares the error, until it is that of rounding."""
    measured = [error(GaussPieces(n), "smooth", "drive", exact)[ACCELERATION, VARIANCE, 0] for n in (8, 16, 32)]
    assert measured[1] < 0.5 * measured[0] ** 1.5
    assert measured[2] < 0.5 * measured[1] ** 1.5


def test_the_trapezoidal_rule_is_of_second_order_on_a_stroke(exact):
    counts = np.array([33, 65, 129, 257])
    measured = [error(Trapezoid(int(n)), "smooth", "drive", exact)[VELOCITY, VARIANCE, 0] for n in counts]
    assert -np.polyfit(np.log(counts - 1), np.log(measured), 1)[0] == pytest.approx(2.0, abs=0.01)


@pytest.mark.parametrize("window", WINDOWS)
@pytest.mark.parametrize("rule", RULES["graded"], ids=repr)
@pytest.mark.parametrize("name", TURNING)
def test_graded_meets_its_tolerance_wherever_the_crank_turns(name, rule, window, exact):
    lengths, branch, expected = exact(name, window)
    found = rule.average(lengths, branch, window).values
    good = geometric_outcome(lengths) == Outcome.OK
    assert good.any()
    for s, signal in enumerate(SIGNALS):
        mean, variance, _, low, high = expected[s][:, good]
        for k, statistic in enumerate(STATISTICS):
            if statistic == "cv" and not (signal == "rocker_velocity" and window == "drive"):
                assert np.isnan(found[s, k]).all()
                continue
            worst = norms.worst(statistic, found[s, k, good], mean, variance, (low, high))
            assert (worst <= rule.tolerance).all(), (signal, statistic, worst)


@pytest.mark.parametrize(("name", "bound"), [
    ("published", 4e-4),  # the sample variance has a factor n / (n - 1), n = 3200
    ("trapezoid", 3e-6),  # the stroke's ends: pi^2 / 6 N^2
    ("trapezoid-half-step", 3e-6),
    ("one-pass", 3e-6),
    ("gauss", 1e-14),  # rounding
    ("graded", 1e-15),
])  # fmt: skip
def test_every_rule_at_its_finest_is_right_on_the_smooth_scene(name, bound, exact):
    for window in WINDOWS:
        found = error(RULES[name][-1], "smooth", window, exact)
        assert found[VELOCITY, VARIANCE, 0] <= bound
        if window == "drive":
            assert found[VELOCITY, CV, 0] <= bound


@pytest.mark.parametrize("name", [name for name in RULES if name != "one-pass"])
def test_finer_settings_take_more_nodes_and_err_less(name, exact):
    lengths, branch, _ = exact("smooth", "drive")
    nodes = [int(rule.average(lengths, branch, "drive").nodes[0]) for rule in RULES[name]]
    assert nodes == sorted(set(nodes))
    found = [error(rule, "smooth", "drive", exact)[VELOCITY, CV, 0] for rule in RULES[name]]
    # down to rounding, where luck decides
    assert all(after < before for before, after in pairwise(found) if before > 5e-15)


def test_nodes_are_the_crank_angles_solved():
    smooth = SCENES["smooth"]
    for rule, stroke, turn in (
        (Published(50), 50, 50),
        (Trapezoid(9), 9, 9),
        (OnePass(9), 9, 9),
        (GaussPieces(7), 7, 28),
    ):
        assert rule.average(smooth.lengths, smooth.branch, "drive").nodes.tolist() == [stroke]
        assert rule.average(smooth.lengths, smooth.branch, "cycle").nodes.tolist() == [turn]


def mirrored(values):
    """Averages of the mirror image: angle and acceleration change sign, the velocity does not."""
    image = values.copy()
    for k in (ANGLE, ACCELERATION):
        image[k, [MEAN, MIN, MAX]] = -values[k, [MEAN, MAX, MIN]]
    return image


@pytest.mark.parametrize("window", WINDOWS)
@pytest.mark.parametrize("rule", FINEST)
def test_the_other_branch_is_the_mirror_image(rule, window):
    lengths = SCENES["smooth"].lengths
    one, other = (rule.average(lengths, branch, window) for branch in (ONE, -ONE))
    # second differences of 3200 samples: 1e-16 rad over the squared step
    least = 1e-9 if isinstance(rule, Published) else 1e-14
    np.testing.assert_allclose(other.values, mirrored(one.values), rtol=1e-11, atol=least)
    assert other.nodes.tolist() == one.nodes.tolist()


@pytest.mark.parametrize("window", WINDOWS)
def test_the_other_branch_is_the_mirror_image_exactly(window):
    lengths = SCENES["smooth"].lengths
    one, other = (exact_statistics(lengths, branch, window) for branch in (ONE, -ONE))
    assert np.array_equal(other, mirrored(one), equal_nan=True)


@pytest.mark.parametrize("window", WINDOWS)
@pytest.mark.parametrize("rule", EVERY)
def test_bad_linkages_are_nan_and_spoil_no_others(rule, window):
    bad = np.vstack([SCENES[n].lengths for n in ("change_point", "blocked_crank", "unassemblable")])
    bad = np.vstack([bad, [[4.0, 5.0, 4.5, 2.0], [np.nan, 1.0, 1.0, 1.0]]])  # a double crank does not rock
    smooth = SCENES["smooth"].lengths
    alone = rule.average(smooth, ONE, window)
    mixed = rule.average(np.vstack([bad, smooth, bad]), np.ones(11), window)
    # sums in blocks may be ordered differently
    np.testing.assert_allclose(mixed.values[:, :, 5], alone.values[:, :, 0], rtol=1e-11, atol=1e-14)
    assert mixed.nodes[5] == alone.nodes[0]
    others = np.delete(np.arange(11), 5)
    assert mixed.nodes[others].tolist() == [0] * 10
    assert np.isnan(mixed.values[:, :, others]).all()


def test_one_pass_cancels_where_the_rocker_hardly_moves(exact):
    """The squared mean is 1e9 times the variance of the angle, so that nine digits of it are lost."""
    one, two = (error(rule, "tiny_swing", "cycle", exact)[ANGLE, VARIANCE, 0] for rule in (OnePass(64), Trapezoid(64)))
    assert 1e-10 < one < 1e-6
    assert two < 1e-12
    one, two = (error(rule, "smooth", "cycle", exact)[ANGLE, VARIANCE, 0] for rule in (OnePass(64), Trapezoid(64)))
    assert max(one, two) < 1e-13


def test_second_differences_cancel_where_the_rocker_hardly_moves(exact):
    """Finer steps make it worse: an angle is rounded to 1e-16, and that is divided by the squared step."""
    fine, finer = (error(Published(n), "tiny_swing", "drive", exact)[ACCELERATION, MAX, 0] for n in (3_200, 51_200))
    assert fine < 1e-6
    assert finer > 1e-5


def test_samples_miss_the_peak_next_to_the_change_point(exact):
    """Of the largest acceleration nothing is left, or all of it, by where the grid starts; the graded rule has it."""
    for rule in (Trapezoid(2048, 0.5), GaussPieces(256), Published(3200)):
        assert error(rule, "almost_change_point", "cycle", exact)[ACCELERATION, MAX, -1] == pytest.approx(1.0, abs=1e-6)
    for rule in (Trapezoid(2048), Graded(1e-9)):
        assert error(rule, "almost_change_point", "cycle", exact)[ACCELERATION, MAX, -1] < 1e-14


def test_rules_are_frozen_data_with_a_name():
    for rules in RULES.values():
        for rule in rules:
            assert rule.name
            assert rule.summary
            assert type(rule)(**{f.name: getattr(rule, f.name) for f in fields(rule)}) == rule
            hash(rule)
