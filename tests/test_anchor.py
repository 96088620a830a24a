"""Input angles may be counted from anywhere: the kernel's half-tangents begin at the angle of the anchor."""

from dataclasses import replace

import numpy as np
import pytest
from toy_mechanism import PEAK

import explore
from explore.evaluation.evaluate import evaluate_columns
from explore.evaluation.windows import find_laws
from explore.mechanisms.registry import MECHANISMS
from explore.running.motions import motion_signals, window_limits
from explore.studies.request.requests import make_request
from explore.testing.derivatives import wrong_derivatives
from explore.testing.statistics import wrong_statistics
from explore.testing.subject import Subject

CRANK_ROCKER, RIG = MECHANISMS["crank-rocker"], MECHANISMS["test-rig"]
#: A binary fraction of a right angle, so that shifted angles in degrees are exact.
SHIFT = 22.5
ANCHOR = np.deg2rad(SHIFT)
DESIGN = {"crank": 100.0, "coupler": 1083.4236, "rocker": 541.7118, "ground": 691.7118}
COLUMNS = {name: np.array([value]) for name, value in DESIGN.items()}
METRICS = ("rocker_velocity_cv", "rocker_acceleration_max", "rocker_angle_mean", "transmission_angle_min_interval")
SHIFTED = replace(CRANK_ROCKER, anchor_angle=ANCHOR, extended=replace(CRANK_ROCKER.extended, anchor_angle=ANCHOR))


def test_a_motion_shifts_with_the_anchor():
    angles = np.linspace(-360.0, 720.0, 41)
    plain, *_ = motion_signals(CRANK_ROCKER, COLUMNS, angles, "closed-form", 1e-9)
    shifted, *_ = motion_signals(SHIFTED, COLUMNS, angles + SHIFT, "closed-form", 1e-9)
    for name, values in plain.items():
        assert shifted[name] == pytest.approx(values, rel=1e-15), name


@pytest.mark.parametrize("opposite", [0.0, 180.0, -180.0])
def test_angles_beside_the_anchor_and_its_opposite_keep_their_digits(opposite):
    """A linkage 1e-12 from its change points, as far from the anchor as a double near 200 is from the next."""
    columns = {"crank": 100.0, "coupler": 300.0, "rocker": 300.0, "ground": 100.0 * (1.0 + 1e-12)}
    columns = {name: np.array([value]) for name, value in columns.items()}
    offsets = np.array([2.0**-k for k in (10, 20, 30, 40, 44)])
    plain, *_ = motion_signals(CRANK_ROCKER, columns, offsets + opposite, "closed-form", 1e-9)
    shifted, *_ = motion_signals(SHIFTED, columns, offsets + (opposite + SHIFT), "closed-form", 1e-9)
    for name, values in plain.items():
        assert shifted[name] == pytest.approx(values, rel=1e-15), name


@pytest.mark.parametrize("window", ["drive", "return", "overlapped_to_extended", "extended_to_overlapped"])
def test_the_ends_of_a_stroke_shift_with_the_anchor(window):
    plain, shifted = (window_limits(m, COLUMNS, window, "slow") for m in (CRANK_ROCKER, SHIFTED))
    # two roundings of an angle of up to two turns
    assert np.array(shifted) - SHIFT == pytest.approx(plain, abs=2.5e-13)


@pytest.mark.parametrize(("start", "stop"), [(31.0, 47.0), (-40.0, 75.0), (10.0, 365.0), (170.0, 190.0)])
def test_an_interval_shifts_with_the_anchor(start, stop):
    def evaluate(mechanism, shift):
        window = {"from": start + shift, "to": stop + shift}
        return evaluate_columns(make_request(mechanism, metrics=METRICS, window=window), COLUMNS).columns

    plain, shifted = evaluate(CRANK_ROCKER, 0.0), evaluate(SHIFTED, SHIFT)
    for name in METRICS:
        # the ends are rounded, and the shortest window is a quarter of a radian long
        assert shifted[name] == pytest.approx(plain[name], rel=1e-13), name


def test_laws_shift_with_the_anchor():
    constants = RIG.constants(np.array([[DESIGN.get(p.name, p.default)] for p in RIG.kernel_parameters]))[:, 0]
    angles = np.linspace(-7.0, 7.0, 301)
    laws = find_laws(RIG, constants, angles)
    assert set(laws) == {0, 1}
    shifted = replace(RIG, anchor_angle=ANCHOR)
    assert (find_laws(shifted, constants, angles + ANCHOR) == laws).all()


@pytest.mark.parametrize("check", [wrong_statistics, wrong_derivatives])
def test_a_shifted_mechanism_keeps_its_promises(check):
    """Statistics over all windows, among them integrals in closed form, agree with sampling at input angles."""
    assert list(check(Subject(SHIFTED, COLUMNS))) == []


def test_a_motion_names_its_input_angle():
    with MECHANISMS.including(replace(PEAK, input_angle="gear angle")):
        motion = explore.simulate("peak", {"distance": 0.1}, angles=4)
    assert motion.index.name == "gear_angle"
    assert explore.simulate("crank-rocker", DESIGN, angles=4).index.name == "crank_angle"


def test_a_mechanism_without_strokes_has_no_drive():
    assert PEAK.default_drive == ""
    with pytest.raises(explore.RequestError, match=r"^drive: unknown drive 'slow'; no window of peak depends on one$"):
        make_request(PEAK, drive="slow")
    assert make_request(PEAK).drive == ""
