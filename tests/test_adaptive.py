"""The adaptive rule: bounds that hold for signals of any shape; and the check of samples by the graded rule."""

from dataclasses import replace

import numpy as np
import pytest
from shapes_mechanism import NAMES, ROUNDING, SHAPES, Row
from toy_mechanism import PEAK, WRONG_PEAK

from explore.evaluation import sampled
from explore.evaluation.evaluate import evaluate_columns
from explore.evaluation.quadrature.resolving import CHECKS, COUNTS
from explore.mechanisms.registry import MECHANISMS
from explore.model.quadrature import Adaptive
from explore.model.quantities import DerivedMetric, SampledMetric, Signal
from explore.model.status import Status
from explore.studies.request.requests import make_request
from explore.testing.subject import COMPUTED, Subject

CRANK_ROCKER, RIG = MECHANISMS["crank-rocker"], MECHANISMS["test-rig"]
TOLERANCES = (1e-6, 1e-9, 1e-12)
LARGEST_EXCESS = sampled.LARGEST_EXCESS
#: The peak by the adaptive rule alone.
ADAPTIVE_PEAK = replace(PEAK, signals=tuple(replace(signal, has_corners=True) for signal in PEAK.signals))
MOMENTS, EXTREMES = ("mean", "variance"), ("min", "max")
#: Mean, mean square, minimum and maximum over a turn.
EXACT = {
    "corner": (2.0 / np.pi, 0.5, 0.0, 1.0),
    "step": (0.5, 0.5, 0.0, 1.0),
    "polynomial": (1.0, 1.545, 0.7 - 5.0 / 12.0, 2.3),
    "wave": (0.0, 0.5, -1.0, 1.0),
    "constant": (0.3, 0.09, 0.3, 0.3),
}


def exact_peak(distance):
    """The same of 1/(1 + distance - cos)."""
    root = np.sqrt(distance * (2.0 + distance))
    return 1.0 / root, (1.0 + distance) / root**3, 1.0 / (2.0 + distance), 1.0 / distance


def evaluate(mechanism, designs, names, tolerance, window="cycle", drive=None):
    request = make_request(mechanism, metrics=names, window=window, drive=drive, tolerance=tolerance)
    return evaluate_columns(request, designs).columns


def relative_error(name, statistics, designs, tolerance):
    """Largest error of the statistics of a signal over a turn, in the norms of the bound, and the columns."""
    count = len(designs["place"])
    exact = exact_peak(designs["distance"]) if name == "peak" else EXACT[name]
    mean, square, low, high = (np.broadcast_to(value, count) for value in exact)
    values = {"mean": mean, "variance": square - mean**2, "min": low, "max": high}
    scales = {"mean": np.sqrt(square), "variance": square}
    columns = evaluate(SHAPES, designs, [f"{name}_{statistic}" for statistic in statistics], tolerance)
    peak = np.maximum(np.abs(low), np.abs(high))
    errors = [np.abs(columns[f"{name}_{s}"] - values[s]) / scales.get(s, peak) for s in statistics]
    return np.max(errors, axis=0), columns


def shapes(count, order=7.0, seed=0):
    rng = np.random.default_rng(seed)
    return {
        "place": rng.uniform(0.01, 6.28, count),
        "distance": 10.0 ** rng.uniform(-6.0, -1.0, count),
        "order": np.full(count, order),
    }


@pytest.mark.parametrize("statistics", [MOMENTS, EXTREMES], ids=["moments", "extremes"])
@pytest.mark.parametrize("tolerance", TOLERANCES)
@pytest.mark.parametrize("name", NAMES)
def test_bounds_hold_for_any_shape(name, tolerance, statistics):
    """Wherever a peak, a corner or a jump stands: a corner may be next to the end of a panel, beyond its last node."""
    error, columns = relative_error(name, statistics, shapes(200), tolerance)
    assert (error <= columns["error"]).all()
    met = np.mean(columns["status"] == Status.OK)
    if name == "step" and (statistics == EXTREMES or tolerance == 1e-12):
        # Samples beside a jump differ, however short the panel; and nodes cannot be told apart within 1e-12.
        assert met < 1.0
    elif name == "peak" and tolerance == 1e-12:
        # The angle from the peak is rounded, by 1e-16 of 1e-3 of the narrowest peaks.
        assert met > 0.95
    else:
        assert met == 1.0
    assert ((columns["status"] == Status.OK) == (columns["error"] <= tolerance)).all()


def test_panels_run_out():
    """More waves than panels: 2,048 of them with 16 nodes resolve 1,000 waves, and not 5,000."""
    for order, status in ((1000.0, Status.OK), (5000.0, Status.TOLERANCE_NOT_MET)):
        error, columns = relative_error("wave", MOMENTS, shapes(3, order), 1e-9)
        assert (columns["status"] == status).all()
        assert (error <= columns["error"]).all()
        assert (columns["error"] > 1e-6).all() == (status != Status.OK)


def test_smooth_signals_need_no_halving(monkeypatch):
    monkeypatch.setattr(sampled, "LARGEST_EXCESS", -1.0)
    # equal steps first, then 16 pieces of each half turn, 16 nodes and two ends each
    for name in ("polynomial", "constant"):
        _, columns = relative_error(name, MOMENTS, shapes(3), 1e-12)
        assert (columns["nodes"] == COUNTS[0] + CHECKS + 2 * 16 * 18).all()


def cut_at(at, noise_row=-1):
    """The mechanism whose corners are at the zeros of a signal."""
    cornering = {"has_corners": True, "corners_at": (at,)}
    signals = [replace(signal, **cornering) for signal in SHAPES.signals if signal.name == "corner"]
    others = [signal for signal in SHAPES.signals if signal.name != "corner"]
    rounding = Signal("rounding", "1", "rounding", ROUNDING, 1, terms_row=NAMES.index("constant"))
    return replace(SHAPES, signals=(*signals, *others, rounding), noise_row=noise_row)


@pytest.mark.parametrize(
    ("at", "order", "is_computed"), [("wave", 60, True), ("wave", 400, False), ("rounding", 1, True)]
)
def test_more_zeros_than_panels_are_cut_at_have_no_bound(at, order, is_computed):
    """A corner or a pulse may stand between those that are not found; but zeros of rounding errors are none."""
    columns = evaluate(cut_at(at), shapes(3, order), ["corner_mean"], 1e-6)
    assert (columns["status"] == (Status.OK if is_computed else Status.TOLERANCE_NOT_MET)).all()
    assert (np.isfinite(columns["error"]) == is_computed).all()


def test_zeros_are_told_from_rounding_by_the_noise_of_their_own_design():
    """Not by that of the first design of its chunk, here so noisy that all its waves are rounding."""
    designs = shapes(2, 400) | {"distance": np.array([1e9, 0.1])}
    columns = evaluate(cut_at("wave", noise_row=Row.DISTANCE - Row.PLACE), designs, ["corner_mean"], 1e-6)
    assert columns["status"].tolist() == [Status.OK, Status.TOLERANCE_NOT_MET]


def test_a_corner_within_an_interval():
    designs = shapes(100) | {"place": np.linspace(0.51, 1.99, 100)}
    start, stop = 0.5, 2.0
    columns = evaluate(SHAPES, designs, ["corner_mean"], 1e-12, {"from": np.rad2deg(start), "to": np.rad2deg(stop)})
    # sin(x/2) on either side of the corner
    before, after = (4.0 * np.sin(0.25 * x) ** 2 for x in (designs["place"] - start, stop - designs["place"]))
    mean = (before + after) / (stop - start)
    # the ends of the interval are rounded to degrees
    assert np.abs(columns["corner_mean"] / mean - 1.0).max() <= 1e-12
    assert (columns["status"] == Status.OK).all()


LINKAGES = {
    "crank": (50.0, 150.0),
    "coupler": (500.0, 1300.0),
    "rocker": (200.0, 660.0),
    "ground": (300.0, 830.0),
    "phases": (1.0, 12.0),
}
RIGS = {"crank": (60.0, 110.0), "coupler": (460.0, 900.0), "rocker": (400.0, 595.0), "ground": (751.0, 751.0)}
LOADS = {"constant_torque": 5e3, "opposing_torque": 5e3, "stiffness": 143e3, "damping": 100.0, "inertia": 8.0}
LOADS |= {"crank_mass": 40.0, "rocker_mass": 60.0, "coupler_mass": 25.0, "crank_centroid": 0.3, "speed": 60.0}


def draw(ranges, count, seed):
    rng = np.random.default_rng(seed)
    designs = {name: rng.uniform(low, high, count) for name, (low, high) in ranges.items()}
    return designs | ({"phases": np.round(designs["phases"])} if "phases" in designs else {})


def scale_of(metric, columns, names):
    """What the error of a metric is relative to."""
    if isinstance(metric, DerivedMetric) or metric.signal.is_magnitude or metric.statistic == "cv":
        return np.abs(columns[metric.name])
    # over an interval the name of an extreme may be that of a closed-form metric
    of_signal = {s: columns[name] for s in metric.signal.statistics if (name := names.get((metric.signal, s)))}
    if metric.statistic in ("min", "max", "peak_to_peak") and "min" in of_signal:
        return np.maximum(np.abs(of_signal["min"]), np.abs(of_signal["max"]))
    return of_signal["rms"] ** (2 if metric.statistic == "variance" else 1)


@pytest.mark.parametrize(
    ("mechanism", "designs"),
    [
        (CRANK_ROCKER, draw(LINKAGES, 60, 0)),
        (CRANK_ROCKER, draw(LINKAGES, 12, 1) | {n: np.full(12, v) for n, v in LOADS.items()}),
        (RIG, draw(RIGS, 12, 1) | {n: np.full(12, v) for n, v in LOADS.items()}),
    ],
    ids=["crank-rocker", "crank-rocker under load", "test-rig"],
)
def test_both_rules_agree(mechanism, designs):
    """Over every window, behind clutches, under loads that jump; means of powers of magnitudes, too."""
    extended = mechanism.extended and replace(mechanism.extended, quadrature=Adaptive())
    adaptive, compared = replace(mechanism, quadrature=Adaptive(), extended=extended), 0
    for window, drive in Subject(mechanism, designs).windows():
        metrics = [
            metric
            for metric in Subject(mechanism, designs).all_metrics(window)
            if isinstance(metric, SampledMetric | DerivedMetric)
        ]
        names = {(m.signal, m.statistic): m.name for m in metrics if isinstance(m, SampledMetric)}
        columns, other = (
            evaluate(each, designs, [metric.name for metric in metrics], 1e-9, window, drive)
            for each in (mechanism, adaptive)
        )
        computed = np.isin(columns["status"], COMPUTED)
        assert np.array_equal(computed, np.isin(other["status"], COMPUTED))
        assert np.mean(other["status"][computed] == Status.OK) > 0.9
        for metric in metrics:
            difference = np.abs(columns[metric.name] - other[metric.name])
            allowed = (columns["error"] + other["error"]) * scale_of(metric, columns, names)
            wrong = computed & (difference > allowed)
            assert not wrong.any(), (metric.name, window, np.flatnonzero(wrong))
            compared += np.count_nonzero(computed)
    assert compared > 1000


@pytest.mark.parametrize("tolerance", TOLERANCES)
def test_a_wrong_declaration_is_noticed(tolerance):
    designs = {"distance": 10.0 ** np.linspace(-4.0, 1.0, 500)}
    names = ["height_mean", "height_variance"]
    columns, other = (evaluate(mechanism, designs, names, tolerance) for mechanism in (WRONG_PEAK, ADAPTIVE_PEAK))
    mean, square, _, _ = exact_peak(designs["distance"])
    error = np.abs(columns["height_mean"] - mean) / np.sqrt(square)
    error = np.maximum(error, np.abs(columns["height_variance"] - square + mean**2) / square)
    # Peaks are sampled by both rules; where the declaration does no harm the graded one is enough.
    by_both = columns["nodes"] > other["nodes"]
    assert by_both[designs["distance"] < 0.5].all()
    assert not by_both[-1]
    # beside the bound, the rounding of cosines in the toy's signal
    assert (error <= columns["error"] + 1e-15 / designs["distance"])[by_both].all()
    # A declaration that is hardly wrong goes unnoticed.
    assert (error <= 10.0 * columns["error"]).all()
    assert (columns["height_mean"][by_both] == other["height_mean"][by_both]).all()
    assert (columns["error"][by_both] == other["error"][by_both]).all()


def test_a_wrong_declaration_goes_unnoticed_without_the_check(monkeypatch):
    monkeypatch.setattr(sampled, "LARGEST_EXCESS", np.inf)
    columns = evaluate(WRONG_PEAK, {"distance": np.array([1e-4])}, ["height_variance"], 1e-9)
    mean, square, _, _ = exact_peak(1e-4)
    assert columns["error"][0] < 1e-9 < 0.1 < abs(columns["height_variance"][0] / (square - mean**2) - 1.0)


def near_kites(count, rng):
    gap = 10.0 ** rng.uniform(-9.0, -1.0, count)
    crank, coupler = rng.uniform(20, 100, count), rng.uniform(110, 500, count)
    rocker = coupler * (1.0 + gap * rng.uniform(0.1, 0.9, count))
    return {"crank": crank, "coupler": coupler, "rocker": rocker, "ground": crank * (1.0 + gap)}


def sliders(count, rng):
    rocker = rng.uniform(0.5, 2.0, count)
    ground, crank = rocker * 10.0 ** rng.uniform(1.5, 4.0, count), rocker * 10.0 ** rng.uniform(-3.0, -0.3, count)
    coupler = ground + rng.uniform(-1.0, 1.0, count) * crank
    return {"crank": crank, "coupler": coupler, "rocker": rocker, "ground": ground}


def boxes(ranges):
    return lambda count, rng: {name: rng.uniform(*bounds, count) for name, bounds in ranges.items()}


FAMILIES = {
    "grid": boxes({"crank": (60, 180), "coupler": (900, 1300), "rocker": (450, 660), "ground": (620, 830)}),
    "optimum": boxes({"crank": (50, 50), "coupler": (50, 1000), "rocker": (50, 500), "ground": (50, 1000)}),
    "near kites": near_kites,
    "slider-like": sliders,
}


@pytest.mark.parametrize("window", ["drive", "cycle", "clutch", {"from": 20.0, "to": 41.0}], ids=str)
@pytest.mark.parametrize("family", FAMILIES)
def test_ordinary_designs_raise_no_alarm(family, window, monkeypatch):
    """At most 0.1 % needlessly; a design that raises none keeps every bit."""
    designs = FAMILIES[family](25_000, np.random.default_rng(5))
    names = None if window == "clutch" else ["rocker_acceleration_max", "coupler_velocity_cv", "rocker_velocity_std"]
    if window == "cycle":
        names[1] = "transmission_angle_std"

    def columns(largest_excess):
        monkeypatch.setattr(sampled, "LARGEST_EXCESS", largest_excess)
        return evaluate(CRANK_ROCKER, designs, names, 1e-9, window, "slow")

    with_check, without = columns(LARGEST_EXCESS), columns(np.inf)
    same = np.all([with_check[name].tobytes() == without[name].tobytes() for name in without], axis=0)
    if not same:
        alarms = np.count_nonzero(with_check["nodes"] != without["nodes"])
        assert alarms <= 1e-3 * np.count_nonzero(np.isin(without["status"], COMPUTED))
    designs = {name: column[:50] for name, column in designs.items()}
    sampled_designs = columns(np.inf)["nodes"] > 0
    assert (columns(0.0)["nodes"] > columns(np.inf)["nodes"])[sampled_designs].all()
