"""`explore.simulate` by other methods: the same motion, a choice with its reason, a warning with measured errors."""

import re
import warnings

import numpy as np
import pytest

import explore
from explore.comparison.guidance import cheapest, measured
from explore.methods.contract import label
from explore.methods.registry import METHODS

SMOOTH = {"crank": 100.0, "coupler": 1083.4236, "rocker": 541.7118, "ground": 691.7118}
#: A relative margin of 1e-7, dyadic, and a turn of which one angle is at the toggle.
NEAR = {"crank": 150.0, "coupler": 1083.5, "rocker": 541.75, "ground": 691.75 + 2.0**-13}
TURN = np.linspace(90.0, 450.0, 73)


def test_auto_is_the_closed_form_and_says_why():
    motion = explore.simulate("crank-rocker", **SMOOTH)
    assert motion.attrs["method"] == "closed-form"
    assert re.match(
        r"closed-form: measured error .* the next that meets it, .*, costs .* times as much", motion.attrs["why"]
    )
    assert motion.equals(explore.simulate("crank-rocker", method="closed-form", **SMOOTH))


@pytest.mark.parametrize("branch", [1, -1])
@pytest.mark.parametrize("method", ["newton", "textbook", "rk45-projected"])
def test_other_methods_give_the_same_signals(method, branch):
    exact = explore.simulate("crank-rocker", speed=3.0, branch=branch, angles=72, **SMOOTH)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        motion = explore.simulate("crank-rocker", speed=3.0, branch=branch, angles=72, method=method, **SMOOTH)
    assert list(motion.columns) == list(exact.columns)
    assert motion.attrs["method"].startswith(method)
    for name in exact:
        difference = motion[name] - exact[name]
        if name.endswith("_angle"):
            difference = np.remainder(difference + 180.0, 360.0) - 180.0
        assert np.abs(difference).max() <= 1e-9 * max(1.0, exact[name].abs().max()), name


def test_an_inaccurate_method_warns_with_its_measured_errors():
    with pytest.warns(RuntimeWarning, match=r"rk45\(rtol=0.001\) misses 1e-09 here: it is off by .* rad") as caught:
        motion = explore.simulate("crank-rocker", method="rk45(rtol=0.001)", **SMOOTH)
    assert caught[0].filename == __file__, "the warning points to the caller"
    exact = explore.simulate("crank-rocker", **SMOOTH)
    stated = float(re.search(r"([0-9.e-]+) of the largest velocity", str(caught[0].message))[1])
    errors = [
        np.abs(motion[name] - exact[name]).max() / exact[name].abs().max()
        for name in ("coupler_velocity", "rocker_velocity")
    ]
    assert stated == pytest.approx(max(errors), rel=0.05)  # two digits are printed


def test_a_method_on_the_wrong_branch_warns():
    with pytest.warns(RuntimeWarning, match="newton-unchecked.* is on the wrong branch here"):
        explore.simulate("crank-rocker", method="newton-unchecked", angles=TURN, **NEAR)


def test_a_method_that_fails_warns_and_gives_nothing():
    with pytest.warns(RuntimeWarning, match="newton.* failed here: the iteration converged to the other branch"):
        motion = explore.simulate("crank-rocker", method="newton", angles=TURN, **NEAR)
    assert motion["rocker_velocity"].isna().any()


def test_the_choice_is_the_cheapest_that_meets_the_tolerance():
    """Against the table itself, by brute force."""
    for margin in (0.05, 1e-4, 1e-11):
        for tolerance in (1e-2, 1e-6, 1e-12):
            method, why = cheapest(margin, tolerance)
            near = max(row.margin for row in measured() if row.margin <= margin)
            good = [row for row in measured() if row.margin == near and row.error <= tolerance]
            assert label(method) == min(good, key=lambda row: row.cost).setting
            assert why.startswith(label(method))


def test_the_table_knows_every_setting_that_is_no_peer():
    known = {label(method) for methods in METHODS.values() for method in methods}
    assert {row.setting for row in measured()} <= known


def test_nearer_than_any_measurement_it_is_the_closed_form():
    method, why = cheapest(1e-20, 1e-9)
    assert (label(method), why) == ("closed-form", "closed-form: nothing was measured at a relative margin of 1e-20")


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"method": "newtn"}, "unknown method 'newtn'; did you mean 'newton'?"),
        ({"method": "rk45", "angles": [90.0, 80.0]}, "goes from one crank angle to the next; give ascending angles"),
        ({"tolerance": 0.0}, "tolerance = 0; give a number between 0 and 1"),
        ({"tolerance": float("nan")}, "tolerance = nan"),
    ],
)
def test_wrong_requests(wrong, words):
    with pytest.raises(explore.RequestError, match=re.escape(words)):
        explore.simulate("crank-rocker", **SMOOTH, **wrong)
