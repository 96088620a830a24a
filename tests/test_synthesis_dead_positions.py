"""Crank-rockers with a given swing and time ratio: reference values, and the swing and time ratio of every linkage."""

import mpmath as mp
import numpy as np
import pytest
from scipy.optimize import brentq
from synthesis_cases import case

import explore
from explore.base.errors import RequestError
from explore.synthesis.dead_positions import DeadPositions, Family, find_best, find_ranges


def family(swing, time_ratio, sign=1):
    return Family(DeadPositions(np.radians(swing), time_ratio), sign)


def everywhere(rho):
    return np.ones(len(rho), dtype=bool)


def lengths_at(chosen, rho):
    return [float(length[0]) for length in chosen.lengths(np.array([rho]))]


@pytest.mark.parametrize("name", ["crankrocker_exact_1", "crankrocker_exact_2", "crankrocker_exact_3"])
def test_members_of_the_family(name):
    """The free number of the reference is another angle; here it follows from its lengths."""
    inputs, outputs = case(name)
    a, b, c = (float(outputs[key]) for key in "abc")
    found = family(inputs["psi_deg"], float(inputs["K"]), inputs["theta_sign"])
    rho = np.array([(b - a) / (b + a)])
    assert lengths_at(found, rho[0]) == pytest.approx([a, b, c], rel=2e-15)
    least, supplement = found.transmission_angles(rho)
    assert np.degrees(least[0]) == pytest.approx(float(outputs["mu_overlapped_deg"]), rel=2e-15)
    assert 180 - np.degrees(supplement[0]) == pytest.approx(float(outputs["mu_extended_deg"]), rel=2e-15)


@pytest.mark.parametrize(
    "name", ["crankrocker_closed_1", "crankrocker_closed_2", "crankrocker_K1_1", "crankrocker_K1_2"]
)
def test_members_with_a_given_transmission_angle(name):
    inputs, outputs = case(name)
    found = family(inputs["psi_deg"], float(inputs.get("K", 1)))
    floor = np.radians(float(inputs["gamma_deg"]))
    ranges = find_ranges(found, lambda rho: found.worst_transmission_angle(rho) >= floor)
    ends = [lengths_at(found, end) for pair in ranges for end in pair]
    expected = [float(outputs[key]) for key in "abc"]
    assert any(end == pytest.approx(expected, rel=1e-13) for end in ends)


@pytest.mark.parametrize(
    ("swing", "time_ratio", "sign", "expected"),
    [  # crank, coupler, rocker over the ground, best transmission angle in deg, to the printed digits
        (40, 1.25, 1, (0.31844924128, 0.78593488497, 1.0, 42.8078098662)),
        (40, 1.25, -1, (0.25681927287, 0.51965632586, 0.78513867229, 31.8541974870)),
        (60, 1.2, 1, (0.39132842207, 0.92431663603, 0.81814465585, 40.3150180980)),
        (30, 1.5, 1, (0.25769179519, 0.52817967125, 1.13768557093, 31.7206895633)),
        (45, 1.4, 1, (0.37140466657, 0.79822129313, 1.08179166889, 35.1381296027)),
        (50, 1.15, 1, (0.32954320651, 0.88779845869, 0.80842408856, 46.2720413810)),
    ],
)
def test_the_best_transmission_angle(swing, time_ratio, sign, expected):
    found = family(swing, time_ratio, sign)
    ((start, stop),) = find_ranges(found, everywhere)
    best = find_best(found, start, stop)
    angle = np.degrees(found.worst_transmission_angle(np.array([best]))[0])
    assert [*lengths_at(found, best), angle] == pytest.approx(expected, rel=2e-11)
    # No other member is better.
    others = found.worst_transmission_angle(np.linspace(start, stop, 100_001))
    assert np.degrees(np.nanmax(others)) <= angle + 1e-12


def test_a_swing_of_90_deg_has_a_best_crank_too():
    """One page says that the transmission angle grows as the crank shrinks; it has a maximum at a crank of 0.40."""
    found = family(90, 1.1)
    ((start, stop),) = find_ranges(found, everywhere)
    best = find_best(found, start, stop)
    assert lengths_at(found, best)[0] == pytest.approx(0.4019331236, abs=1e-9)
    lower = lengths_at(found, stop)[0]
    assert lower < 0.1
    assert found.worst_transmission_angle(np.array([stop]))[0] < 1e-6


def test_swing_and_time_ratio_by_simulation():
    """1,000 random tasks: `evaluate`, which knows nothing of the task, finds swing and time ratio again."""
    rng = np.random.default_rng(4)
    rows, tasks = [], []
    while len(rows) < 1000:
        swing, time_ratio = rng.uniform(5, 150), rng.choice([1.0, rng.uniform(1.0, 2.5)])
        found = family(swing, time_ratio, int(rng.choice([1, -1])))
        rho = rng.uniform(0.001, 0.999, 1)
        if found.is_valid(rho)[0] and found.lengths(rho)[0][0] > 1e-3:
            rows.append([*lengths_at(found, rho[0]), 1.0])
            tasks.append((swing, time_ratio))
    columns = dict(zip(("crank", "coupler", "rocker", "ground"), np.array(rows).T, strict=True))
    table = explore.evaluate("crank-rocker", columns, metrics=["swing_angle", "time_ratio"])
    assert (table["status"] == 1).all()
    swings, ratios = np.array(tasks).T
    # Lengths rounded to doubles change the swing by their condition, which grows near the ends of a family.
    np.testing.assert_allclose(table["swing_angle"], swings, rtol=1e-9)
    np.testing.assert_allclose(table["time_ratio"], ratios, rtol=1e-9)


@pytest.mark.parametrize("name", ["crankrocker_quartic_1", "crankrocker_quartic_2", "crankrocker_quartic_3"])
def test_what_the_published_procedure_makes(name):
    """Its linkages have the transmission angle but not the swing; the family has no member with these lengths."""
    inputs, outputs = case(name)
    a, b, c = float(inputs["a"]), float(outputs["b"]), float(outputs["c"])
    table = explore.evaluate(
        "crank-rocker", {"crank": a, "coupler": b, "rocker": c, "ground": 1.0}, metrics=["swing_angle"]
    )
    assert table["swing_angle"][0] == pytest.approx(float(outputs["actual_psi_deg"]), rel=1e-13)
    found = family(inputs["psi_deg"], float(inputs["K"]))
    rho = brentq(lambda x: lengths_at(found, x)[0] - a, *find_ranges(found, everywhere)[0])
    assert abs(lengths_at(found, rho)[1] - b) > 0.01


def test_the_dead_angle_may_equal_the_swing():
    """The usual formula divides by the sine of their difference."""
    swing = 36.0
    found = family(swing, 1.5)  # a dead angle of 36 deg
    ((start, stop),) = find_ranges(found, everywhere)
    a, b, c = lengths_at(found, (start + stop) / 2)
    with mp.workdps(30):
        limit = [mp.acos((1 + mp.mpf(c) ** 2 - side**2) / (2 * mp.mpf(c))) for side in (mp.mpf(b) - a, mp.mpf(b) + a)]
        assert float(mp.degrees(limit[1] - limit[0])) == pytest.approx(swing, rel=1e-14)


@pytest.mark.parametrize("arguments", [(0, 1.2), (180, 1.2), (40, 0.9), (40, float("inf"))])
def test_tasks_that_make_no_sense(arguments):
    with pytest.raises(RequestError, match="the (swing|time ratio) is"):
        family(*arguments)
