"""Averaging rules against exact statistics: published figures, rates of convergence, and failures."""

import math
from dataclasses import fields
from itertools import pairwise

import norms
import numpy as np
import pytest
from loop_cases import rockers

from explore.comparison.averaging_rules import (
    AVERAGING_RULES,
    GaussRule,
    GradedRule,
    OnePassRule,
    PublishedRule,
    TrapezoidalRule,
    relative_errors,
)
from explore.comparison.reference_statistics import STATISTICS, exact_statistics
from explore.comparison.scenes import bundled_scenes, load_scene
from explore.comparison.strokes import WINDOWS

ALL_SCENES = [load_scene(path) for path in bundled_scenes().values()]
SCENES = {scene.name: scene.designs for scene in ALL_SCENES if scene.designs.loop.name == "crank-rocker"}
SCENES_WITH_MOTION = [name for name, scene in SCENES.items() if scene.has_strokes.any()]
#: 1 um from the change point.
NEAR_CHANGE_POINT = rockers([[150.0, 1083.4236, 541.7118, 691.7128]])
#: All designs of a scene: start, stop and step.
ALL = (0, None, 1)
#: Designs of two scenes by day, with the change point of the block and the design nearest to one.
DAY = {"large_block": (0, None, 48), "almost_change_point": (1, None, 4)}
#: Designs of these scenes by night.
NIGHT = {"large_block": (0, None, 16), "almost_change_point": ALL}
SCENES_AND_PARTS = [
    *(pytest.param(name, DAY.get(name, ALL), id=name) for name in SCENES_WITH_MOTION),
    *(pytest.param(name, part, id=f"more of {name}", marks=pytest.mark.slow) for name, part in NIGHT.items()),
]
ANGLE, VELOCITY, ACCELERATION = range(3)
MEAN, VARIANCE, CV, MIN, MAX = range(5)
ALL_RULES = [pytest.param(rule, id=repr(rule)) for rules in AVERAGING_RULES.values() for rule in rules]
FINEST_RULES = [pytest.param(rules[-1], id=name) for name, rules in AVERAGING_RULES.items()]


@pytest.fixture(scope="module")
def exact():
    """Exact statistics of a scene's linkages over a window, computed once."""
    cache = {}

    def statistics(name, window, part=None):
        part = DAY.get(name, ALL) if part is None else part
        if (name, window, part) not in cache:
            designs = SCENES[name].part(np.arange(len(SCENES[name]))[slice(*part)])
            cache[name, window, part] = designs, exact_statistics(designs, window)
        return cache[name, window, part]

    return statistics


def error(rule, name, window, exact):
    """Errors of a rule, shape (3, 5, n)."""
    scene, expected = exact(name, window)
    return relative_errors(rule.average(scene, window), expected)


def test_equispaced_samples_alias_near_the_change_point():
    """The standard deviation is 117.13 rad/s^2; samples give 250.4 or 15.5, depending on the first one."""

    def standard_deviation(values):
        return math.sqrt(values[ACCELERATION, VARIANCE, 0]) * 4.2735**2

    assert standard_deviation(exact_statistics(NEAR_CHANGE_POINT, "cycle")) == pytest.approx(117.13, abs=0.005)
    assert standard_deviation(TrapezoidalRule(360).average(NEAR_CHANGE_POINT, "cycle").values) == pytest.approx(
        250.4, abs=0.05
    )
    assert standard_deviation(TrapezoidalRule(360, 0.5).average(NEAR_CHANGE_POINT, "cycle").values) == pytest.approx(
        15.5, abs=0.05
    )
    assert standard_deviation(GradedRule(1e-9).average(NEAR_CHANGE_POINT, "cycle").values) == pytest.approx(
        117.13, abs=0.005
    )


def test_the_published_cv_of_the_published_optimum(exact):
    scene, expected = exact("published_optimum", "drive")
    assert PublishedRule().average(scene, "drive").values[VELOCITY, CV, 0] == pytest.approx(0.47771, abs=5e-6)
    assert expected[VELOCITY, CV, 0] == pytest.approx(0.473262099318, abs=5e-13)


def test_the_trapezoidal_rule_converges_at_the_rate_of_the_nearest_singularity(exact):
    """The squared velocity has simple poles at +-0.87679 i, so the error is proportional to exp(-0.87679 N)."""
    r1, r2, r3, r4 = SCENES["smooth"].parameters[0, :4]
    rate = math.acosh((r4**2 + r1**2 - (r2 - r3) ** 2) / (2.0 * r1 * r4))
    assert rate == pytest.approx(0.87679, abs=5e-6)
    counts = np.arange(15, 29)
    measured = [error(TrapezoidalRule(int(n)), "smooth", "cycle", exact)[VELOCITY, VARIANCE, 0] for n in counts]
    # the next term is exp(-rate 15) = 2e-6 of the first, rounding at 28 nodes 1e-6
    assert -np.polyfit(counts, np.log(measured), 1)[0] == pytest.approx(rate, rel=1e-6)


@pytest.mark.parametrize(("window", "counts"), [("drive", (8, 16, 32)), ("cycle", (3, 6, 12))])
def test_gauss_legendre_converges_geometrically_on_a_stroke_and_on_quarters_of_a_turn(exact, window, counts):
    """Each doubling of the nodes squares the error, until it is that of rounding."""
    measured = [error(GaussRule(n), "smooth", window, exact)[ACCELERATION, VARIANCE, 0] for n in counts]
    assert measured[1] < 0.5 * measured[0] ** 1.5
    assert measured[2] < 0.5 * measured[1] ** 1.5


def test_the_trapezoidal_rule_is_of_second_order_on_a_stroke(exact):
    counts = np.array([33, 65, 129, 257])
    measured = [error(TrapezoidalRule(int(n)), "smooth", "drive", exact)[VELOCITY, VARIANCE, 0] for n in counts]
    assert -np.polyfit(np.log(counts - 1), np.log(measured), 1)[0] == pytest.approx(2.0, abs=0.01)


@pytest.mark.parametrize("window", WINDOWS)
@pytest.mark.parametrize("rule", AVERAGING_RULES["graded"], ids=repr)
@pytest.mark.parametrize(("name", "part"), SCENES_AND_PARTS)
def test_graded_meets_its_tolerance_on_every_scene_with_a_motion(name, part, rule, window, exact):
    scene, expected = exact(name, window, part)
    values, has_motion = rule.average(scene, window).values, scene.has_strokes
    assert has_motion.any()
    for s, signal in enumerate(scene.output):
        mean, variance, _, low, high = expected[s][:, has_motion]
        for k, statistic in enumerate(STATISTICS):
            if statistic == "cv" and not (signal == "rocker_velocity" and window == "drive"):
                assert np.isnan(values[s, k]).all()
                continue
            worst_error = norms.worst(statistic, values[s, k, has_motion], mean, variance, (low, high))
            assert (worst_error <= rule.tolerance).all(), (signal, statistic, worst_error)


@pytest.mark.parametrize(("name", "bound"), [
    ("published", 4e-4),  # the sample variance has a factor n / (n - 1), n = 3200
    ("trapezoid", 3e-6),  # the stroke's ends: pi^2 / 6 N^2
    ("trapezoid-half-step", 3e-6),
    ("one-pass", 3e-6),
    ("gauss", 1e-14),  # rounding
    ("graded", 1e-15),
])  # fmt: skip
def test_the_finest_setting_of_each_rule_is_accurate_on_the_smooth_scene(name, bound, exact):
    for window in WINDOWS:
        errors = error(AVERAGING_RULES[name][-1], "smooth", window, exact)
        assert errors[VELOCITY, VARIANCE, 0] <= bound
        if window == "drive":
            assert errors[VELOCITY, CV, 0] <= bound


@pytest.mark.parametrize("name", [name for name in AVERAGING_RULES if name != "one-pass"])
def test_finer_settings_take_more_nodes_and_have_smaller_errors(name, exact):
    scene, _ = exact("smooth", "drive")
    nodes = [int(rule.average(scene, "drive").nodes[0]) for rule in AVERAGING_RULES[name]]
    assert nodes == sorted(set(nodes))
    errors = [error(rule, "smooth", "drive", exact)[VELOCITY, CV, 0] for rule in AVERAGING_RULES[name]]
    # until rounding dominates
    assert all(after < before for before, after in pairwise(errors) if before > 5e-15)


def test_nodes_counts_the_solved_crank_angles():
    smooth = SCENES["smooth"]
    for rule, stroke, turn in (
        (PublishedRule(50), 50, 50),
        (TrapezoidalRule(9), 9, 9),
        (OnePassRule(9), 9, 9),
        (GaussRule(7), 7, 28),
    ):
        assert rule.average(smooth, "drive").nodes.tolist() == [stroke]
        assert rule.average(smooth, "cycle").nodes.tolist() == [turn]


def mirrored(values):
    """Statistics of the mirror image: angle and acceleration change sign, the velocity does not."""
    image = values.copy()
    for k in (ANGLE, ACCELERATION):
        image[k, [MEAN, MIN, MAX]] = -values[k, [MEAN, MAX, MIN]]
    return image


@pytest.mark.parametrize("window", WINDOWS)
@pytest.mark.parametrize("rule", FINEST_RULES)
def test_the_other_branch_is_the_mirror_image(rule, window):
    lengths = SCENES["smooth"].parameters[:, :4]
    one, other = (rule.average(rockers(lengths, branch), window) for branch in (1.0, -1.0))
    # second differences of 3200 samples: 1e-16 rad over the squared step
    tolerance = 1e-9 if isinstance(rule, PublishedRule) else 1e-14
    np.testing.assert_allclose(other.values, mirrored(one.values), rtol=1e-11, atol=tolerance)
    assert other.nodes.tolist() == one.nodes.tolist()


@pytest.mark.parametrize("window", WINDOWS)
def test_the_exact_statistics_of_the_other_branch_are_the_mirror_image(window):
    lengths = SCENES["smooth"].parameters[:, :4]
    one, other = (exact_statistics(rockers(lengths, branch), window) for branch in (1.0, -1.0))
    assert np.array_equal(other, mirrored(one), equal_nan=True)


@pytest.mark.parametrize("window", WINDOWS)
@pytest.mark.parametrize("rule", ALL_RULES)
def test_linkages_without_a_motion_are_nan_and_do_not_change_others(rule, window):
    impossible = np.vstack([SCENES[n].parameters[:, :4] for n in ("change_point", "blocked_crank", "unassemblable")])
    impossible = np.vstack(
        [impossible, [[4.0, 5.0, 4.5, 2.0], [np.nan, 1.0, 1.0, 1.0]]]
    )  # a double crank does not rock
    smooth = SCENES["smooth"].parameters[:, :4]
    alone = rule.average(rockers(smooth), window)
    mixed = rule.average(rockers(np.vstack([impossible, smooth, impossible])), window)
    # sums in blocks may be ordered differently
    np.testing.assert_allclose(mixed.values[:, :, 5], alone.values[:, :, 0], rtol=1e-11, atol=1e-14)
    assert mixed.nodes[5] == alone.nodes[0]
    others = np.delete(np.arange(11), 5)
    assert mixed.nodes[others].tolist() == [0] * 10
    assert np.isnan(mixed.values[:, :, others]).all()


def test_one_pass_cancels_where_the_rocker_hardly_moves(exact):
    """The squared mean is 1e9 times the variance of the angle, so nine digits of it are lost."""
    one_pass, two_pass = (
        error(rule, "tiny_swing", "cycle", exact)[ANGLE, VARIANCE, 0] for rule in (OnePassRule(64), TrapezoidalRule(64))
    )
    assert 1e-10 < one_pass < 1e-6
    assert two_pass < 1e-12
    one_pass, two_pass = (
        error(rule, "smooth", "cycle", exact)[ANGLE, VARIANCE, 0] for rule in (OnePassRule(64), TrapezoidalRule(64))
    )
    assert max(one_pass, two_pass) < 1e-13


def test_second_differences_cancel_where_the_rocker_hardly_moves(exact):
    """Finer steps increase the error: the rounding error of an angle, 1e-16, is divided by the squared step.

    With 3200 steps four roundings of 1e-16 over the squared step of 1e-3, for an amplitude of 5e-5.
    """
    error_3200, error_51200 = (
        error(PublishedRule(n), "tiny_swing", "drive", exact)[ACCELERATION, MAX, 0] for n in (3_200, 51_200)
    )
    assert error_3200 < 1e-5
    assert error_51200 > 1e-4


def test_samples_miss_the_peak_next_to_the_change_point(exact):
    """Whether equispaced samples contain the peak depends on where they start; the graded rule always does."""
    for rule in (TrapezoidalRule(2048, 0.5), GaussRule(256), PublishedRule(3200)):
        assert error(rule, "almost_change_point", "cycle", exact)[ACCELERATION, MAX, -1] == pytest.approx(1.0, abs=1e-6)
    for rule in (TrapezoidalRule(2048), GradedRule(1e-9)):
        assert error(rule, "almost_change_point", "cycle", exact)[ACCELERATION, MAX, -1] < 1e-14


def test_rules_are_frozen_data_with_a_name():
    for rules in AVERAGING_RULES.values():
        for rule in rules:
            assert rule.name
            assert type(rule)(**{f.name: getattr(rule, f.name) for f in fields(rule)}) == rule
            hash(rule)
