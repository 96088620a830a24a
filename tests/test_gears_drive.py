"""Trains of gear pairs as a stepless drive: plateau, ripple, and the branches where clutches miss the plateau."""

import numpy as np
import pytest
from test_gears import TURN, both_sectors, one_of, random_designs

import explore
from explore.base.compiling import LANES
from explore.mechanisms.gears import columns
from explore.mechanisms.gears.columns import Row
from explore.mechanisms.gears.kernel import close
from explore.mechanisms.gears.smoothstep_law import (
    smoothstep_driven_angle,
    smoothstep_driver_angle,
    smoothstep_ratio,
)

BASE = {"growth": 1.5, "sector": 4.2, "centre_distance": 150.0}


def evaluate(design, metrics, **more):
    return explore.evaluate("gears", design, metrics=metrics, **more)


def brute_force_ripple(design, count=20_000):
    """Ripple of samples: ratios over the input angle of each train, interpolated, and the fastest at each."""
    angles, rows = both_sectors(design, count)
    ratio, driven = rows[columns.RATIO], rows[columns.DRIVEN_ANGLE]
    train = ratio / np.interp(angles + design["phase_shift"], np.append(angles, angles + TURN), np.tile(ratio, 2))
    period = TURN / design["trains"]
    places = np.linspace(0.0, period, 40_001)
    fastest = np.max([np.interp(places + k * period, driven, train) for k in range(int(design["trains"]))], axis=0)
    return 1.0 - fastest.min() / max(fastest.max(), train.max())


@pytest.mark.parametrize("order", [0, 1, 2, 3])
def test_the_plateau_is_growth_to_the_shift(order):
    for shift in (0.3, 1.0, 1.2):
        design = BASE | {"phase_shift": shift, "return_order": order, "trains": 4.0}
        motion = explore.simulate("gears", design, angles=np.rad2deg(np.linspace(0.0, 4.2 - shift, 50)[:-1]))
        np.testing.assert_allclose(motion["train_ratio"], 1.5**shift, rtol=1e-14)
        names = ["train_ratio_max", "overall_ratio_max", "overall_ratio_min"]
        row = evaluate(design, names).iloc[0]
        # the plateau is the largest ratio, so that the clutches choose it, and four trains have it all the time
        np.testing.assert_allclose(row[names[1:]].to_numpy(dtype=float), 1.5**shift, rtol=1e-14)
        # the search for the maximum goes up to the joint with the return, where a law of order 3 rounds more
        np.testing.assert_allclose(row["train_ratio_max"], 1.5**shift, rtol=5e-14)


@pytest.mark.parametrize("trains", [2, 3, 4, 6])
def test_no_ripple_up_to_the_largest_shift(trains):
    largest = evaluate(BASE | {"trains": trains}, ["phase_shift_max", "drive_ratio_max"]).iloc[0]
    shift = largest["phase_shift_max"]
    shifts = shift * np.array([0.2, 0.9, 1.0, 1.0 + 1e-6, 1.02, 1.1])
    table = evaluate(BASE | {"trains": trains, "phase_shift": shifts}, ["ripple"])
    assert (table["ripple"][:3] == 0.0).all()
    assert (np.diff(table["ripple"][2:]) > 0.0).all()
    assert table["ripple"][3] < 1e-8
    assert largest["drive_ratio_max"] == pytest.approx(1.5**shift, rel=1e-14)
    # what is computed by the sampled ratio, within its bound
    names = ["overall_ratio_max", "overall_ratio_min"]
    sampled = evaluate(BASE | {"trains": trains, "phase_shift": shifts}, names, tolerance=1e-8)
    ripple = 1.0 - sampled["overall_ratio_min"] / sampled["overall_ratio_max"]
    np.testing.assert_allclose(ripple, table["ripple"], rtol=0, atol=1e-8)
    np.testing.assert_allclose(ripple[:3], 0.0, atol=2e-15)


@pytest.mark.parametrize("order", [0, 1, 2, 3])
def test_a_drive_without_ripple_keeps_its_ratio_by_brute_force(order):
    designs = random_designs(8, 20 + order, return_order=order)
    designs["trains"] = np.array([2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 12.0])
    largest = evaluate(designs, ["phase_shift_max"])["phase_shift_max"].to_numpy()
    designs["phase_shift"] = 0.9 * largest
    table = evaluate(designs, ["overall_ratio_mean", "drive_ratio_max"])
    for k in np.flatnonzero(largest):
        # samples miss a corner by the slope times their distance
        assert abs(brute_force_ripple(one_of(designs, k))) < 2e-4
    expected = designs["growth"] ** designs["phase_shift"]
    np.testing.assert_allclose(table["overall_ratio_mean"], expected, rtol=1e-14)


@pytest.mark.parametrize("order", [1.0, 2.0, 3.0])
def test_the_angle_of_gear_1_is_the_inverse_of_the_input_angle(order):
    """Beside the joints, too: bisections that rounding led to ended 1e-9 rad off."""
    random = np.random.default_rng(int(order))
    for _ in range(40):
        sector = random.uniform(0.1, 6.2)
        growth = np.exp(10.0 ** random.uniform(-4.0, 1.0) / sector)
        record = np.zeros((max(Row) + 1) * LANES)
        given = {"GROWTH": growth, "SECTOR": sector, "CENTRE_DISTANCE": 100.0, "RETURN_ORDER": order, "BRANCH": 1.0,
                 "TRAINS": 3.0}  # fmt: skip
        for name, value in given.items():
            record[Row[name] * LANES : (Row[name] + 1) * LANES] = value
        close(record)
        beyond = (TURN - sector) * np.concatenate([[0.0, 1e-9, 1.0 - 1e-9, 1.0], np.arange(1, 8) / 8, random.random(8)])
        for angle in beyond:
            found = smoothstep_driver_angle(record, 0, smoothstep_driven_angle(record, 0, angle)) - sector
            # roundings of angles, and of powers by those of their exponents; of gear 1 as much times the ratio
            ratio, *_ = smoothstep_ratio(record, 0, angle)
            assert abs(found - angle) <= 4e-15 * (1.0 + ratio) * max(1.0, TURN * np.log(growth))


def test_ripple_beyond_the_largest_shift_of_three_trains():
    """0.10 % at 1.02 and 2.5 % at 1.10 times the largest shift."""
    shift = evaluate(BASE, ["phase_shift_max"])["phase_shift_max"][0]
    ripple = evaluate(BASE | {"phase_shift": [1.02 * shift, 1.1 * shift]}, ["ripple"])["ripple"]
    assert [f"{100.0 * value:.2g}" for value in ripple] == ["0.099", "2.5"]


@pytest.mark.parametrize(("branch", "order"), [(1, 0), (2, 0), (3, 0), (1, 1), (1, 2), (1, 3)])
def test_ripple_is_that_of_brute_force(branch, order):
    random = np.random.default_rng(branch + 10 * order)
    designs = random_designs(6, branch + order, branch=branch, return_order=order)
    designs["trains"] = random.integers(1, 7, 6).astype(float)
    designs["phase_shift"] = random.uniform(0.2, 5.0, 6)
    table = evaluate(designs, ["ripple"])
    for k in range(6):
        expected = brute_force_ripple(one_of(designs, k))
        # samples miss a corner by the slope times their distance
        assert expected - 1e-9 <= table["ripple"][k] <= expected + 2e-4, one_of(designs, k)


@pytest.mark.parametrize(
    ("growth", "sector", "branch", "trains", "shift"), [(6.1101, 5.9833, 18, 7, 0.1326), (1.6716, 5.695, 3, 4, 0.3312),
    (2.2889, 5.6936, 3, 12, 0.3891), (5.3857, 5.8023, 5, 1, 0.2022), (1.2446, 1.1064, 29, 2, 2.315)],
)  # fmt: skip
def test_ripple_of_a_return_that_oscillates_fast(growth, sector, branch, trains, shift):
    """Steps of a thirtieth of a turn saw the plateau alone, and a ripple of 0 in place of 0.9999."""
    design = {
        "growth": growth, "sector": sector, "centre_distance": 150.0, "branch": float(branch), "trains": float(trains),
        "phase_shift": shift,
    }  # fmt: skip
    expected = brute_force_ripple(design)
    ripple = evaluate(design, ["ripple"])["ripple"][0]
    # samples miss a corner by the slope times their distance
    assert expected - 1e-9 <= ripple <= expected + 2e-3 * (1.0 - expected) + 2e-4


@pytest.mark.parametrize("trains", [2, 5, 12])
@pytest.mark.parametrize("order", [0, 1, 2])
def test_a_dip_between_two_trains_is_not_missed(order, trains):
    """Just beyond the largest shift the dips are narrower than any distance of nodes, 2e-4 of a turn and less."""
    design = BASE | {"return_order": order, "trains": float(trains), "growth": 1.9}
    shift = evaluate(design, ["phase_shift_max"])["phase_shift_max"][0]
    for excess in (3e-6, 1e-4, 3e-3):
        shifted = design | {"phase_shift": shift * (1.0 + excess)}
        names = ["ripple", "overall_ratio_min_cycle", "overall_ratio_max_cycle"]
        row = evaluate(shifted, names).iloc[0]
        plateau = 1.9 ** shifted["phase_shift"]
        assert abs(row["overall_ratio_max_cycle"] - plateau) <= row["error"] * plateau
        # the ripple is found to the rounding of ratios
        lowest = (1.0 - row["ripple"]) * plateau
        assert abs(row["overall_ratio_min_cycle"] - lowest) <= (row["error"] + 1e-14) * plateau


def test_on_branch_2_the_plateau_is_not_the_largest_ratio():
    """The plateau would be 1.2247."""
    row = evaluate(BASE | {"branch": 2, "phase_shift": 0.5}, ["train_ratio_max", "overall_ratio_max", "ripple"]).iloc[0]
    assert row["train_ratio_max"] == pytest.approx(4.9364, abs=5e-5)
    # each is refined on panels of its own, to rounding
    assert row["overall_ratio_max"] == pytest.approx(row["train_ratio_max"], rel=1e-14)
    assert row["ripple"] > 0.7


def test_one_train_and_no_shift():
    table = evaluate(
        BASE | {"trains": [1.0, 3.0], "phase_shift": 0.0}, ["phase_shift_max", "drive_ratio_max", "ripple"]
    )
    assert table["phase_shift_max"][0] == 0.0, "a single train has no ripple only without a shift"
    assert table["drive_ratio_max"][0] == 1.0
    assert (table["ripple"] == 0.0).all()
    row = evaluate(BASE, ["overall_ratio_min", "overall_ratio_max"]).iloc[0]
    assert row["overall_ratio_min"] == row["overall_ratio_max"] == 1.0
