"""Control curves: intervals against mpmath, closed forms and dense evaluation; the command as a user meets it."""

import json
import math
from pathlib import Path
from types import SimpleNamespace

import mpmath as mp
import numpy as np
import pandas as pd
import pytest
from command_line import assert_refused, call, run

import explore
from explore.analysis.tuning.curves import END_OF_RANGE, Run
from explore.analysis.tuning.intervals import End, Interval, find_intervals
from explore.charts import tuning_chart
from explore.cli.tuning_sentences import describe_tuning
from explore.mechanisms.registry import MECHANISMS

#: The optimum of the published study, mm.
PUBLISHED = {"crank": 50, "coupler": 940.62, "rocker": 211.79, "ground": 869.44}
#: The classics that `explore init` writes.
LINKAGES = Path(explore.__file__).parent / "data" / "linkages"
SLIDER = {"crank": 40.0, "rod": 150.0, "offset": 20.0}


def tune(**arguments):
    options = {"parameter": "crank", "metric": "mean_output_ratio", **arguments}
    return explore.tune("crank-rocker", PUBLISHED, **options)


def exact_crank(ratio):
    """The crank that gives a mean output ratio, from the limit angles by the law of cosines, 30 digits."""
    with mp.workdps(30):
        coupler, rocker, ground = (mp.mpf(PUBLISHED[name]) for name in ("coupler", "rocker", "ground"))

        def limit_angle(side):
            return mp.acos((rocker**2 + ground**2 - side**2) / (2 * rocker * ground))

        def excess(crank):
            return (limit_angle(coupler + crank) - limit_angle(coupler - crank)) / (2 * mp.pi) - mp.mpf(ratio)

        return float(mp.findroot(excess, (600 * ratio, 610 * ratio)))


def test_the_published_crank_range_to_the_last_digits():
    tuning = tune(low=0.02, high=0.2)

    (interval,) = tuning.intervals
    assert interval.start.parameter == pytest.approx(exact_crank(0.02), rel=1e-14)
    assert interval.stop.parameter == pytest.approx(exact_crank(0.2), rel=1e-14)
    # the study printed 11.966 and 108.949; 1e-12 is what its values at many digits are claimed to
    assert interval.start.parameter == pytest.approx(11.96574463883727, rel=1e-12)
    assert round(interval.stop.parameter, 3) == 108.949
    assert (interval.start.cause, interval.stop.cause) == ("", "")


def test_a_value_out_of_reach_gives_the_nearest_and_why_the_curve_ends():
    tuning = tune(low=0.5)

    assert tuning.intervals == ()
    most = tuning.reach[1]
    # The crank turns while it and the longest link are shorter than the others together.
    assert most.parameter == pytest.approx(211.79 + 869.44 - 940.62, rel=1e-14)
    assert most.cause == "change_point"
    evaluated = explore.evaluate("crank-rocker", {**PUBLISHED, "crank": most.parameter}, metrics="mean_output_ratio")
    assert most.value == evaluated["mean_output_ratio"].iloc[0] < 0.5


def test_the_smallest_value_of_a_curve_that_falls_and_rises():
    tuning = tune(parameter="coupler", metric="swing_angle", low=30)
    crank, rocker, ground = (PUBLISHED[name] for name in ("crank", "rocker", "ground"))

    least = tuning.reach[0]
    # Its stationary point in closed form; a place of a flat minimum is known to the root of the rounding.
    assert least.value == pytest.approx(math.degrees(2 * math.asin(crank / rocker)), rel=1e-14)
    assert least.parameter == pytest.approx(math.sqrt(crank**2 + ground**2 - rocker**2), rel=1e-7)
    assert least.cause == ""
    assert [(i.start.cause, i.stop.cause) for i in tuning.intervals] == [("change_point", ""), ("", "change_point")]


@pytest.mark.parametrize("start", [-0.5, -1.5])  # in the first step of the scan, and in the middle of the second
def test_an_extreme_between_two_equal_values_is_met(start):
    slider = {"crank": 50.0, "rod": 400.0}
    tuning = explore.tune(
        "slider-crank", slider, parameter="offset", metric="stroke", high=100.00001, start=start, stop=start + 256
    )

    least = tuning.reach[0]
    assert least.value == pytest.approx(100.0, rel=1e-14)  # twice the crank where the offset is 0
    assert least.cause == ""
    (interval,) = tuning.intervals
    # The stroke is 2 crank + offset^2 crank / (rod^2 - crank^2) + ...; 100 has a rounding error of 3e-10 of 1e-5.
    expected = math.sqrt(1e-5 * (400.0**2 - 50.0**2) / 50.0)
    assert (interval.start.parameter, interval.stop.parameter) == pytest.approx((-expected, expected), rel=1e-6)


def test_a_pole_hides_no_extreme():
    """A third power is 2e19 where all links fall into one line, and least where its root is."""
    formulas = {"cube": {"formula": "rocker_acceleration_peak_cycle ** 3", "unit": "1"}}
    least = tune(parameter="coupler", metric="cube", formulas=formulas).reach[0]
    root = tune(parameter="coupler", metric="rocker_acceleration_peak_cycle").reach[0]

    assert least.value == pytest.approx(root.value**3, rel=1e-11)  # three times the tolerance, and rounding
    assert least.parameter == pytest.approx(root.parameter, rel=1e-5)  # a flat minimum


@pytest.mark.parametrize(
    ("formula", "bounds", "ends"),
    [
        # in the middle between two bounds, which a crank beside 60 mm meets
        ("abs(crank - 60)**2 / abs(crank - 60)", {"high": 3.0}, [57.0, 60.0, 60.0, 63.0]),
        # where the metric jumps over its bound
        ("(crank - 60) / abs(crank - 60)", {"low": 0.5}, [60.0, 81.0]),
        ("(crank + 100) * (crank - 60) / abs(crank - 60)", {"low": 0.5}, [60.0, 81.0]),
    ],
)
def test_an_interval_ends_at_a_single_number_at_which_the_metric_does_not_exist(formula, bounds, ends):
    formulas = {"own": {"formula": formula, "unit": "1"}}
    tuning = tune(parameter="crank", metric="own", start=40.0, stop=81.0, formulas=formulas, **bounds)
    found = [end for interval in tuning.intervals for end in (interval.start, interval.stop)]
    assert [end.parameter for end in found] == pytest.approx(ends, rel=1e-14)
    assert 60.0 not in [end.parameter for end in found]
    assert all(np.isfinite(end.value) for end in found)
    assert {end.cause for end in found if abs(end.parameter - 60.0) < 1e-9} == {"undefined"}


def test_a_fold_is_met_to_the_last_digit():
    """Both strokes last equally long where the squares of crank and ground add up to those of coupler and rocker."""
    tuning = tune(parameter="coupler", metric="time_ratio", low=1, high=1)

    (interval,) = tuning.intervals
    crank, rocker, ground = (PUBLISHED[name] for name in ("crank", "rocker", "ground"))
    assert tuning.reach[0].value == 1.0
    assert interval.start.parameter == pytest.approx(math.sqrt(crank**2 + ground**2 - rocker**2), rel=1e-14)


@pytest.mark.parametrize(
    ("mechanism", "design", "parameter", "metric", "low", "high"),
    [
        ("crank-rocker", PUBLISHED, "coupler", "swing_angle", 28.0, 31.0),  # two intervals
        ("crank-rocker", PUBLISHED, "rocker", "transmission_angle_min", 50.0, 60.0),  # two intervals
        ("crank-rocker", PUBLISHED, "ground", "cv", 0.45, 0.47),  # sampled, with a jump where the slow stroke changes
        ("crank-rocker", PUBLISHED, "speed", "rocker_velocity_mean", 0.1, 3.0),
        ("slider-crank", SLIDER, "offset", "time_ratio", 1.05, 1.2),  # a parameter of either sign
        ("slider-crank", SLIDER, "rod", "stroke", 85.0, 90.0),
    ],
)
def test_intervals_are_those_of_dense_evaluation(mechanism, design, parameter, metric, low, high):
    tuning = explore.tune(mechanism, design, parameter=parameter, metric=metric, low=low, high=high)
    points = np.linspace(tuning.curve[parameter].min(), tuning.curve[parameter].max(), 20_001)
    frame = explore.evaluate(mechanism, {**design, parameter: points}, metrics=[metric], tolerance=1e-12)
    values = frame[metric].where(frame["status"].isin([1, 7]))
    expected = values.between(low, high).to_numpy()
    found, near = np.zeros(len(points), dtype=bool), np.zeros(len(points), dtype=bool)
    for interval in tuning.intervals:
        found |= (points >= interval.start.parameter) & (points <= interval.stop.parameter)
        for end in (interval.start, interval.stop):
            near |= np.abs(points - end.parameter) <= 1e-9 * np.ptp(points)  # a point that rounding may move across

    assert expected.any()
    np.testing.assert_array_equal(found[~near], expected[~near])
    assert tuning.reach[0].value <= values.min()
    assert tuning.reach[1].value >= values.max()


def test_a_jump_is_no_solution():
    """The cv jumps where the slow stroke becomes the other one: values in between are reached nowhere near there."""
    limit = math.sqrt(PUBLISHED["coupler"] ** 2 + PUBLISHED["rocker"] ** 2 - PUBLISHED["crank"] ** 2)  # equal strokes
    grounds = [limit - 1e-6, limit + 1e-6]
    beside = explore.evaluate("crank-rocker", {**PUBLISHED, "ground": grounds}, metrics=["cv"])["cv"]
    assert abs(beside[1] - beside[0]) > 5e-4  # it changes by 1e-10 in 2e-6 mm elsewhere
    middle = beside.mean()

    tuning = tune(parameter="ground", metric="cv", low=middle, high=middle, start=limit - 0.1, stop=limit + 0.1)

    assert tuning.reach[0].value < middle < tuning.reach[1].value
    assert tuning.intervals == ()


def test_a_jump_is_no_solution_of_a_metric_with_a_pole_elsewhere():
    """The largest acceleration grows beyond all bounds at a change point."""
    design, name = {"crank": 50.0, "coupler": 300.0, "rocker": 211.79}, "rocker_acceleration_max"
    limit = math.sqrt(design["coupler"] ** 2 + design["rocker"] ** 2 - design["crank"] ** 2)  # equal strokes
    grounds = [limit - 1e-6, limit + 1e-6]
    middle = explore.evaluate("crank-rocker", {**design, "ground": grounds}, metrics=[name])[name].mean()

    tuning = explore.tune("crank-rocker", design, parameter="ground", metric=name, low=middle, high=middle)

    assert tuning.reach[1].value > 1e6
    assert [interval.start.value for interval in tuning.intervals] == pytest.approx([middle] * 3, rel=1e-9)


def test_equal_bounds_give_single_values():
    tuning = tune(parameter="coupler", metric="swing_angle", low=30, high=30)

    places = [interval.start.parameter for interval in tuning.intervals]
    assert all(interval.start == interval.stop for interval in tuning.intervals)
    swings = explore.evaluate("crank-rocker", {**PUBLISHED, "coupler": places}, metrics=["swing_angle"])["swing_angle"]
    assert len(places) == 2
    np.testing.assert_allclose(swings, 30.0, rtol=1e-14)


def test_an_end_of_the_range_that_has_the_bound_itself_keeps_its_cause():
    """The ripple is 0 from no shift on, not from the first shift that is looked at."""
    design = {"growth": 1.48, "sector": 2.6, "phase_shift": 1.0}
    tuning = explore.tune("gears", design, parameter="phase_shift", metric="ripple", low=0.0, high=0.05)
    assert tuning.intervals[0].start.value == 0.0
    assert tuning.intervals[0].start.cause == END_OF_RANGE


def test_single_values_at_a_bound_are_intervals():
    function = SimpleNamespace(values=lambda x: (1.0 - np.square(x), None), at=lambda x: 1.0 - x * x)
    top = Run(np.array([-1.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0]))
    assert find_intervals(function, [top], 1.0, 2.0)[0] == [Interval(End(0.0, 1.0), End(0.0, 1.0))]
    alone = End(0.5, 0.75, END_OF_RANGE)
    assert find_intervals(function, [Run(np.array([0.5]), np.array([0.75]))], 0.0, 1.0)[0] == [Interval(alone, alone)]


@pytest.mark.parametrize(
    ("formula", "bounds", "ends"),
    [
        ("max(crank, 60)", (None, 60), (10, 60)),
        ("min(crank, 60) - 60", (0, None), (60, 130)),
        ("max(60, min(crank, 70))", (70, 70), (70, 130)),
        ("abs(crank - 60) + abs(crank - 70)", (10, 10), (60, 70)),
    ],
)
def test_an_interval_ends_where_the_metric_leaves_the_value_of_its_bound(formula, bounds, ends):
    """It ended at the last point of the scan with that value, such as 59.6875."""
    formulas = {"f": {"formula": formula, "unit": "mm"}}
    (found,) = tune(metric="f", low=bounds[0], high=bounds[1], start=10, stop=130, formulas=formulas).intervals
    assert (found.start.parameter, found.stop.parameter) == pytest.approx(ends, rel=2e-15)


def test_a_bound_is_met_to_the_rounding_of_the_metric():
    """A slider-crank is as high as its crank's circle up to an offset of the crank: 60.00000000000001 mm."""
    slider = explore.load_linkage(LINKAGES / "slider-crank.toml")
    design = {"r": 30, "l": 100, "e": 12}
    tuning = explore.tune(slider, design, parameter="e", metric="envelope_height", high=60, start=0, stop=60)
    (found,) = tuning.intervals
    assert (found.start.parameter, found.stop.parameter) == (0.0, pytest.approx(30.0, rel=4e-15))


def test_the_curve_has_the_metrics_at_its_points():
    tuning = tune(low=0.02, high=0.2, also=["cv", "transmission_angle_min"])
    curve = tuning.curve

    frame = explore.evaluate("crank-rocker", {**PUBLISHED, "crank": curve["crank"]}, metrics=["cv"], tolerance=1e-12)
    pd.testing.assert_series_equal(curve["cv"], frame["cv"], check_exact=True, check_index=False)
    assert curve["crank"].is_monotonic_increasing
    ends = [tuning.intervals[0].start.parameter, tuning.intervals[0].stop.parameter]
    assert set(ends) <= set(curve["crank"])
    assert curve.attrs["units"]["transmission_angle_min"] == "deg"
    assert len(tuning_chart(tuning).axes) == 3


def test_the_curve_has_its_errors_and_a_line_says_where_they_miss_the_tolerance():
    """The pin D of a crank shaper turns about a pivot 260 mm away, and rests at the ends of its strokes."""
    shaper = explore.load_linkage(Path(explore.__file__).parent / "data/linkages/crank-shaper.toml")
    design = {"height": 120, "r": 50, "l": 260, "k": 80, "rise": 145, "speed": 6}
    asked = {"parameter": "r", "start": 34, "stop": 36}
    curvature = explore.tune(shaper, design, metric="D_curvature_max", **asked)
    stroke = explore.tune(shaper, design, metric="stroke", **asked)

    assert (curvature.curve["error"] > 1e-12).all()
    count = len(curvature.curve)
    assert f"{count} of {count} values of the curve may miss the tolerance" in describe_tuning(curvature, {})[-1]
    assert (stroke.curve["error"] <= 1e-12).all()
    assert len(describe_tuning(stroke, {})) == 1


def test_units_may_follow_every_value():
    plain = tune(metric="swing_angle", low=20, high=40, start=10, stop=120)
    written = tune(metric="swing_angle", low="20 deg", high="40 deg", start="1 cm", stop="12 cm")

    assert plain.intervals == written.intervals
    assert "deg" not in repr(plain)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"parameter": "krank"}, "no parameter 'krank'; did you mean 'crank'"),
        ({"parameter": "phases"}, "phases has only the values 1, 2, 3"),
        ({"metric": "linkage_class"}, "label, not a quantity"),
        ({"low": 2, "high": 1}, "`low` = 2 is above `high` = 1"),
        ({"low": "2 mm"}, "`low`: 'mm' cannot be converted"),
        ({"start": 10, "stop": 5}, "from 10 to 5 is empty"),
        ({"parameter": "stiffness"}, "stiffness is 0 here, which says no range to look at"),
        ({"start": math.nan}, "`start`: nan is not a finite number"),
    ],
)
def test_wrong_arguments_are_one_line(arguments, message):
    with pytest.raises(explore.RequestError, match=message) as caught:
        tune(**arguments)
    assert "\n" not in str(caught.value)


def test_a_range_without_motion_says_so():
    with pytest.raises(
        explore.MotionError, match="exists for no crank from 200 to 300 mm: the crank cannot turn fully"
    ):
        tune(start=200, stop=300)


ARGUMENTS = (
    "tune", "--mechanism", "crank-rocker",
    "--set", "coupler=940.62", "--set", "rocker=211.79", "--set", "ground=869.44",
    "--parameter", "crank", "--metric", "mean_output_ratio",
)  # fmt: skip


def test_the_command_prints_the_interval_and_writes_files(tmp_path):
    output = run(*ARGUMENTS, "--from", "0.02", "--to", "0.2", "-o", "c.csv", "-o", "c.svg", cwd=tmp_path)

    assert "mean_output_ratio from 0.02 to 0.2: crank 11.96574463884 mm to 108.949023183 mm" in output.stdout
    curve = pd.read_csv(tmp_path / "c.csv")
    assert curve["mean_output_ratio"].between(0.02, 0.2).sum() > 100
    assert (tmp_path / "c.svg").read_text().startswith("<?xml")
    shown = [float(line.split()[0]) for line in output.stdout.rpartition("─\n")[2].split("\n") if line.strip()]
    assert shown == pytest.approx(np.linspace(11.96574, 108.94902, 11), abs=curve["crank"].diff().max() / 2)


def test_the_command_says_what_is_not_reached(tmp_path):
    output = run(*ARGUMENTS, "--from", "0.3", "--to", "0.5", cwd=tmp_path)

    assert "0.5 is not reached: mean_output_ratio is at most 0.321897, at crank 140.61 mm" in output.stdout
    assert "where the curve ends: all links fall into one line" in output.stdout


def test_the_command_takes_a_design_of_results(tmp_path):
    (tmp_path / "study.toml").write_text(
        'mechanism = "crank-rocker"\n[parameters]\ncrank = [40, 50]\n'
        "coupler = 940.62\nrocker = 211.79\nground = 869.44\n"
        '[evaluate]\nwindow = "return"\nmetrics = ["half", "cv"]\n'
        '[metrics]\nhalf = { formula = "swing_angle / 2", unit = "deg" }\n[rank]\nmetrics = ["cv"]\n'
    )
    run("sweep", "study.toml", cwd=tmp_path)

    options = ("--parameter", "crank", "--metric", "half", "--metric", "cv", "--from", "10 deg")
    output = run("tune", "--design", "1", *options, "--json", cwd=tmp_path)

    found = json.loads(output.stdout)
    expected = tune(metric="swing_angle", low=20, also=["cv"], window="return")
    assert found["intervals"][0]["start"]["parameter"] == pytest.approx(
        expected.intervals[0].start.parameter, rel=1e-14
    )
    row = next(row for row in found["curve"] if row["crank"] == 50.0)
    cv = explore.evaluate("crank-rocker", PUBLISHED, metrics=["cv"], window="return")["cv"].iloc[0]
    assert row["cv"] == pytest.approx(cv, rel=1e-9)  # the tolerance of `evaluate`


@pytest.mark.parametrize(("mechanism", "parameter"), [("crank-rocker", "crank"), ("gears", "growth")])
def test_the_command_takes_a_design_of_a_mechanism_without_strokes(mechanism, parameter, tmp_path):
    """Whose files say that the drive is "none"."""
    run("init", "study.toml", "--mechanism", mechanism, cwd=tmp_path)
    run("sweep", "study.toml", "-o", "study.h5", "--quiet", cwd=tmp_path)
    results = explore.open_results(tmp_path / "study.h5")
    assert bool(results.drive) == bool(MECHANISMS[mechanism].drives)
    metric = results.objectives[0].partition(":")[0]
    output = run("tune", "study.h5", "--parameter", parameter, "--metric", metric, cwd=tmp_path)
    assert metric in output.stdout


def test_the_command_says_where_constraints_of_the_study_hold(tmp_path):
    (tmp_path / "study.toml").write_text(
        'mechanism = "crank-rocker"\n[parameters]\ncrank = [40, 50]\n'
        "coupler = 940.62\nrocker = 211.79\nground = 869.44\n"
        '[evaluate]\nmetrics = ["mean_output_ratio", "cv"]\n'
        "[constraints]\ntransmission_angle_min = { min = 30 }\ntime_ratio = { max = 2 }\nswing_angle = { max = 60 }\n"
        '[rank]\nmetrics = ["coupler:min", "mean_output_ratio:max"]\n'
    )
    run("sweep", "study.toml", cwd=tmp_path)

    output = run("tune", "--parameter", "crank", "--from", "0.02", "--to", "0.2", cwd=tmp_path)

    limit = tune(metric="transmission_angle_min", low=30).intervals[0].stop.parameter
    assert "mean_output_ratio from 0.02 to 0.2: crank 11.96574463884 mm to 108.949023183 mm" in output.stdout
    message = "within it the study's constraint transmission_angle_min from 30 deg holds only for crank 11.96574463884"
    assert f"{message} to {limit:.13g} mm" in output.stderr
    limit = tune(metric="swing_angle", high=60).intervals[0].stop.parameter
    message = "within it the study's constraint swing_angle to 60 deg holds only for crank 11.96574463884"
    assert f"{message} to {limit:.13g} mm" in output.stderr
    assert "time_ratio" not in output.stderr

    output = run("tune", "--parameter", "crank", "--from", "0.2", "--to", "0.2", "--units", "length=cm", cwd=tmp_path)

    message = "at crank 10.8949023183 cm the study's constraint transmission_angle_min from 30 deg does not hold\n"
    assert output.stderr.endswith(message)


def test_a_constraint_of_the_study_names_which_of_several_intervals_it_breaks(tmp_path):
    """It said "within it" of each of two intervals."""
    (tmp_path / "study.toml").write_text(
        'mechanism = "crank-rocker"\n[parameters]\ncrank = 50\ncoupler = 940.62\nrocker = 211.79\n'
        'ground = 869.44\n[evaluate]\nmetrics = ["swing_angle"]\n[constraints]\ntime_ratio = { max = 1.1 }\n'
        '[rank]\nmetrics = ["swing_angle:max"]\n'
    )
    run("sweep", "study.toml", cwd=tmp_path)
    output = run("tune", "--parameter", "coupler", "--from", "30", cwd=tmp_path)
    first, second = tune(parameter="coupler", metric="swing_angle", low=30).intervals
    lines = [line for line in output.stderr.splitlines() if "the study's constraint" in line]
    for line, interval in zip(lines, (first, second), strict=True):
        place = f"within coupler {interval.start.parameter:.13g} to {interval.stop.parameter:.13g} mm the study's"
        assert line.startswith(place)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("tune", "--parameter", "crank", "--window", "drive"), "leave out --window and --drive"),
        (ARGUMENTS[:3], "name the parameter to vary: --parameter NAME"),
        ((*ARGUMENTS, "--design", "3"), "--mechanism takes its parameters from --set; leave out RESULTS and --design"),
        ((*ARGUMENTS, "--from", "2", "--to", "1"), "--from = 2 is above --to = 1"),
        ((*ARGUMENTS, "-o", "curve.xlsx"), "the name must end in"),
    ],
)
def test_mistakes_on_the_command_line_are_one_line(arguments, message):
    assert_refused(call(*arguments), 2, message)


def test_window_and_drive_of_a_mechanism():
    options = ("--metric", "rocker_velocity_rms", "--window", "drive", "--drive", "fast", "--to", "0.1", "--json")
    code, out, _ = call(*ARGUMENTS[:-2], *options)

    fast, slow = (tune(metric="rocker_velocity_rms", window="drive", drive=d, high=0.1) for d in ("fast", "slow"))
    assert code == 0
    assert json.loads(out)["intervals"][0]["stop"]["parameter"] == fast.intervals[0].stop.parameter
    assert fast.intervals != slow.intervals


def test_a_design_of_a_study_with_points(tmp_path):
    """The largest height of a point beside the crank's pin, which moves as the pin does, is that of the pin."""
    study = """mechanism = "slider-crank"
[parameters]
crank = 30
rod = 120
[points]
pin = { along = 0, across = 0 }
[evaluate]
window = "cycle"
metrics = ["stroke", "pin_y_max"]
[rank]
metrics = ["pin_y_max"]
"""
    (tmp_path / "pin.toml").write_text(study)
    run("sweep", "pin.toml", cwd=tmp_path)

    own = json.loads(run("tune", "--parameter", "crank", "--to", "40", "--json", cwd=tmp_path).stdout)
    moved = ["tune", "--parameter", "pin_along", "--metric", "pin_x_max", "--from", "90", "--json"]
    other = json.loads(run(*moved, cwd=tmp_path).stdout)

    assert own["intervals"][0]["stop"]["parameter"] == pytest.approx(40.0, rel=1e-12)  # the height is the crank
    # At the outer dead centre the rod is in line with the crank: x = 30 + along.
    assert other["intervals"][0]["start"]["parameter"] == pytest.approx(60.0, rel=1e-9)
