"""Resolve names to metrics, windows, constraints and objectives."""

import math
from fractions import Fraction

import mpmath
import pytest

from explore.base.errors import RequestError
from explore.base.suggest import format_value
from explore.base.units.quantities import WrittenNumber
from explore.mechanisms.registry import MECHANISMS
from explore.model.quantities import STATISTICS, Metric, SampledMetric
from explore.model.window import Window
from explore.studies.request.names import find_mechanism, find_metric
from explore.studies.request.requests import make_objective, make_request

MECHANISM = MECHANISMS["crank-rocker"]
WINDOWS = {window.name: window for window in MECHANISM.windows}
STROKES = ("drive", "return", "overlapped_to_extended", "extended_to_overlapped")
DRIVE = WINDOWS["drive"]


def problem(**arguments):
    with pytest.raises(RequestError) as caught:
        make_request(MECHANISM, **arguments)
    return str(caught.value)


def test_mechanism_by_name():
    assert find_mechanism("crank-rocker") is MECHANISM
    with pytest.raises(RequestError, match="unknown mechanism 'crank-roker'; did you mean 'crank-rocker'"):
        find_mechanism("crank-roker")


def test_closed_form_metric_owns_its_name():
    metric = find_metric(MECHANISM, "transmission_angle_min", DRIVE)
    assert isinstance(metric, Metric)
    assert "over the turn" in metric.long_name
    sampled = find_metric(MECHANISM, "transmission_angle_min_drive", DRIVE)
    assert isinstance(sampled, SampledMetric)
    assert (sampled.signal.name, sampled.statistic, sampled.window.name) == ("transmission_angle", "min", "drive")


@pytest.mark.parametrize(
    ("name", "signal", "statistic", "window"),
    [
        ("rocker_velocity_mean", "rocker_velocity", "mean", "return"),
        ("coupler_acceleration_peak_to_peak", "coupler_acceleration", "peak_to_peak", "return"),
        ("rocker_velocity_rms_cycle", "rocker_velocity", "rms", "cycle"),
        (
            "velocity_ratio_peak_to_peak_extended_to_overlapped",
            "velocity_ratio",
            "peak_to_peak",
            "extended_to_overlapped",
        ),
        ("output_velocity_cv_clutch", "output_velocity", "cv", "clutch"),
        ("cv", "rocker_velocity", "cv", "return"),
        ("mean", "rocker_velocity", "mean", "return"),
        ("variance", "rocker_velocity", "variance", "return"),
    ],
)
def test_sampled_metric_by_name(name, signal, statistic, window):
    metric = find_metric(MECHANISM, name, WINDOWS["return"])
    assert metric.name == name
    assert (metric.signal.name, metric.statistic, metric.window.name) == (signal, statistic, window)


def test_output_of_the_clutch_window():
    assert find_metric(MECHANISM, "cv", WINDOWS["clutch"]).signal.name == "output_velocity"


@pytest.mark.parametrize(
    ("name", "unit", "sense"),
    [
        ("rocker_velocity_mean", "rad/s", None),
        ("rocker_velocity_variance", "rad^2/s^2", "min"),
        ("rocker_acceleration_variance", "rad^2/s^4", "min"),
        ("rocker_acceleration_std", "rad/s^2", "min"),
        ("rocker_angle_variance", "deg^2", "min"),
        ("velocity_ratio_variance", "1", "min"),
        ("rocker_velocity_cv", "1", "min"),
        ("rocker_acceleration_max", "rad/s^2", "min"),
        ("rocker_acceleration_min", "rad/s^2", None),
        ("rocker_acceleration_rms", "rad/s^2", "min"),
        ("rocker_angle_peak_to_peak", "deg", "min"),
        ("rocker_acceleration_peak", "rad/s^2", "min"),
    ],
)
def test_units_and_senses(name, unit, sense):
    metric = find_metric(MECHANISM, name, DRIVE)
    assert (metric.unit, metric.sense) == (unit, sense)
    assert metric.long_name


def test_every_listed_name_is_known():
    refusals = []
    for name in MECHANISM.metric_names():
        try:
            assert find_metric(MECHANISM, name, DRIVE).name == name
        except RequestError as error:
            refusals.append(str(error))
    assert refusals
    assert all(
        any(part in reason for part in ("exactly 0", "exists only", "has only", "of a full turn"))
        for reason in refusals
    )


def test_unknown_metric_is_suggested():
    assert problem(metrics=["rocker_velocty_mean"]).endswith(
        "unknown metric 'rocker_velocty_mean'; did you mean 'rocker_velocity_mean'?"
    )
    assert "`explore mechanisms crank-rocker` lists them" in problem(metrics=["zzz"])


@pytest.mark.parametrize("window", STROKES)
def test_cv_of_rocker_acceleration_over_a_stroke_is_refused(window):
    expected = "the mean of rocker_acceleration over a stroke is exactly 0, so its cv is undefined for every design"
    assert expected in problem(metrics=[f"rocker_acceleration_cv_{window}"])
    assert expected in problem(metrics=["rocker_acceleration_cv"], window=window)
    assert make_request(MECHANISM, metrics=["rocker_acceleration_mean"], window=window).metrics


@pytest.mark.parametrize("window", ["cycle", {"from": 0, "to": 360}, {"from": -10.1, "to": 349.9}])
@pytest.mark.parametrize("metric", ["cv", "rocker_velocity_cv", "coupler_acceleration_cv", "velocity_ratio_cv"])
def test_cv_over_a_full_turn_is_refused(window, metric):
    assert "over a full turn is exactly 0, so its cv is undefined" in problem(metrics=[metric], window=window)


def test_signals_of_the_clutch_window():
    assert "output_velocity exists only in the window 'clutch'" in problem(metrics=["output_velocity_mean"])
    message = problem(metrics=["rocker_velocity_mean"], window="clutch")
    assert "the window 'clutch' has only output_velocity, not" in message
    assert make_request(MECHANISM, metrics=["rocker_velocity_mean_drive"], window="clutch").metrics


@pytest.mark.parametrize("window", [*WINDOWS, {"from": 0, "to": 90}, {"from": 0, "to": 360}])
def test_default_metrics_exist_in_every_window(window):
    if window == "interval":
        assert "give { from, to }" in problem(window=window)
        return
    names = [metric.name for metric in make_request(MECHANISM, window=window).metrics]
    cycle = window == "cycle" or window == {"from": 0, "to": 360}
    name = window if isinstance(window, str) else "cycle" if cycle else "interval"
    expected = MECHANISM.default_metrics.get(name, MECHANISM.default_metrics[""])
    assert names == list(expected)


def test_interval_in_degrees():
    window = make_request(MECHANISM, metrics=["rocker_velocity_mean"], window={"from": 30, "to": 380}).window
    assert (window.name, window.kind) == ("interval", "interval")
    assert (window.start, window.stop) == (30, 380)


def test_only_statistics_over_the_interval_do_without_a_turn():
    dwell, mean, window = {"kind": "dwell", "angle": 60.0}, "rocker_velocity_mean", {"from": 30, "to": 120}
    request = make_request(MECHANISM, metrics=[mean, "transmission_angle_min"], window=window)
    assert request.interval == request.window
    assert make_request(MECHANISM, metrics=[mean, f"{mean}_cycle"], window=window).interval is None
    assert make_request(MECHANISM, metrics=[mean], window="cycle").interval is None
    with_dwell = find_mechanism("crank-rocker", (), dwell)
    assert make_request(with_dwell, metrics=[mean], window=window).interval is not None
    assert make_request(with_dwell, metrics=[mean, "dwell_error"], window=window).interval is None


def test_an_interval_of_a_full_turn_is_the_cycle():
    assert make_request(MECHANISM, window={"from": 30, "to": 390}).window == WINDOWS["cycle"]


@pytest.mark.parametrize(
    ("window", "reason"),
    [
        ({"from": 90, "to": 90}, "must be below"),
        ({"from": 0, "to": 361}, "longer than a turn"),
        ({"from": 0}, "needs both ends"),
        ({"from": 0, "too": 3}, "unknown key 'too'"),
        ({"from": 0, "to": math.inf}, "not a finite number"),
        ({"from": "0 mm", "to": 3}, "cannot be converted to 'deg'"),
    ],
)
def test_bad_window(window, reason):
    assert reason in problem(window=window)


def test_a_bad_interval_says_nothing_false_of_its_metrics():
    """It said that the window were no interval, or that means over it were 0, as over a full turn."""
    metrics, window = ["rocker_velocity_mean_interval", "rocker_velocity_cv"], {"from": 350, "to": 20}
    assert problem(metrics=metrics, window=window).count("\n") == 0


def test_metric_names_can_name_only_the_interval_of_the_study():
    interval = problem(metrics=["rocker_velocity_mean_interval"], window={"from": 0, "to": 360})
    assert "the window is no interval but 'cycle'; write rocker_velocity_mean, or a window { from, to }" in interval
    request = make_request(MECHANISM, metrics=["transmission_angle_min_interval"], window={"from": 0, "to": 90})
    assert request.metrics[0].window == request.window


def test_defaults():
    request = make_request(MECHANISM)
    assert (request.window.name, request.drive, request.tolerance) == ("drive", "slow", 1e-9)
    assert request.constraints == ()


@pytest.mark.parametrize(
    ("tolerance", "reason"),
    [
        (1e-14, "rounding errors of doubles are larger"),
        (0.2, "coefficients of variation"),
        (math.nan, "not a finite"),
        (True, "not a number"),
    ],
)
def test_bad_tolerance(tolerance, reason):
    assert reason in problem(tolerance=tolerance)


def test_a_plain_request_is_resolved_once_for_each_mechanism():
    names = ["mean", "rocker_velocity_max"]
    assert make_request(MECHANISM, metrics=names) is make_request(MECHANISM, metrics=list(names))
    assert make_request(MECHANISM, metrics=names, tolerance=1e-6).tolerance == 1e-6
    assert make_request(MECHANISMS["test-rig"]).mechanism.name == "test-rig"
    assert make_request(MECHANISM, window="return") != make_request(MECHANISM)


def test_constraints_are_sorted_by_name_and_converted():
    bounds = {"swing_angle": {"max": "1 rad"}, "cv": {"min": 0.1, "max": 0.5}, "grashof_margin": {"min": "1 cm"}}
    constraints = make_request(MECHANISM, constraints=bounds).constraints
    assert [c.metric.name for c in constraints] == ["cv", "grashof_margin", "swing_angle"]
    assert [(c.minimum, c.maximum) for c in constraints] == [(0.1, 0.5), (10.0, None), (None, math.degrees(1.0))]


@pytest.mark.parametrize(
    ("bounds", "reason"),
    [
        ({"linkage_class": {"min": 1}}, "constraints.linkage_class: linkage_class is a label"),
        ({"swing_angle": {}}, "at least one bound"),
        ({"swing_angle": {"min": 3, "max": 2}}, "min = 3 is above max = 2"),
        ({"swing_angle": {"max": True}}, "true is not a number"),
    ],
)
def test_bad_constraints(bounds, reason):
    assert reason in problem(constraints=bounds)


def test_all_problems_at_once():
    lines = problem(metrics=["foo", "cv", "cv", 3], window="dirve", drive="slo", tolerance=1, constraints={"bar": {}})
    assert [line.split(":")[0] for line in lines.splitlines()] == [
        "window",
        "drive",
        "metrics",
        "metrics",
        "metrics",
        "constraints.bar",
        "tolerance",
    ]


@pytest.mark.parametrize("argument", ["formulas", "constraints"])
@pytest.mark.parametrize("value", [["coupler + ground"], [], "coupler + ground", 5])
def test_what_is_no_table_is_named(argument, value):
    (line,) = problem(**{argument: value}).splitlines()
    assert line.startswith(f"{argument}: must be a dict with a name for each of them, got ")


def test_metrics_are_a_list():
    assert problem(metrics=5) == "metrics: must be a list of names, got 5"


@pytest.mark.parametrize(
    ("text", "sense"),
    [
        ("cv", "min"),
        ("swing_angle:max", "max"),
        ("swing_angle", "max"),
        ("cv:max", "max"),
        ("mid_angle : min", "min"),
        ("crank:min", "min"),
    ],
)
def test_objective(text, sense):
    objective = make_objective((MECHANISM, DRIVE), text)
    assert objective.sense == sense
    assert objective == make_objective(make_request(MECHANISM), text)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("mid_angle", "write mid_angle:min or mid_angle:max"),
        ("rocker_velocity_mean", "write rocker_velocity_mean:min or"),
        ("cv:up", "unknown sense 'up' of cv"),
        ("cv:", "unknown sense ''"),
        ("linkage_class:min", "is a label"),
        ("crank", "crank has no default sense; write crank:min or crank:max"),
        ("crank:up", "unknown sense 'up' of crank"),
    ],
)
def test_bad_objective(text, reason):
    with pytest.raises(RequestError, match=reason):
        make_objective((MECHANISM, DRIVE), text)


def test_only_declared_statistics():
    assert set(STATISTICS) == {"mean", "variance", "std", "cv", "min", "max", "peak", "rms", "peak_to_peak"}
    assert isinstance(DRIVE, Window)


def test_every_unknown_name_is_reported():
    lines = problem(constraints={"bar": {"min": 1}, "foo": {"min": 1}, "swing_angle": {"min": 1}}).splitlines()
    assert [line.split(":")[0] for line in lines] == ["constraints.bar", "constraints.foo"]
    lines = problem(metrics=["bar", "cv", "foo"]).splitlines()
    assert [line.split("'")[1] for line in lines] == ["bar", "foo"]


def test_values_in_messages_are_cut_to_forty_characters():
    assert format_value(10**39) == "1" + "0" * 39
    assert format_value("x" * 41) == f"'{'x' * 37}...'"


def test_both_bounds_may_be_the_same():
    (constraint,) = make_request(MECHANISM, constraints={"swing_angle": {"min": 20, "max": 20}}).constraints
    assert (constraint.minimum, constraint.maximum) == (20.0, 20.0)


@pytest.mark.parametrize(
    ("ends", "start", "stop"),
    [
        ((280 + 360e9, 281 + 360e9), Fraction(280), Fraction(281)),
        ((280.3 + 360e12, 281.3 + 360e12), Fraction("280.3"), Fraction("281.3")),  # the fewest digits
        (("360000000000280.3 deg", "360000000000281.3 deg"), Fraction("280.3"), Fraction("281.3")),
        (map(WrittenNumber, ("360000000000280.3", "360000000000281.3")), Fraction("280.3"), Fraction("281.3")),
        ((10**20 * 360 + 30, 10**20 * 360 + 90), Fraction(30), Fraction(90)),
        ((-45, 45), Fraction(-45), Fraction(45)),
        ((-(10**9) * 360 - 45, -(10**9) * 360 + 45), Fraction(-45), Fraction(45)),
        ((30, WrittenNumber("30.000000000001")), Fraction(30), 30 + Fraction(1, 10**12)),
    ],
)  # fmt: skip
def test_whole_turns_of_an_interval_are_exact(ends, start, stop):
    window = make_request(
        MECHANISM, metrics=["rocker_velocity_mean"], window=dict(zip(("from", "to"), ends, strict=True))
    ).window
    assert (window.start, window.stop) == (start, stop)


def test_whole_turns_in_radians_are_exact():
    """With 50 digits of pi."""
    ends = {"from": "1e12 rad", "to": "1000000000001 rad"}
    window = make_request(MECHANISM, metrics=["rocker_velocity_mean"], window=ends).window
    with mpmath.workdps(40):
        expected = mpmath.fmod(mpmath.mpf(10) ** 12 * 180 / mpmath.pi, 360)
        assert abs(mpmath.mpf(window.start.numerator) / window.start.denominator - expected) < 1e-20
        assert abs(mpmath.mpf(window.length.numerator) / window.length.denominator - 180 / mpmath.pi) < 1e-20
