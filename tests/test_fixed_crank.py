"""The variable crank beside a fixed one, of equal stroke and of equal length, against the slider-crank itself."""

from functools import partial

import mpmath
import numpy as np
import pytest

import explore
from explore.mechanisms.variable_crank.fixed_crank import _rounding, _slope, _speed, fixed_crank_share

DESIGNS = {
    "rod": np.array([500.0, 500.0, 250.0, 300.0]),
    "slider_speed": 800.0,
    "speed": 100.0 * np.pi / 30.0,
    "reversal_time": np.array([0.1, 0.2, 0.05, 0.15]),
    "blend_order": np.array([2.0, 2.0, 1.0, 3.0]),
}
#: Steps of the half-turn, from the outer to the inner dead centre.
STEPS = 20_000


def share_by_samples(crank, rod, speed, wanted, deviation):
    """Share of the samples of a slider-crank's motion within the deviation, the ends interpolated."""
    angles = np.linspace(0.0, 180.0, STEPS + 1)
    design = {"crank": crank, "rod": rod, "speed": speed}
    velocity = np.abs(explore.simulate("slider-crank", design, angles=angles)["slider_velocity"].to_numpy())
    total = 0.0
    for level, sign in (((1.0 - deviation) * wanted, 1.0), ((1.0 + deviation) * wanted, -1.0)):
        above = velocity - level
        first, second = above[:-1], above[1:]
        with np.errstate(divide="ignore", invalid="ignore"):
            part = np.where(first > 0.0, first, second) / np.abs(first - second)
        total += sign * np.where((first > 0.0) & (second > 0.0), 1.0, np.where(first * second < 0.0, part, 0.0)).sum()
    return total / STEPS


@pytest.mark.parametrize("kind", ["stroke", "length"])
def test_shares_are_those_of_the_slider_crank(kind):
    forms = ("fixed_crank_speed_share_{}_equal_{}", "speed_share_{}_gain_equal_{}")
    names = [form.format(percent, kind) for percent in (1, 2, 5) for form in forms]
    lengths = ["stroke", "crank_max", *(f"speed_share_{percent}" for percent in (1, 2, 5))]
    table = explore.evaluate("variable-crank", DESIGNS, metrics=[*names, *lengths])
    assert (table["status"] == 1).all()
    for _, row in table.iterrows():
        crank = 0.5 * row["stroke"] if kind == "stroke" else row["crank_max"]
        for percent in (1, 2, 5):
            share = share_by_samples(crank, row["rod"], DESIGNS["speed"], 800.0, 0.01 * percent)
            # interpolation over steps of 1.6e-4 rad is off by their square, more where the speed is near its peak
            assert share > 0.0
            assert row[f"fixed_crank_speed_share_{percent}_equal_{kind}"] == pytest.approx(share, abs=1e-6)
            gain = row[f"speed_share_{percent}"] / row[f"fixed_crank_speed_share_{percent}_equal_{kind}"]
            assert row[f"speed_share_{percent}_gain_equal_{kind}"] == pytest.approx(gain, rel=1e-15)


def test_the_bound_holds_where_a_level_is_the_peak():
    """Durations a rounding apart: there the share is as the root of how far the peak is above the level."""
    times = np.linspace(2.99095770115985, 2.99095770115995, 2001) / 10.0
    design = {"rod": 500.0, "slider_speed": 20.0, "speed": 10.0, "blend_order": 1.0, "reversal_time": times}
    name = "fixed_crank_speed_share_1_equal_stroke"
    table = explore.evaluate("variable-crank", design, metrics=[name])
    apart = (table[name].diff().abs() / table[name]).fillna(0.0)
    assert apart.max() > 1e-8
    assert (table["error"] > apart).all()
    assert table["error"].max() < 1e-6


def test_a_crank_that_never_is_as_fast_has_no_share():
    """It is 0 without any error, and the design is feasible."""
    name = "fixed_crank_speed_share_1_equal_stroke"
    design = {"rod": 500.0, "slider_speed": 20.0, "speed": 10.0, "blend_order": 1.0, "reversal_time": 0.31}
    table = explore.evaluate("variable-crank", design, metrics=[name])
    assert table[[name, "error", "status"]].iloc[0].tolist() == [0.0, 0.0, 1.0]


def test_a_design_without_motion_has_no_fixed_crank():
    name = "fixed_crank_speed_share_2_equal_stroke"
    table = explore.evaluate("variable-crank", DESIGNS | {"reversal_time": 0.29}, metrics=[name])
    assert table[name].isna().all()


@pytest.mark.parametrize("ratio", [1e-3, 0.2, 0.5, 0.9, 0.999])
def test_the_speed_of_a_fixed_crank_has_one_peak(ratio):
    """Which the two roots of a level need."""
    theta = np.linspace(0.0, np.pi, 200_001)[1:-1]
    slope = _slope(theta, np.full_like(theta, ratio))
    assert np.count_nonzero(np.diff(np.sign(slope))) == 1
    difference = np.gradient(_speed(theta, np.full_like(theta, ratio)), theta)
    # second-order differences; third derivatives grow near a ratio of 1
    assert np.abs(difference - slope)[1:-1].max() <= (1e-8 if ratio < 0.95 else 1e-3)


def exact_share_above(ratio, level):
    """Part of the half-turn above a level, by bisection with 40 digits on both sides of the peak."""

    def speed(theta):
        sine, cosine = mpmath.sin(theta), mpmath.cos(theta)
        return sine * (1 + ratio * cosine / mpmath.sqrt(1 - (ratio * sine) ** 2))

    def first_false(holds, low, high):
        for _ in range(130):
            middle = (low + high) / 2
            low, high = (middle, high) if holds(middle) else (low, middle)
        return low

    step = mpmath.mpf(10) ** -18
    peak = first_false(lambda theta: speed(theta + step) > speed(theta - step), mpmath.mpf(0), mpmath.pi)
    if speed(peak) <= level:
        return 0
    first = first_false(lambda theta: speed(theta) < level, mpmath.mpf(0), peak)
    return (first_false(lambda theta: speed(theta) >= level, peak, mpmath.pi) - first) / mpmath.pi


def test_shares_keep_their_bounds_for_any_ratio_and_level():
    """Cranks as long as the rod but for 1e-13, tiny ones, and levels beside the peak, of which f is 1 or a little more.

    There the derivative of f cancels at the inner dead centre, and the two angles meet.
    """
    rng = np.random.default_rng(20261201)
    with mpmath.workdps(40):
        for number in range(40):
            ratio = 1.0 - 10.0 ** rng.uniform(-13, -0.3) if number % 2 else 10.0 ** rng.uniform(-6, -0.1)
            largest = _speed(np.linspace(0.0, np.pi, 20_001), np.array(ratio)).max()
            level = largest * rng.choice([rng.uniform(0.0, 1.1), 0.8 - 10.0 ** rng.uniform(-12, -2)])
            # the deviation is one whose levels are exact
            design = np.array([ratio]), np.array([1.0]), np.array([level * ratio]), np.array([1.0])
            share = partial(fixed_crank_share, deviation=0.25)
            speed = mpmath.mpf(level * ratio) / mpmath.mpf(ratio)
            true = exact_share_above(mpmath.mpf(ratio), 0.75 * speed) - exact_share_above(
                mpmath.mpf(ratio), 1.25 * speed
            )
            # of 9,000 the largest error was a fourth of the bound
            assert abs(share(*design)[0] - true) <= 0.5 * _rounding(share, *design)[0], (ratio, level)
