"""`explore.simulate` by other methods: the same motion, or a warning with measured errors."""

import re
import warnings

import numpy as np
import pytest

import explore
from explore.comparison.methods.contract import method_label
from explore.comparison.methods.registry import METHODS, find_method
from explore.mechanisms.registry import MECHANISMS
from explore.running.motions import window_limits

SMOOTH = {"crank": 100.0, "coupler": 1083.4236, "rocker": 541.7118, "ground": 691.7118}
#: A relative margin of 1e-7, dyadic, and a turn of which one angle is at the toggle.
NEAR = {"crank": 150.0, "coupler": 1083.5, "rocker": 541.75, "ground": 691.75 + 2.0**-13}
TURN = np.linspace(90.0, 450.0, 73)


def test_the_default_is_the_closed_form():
    motion = explore.simulate("crank-rocker", SMOOTH)
    assert motion.attrs["method"] == "closed-form"
    assert motion.equals(explore.simulate("crank-rocker", SMOOTH, method="closed-form"))


@pytest.mark.parametrize("count", [1, 7, 50, 100, 1000])
def test_evenly_spread_angles_are_found_by_their_decimals(count):
    motion = explore.simulate("crank-rocker", SMOOTH, angles=count)
    assert motion.index.tolist() == [360 * k / count for k in range(count)], "46.8 and not 46.800000000000004"


@pytest.mark.parametrize("branch", [1, -1])
@pytest.mark.parametrize("method", ["newton", "textbook", "rk45-projected"])
def test_other_methods_give_the_same_signals(method, branch):
    exact = explore.simulate("crank-rocker", {"speed": 3.0, "branch": branch, **SMOOTH}, angles=72)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        motion = explore.simulate("crank-rocker", {"speed": 3.0, "branch": branch, **SMOOTH}, angles=72, method=method)
    assert list(motion.columns) == list(exact.columns)
    assert motion.attrs["method"].startswith(method)
    for name in exact:
        difference = motion[name] - exact[name]
        if name.endswith("_angle"):
            difference = np.remainder(difference + 180.0, 360.0) - 180.0
        assert np.abs(difference).max() <= 1e-9 * max(1.0, exact[name].abs().max()), name


def test_an_inaccurate_method_warns_with_its_measured_errors():
    with pytest.warns(
        RuntimeWarning, match=r"rk45\(rtol=0.001\) misses the tolerance 1e-09 for this design: its errors .* rad"
    ) as caught:
        motion = explore.simulate("crank-rocker", SMOOTH, method="rk45(rtol=0.001)")
    assert caught[0].filename == __file__, "the warning points to the caller"
    exact = explore.simulate("crank-rocker", SMOOTH)
    stated = float(re.search(r"([0-9.e-]+) of the largest velocity", str(caught[0].message))[1])
    errors = [
        np.abs(motion[name] - exact[name]).max() / exact[name].abs().max()
        for name in ("coupler_velocity", "rocker_velocity")
    ]
    assert stated == pytest.approx(max(errors), rel=0.05)  # two digits are printed


def test_a_method_on_the_wrong_branch_warns():
    with pytest.warns(RuntimeWarning, match="newton-unchecked.* is on the wrong branch for this design"):
        explore.simulate("crank-rocker", NEAR, method="newton-unchecked", angles=TURN)


def test_a_method_that_fails_warns_and_returns_nan():
    with pytest.warns(
        RuntimeWarning, match="newton.* failed for this design: the iteration converged to another assembly"
    ):
        motion = explore.simulate("crank-rocker", NEAR, method="newton", angles=TURN)
    assert motion["rocker_velocity"].isna().any()


def test_a_method_is_found_by_name_or_by_label():
    assert find_method("newton") == METHODS["newton"][-1], "the finest setting"
    for methods in METHODS.values():
        for method in methods:
            assert find_method(method_label(method)) == method


def test_a_peer_that_is_not_installed_is_named(monkeypatch):
    monkeypatch.setitem(METHODS, "pylinkage", ())
    with pytest.raises(explore.RequestError, match="'pylinkage' is not installed"):
        find_method("pylinkage")


def test_other_mechanisms_have_the_closed_form_only():
    with pytest.raises(explore.RequestError, match="test-rig has only the closed form; other methods solve"):
        explore.simulate("test-rig", SMOOTH, method="newton")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"method": "newtn"}, "unknown method 'newtn'; did you mean 'newton'?"),
        ({"method": "radau(rtol=1e-3)"}, "available: radau(rtol=0.001), radau(rtol=1e-06), radau(rtol=1e-09)"),
        (
            {"method": "rk45", "angles": [90.0, 80.0]},
            "proceeds from one crank angle to the next; give ascending angles",
        ),
        ({"tolerance": 0.0}, "tolerance = 0; give a number between 0 and 1"),
        ({"tolerance": float("nan")}, "tolerance = nan"),
    ],
)
def test_invalid_requests(arguments, message):
    with pytest.raises(explore.RequestError, match=re.escape(message)):
        explore.simulate("crank-rocker", SMOOTH, **arguments)


def test_the_speed_scales_velocities_and_accelerations_alone():
    slow, fast = (explore.simulate("crank-rocker", {**SMOOTH, "speed": speed}, angles=24) for speed in (1.0, 4.0))
    for name in slow:
        power = 2 if name.endswith("_acceleration") else 1 if name.endswith("_velocity") else 0
        np.testing.assert_array_equal(fast[name], 4.0**power * slow[name], err_msg=name)


@pytest.mark.parametrize("name", ["crank-rocker", "test-rig"])
def test_limits_of_a_window_of_several_pieces(name):
    mechanism = MECHANISMS[name]
    columns = {
        link: np.array([length])
        for link, length in zip(mechanism.loop_lengths, (100.0, 300.0, 250.0, 350.0), strict=True)
    }
    start, stop = window_limits(mechanism, columns, "cycle", mechanism.default_drive)
    assert stop - start == pytest.approx(360.0, rel=1e-14)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"crank": -100.0}, "crank: must be greater than 0 mm, got -100.0"),
        ({"ground": 1e-31}, "ground: 1e-31 is outside 1e-30 to 1e+30, the magnitudes that are computed with"),
    ],
)
def test_a_value_that_a_parameter_cannot_take_is_named(change, message):
    with pytest.raises(explore.RequestError) as caught:
        explore.simulate("crank-rocker", SMOOTH | change)
    assert str(caught.value) == message
