"""Properties of every crank-rocker: 60 digits of motion and closed form, scaling, clutch output."""

import math

import numpy as np
import pytest
from exact_linkage import ExactLinkage
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import explore

CI = settings(derandomize=True, deadline=None, max_examples=60)
SIGNALS = ("coupler_velocity", "rocker_velocity", "coupler_acceleration", "rocker_acceleration")
LENGTHS = ("crank", "coupler", "rocker", "ground")
OK, TOLERANCE_NOT_MET = 1, 7


@st.composite
def crank_rockers(draw, margins=(-12.0, 0.0)):
    """Lengths of a crank-rocker whose relative margin is log-uniform in the given decades; any link may be longest."""
    crank = 10.0 ** draw(st.floats(-2.0, -0.15))
    middle = [draw(st.floats(1.05 * crank, 1.6)) for _ in range(2)]
    longest = (sum(middle) - crank) / (1.0 + 10.0 ** draw(st.floats(*margins)))
    assume(longest > max(middle))
    lengths = np.array([crank, *draw(st.permutations([*middle, longest]))]) * draw(st.sampled_from([1.0, 37.0, 1000.0]))
    return dict(zip(LENGTHS, map(float, lengths), strict=True))


def table(design, metrics, **more):
    frame = explore.evaluate("crank-rocker", design, metrics=metrics, **more)
    assert frame["status"].isin((OK, TOLERANCE_NOT_MET)).all()
    return frame


def distance_of_singularities(design):
    """Smaller imaginary part of the complex crank angles of the two toggle positions."""
    r1, r2, r3, r4 = (design[k] for k in LENGTHS)
    toggles = [(r1**2 + r4**2 - (r2 + sign * r3) ** 2) / (2.0 * r1 * r4) for sign in (1, -1)]
    return min(math.acosh(max(1.0, abs(c))) for c in toggles)


@CI
@given(design=crank_rockers(), branch=st.sampled_from([1.0, -1.0]), angle=st.floats(-720.0, 720.0))
def test_motion_agrees_with_60_digits(design, branch, angle):
    """Angles and derivatives at one crank angle, with relative margins down to 1e-12."""
    motion = explore.simulate("crank-rocker", {**design, "branch": branch}, angles=[angle]).iloc[0]
    exact = ExactLinkage(*design.values(), branch=int(branch))
    radians = exact.radians(angle)
    values = [float(v) for v in (*exact.angles(radians), *exact.motion(radians))]
    names = [*(f"{link}_angle" for link in ("coupler", "rocker")), *SIGNALS]
    velocity, acceleration = np.abs(values[2:4]).max(), np.abs(values[4:]).max()
    # An angle in degrees is rounded when turned into rad: at most 1e-13 rad at two turns, times the rate; the rest
    # are a few roundings of terms as large as the sum of the velocities (accelerations).
    noise = 1.0 + design["crank"] / abs(design["ground"] - design["crank"])
    for name, value in zip(names, values, strict=True):
        size = {"e": math.pi, "y": 1.0 + velocity, "n": 1.0 + acceleration}[name[-1]]
        computed = math.radians(motion[name]) if name.endswith("angle") else motion[name]
        difference = abs(computed - value)
        if name.endswith("angle"):
            difference = min(difference, abs(2.0 * math.pi - difference))
        rate = {
            "e": velocity,
            "y": acceleration,
            "n": acceleration * (1.0 + velocity) / distance_of_singularities(design),
        }
        assert difference <= 2e-14 * noise * size + 2e-16 * rate[name[-1]] * math.radians(180.0), name


@CI
@given(design=crank_rockers(), branch=st.sampled_from([1.0, -1.0]))
def test_the_loop_closes(design, branch):
    motion = explore.simulate("crank-rocker", {**design, "branch": branch}, angles=72)
    crank, coupler, rocker = (
        np.exp(1j * np.deg2rad(angle))
        for angle in (motion.index.to_numpy(), motion["coupler_angle"].to_numpy(), motion["rocker_angle"].to_numpy())
    )
    gap = design["crank"] * crank + design["coupler"] * coupler - design["rocker"] * rocker - design["ground"]
    # each angle carries a few roundings of pi, 4e-16 each, times its length
    assert np.abs(gap).max() <= 1e-14 * max(design.values())
    mu = motion["transmission_angle"].to_numpy()
    opposite = np.degrees(np.abs(np.angle(coupler / rocker)))
    # a difference of two angles of up to 180 deg, each rounded: a few 3e-14 deg; the direction of a short link comes
    # from a difference of longer ones, with the roundings of those
    short = min(design["coupler"], design["rocker"])
    assert np.abs(mu - opposite).max() <= 3e-13 + 3e-14 * max(design.values()) / short
    # branch 1: the joint lies left of the line from crank pin to rocker pivot
    pin = design["crank"] * crank
    side = (np.conj(design["ground"] - pin) * design["coupler"] * coupler).imag
    assert (np.sign(side) == branch).all()


METRICS = ["swing_angle", "mid_angle", "time_ratio", "transmission_angle_min", "transmission_angle_max", "cv"]
METRICS += [f"{signal}_{s}" for signal in SIGNALS for s in ("mean", "variance", "min", "max")]


@CI
@given(design=crank_rockers(), power=st.integers(-90, 80))
def test_scaling_by_powers_of_two_is_exact(design, power):
    """To nearly the smallest and the largest lengths that are computed with, 1e-30 and 1e30."""
    scaled = {name: length * 2.0**power for name, length in design.items()}
    one, other = (table(d, [*METRICS, "grashof_margin"]).iloc[0] for d in (design, scaled))
    # scaling by a power of two commutes with every rounding: bit for bit
    for name in [*METRICS, "nodes", "error", "status"]:
        assert one[name] == other[name] or (np.isnan(one[name]) and np.isnan(other[name])), name
    assert other["grashof_margin"] == one["grashof_margin"] * 2.0**power


@CI
@given(design=crank_rockers())
def test_closed_form_agrees_with_60_digits(design):
    names = ["swing_angle", "mid_angle", "time_ratio", "transmission_angle_min", "transmission_angle_max"]
    row = explore.evaluate("crank-rocker", design, metrics=["mean_output_ratio", *names, "grashof_margin"]).iloc[0]
    exact = ExactLinkage(*design.values())
    for name in names:
        expected = getattr(exact, name) if name == "time_ratio" else np.degrees(float(swing_or_angle(exact, name)))
        # promised: 1e-12 relative for any doubles as lengths at a relative margin >= 1e-12
        assert row[name] == pytest.approx(float(expected), rel=1e-12, abs=0.0), name
    assert row["mean_output_ratio"] == pytest.approx(float(exact.swing) / (2 * math.pi), rel=1e-12, abs=0.0)
    # rounded exactly once
    assert row["grashof_margin"] == pytest.approx(float(exact.grashof_margin), rel=1e-15, abs=0.0)


def swing_or_angle(exact, name):
    return exact.swing if name == "swing_angle" else getattr(exact, name)


def sampled_clutch_output(design, phases, sign_of_drive, samples=20_000):
    """Output of the clutches, the largest of all phases, at angles that are denser near 0 and 180 deg."""
    near = distance_of_singularities(design)
    t = np.linspace(-1.0, 1.0, samples // 2) * math.asinh(math.pi / 2 / near)
    graded = np.degrees(near * np.sinh(t))
    period = 360.0 / phases
    angles = np.unique(np.concatenate([np.mod(graded, period), np.mod(graded + 180.0, period)]))
    velocity = [
        explore.simulate("crank-rocker", design, angles=angles + k * period)["rocker_velocity"].to_numpy()
        for k in range(phases)
    ]
    return angles, np.maximum(np.max(sign_of_drive * np.array(velocity), axis=0), 0.0)


@settings(derandomize=True, deadline=None, max_examples=25)
@given(design=crank_rockers((-9.0, 0.0)), phases=st.integers(1, 12), drive=st.sampled_from(["slow", "fast"]))
def test_clutch_output_is_the_largest_of_all_phases(design, phases, drive):
    names = [f"output_velocity_{s}" for s in ("mean", "variance", "min", "max")]
    row = table(design | {"phases": phases}, names, window="clutch", drive=drive).iloc[0]
    stroke = table(design, ["rocker_velocity_mean"], window="drive", drive=drive).iloc[0]["rocker_velocity_mean"]
    angles, output = sampled_clutch_output(design, phases, np.sign(stroke))
    period = 360.0 / phases
    closed_angles, closed = np.append(angles, angles[0] + period), np.append(output, output[0])
    mean = np.trapezoid(closed, closed_angles) / period
    square = np.trapezoid(closed**2, closed_angles) / period
    largest = output.max()
    # trapezoids of 20,000 graded samples: 1e-7 in smooth parts, and at a kink a step (1e-3) squared
    assert row["output_velocity_mean"] == pytest.approx(mean, abs=2e-5 * largest)
    assert row["output_velocity_variance"] == pytest.approx(square - mean**2, abs=4e-5 * largest**2)
    # a sample misses the largest value by a step squared, and the smallest, at a kink, by a step times the slope
    assert largest * (1 - 1e-12) <= row["output_velocity_max"] <= largest * (1 + 1e-4)
    assert output.min() - 1e-2 * largest <= row["output_velocity_min"] <= output.min() + 1e-12 * largest
