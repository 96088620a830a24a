"""Evaluation: statuses, screening, shared evaluations, independence of the blocks and the order of designs."""

import math
from fractions import Fraction
from itertools import permutations

import mpmath
import numpy as np
import pandas as pd
import pytest
from exact_linkage import ExactLinkage

import explore
from explore.mechanisms.crank_rocker.declaration import CRANK_ROCKER
from explore.mechanisms.registry import MECHANISMS
from explore.mechanisms.rocking import CANNOT_ASSEMBLE
from explore.model.status import Status
from explore.studies.designs.spaces import BLOCK_SIZE

PUBLISHED = {"crank": 100.0, "coupler": 1083.4236, "rocker": 541.7118, "ground": 691.7118}


def random_designs(n, seed=0):
    rng = np.random.default_rng(seed)
    return {
        "crank": rng.uniform(40, 220, n),
        "coupler": rng.uniform(800, 1200, n),
        "rocker": rng.uniform(300, 700, n),
        "ground": rng.uniform(500, 900, n),
    }


@pytest.mark.parametrize(
    ("lengths", "status"),
    [
        ((100, 1083.4236, 541.7118, 691.7118), "ok"),
        ((150, 1083.4236, 541.7118, 691.7118), "change_point"),
        ((200, 1083.4236, 541.7118, 691.7118), "crank_blocked"),
        ((100, 2000, 541, 691), "cannot_assemble"),
        ((150, 700, 541, 91), "crank_blocked"),  # ground shortest, but shortest + longest too long
        ((500, 700, 600, 100), "no_stroke"),  # double crank
        ((500, 100, 600, 700), "crank_blocked"),  # coupler shortest: double rocker
        ((500, 700, 100, 600), "crank_blocked"),  # rocker shortest: only the rocker turns
        ((100, 100, 100, 100), "change_point"),
    ],
)
def test_classes_that_cannot_swing_have_a_status_and_no_numbers(lengths, status):
    labels = {1: "ok", 2: "cannot_assemble", 3: "crank_blocked", 4: "change_point", 5: "no_stroke"}
    row = explore.evaluate("crank-rocker", dict(zip(PUBLISHED, lengths, strict=True))).iloc[0]

    assert labels[row["status"]] == status
    assert row["feasible"] == (status == "ok")
    if status != "ok":
        assert np.isnan(row["cv"])
        assert np.isnan(row["swing_angle"])
        assert row["nodes"] == 0


def test_decimal_change_points_are_recognised_despite_rounding():
    # Sums of multiples of 0.1 that are equal in decimals: more than half miss exact zero in doubles.
    rng = np.random.default_rng(1)
    tenths = rng.integers(200, 5000, (4000, 3))
    crank, other = tenths.min(axis=1) // 2, tenths
    longest = other[:, 0] + other[:, 1] - crank
    keep = (longest > other.max(axis=1)) & (crank < other.min(axis=1))
    crank, a, b, longest = (v[keep] / 10 for v in (crank, other[:, 0], other[:, 1], longest))

    frame = explore.evaluate("crank-rocker", {"crank": crank, "coupler": longest, "rocker": a, "ground": b})

    assert len(frame) > 500
    assert (frame["status"] == 4).all()
    assert (frame["grashof_margin"] != 0).any()  # else the test would prove nothing about rounding


def test_a_margin_of_five_units_in_the_last_place_is_a_design():
    ulp = np.spacing(1083.5)
    frame = explore.evaluate(
        "crank-rocker", {"crank": 150.0, "coupler": [1083.5, 1083.5 - 5 * ulp], "rocker": 541.75, "ground": 691.75}
    )

    assert frame["status"].tolist() == [4, 1]
    assert frame["error"][1] <= 1e-9
    assert frame["nodes"][1] < 300


def test_bad_designs_do_not_disturb_their_neighbours():
    designs = random_designs(500)
    alone = explore.evaluate("crank-rocker", designs)
    for i, bad in ((3, np.nan), (77, -5.0), (200, 0.0), (499, np.inf)):
        designs["coupler"][i] = bad

    frame = explore.evaluate("crank-rocker", designs)

    touched = [3, 77, 200, 499]
    assert (frame["status"].iloc[touched] == 8).all()
    assert frame.iloc[touched][["cv", "swing_angle", "grashof_margin"]].isna().all(axis=None)
    pd.testing.assert_frame_equal(frame.drop(touched), alone.drop(touched), check_exact=True)


@pytest.mark.parametrize("order", ["speed fastest", "speed slowest"])
def test_speeds_share_one_kinematic_evaluation(order):
    designs = random_designs(200)
    designs["crank"] = np.round(designs["crank"], -1)  # the same for many geometries, as in a grid
    speeds = np.array([0.5, 1.0, 7.25])
    if order == "speed fastest":
        repeated = {k: np.repeat(v, 3) for k, v in designs.items()} | {"speed": np.tile(speeds, 200)}
    else:
        repeated = {k: np.tile(v, 3) for k, v in designs.items()} | {"speed": np.repeat(speeds, 200)}
    metrics = ["cv", "rocker_velocity_mean", "rocker_acceleration_max", "coupler_acceleration_variance"]
    metrics.append("rocker_acceleration_std")

    one = explore.evaluate("crank-rocker", designs, metrics=metrics)
    three = explore.evaluate("crank-rocker", repeated, metrics=metrics)

    assert three.attrs["kinematic_evaluations"] == one.attrs["kinematic_evaluations"] == (one["status"] == 1).sum()
    for speed in speeds:
        rows = three[three["speed"] == speed].reset_index(drop=True)
        np.testing.assert_array_equal(rows["cv"], one["cv"])
        # one product each, rounded once or (for powers) a few times
        np.testing.assert_allclose(rows["rocker_velocity_mean"], one["rocker_velocity_mean"] * speed, rtol=3e-16)
        for name in ("rocker_acceleration_max", "rocker_acceleration_std"):
            np.testing.assert_allclose(rows[name], one[name] * speed**2, rtol=5e-16)
        np.testing.assert_allclose(
            rows["coupler_acceleration_variance"], one["coupler_acceleration_variance"] * speed**4, rtol=1e-15
        )


def test_closed_form_metrics_alone_sample_nothing():
    frame = explore.evaluate("crank-rocker", random_designs(100), metrics=["swing_angle", "transmission_angle_min"])

    assert frame.attrs["kinematic_evaluations"] == 0
    assert (frame["nodes"] == 0).all()
    assert (frame["error"] == 0).all()


def test_designs_that_fail_a_geometric_constraint_are_not_sampled():
    designs = random_designs(2000)
    metrics = ["rocker_acceleration_max", "transmission_angle_min"]
    free = explore.evaluate("crank-rocker", designs, metrics=metrics)
    bound = explore.evaluate(
        "crank-rocker",
        designs,
        metrics=metrics,
        constraints={"transmission_angle_min": {"min": 30}},
    )

    passes = free["transmission_angle_min"] >= 30
    computed = free["status"] == 1
    assert 100 < (computed & ~passes).sum() < (computed & passes).sum()
    assert (bound["status"][computed & ~passes] == 6).all()
    assert bound.attrs["kinematic_evaluations"] == (computed & passes).sum()
    np.testing.assert_array_equal(
        bound["transmission_angle_min_margin"][computed], free["transmission_angle_min"][computed] - 30
    )
    np.testing.assert_array_equal(bound["feasible"], computed & passes)


def test_margins_are_to_the_nearer_bound_and_count_as_satisfied_at_zero():
    swing = explore.evaluate("crank-rocker", PUBLISHED, metrics=["swing_angle"])["swing_angle"][0]
    frame = explore.evaluate(
        "crank-rocker", PUBLISHED, metrics=["cv"], constraints={"swing_angle": {"min": 10, "max": swing}}
    )

    assert frame["swing_angle_margin"][0] == 0
    assert frame["feasible"][0]


def test_a_tolerance_below_the_rounding_error_is_reported():
    # A near-kite: ground hardly longer than crank, rocker than coupler. The two terms of the velocity nearly cancel.
    frame = explore.evaluate(
        "crank-rocker",
        {"crank": 0.74187406, "coupler": 0.7617274, "rocker": 0.7637541, "ground": 0.74390088},
        window="return",
        tolerance=1e-13,
    )

    assert frame["status"][0] == 7
    assert frame["error"][0] > 1e-13
    assert np.isfinite(frame["rocker_velocity_mean"][0])
    assert not frame["feasible"][0]


def test_ends_of_strokes_that_are_solved_for_have_their_errors():
    """They count in the status and in formulas; the time ratio of a quick return is known."""
    links = {"crank": {"O": 0, "A": "r"}, "lever": {"Q": 0}}
    slots = {"slot": {"pin": "A", "link": "lever", "along": ["Q", [1, 0]]}}
    frame = {"O": [0, 0], "Q": [0, "-h"]}
    quick_return = explore.Linkage(
        {"driver": "crank", "output": "lever", "frame": frame, "links": links, "slots": slots}
    )
    cranks, power = [0.99, 0.9999], 8
    designs = {"h": 1.0, "r": cranks}
    ratios = explore.evaluate(quick_return, designs, metrics=["time_ratio"], tolerance=1e-13)
    with mpmath.workdps(30):
        for row, crank in zip(ratios.itertuples(), cranks, strict=True):
            half = mpmath.pi / 2 + mpmath.asin(crank)
            wanted = half / (mpmath.pi - half)
            assert abs(row.time_ratio - wanted) / wanted <= row.error <= 1e-12
    assert ratios["error"].iloc[0] <= 1e-13 < ratios["error"].iloc[1]
    assert list(ratios["status"]) == [Status.OK, Status.TOLERANCE_NOT_MET]

    cv = "lever_velocity_cv_forward"
    formulas = {"plain": {"formula": cv, "unit": "1"}, "power": {"formula": f"{cv}**{power}", "unit": "1"}}
    plain, raised = (
        explore.evaluate(quick_return, designs, metrics=[cv], formulas={k: formula})["error"]
        for k, formula in formulas.items()
    )
    assert (raised >= 0.99 * power * plain).all()  # the bounds of samples alone are 7 % smaller


def test_a_double_crank_is_defined_over_the_cycle_only():
    lengths = {"crank": 500, "coupler": 700, "rocker": 600, "ground": 100}
    cycle = explore.evaluate(
        "crank-rocker", lengths, metrics=["rocker_velocity_mean", "coupler_acceleration_mean"], window="cycle"
    ).iloc[0]

    assert cycle["status"] == 1
    # A full turn of the crank is a full turn of the output at the same velocity: the mean acceleration is 0.
    assert cycle["rocker_velocity_mean"] == pytest.approx(1, abs=1e-9)
    assert cycle["coupler_acceleration_mean"] == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize("interval", [(-70.0, 80.0), (100.0, 300.0), (10.0, 369.0)])
def test_a_double_crank_is_defined_over_an_interval(interval):
    lengths = {"crank": 500, "coupler": 700, "rocker": 600, "ground": 100}
    names = ["rocker_velocity_mean", "rocker_velocity_variance", "rocker_acceleration_max", "coupler_velocity_min"]
    window = dict(zip(("from", "to"), interval, strict=True))
    row = explore.evaluate("crank-rocker", lengths, metrics=names, window=window, tolerance=1e-12).iloc[0]
    x, w = np.polynomial.legendre.leggauss(200)
    angles = 0.5 * (interval[0] + interval[1]) + 0.5 * (interval[1] - interval[0]) * x
    velocity = explore.simulate("crank-rocker", lengths, angles=angles)["rocker_velocity"].to_numpy()
    mean = 0.5 * np.sum(w * velocity)
    dense = explore.simulate("crank-rocker", lengths, angles=np.linspace(*interval, 20_001))

    assert row["status"] == 1
    # NumPy's weights of 200 nodes have an error of 1e-14
    assert row["rocker_velocity_mean"] == pytest.approx(mean, rel=1e-12)
    assert row["rocker_velocity_variance"] == pytest.approx(0.5 * np.sum(w * (velocity - mean) ** 2), rel=1e-12)
    # the samples miss an extreme by at most half a step of 3e-4 rad
    assert row["rocker_acceleration_max"] == pytest.approx(dense["rocker_acceleration"].max(), rel=1e-6)
    assert row["coupler_velocity_min"] == pytest.approx(dense["coupler_velocity"].min(), rel=1e-6)
    with_angle = explore.evaluate("crank-rocker", lengths, metrics=["rocker_angle_mean"], window=window)
    assert with_angle["status"][0] == 5


def test_input_may_be_a_table_with_its_own_index():
    table = pd.DataFrame(random_designs(5), index=list("abcde"))

    assert explore.evaluate("crank-rocker", table, metrics=["cv"]).index.tolist() == list("abcde")


def test_input_may_be_a_row_of_a_table():
    table = pd.DataFrame(random_designs(3))
    row = explore.evaluate("crank-rocker", table.iloc[1], metrics=["cv"])
    assert row["cv"].to_list() == explore.evaluate("crank-rocker", table, metrics=["cv"])["cv"].to_list()[1:2]


def test_what_an_array_masks_is_no_number():
    masked = np.ma.array([30.0, 31.0, 32.0], mask=[False, True, False])
    designs = {"crank": masked, "coupler": 100.0, "rocker": 80.0, "ground": 110.0}
    table = explore.evaluate("crank-rocker", designs, metrics=["swing_angle"])
    assert table["status"].to_list() == [1, 8, 1]
    assert table["crank"].isna().to_list() == [False, True, False]


def test_words_of_a_table_stay_words():
    designs = {"crank": [30.0, 95.0], "coupler": 100.0, "rocker": 80.0, "ground": 110.0}
    words = explore.in_words(explore.evaluate("crank-rocker", designs, metrics=["linkage_class"]))
    assert words["status"].to_list() == ["ok", "crank_blocked"]
    pd.testing.assert_frame_equal(explore.in_words(words), words)


def test_arrays_are_those_of_the_table():
    designs = {"crank": [30.0, 40.0], "coupler": 200.0, "rocker": 80.0, "ground": 201.0, "speed": "40 rpm"}
    question = {"metrics": ["cv", "swing_angle"], "constraints": {"cv": {"max": 1.0}}}
    arrays = explore.evaluate("crank-rocker", designs, **question, table=False)
    table = explore.evaluate("crank-rocker", designs, **question)
    assert list(arrays) == list(table)
    for name, column in arrays.items():
        assert column.dtype == table[name].dtype
        np.testing.assert_array_equal(column, table[name])


def test_attributes_of_a_table_are_its_own():
    designs = {"crank": 30.0, "coupler": 200.0, "rocker": 80.0, "ground": 201.0, "speed": 40.0}
    first = explore.evaluate("crank-rocker", designs).attrs
    first["labels"]["status"].clear()
    first["units"].clear()
    second = explore.evaluate("crank-rocker", designs).attrs
    assert second["labels"]["status"]
    assert second["units"]["crank"] == "mm"


@pytest.mark.parametrize(
    ("designs", "message"),
    [
        ({"crank": 1.0}, "needs coupler, rocker, ground"),
        (PUBLISHED | {"crnak": 3.0}, "no parameter 'crnak'"),
        (PUBLISHED | {"crank": [1.0, 2.0], "rocker": [1.0, 2.0, 3.0]}, "one length"),
        (PUBLISHED | {"crank": np.ones((2, 2))}, "one-dimensional"),
    ],
)
def test_designs_of_the_wrong_form_are_refused(designs, message):
    with pytest.raises(explore.RequestError, match=message):
        explore.evaluate("crank-rocker", designs)


def test_simulate_matches_the_statistics_and_refuses_a_blocked_crank():
    motion = explore.simulate("crank-rocker", {**PUBLISHED, "speed": 2.0}, angles=720)

    assert motion.index.name == "crank_angle"
    # The trapezoidal rule over the full turn converges like exp(-720 * 0.877): equal to rounding.
    cycle = explore.evaluate(
        "crank-rocker", PUBLISHED | {"speed": 2.0}, metrics=["rocker_velocity_rms"], window="cycle", tolerance=1e-12
    )
    assert np.sqrt((motion["rocker_velocity"] ** 2).mean()) == pytest.approx(cycle["rocker_velocity_rms"][0], rel=1e-12)
    with pytest.raises(explore.MotionError, match="cannot turn fully"):
        explore.simulate("crank-rocker", PUBLISHED | {"crank": 200.0})
    with pytest.raises(explore.MotionError, match="fall into one line"):
        explore.simulate("crank-rocker", PUBLISHED | {"crank": 150.0})


def test_simulate_takes_angles_beyond_a_turn():
    a = explore.simulate("crank-rocker", PUBLISHED, angles=[-90.0, 0.0, 180.0, 359.0])
    b = explore.simulate("crank-rocker", PUBLISHED, angles=[270.0, 720.0, -180.0, -1.0])

    np.testing.assert_array_equal(a.to_numpy(), b.to_numpy())


def test_blocks_are_of_the_size_that_the_format_fixes():
    assert BLOCK_SIZE == 65_536


@pytest.mark.parametrize("factor", [1e-25, 1e25])
def test_the_size_of_the_linkage_changes_nothing(factor):
    lengths = dict(zip(PUBLISHED, (100.0, 1083.0, 541.0, 691.0), strict=True))
    metrics = ["swing_angle", "transmission_angle_min", "cv", "coupler_acceleration_variance"]
    one = explore.evaluate("crank-rocker", lengths, metrics=metrics).iloc[0]
    # Scaled lengths are rounded once each, which moves the metrics by a few times 1e-16 of themselves.
    other = explore.evaluate("crank-rocker", {k: v * factor for k, v in lengths.items()}, metrics=metrics).iloc[0]

    assert other["status"] == 1
    np.testing.assert_allclose(other[metrics].astype(float), one[metrics].astype(float), rtol=1e-13)


@pytest.mark.parametrize("change", [{"crank": 1e-31}, {"coupler": 1e31}, {"speed": 1e31}])
def test_sizes_beyond_the_range_of_doubles_are_not_usable(change):
    row = explore.evaluate("crank-rocker", PUBLISHED | change).iloc[0]

    assert row["status"] == 8
    assert np.isnan(row["swing_angle"])
    assert not row["feasible"]


def test_phases_share_one_evaluation_outside_the_clutch():
    designs = PUBLISHED | {"phases": [1, 2, 3, 4]}

    drive = explore.evaluate("crank-rocker", designs, metrics=["rocker_velocity_max"])
    clutch = explore.evaluate("crank-rocker", designs, metrics=["output_velocity_max"], window="clutch")

    assert drive.attrs["kinematic_evaluations"] == 1
    assert clutch.attrs["kinematic_evaluations"] == 4


@pytest.mark.parametrize("past", [0.0, 1e-9, 1e-8, 1e-7, 1e-6, 1e-4, 1e-2, 1.0])
def test_extreme_just_inside_the_end_of_a_window_is_found(past):
    def largest(start, stop):
        metrics = ["rocker_velocity_max", "rocker_velocity_min"]
        row = explore.evaluate("crank-rocker", PUBLISHED, metrics=metrics, window={"from": start, "to": stop}).iloc[0]
        return row[metrics[0]], row[metrics[1]]

    angles = np.linspace(0.0, 360.0, 360_001)
    velocity = explore.simulate("crank-rocker", PUBLISHED, angles=angles)["rocker_velocity"].to_numpy()
    for k, sign in ((velocity.argmax(), 0), (velocity.argmin(), 1)):
        top = angles[k]
        near = slice(k - 2, k + 3)
        a, b, _ = np.polyfit(angles[near] - top, velocity[near], 2)
        top -= b / (2.0 * a)  # 1e-3 deg apart: the parabola's vertex is the extreme to about 1e-7 deg
        expected = largest(top - 40.0, top + 40.0)[sign]
        # Both are exact to the rounding of one evaluation, a few units in the last place.
        assert largest(top - 40.0, top + past)[sign] == pytest.approx(expected, rel=2e-15, abs=0.0)
        assert largest(top - past, top + 40.0)[sign] == pytest.approx(expected, rel=2e-15, abs=0.0)


@pytest.mark.parametrize(
    "lengths",
    [(50.0, 346.3141, 182.7531, 372.4748), (50.0, 621.3787, 148.6088, 631.8962), (50.0, 774.0741, 177.0904, 785.162)],
)
def test_the_higher_of_two_peaks_is_found(lengths):
    """They differ by less than 0.1 %, and the higher one is between samples whose slope seems to be 0."""
    design = dict(zip(("crank", "coupler", "rocker", "ground"), lengths, strict=True))
    row = explore.evaluate("crank-rocker", design, metrics=["coupler_acceleration_max"], window="cycle").iloc[0]
    acceleration = explore.simulate("crank-rocker", design, angles=3600)["coupler_acceleration"]
    # A peak is at most 0.05 deg from a sample.
    assert row["coupler_acceleration_max"] == pytest.approx(acceleration.max(), rel=1e-5)


@pytest.mark.parametrize("rocker", [0.01, 3.0, 3000.0])
def test_angles_of_a_short_rocker_keep_their_digits(rocker):
    """Its direction follows from lengths of its own size; differences of the others would leave five digits."""
    lengths = {"crank": 1e-5, "coupler": 1e6, "rocker": rocker, "ground": 1e6}
    motion = explore.simulate("crank-rocker", lengths, angles=24)
    linkage = ExactLinkage(*lengths.values())
    for degrees, row in zip(motion.index, motion.itertuples(), strict=True):
        coupler, rocker_angle = linkage.angles(linkage.radians(degrees))
        assert row.rocker_angle == pytest.approx(float(rocker_angle * 180 / mpmath.pi), rel=1e-15)
        # a small angle: the sine is a difference of two terms of its own size
        assert row.coupler_angle == pytest.approx(float(coupler * 180 / mpmath.pi), rel=1e-13)


def test_a_constraint_on_an_undefined_metric_is_not_met():
    """The output of a double crank turns fully, so it has no swing angle and meets no bound on it."""
    lengths = {"crank": 500, "coupler": 700, "rocker": 600, "ground": 100}
    for bounds in ({"min": 10}, {"max": 170}, {"min": 10, "max": 170}):
        frame = explore.evaluate(
            "crank-rocker",
            lengths,
            metrics=["rocker_velocity_mean"],
            window="cycle",
            constraints={"swing_angle": bounds},
        )

        assert np.isnan(frame["swing_angle_margin"][0])
        assert CRANK_ROCKER.status_labels[int(frame["status"][0])] == "no_stroke"
        assert not frame["feasible"][0]


@pytest.mark.parametrize("window", ["cycle", {"from": 10, "to": 80}])
def test_a_double_crank_is_computed_unless_a_metric_needs_strokes(window):
    """A swing angle that is NaN beside the status ok would be wrong without a word."""
    rocking_and_not = {"crank": [500, 100], "coupler": 700, "rocker": 600, "ground": [100, 500]}

    def labels(**request):
        frame = explore.evaluate("crank-rocker", rocking_and_not, window=window, **request)
        metrics = [name for name in frame if name not in ("nodes", "error", "feasible", "status")]
        assert not frame.loc[frame["status"] == 1, metrics].isna().any(axis=None)
        return [CRANK_ROCKER.status_labels[int(code)] for code in frame["status"]]

    for name in ("swing_angle", "mid_angle", "time_ratio", "mean_output_ratio", "second_difference_dispersion"):
        assert labels(metrics=["rocker_velocity_mean", name]) == ["no_stroke", "ok"]
    chord = {"chord": {"formula": "2 * rocker * sin(swing_angle / 2)", "unit": "mm"}}
    assert labels(metrics=["rocker_velocity_mean"], formulas=chord) == ["no_stroke", "ok"]
    assert labels() == ["ok", "ok"]
    assert labels(metrics=["footprint", "transmission_angle_min"]) == ["ok", "ok"]


@pytest.mark.parametrize("units", [3, 4])
def test_a_margin_of_up_to_four_units_in_the_last_place_is_a_change_point(units):
    longest = 1083.5 - units * np.spacing(1083.0)
    frame = explore.evaluate(
        "crank-rocker",
        {"crank": 150.0, "coupler": longest, "rocker": 541.75, "ground": 691.75},
        metrics=["grashof_margin"],
    )

    assert frame["grashof_margin"][0] == units * np.spacing(1083.0)
    assert frame["status"][0] == 4


def test_the_table_has_its_constraints():
    bounds = {"swing_angle": {"min": 5, "max": 60}, "cv": {"max": 1.0}}
    frame = explore.evaluate("crank-rocker", PUBLISHED, constraints=bounds)

    assert frame.attrs["constraints"] == {"cv": {"min": None, "max": 1.0}, "swing_angle": {"min": 5.0, "max": 60.0}}


def test_a_link_as_long_as_the_others_together_cannot_be_assembled():
    frame = explore.evaluate("crank-rocker", {"crank": 100, "coupler": 600, "rocker": 200, "ground": 300})

    assert frame["status"][0] == 2


def test_statistics_of_an_angle_are_in_degrees():
    names = [f"rocker_angle_{statistic}" for statistic in ("variance", "std", "min", "max", "peak_to_peak")]
    row = explore.evaluate("crank-rocker", PUBLISHED, metrics=[*names, "swing_angle"]).iloc[0]

    assert row["rocker_angle_variance"] == pytest.approx(row["rocker_angle_std"] ** 2, rel=1e-14)
    assert row["rocker_angle_max"] - row["rocker_angle_min"] == pytest.approx(row["swing_angle"], rel=1e-12)
    assert row["rocker_angle_peak_to_peak"] == pytest.approx(row["swing_angle"], rel=1e-12)


@pytest.mark.parametrize("phases", [1, 3])
def test_the_output_behind_clutches_is_taken_in_the_sense_of_its_mean(phases):
    """A mirrored linkage turns its rocker the other way, and drives as well."""
    names = [f"output_velocity_{statistic}" for statistic in ("mean", "min", "max", "peak_to_peak")]
    designs = {name: np.repeat(values, 2) for name, values in random_designs(200).items()}
    designs |= {"branch": np.tile([1.0, -1.0], 200), "phases": np.full(400, float(phases))}
    table = explore.evaluate("crank-rocker", designs, metrics=names, window="clutch").query("status == 1")

    assert len(table) > 100
    np.testing.assert_allclose(table[names][1::2], table[names][::2], rtol=1e-9, atol=1e-15)
    low, mean, high = (table[f"output_velocity_{statistic}"] for statistic in ("min", "mean", "max"))
    assert ((low >= 0.0) & (low < mean) & (mean < high)).all()


@pytest.mark.parametrize("phases", [1, 2])
@pytest.mark.parametrize("drive", ["slow", "fast"])
def test_the_output_rests_at_exactly_zero_where_the_drive_is_shorter_than_a_period(phases, drive):
    """The velocity at the ends of a stroke is 0 only up to rounding."""
    designs = random_designs(2000) | {"phases": phases}
    metrics = ["output_velocity_min", "time_ratio"]
    table = explore.evaluate("crank-rocker", designs, metrics=metrics, window="clutch", drive=drive)
    table = table.query("status == 1")

    assert len(table) > 1000
    ratio = table["time_ratio"]  # of the slow stroke to the fast one
    stroke = 360.0 / (1.0 + (1.0 / ratio if drive == "slow" else ratio))
    assert ((table["output_velocity_min"] == 0.0) == (stroke < 360.0 / phases)).all()


def test_the_grashof_margin_is_the_exact_sum_rounded_once():
    """Near a change point a plain sum of the lengths would leave few digits of it."""
    rng = np.random.default_rng(4)
    crank, rocker, ground = rng.uniform(1.0, 2.0, 200), rng.uniform(300.0, 400.0, 200), rng.uniform(500.0, 600.0, 200)
    coupler = rocker + ground - crank - rng.uniform(1e-11, 1e-9, 200)
    designs = {"crank": crank, "coupler": coupler, "rocker": rocker, "ground": ground}
    margins = explore.evaluate("crank-rocker", designs, metrics=["grashof_margin"])["grashof_margin"]
    exact = [float(Fraction(b) + Fraction(c) - Fraction(a) - Fraction(d))
             for a, d, b, c in zip(crank, coupler, rocker, ground, strict=True)]  # fmt: skip

    assert margins.tolist() == exact


def class_of(crank, coupler, rocker, ground):
    """The class of a linkage of whole lengths by which links turn fully: those that pass both lines of their bases."""
    longest = max(crank, coupler, rocker, ground)
    total, sums = crank + coupler + rocker + ground, (crank + coupler, crank + rocker, crank + ground)
    if 2 * longest >= total or total in [2 * each for each in sums]:
        return "cannot_assemble" if 2 * longest >= total else "change_point"

    def turns(link, base, first, second):
        return base + link < first + second and abs(base - link) > abs(first - second)

    rotating = turns(crank, ground, coupler, rocker), turns(rocker, ground, crank, coupler)
    of_coupler = "double_rocker" if turns(coupler, crank, rocker, ground) else "non_grashof"
    names = {(True, False): "crank_rocker", (False, True): "rocker_crank", (True, True): "double_crank"}
    return names.get(rotating, of_coupler)


def test_classes_are_those_of_the_links_that_turn_fully():
    lengths = [
        order for some in ((2, 5, 6, 8), (3, 5, 6, 9), (1, 2, 3, 7), (2, 4, 5, 7)) for order in permutations(some)
    ]
    designs = dict(zip(PUBLISHED, np.array(lengths, dtype=float).T, strict=True))
    table = explore.evaluate("crank-rocker", designs, metrics=["linkage_class", "grashof_margin"])
    labels = table.attrs["labels"]["linkage_class"]
    found = [labels[code] for code in table["linkage_class"]]
    assert found == [class_of(*each) for each in lengths]
    assert len(set(found)) == 7
    assert table["grashof_margin"].tolist() == [sum(each) - 2.0 * (min(each) + max(each)) for each in lengths]


def test_the_mid_angle_of_the_mirrored_linkage_is_the_opposite():
    rows = explore.evaluate("crank-rocker", PUBLISHED | {"branch": [1, -1]}, metrics=["mid_angle", "swing_angle"])

    assert rows["mid_angle"][1] == -rows["mid_angle"][0] != 0.0
    assert rows["swing_angle"][1] == rows["swing_angle"][0]


def test_nodes_add_up_over_windows_and_the_largest_bound_counts():
    """The window that is sampled last is not the one with the larger bound for either order of the two."""
    one = {w: explore.evaluate("crank-rocker", PUBLISHED, metrics=["rocker_velocity_cv"], window=w).iloc[0]
           for w in ("drive", "return")}  # fmt: skip
    names = [f"rocker_velocity_cv_{window}" for window in one]
    for metrics in (names, names[::-1]):
        both = explore.evaluate("crank-rocker", PUBLISHED, metrics=metrics).iloc[0]
        assert both["nodes"] == one["drive"]["nodes"] + one["return"]["nodes"]
        assert both["error"] == max(one["drive"]["error"], one["return"]["error"])


def test_parameters_may_be_strings_with_units():
    with mpmath.workdps(50):  # the exact value rounded once, which 40 * 2 * np.pi / 60 is not
        speed = float(mpmath.pi * 4 / 3)
    numbers = {**PUBLISHED, "speed": speed}
    texts = {**PUBLISHED, "crank": "10 cm", "speed": "40 rpm"}
    pd.testing.assert_frame_equal(
        explore.evaluate("crank-rocker", texts), explore.evaluate("crank-rocker", numbers), check_exact=True
    )
    pd.testing.assert_frame_equal(
        explore.simulate("crank-rocker", texts), explore.simulate("crank-rocker", numbers), check_exact=True
    )
    listed = explore.evaluate("crank-rocker", {**PUBLISHED, "crank": ["10 cm", 110]})
    assert listed["crank"].tolist() == [100.0, 110.0]


@pytest.mark.parametrize("speed", ["40", "40 mm", ["40 rpm", "fast"]])
def test_a_string_that_is_no_quantity_of_the_parameter_is_refused(speed):
    with pytest.raises(explore.RequestError, match=r"^speed: .*rad/s"):
        explore.evaluate("crank-rocker", {**PUBLISHED, "speed": speed})


def test_a_table_of_evaluate_can_be_ranked_as_it_is():
    designs = random_designs(200)
    frame = explore.evaluate("crank-rocker", designs)
    assert frame.attrs["objectives"] == ["cv:min", "swing_angle:max", "transmission_angle_min:max"]
    ranked = explore.rank(frame)
    pd.testing.assert_frame_equal(ranked, explore.rank(frame, objectives=frame.attrs["objectives"]))
    only = explore.evaluate("crank-rocker", designs, metrics="cv")
    assert only.attrs["objectives"] == ["cv:min"]
    assert only.equals(explore.evaluate("crank-rocker", designs, metrics=["cv"]))


def test_mechanisms_are_listed_with_their_summaries():
    summaries = explore.list_mechanisms()
    assert {"crank-rocker", "test-rig"} <= summaries.keys()
    assert all(summaries.values())


def test_extremes_of_what_is_finite_nowhere_are_blank():
    """They were -inf and inf: the swing of a link that slides on the driver, and so turns with it."""
    linkage = explore.Linkage({
        "driver": "crank",
        "output": "block",
        "frame": {"O": [0, 0], "C": [0, "h"]},
        "links": {"crank": {"O": 0}, "block": {"A": 0}, "rod": {"C": 0, "A": "l"}},
        "slides": {"block": {"link": "crank", "direction": [1, 0]}},
        "branch": {"A": "far"},
    })  # fmt: skip
    row = explore.evaluate(linkage, {"h": 20.0, "l": 50.0}, metrics=["swing_angle", "block_angle_max"]).iloc[0]
    assert row["status"] == Status.NOT_FINITE
    assert row[["swing_angle", "block_angle_max"]].isna().all()


@pytest.mark.parametrize("name", sorted(MECHANISMS))
def test_a_design_outside_its_ranges_has_no_nodes(name):
    """Whatever stands for it in the closed form; some mechanisms move where all parameters are 1."""
    metric = next(f"{signal.name}_max" for signal in MECHANISMS[name].signals if "max" in signal.statistics)
    parameters = {parameter.name: [math.nan] for parameter in MECHANISMS[name].parameters}
    row = explore.evaluate(name, parameters, metrics=[metric]).iloc[0]
    assert row["status"] == Status.NOT_FINITE
    assert row["nodes"] == 0
    assert math.isnan(row[metric])


@pytest.mark.parametrize("metric", ["swing_angle", "velocity_ratio_rms", "velocity_ratio_mean"])
def test_what_is_not_finite_has_no_bound(metric):
    designs = {"crank": [40.0, np.nan, 0.0, 1e31, 400.0], "coupler": 120.0, "rocker": 80.0, "ground": 140.0}
    found = explore.evaluate("crank-rocker", designs, metrics=[metric])
    assert found["status"].tolist() == [Status.OK, *[Status.NOT_FINITE] * 3, CANNOT_ASSEMBLE]
    assert found["error"].isna().tolist() == [False, True, True, True, False]
