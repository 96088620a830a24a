"""Statistics that are known without samples: they cost no nodes, agree with sampled ones, and screen."""

from pathlib import Path

import numpy as np
import pytest
from exact_linkage import ExactLinkage

import explore

OK, SCREENED = 1, 6
GRID = Path(__file__).parents[1] / "configs" / "grid.toml"
RATES = ("coupler_velocity", "rocker_velocity", "coupler_acceleration", "rocker_acceleration", "velocity_ratio")
EXTREMES = (
    *(f"rocker_angle_{statistic}" for statistic in ("min", "max", "peak", "peak_to_peak")),
    "transmission_angle_peak_to_peak",
)
#: A third of a turn without a limit position or an anchor, and most of a turn.
INTERVALS = ({"from": 31, "to": 47}, {"from": -40, "to": 75}, {"from": 10, "to": 365})
WINDOWS = ("drive", "return", "overlapped_to_extended", "extended_to_overlapped", *INTERVALS)


def crank_rockers(n, seed=1):
    """Designs that all swing, on both branches."""
    rng = np.random.default_rng(seed)
    crank, coupler, rocker = rng.uniform(20, 60, n), rng.uniform(200, 400, n), rng.uniform(150, 300, n)
    ground = (
        np.abs(coupler - rocker) + crank + rng.uniform(0.05, 0.95, n) * (2 * np.minimum(coupler, rocker) - 2 * crank)
    )
    return {
        "crank": crank, "coupler": coupler, "rocker": rocker, "ground": ground, "branch": rng.choice([-1.0, 1.0], n)
    }  # fmt: skip


@pytest.mark.parametrize("window", WINDOWS, ids=str)
@pytest.mark.parametrize("name", [*(f"{rate}_mean" for rate in RATES), *EXTREMES])
def test_known_statistics_cost_no_nodes_and_agree_with_sampled_ones(name, window):
    designs = crank_rockers(300)
    signal = next(s for s in (*RATES, "rocker_angle", "transmission_angle") if name.startswith(s))
    known = explore.evaluate("crank-rocker", designs, metrics=[name], window=window)
    # the largest velocity and the rms of an angle need samples, and the metrics of a window are sampled together
    metrics = list(dict.fromkeys([name, f"{signal}_rms", f"{signal}_peak"]))
    sampled = explore.evaluate("crank-rocker", designs, metrics=metrics, window=window, tolerance=1e-12)

    assert (known["status"] == OK).all()
    assert (sampled["nodes"] > 0).all()
    # a mean may happen to be so small that its bound, relative to itself, misses the tolerance
    assert (known["nodes"] == 0).mean() > 0.99
    assert known.attrs["kinematic_evaluations"] == (known["nodes"] > 0).sum()
    # the largest magnitude, to which the error of an extreme is relative, is larger than the rms
    assert (np.abs(known[name] - sampled[name]) <= (known["error"] + sampled["error"]) * sampled[f"{signal}_rms"]).all()


def test_known_statistics_agree_with_60_digits():
    designs = crank_rockers(3)
    for k in range(3):
        linkage = ExactLinkage(
            *(designs[name][k] for name in ("crank", "coupler", "rocker", "ground")), designs["branch"][k]
        )
        design = {name: column[k] for name, column in designs.items()}
        window = "overlapped_to_extended"
        first, last = linkage.stroke(design["branch"] > 0)
        names = ["coupler_velocity_mean", "rocker_velocity_mean", "rocker_angle_min", "rocker_angle_max"]
        row = explore.evaluate("crank-rocker", design, metrics=names, window=window).iloc[0]
        moments, angles = linkage.moments(first, last), sorted((linkage.angles(first)[1], linkage.angles(last)[1]))
        expected = [moments[0][0], moments[1][0], *(angle * 180 / np.pi for angle in angles)]
        assert row["nodes"] == 0
        for k, (name, value) in enumerate(zip(names, expected, strict=True)):
            scale = np.sqrt(float(moments[k][0] ** 2 + moments[k][1])) if k < 2 else abs(float(expected[3]))
            assert abs(row[name] - float(value)) <= row["error"] * scale


@pytest.mark.parametrize("rate", RATES)
def test_the_mean_of_a_rate_over_a_turn_is_exactly_zero(rate):
    frame = explore.evaluate("crank-rocker", crank_rockers(50), metrics=[f"{rate}_mean"], window="cycle")

    assert (frame[f"{rate}_mean"] == 0.0).all()
    assert (frame["nodes"] == 0).all()
    assert (frame["error"] == 0.0).all()
    names = [f"{rate}_mean", "coupler_acceleration_peak"]
    sampled = explore.evaluate("crank-rocker", crank_rockers(50), metrics=names, window="cycle")
    assert (sampled[f"{rate}_mean"] == 0.0).all()
    assert (sampled["nodes"] > 0).all()


def test_the_angle_of_a_double_crank_grows_so_its_rate_is_sampled():
    lengths = {"crank": 500.0, "coupler": 700.0, "rocker": 600.0, "ground": 100.0}

    row = explore.evaluate("crank-rocker", lengths, metrics=["rocker_velocity_mean"], window="cycle").iloc[0]

    assert row["rocker_velocity_mean"] == pytest.approx(1.0, abs=1e-9)
    assert row["nodes"] > 0


def test_a_known_statistic_that_misses_the_tolerance_is_sampled():
    """The terms of the variance nearly cancel beside a kite."""
    lengths = {"crank": 1.0, "coupler": 4.0, "rocker": 4.002, "ground": 3.0}

    loose, tight = (
        explore.evaluate("crank-rocker", lengths, metrics=["variance"], tolerance=tolerance).iloc[0]
        for tolerance in (1e-6, 1e-12)
    )

    assert loose["nodes"] == 0
    assert tight["nodes"] > 0
    assert tight["error"] <= 1e-12
    assert loose["error"] > 1e-10
    # the bound is relative to the mean square, which is at most 5 times this variance
    assert loose["variance"] == pytest.approx(tight["variance"], rel=5 * loose["error"], abs=0.0)


def test_a_constraint_on_a_known_statistic_screens_each_speed_by_itself():
    """A row does not depend on the other speeds of its linkage, one of which may need the samples."""
    designs, speeds = crank_rockers(200), np.array([2.0, 4.0, 8.0])
    repeated = {name: np.repeat(column, 3) for name, column in designs.items()} | {"speed": np.tile(speeds, 200)}
    largest = "rocker_acceleration_max"
    request = {"metrics": [largest, "mean"], "constraints": {"mean": {"min": 0.3, "max": 0.6}}}
    free = explore.evaluate("crank-rocker", repeated, metrics=[largest, "mean"])

    table = explore.evaluate("crank-rocker", repeated, **request)

    inside = free["mean"].between(0.3, 0.6)
    assert 100 < inside.sum() < 400
    np.testing.assert_array_equal(table["status"], np.where(inside, OK, SCREENED))
    np.testing.assert_array_equal(table["feasible"], inside)
    assert table.attrs["kinematic_evaluations"] == inside.to_numpy().reshape(-1, 3).any(axis=1).sum()
    assert (table["nodes"][~inside] == 0).all()
    assert table[largest][~inside].isna().all()
    np.testing.assert_array_equal(table[largest][inside], free[largest][inside])
    np.testing.assert_allclose(table["mean"], free["mean"], rtol=2e-13)  # the bounds of both add up to half of it
    for k, speed in enumerate(speeds):
        alone = explore.evaluate("crank-rocker", designs | {"speed": speed}, **request)
        for name in (largest, "mean", "mean_margin", "nodes", "error", "feasible", "status"):
            np.testing.assert_array_equal(alone[name], table[name][k::3], err_msg=name)


def test_a_name_without_a_window_is_of_the_design_or_of_the_window_of_the_study():
    """A closed-form metric does not depend on the window; a statistic of the same name says its window."""
    lengths = {"crank": 100.0, "coupler": 1083.4236, "rocker": 541.7118, "ground": 691.7118}
    names = ["min", "max", "min_drive", "max_drive", "min_cycle", "max_cycle", "peak_to_peak", "peak_to_peak_cycle"]

    row = explore.evaluate(
        "crank-rocker", lengths, metrics=[f"transmission_angle_{name}" for name in names], window="drive"
    ).iloc[0]

    turn_min, turn_max, drive_min, drive_max, *turn, drive_span, turn_span = row[: len(names) + 4][4:]
    # an angle of 1 rad is good to 4e-15, in degrees
    assert turn == pytest.approx([turn_min, turn_max], rel=1e-13, abs=0.0)
    assert turn_span == pytest.approx(turn_max - turn_min, rel=1e-13, abs=0.0)
    assert drive_span == pytest.approx(drive_max - drive_min, rel=1e-13, abs=0.0)
    assert turn_min < drive_min < drive_max <= turn_max


def test_the_peak_of_a_signal_is_its_largest_magnitude():
    designs = crank_rockers(200)
    names = [f"rocker_acceleration_{statistic}" for statistic in ("min", "max", "peak")]

    table = explore.evaluate("crank-rocker", designs, metrics=names, window="drive")

    low, high, peak = (table[name] for name in names)
    assert (-low > high).sum() > 20
    assert (-low < high).sum() > 20
    np.testing.assert_array_equal(peak, np.maximum(-low, high))


def test_the_grid_samples_the_geometries_that_can_be_feasible(tmp_path):
    study = explore.load_study(GRID)

    results = explore.sweep(study, tmp_path / "grid.h5")

    # 23,179 pass the constraints on the transmission angle; 11,494 of these have a feasible mean at one of three speeds
    assert results.counts["ok"] == 11_494
