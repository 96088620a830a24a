"""Certificates of designs: enclosures beside mpmath, and false rows that must be found."""

import json
import math
import re
from fractions import Fraction
from importlib.util import find_spec
from types import SimpleNamespace
from unittest import mock

import mpmath
import numpy as np
import pytest
from command_line import call, succeed
from exact_linkage import ExactLinkage
from exact_slider_crank import SIGNALS as SLIDERS
from exact_slider_crank import ExactSliderCrank
from flint import arb, ctx
from studies import box, swept

import explore
from explore.analysis.certifying.arcs import window_arc
from explore.analysis.certifying.balls import PRECISIONS, UndecidedError
from explore.analysis.certifying.certificate import require_table
from explore.analysis.certifying.certification import certify_designs
from explore.analysis.certifying.designs import Design
from explore.analysis.certifying.functions import BINARY, UNARY
from explore.base.errors import RequestError
from explore.evaluation.evaluate import evaluate_columns
from explore.mechanisms import four_bar
from explore.mechanisms.four_bar_exact import classify
from explore.model.request import Objective
from explore.model.status import Status
from explore.studies.request.names import find_mechanism
from explore.studies.request.requests import make_request

CRANK_ROCKER = find_mechanism("crank-rocker")
LENGTHS = ("crank", "coupler", "rocker", "ground")
STROKES = ("overlapped_to_extended", "extended_to_overlapped")
VELOCITIES = ("coupler_velocity", "rocker_velocity")
ACCELERATIONS = ("coupler_acceleration", "rocker_acceleration")
ANGLES = ("coupler_angle", "rocker_angle", "transmission_angle")
#: Digits of the quadrature of `ExactLinkage`, whose rule has a fixed number of nodes.
QUADRATURE = 1e-19
#: The published optimum.
PUBLISHED = (50.0, 940.62, 211.79, 869.44)


def class_of(lengths):
    return classify(tuple(map(Fraction, lengths)))[0]


def random_linkages(count, seed):
    """Crank-rockers of all shapes."""
    random, found = np.random.default_rng(seed), []
    while len(found) < count:
        lengths = tuple(random.uniform(50.0, 1000.0, 4).tolist())
        if class_of(lengths) == four_bar.CRANK_ROCKER:
            found.append(lengths)
    return found


#: The margins are exact: the lengths are dyadic. The last one is a kite.
NEAR_CHANGE_POINT = [(150.0, 1083.5, 541.75, 691.75 + 2.0**-power) for power in (0, 14, 27, 36)]
KITES = [(50.0, 300.0, 300.0, 200.0), (50.0, 300.0 + 2.0**-30, 300.0, 200.0)]


def design_of(lengths, metrics, *, branch=1.0, phases=3.0, speed=1.0, **options):
    """A design and its request."""
    request = make_request(CRANK_ROCKER, metrics=metrics, **options)
    parameters = {parameter.name: parameter.default for parameter in CRANK_ROCKER.parameters}
    parameters |= dict(zip(LENGTHS, lengths, strict=True)) | {"branch": branch, "phases": phases, "speed": speed}
    return Design(parameters, request)


def enclosures(lengths, metrics, **options):
    """Enclosures by name."""
    design = design_of(lengths, metrics, **options)
    return {metric.name: design.enclose(metric) for metric in design.request.metrics}


def is_close(enclosure, number, error=0.0):
    """Whether a ball of less than 2^-64 of its scale holds an mpmath number that has 50 digits, or a relative error."""
    with ctx.workprec(256):
        distance = abs(enclosure.ball - arb(mpmath.nstr(number, 50)))
        allowed = enclosure.scale.upper() * (arb(10) ** -46 + arb(error))
        return enclosure.is_narrow and bool(distance.lower() <= allowed)


@pytest.mark.parametrize("branch", [1.0, -1.0])
def test_closed_forms_hold_the_numbers_of_mpmath(branch):
    names = (
        "grashof_margin", "swing_angle", "mid_angle", "time_ratio", "mean_output_ratio",
        "transmission_angle_min", "transmission_angle_max",
    )  # fmt: skip
    for lengths in [*random_linkages(24, seed=1), *NEAR_CHANGE_POINT, *KITES]:
        exact = ExactLinkage(*lengths, branch)
        found = enclosures(lengths, names, branch=branch)
        for name in names:
            if name == "mean_output_ratio":
                true = exact.swing / (2 * mpmath.pi)
            else:
                true = getattr(exact, "swing" if name == "swing_angle" else name)
            true = true * 180 / mpmath.pi if "_angle" in name else true
            assert is_close(found[name], true), (lengths, name)


@pytest.mark.parametrize("stroke", STROKES)
def test_moments_hold_the_numbers_of_mpmath(stroke):
    """Velocities by antiderivatives, accelerations by rigorous integration; mpmath integrates all."""
    signals = (*VELOCITIES, *ACCELERATIONS)
    metrics = [f"{signal}_{statistic}" for signal in signals for statistic in ("mean", "variance")]
    metrics += ["rocker_velocity_cv", "coupler_velocity_rms", "coupler_acceleration_std"]
    for lengths in [*random_linkages(2, seed=2), NEAR_CHANGE_POINT[1], KITES[1]]:
        exact = ExactLinkage(*lengths)
        moments = dict(zip(signals, exact.moments(*exact.stroke(stroke == STROKES[0])), strict=True))
        found = enclosures(lengths, metrics, window=stroke)
        for name in metrics:
            signal, statistic = name.rsplit("_", 1)
            mean, variance = moments[signal]
            true = {
                "mean": mean, "variance": variance, "std": mpmath.sqrt(variance),
                "rms": mpmath.sqrt(variance + mean**2), "cv": mpmath.sqrt(variance) / abs(mean) if mean else None,
            }[statistic]  # fmt: skip
            assert is_close(found[name], true, QUADRATURE), (lengths, name)


@pytest.mark.parametrize("branch", [1.0, -1.0])
def test_interval_statistics_hold_the_numbers_of_mpmath(branch):
    """Over an interval past a full turn's end, all signals; extremes by roots here, by a search in mpmath."""
    signals = (*VELOCITIES, *ACCELERATIONS, *ANGLES)
    statistics = ("mean", "variance", "min", "max")
    # the window in the name: `transmission_angle_max` alone is over the turn
    metrics = [f"{signal}_{statistic}_interval" for signal in signals for statistic in statistics]
    lengths = PUBLISHED
    exact = ExactLinkage(*lengths, branch)
    window = {"from": 200.0, "to": 500.0}
    first, last = (mpmath.mpf(angle) * mpmath.pi / 180 for angle in window.values())
    moments, extremes = exact.moments(first, last, exact.signals), exact.extremes(first, last)
    found = enclosures(lengths, metrics, branch=branch, window=window)
    for k, signal in enumerate(signals):
        factor = 180 / mpmath.pi if signal in ANGLES else 1
        for statistic, true in zip(statistics, (*moments[k], *extremes[k]), strict=True):
            true = true * (factor**2 if statistic == "variance" else factor)
            # the search takes differences with a step of 1e-15, which leaves an extreme 1e-30 off
            assert is_close(found[f"{signal}_{statistic}_interval"], true, QUADRATURE), (signal, statistic)


def certified(table, metrics, *, is_front=False, objectives=(), **options):
    """Proofs of the rows of `explore.evaluate`, by number."""
    request = make_request(CRANK_ROCKER, metrics=metrics, **options)
    rows = {number: {name: float(value) for name, value in row.items()} for number, row in enumerate(table)}
    return {
        number: proof
        for number, (proof, _) in certify_designs(request, rows, list(objectives), is_front=is_front).items()
    }


def evaluated(lengths, metrics, **options):
    """Rows of `explore.evaluate` as dictionaries."""
    columns = {name: np.array(column) for name, column in zip(LENGTHS, zip(*lengths, strict=True), strict=True)}
    return explore.evaluate("crank-rocker", columns, metrics=metrics, **options).to_dict(orient="records")


def test_all_classes_are_proved():
    """All seven, and two change points: dyadic lengths, and equal ones."""
    lengths = [
        PUBLISHED, (170, 140, 130, 50), (100, 50, 110, 120), (110, 120, 50, 100), (100, 110, 120, 135),
        (150, 1083.5, 541.75, 691.75), (50, 60, 400, 200), (100, 100, 100, 100),
    ]  # fmt: skip
    metrics = ["linkage_class", "grashof_margin", "swing_angle", "transmission_angle_min", "coupler_velocity_variance"]
    table = evaluated(lengths, metrics, window="cycle")
    assert {row["linkage_class"] for row in table} == set(range(7))
    for number, proof in certified(table, metrics, window="cycle").items():
        assert proof.verdict == "proved", (number, proof.reason)


@pytest.mark.parametrize("crank", [math.nan, math.inf, -1.0, 0.0, 1e31])
def test_a_parameter_that_is_no_length_is_a_status(crank):
    (row,) = evaluated([(crank, *PUBLISHED[1:])], ["cv"])
    assert certified([row], ["cv"])[0].verdict == "proved"
    objectives = [Objective("cv", "min")]
    (proof,) = certified([row | {"status": 1}], ["cv"], is_front=True, objectives=objectives).values()
    assert proof.reason == "a parameter is not a usable number, but the status does not say so"
    for column, told, reason in (("cv", 0.3, "cv is undefined, not 0.3"), ("feasible", 1, "it is not feasible")):
        assert certified([row | {column: told}], ["cv"])[0].reason.startswith(reason)


@pytest.mark.parametrize(
    ("margin", "feasible", "reason"),
    [(-1.0, 0, ""), (math.nan, 0, ""), (1.0, 1, ""), (-1.0, 1, "it is not feasible: passage")],
)
def test_bounds_on_what_comes_with_designs_are_taken_as_they_are(margin, feasible, reason):
    """Only the solver of a task measures such a metric: a design may be infeasible by it alone."""
    (row,) = evaluated([PUBLISHED], ["cv"], window="drive")
    (proof,) = certified([row | {"passage_margin": margin, "feasible": feasible}], ["cv"], window="drive").values()
    assert proof.reason == reason


METRICS = ["linkage_class", "swing_angle", "cv", "rocker_acceleration_max", "coupler_velocity_mean"]
OPTIONS = {"window": "drive", "constraints": {"transmission_angle_min": {"min": 10.0}}, "tolerance": 1e-12}


@pytest.mark.parametrize(
    ("column", "change", "reason"),
    [
        ("cv", lambda x: x * (1 + 3e-12), "cv .* is off by"),
        ("rocker_acceleration_max", lambda x: x + 1e-13, "rocker_acceleration_max .* is off by"),
        ("coupler_velocity_mean", lambda x: -x, "coupler_velocity_mean .* is off by"),
        ("swing_angle", lambda x: x * (1 + 3e-15), "swing_angle .* is off by"),
        ("swing_angle", lambda x: math.nan, "swing_angle is missing"),
        ("cv", lambda x: math.inf, "cv is inf"),
        ("transmission_angle_min_margin", lambda x: x + 1e-10, "transmission_angle_min_margin .* is off by"),
        ("linkage_class", lambda x: 1, "linkage_class is crank_rocker, not double_crank"),
        ("status", lambda x: 3, "status is ok by exact signs, not crank_blocked"),
        ("status", lambda x: 6, "it is not feasible: its status is not ok"),
        ("status", lambda x: 9, "it is not feasible: its status is not ok; nothing was computed: failed"),
        ("feasible", lambda x: 0, "it is feasible"),
        ("error", lambda x: 2e-12, "error 2e-12 misses the tolerance 1e-12"),
    ],
)
def test_a_false_row_is_refuted(column, change, reason):
    (row,) = evaluated([(100.0, 1083.4236, 541.7118, 691.75)], METRICS, **OPTIONS)
    assert certified([row], METRICS, **OPTIONS)[0].verdict == "proved"
    row[column] = change(row[column])
    (proof,) = certified([row], METRICS, **OPTIONS).values()
    assert proof.verdict == "refuted"
    assert re.search(reason, proof.reason)


def test_a_bound_that_is_too_small_is_refuted():
    """The value is the same; what the row says of its error is not true."""
    (row,) = evaluated([(100.0, 1083.4236, 541.7118, 691.75)], ["rocker_acceleration_variance"], tolerance=1e-6)
    true = enclosures((100.0, 1083.4236, 541.7118, 691.75), ["rocker_acceleration_variance"])
    variance = true["rocker_acceleration_variance"].ball
    row["rocker_acceleration_variance"] = float(variance) * (1 + 1e-9)
    assert row["error"] > 1e-8
    assert certified([row], ["rocker_acceleration_variance"], tolerance=1e-6)[0].verdict == "proved"
    row["error"] = 0.9e-9
    (proof,) = certified([row], ["rocker_acceleration_variance"], tolerance=1e-6).values()
    assert "its error bound is" in proof.reason


@pytest.mark.parametrize(
    ("steps", "verdict"), [(-3, "proved"), (-1, "open"), (0, "open"), (1, "refuted"), (2, "refuted")]
)
def test_a_bound_within_rounding_is_never_proved(steps, verdict):
    """The bound is the double below the true value, or some doubles beside it: within 1e-14 deg nothing is proved."""
    metrics = ["cv", "transmission_angle_min"]
    (true,) = enclosures(PUBLISHED, metrics[1:]).values()
    below = float(true.ball)
    below = below if arb(below) < true.ball else math.nextafter(below, 0.0)
    options = {"window": "drive", "constraints": {"transmission_angle_min": {"min": below + steps * math.ulp(below)}}}
    (row,) = evaluated([PUBLISHED], metrics, **options)
    (row["cv"],) = (row["cv"] for row in evaluated([PUBLISHED], ["cv"], window="drive"))
    (proof,) = certified([row | {"feasible": 1, "status": 1}], metrics, **options).values()
    assert proof.verdict == verdict, proof.reason


def test_the_steadiest_design_of_the_published_bounds_is_feasible():
    """It touches both bounds, by 3 and 16 doubles; the value of cv is that of a prototype in ball arithmetic."""
    options = {"constraints": {"transmission_angle_min": {"min": 30.0}, "transmission_angle_max": {"max": 150.0}}}
    options |= {"window": "drive", "drive": "slow"}
    (row,) = evaluated([(50.0, 999.5818512050799, 57.759178849994406, 1000.0)], ["cv"], **options)
    (proof,) = certified([row], ["cv"], **options).values()
    assert (proof.verdict, proof.reason) == ("proved", "")
    low, high = proof.intervals["cv"]
    assert low < 0.35391225169688586 < high


def test_what_no_precision_decides_is_open():
    """The coupler and the rocker are the legs of a triangle of 3, 4 and 5: the angle is 90 deg exactly."""
    options = {"constraints": {"transmission_angle_min": {"min": 90.0}}}
    lengths = (0.5, 3.0, 4.0, 5.5)
    design = design_of(lengths, ["transmission_angle_min"], **options)
    (row,) = evaluated([lengths], ["transmission_angle_min"], **options)
    row |= {"feasible": 1, "status": int(Status.OK)}
    proof, proved = certify_designs(design.request, {0: row}, [], is_front=False)[0]
    assert proof.verdict == "open"
    assert proof.reason == f"whether transmission_angle_min keeps its bound is not decided with {PRECISIONS[-1]} bits"
    assert proved.bits == PRECISIONS[-1]


def test_precision_rises_where_it_must():
    """The rocker of a double crank turns as the crank but for 1e-8, of which the variance is the square."""
    lengths = (100.0, 100.0, 100.0, 1e-6)
    design = design_of(lengths, ["rocker_velocity_cv"], window={"from": 0.0, "to": 359.0})
    # other tests may have raised the precision of the process
    with ctx.workprec(53):
        enclosure = design.enclose(design.request.metrics[0])
        assert ctx.prec == 53
    assert design.bits == 256
    assert enclosure.is_narrow


def test_a_dominated_design_is_found():
    """Beside two designs of a front, one of which stands twice: the objectives do not depend on the speed."""
    metrics = ["cv", "transmission_angle_min"]
    front = {"window": "drive", "is_front": True}
    front["objectives"] = [Objective("cv", "min"), Objective("transmission_angle_min", "max")]
    table = evaluated([PUBLISHED, (50.0, 999.5, 58.0, 999.5), PUBLISHED], metrics, window="drive")
    for row, speed in zip(table, (1.0, 1.0, 2.0), strict=True):
        row["speed"] = speed
    assert [proof.verdict for proof in certified(table, metrics, **front).values()] == ["proved"] * 3
    others = evaluated(random_linkages(64, seed=5), metrics, window="drive")
    worse = [
        row
        for row in others
        if row["cv"] > table[0]["cv"] and row["transmission_angle_min"] < table[0]["transmission_angle_min"]
    ]
    assert len(worse) > 4
    proofs = certified([*table, *worse], metrics, **front)
    assert [proof.verdict for proof in proofs.values()] == ["proved"] * 3 + ["refuted"] * len(worse)
    assert proofs[3].reason.endswith("dominates it")


def test_a_tie_in_one_objective_does_not_hide_dominance():
    """Parameters are objectives too, and are equal exactly; two designs that are equal throughout stay."""
    table = evaluated([PUBLISHED, (50.0, 940.62, 211.79, 880.0), PUBLISHED], ["cv"], window="drive")
    assert table[1]["cv"] > table[0]["cv"]
    objectives = [Objective("crank", "min"), Objective("cv", "min")]
    proofs = certified(table, ["cv"], window="drive", is_front=True, objectives=objectives)
    assert [proof.verdict for proof in proofs.values()] == ["proved", "refuted", "proved"]


@pytest.mark.parametrize(
    ("window", "drive", "forth", "start"),
    [
        ("back", "slow", 200, 200), ("drive", "slow", 200, 0), ("drive", "slow", 160, 160),
        ("drive", "fast", 200, 200), ("drive", "fast", 160, 0),
        ("return", "fast", 200, 0), ("return", "forth", 160, 160), ("clutch", "back", 200, 200),
    ],
)  # fmt: skip
def test_windows_are_strokes(window, drive, forth, start):
    """The stroke forth takes so many degrees from 0; at an anchor within, the half-tangents have other signs."""
    for anchor in (0, 90):
        windows = [SimpleNamespace(name="forth", ends=("a", "b")), SimpleNamespace(name="back", ends=("b", "a"))]
        mechanism = SimpleNamespace(strokes=("forth", "back"), windows=windows, anchor_angle=math.radians(anchor))
        request = SimpleNamespace(mechanism=mechanism, drive=drive)
        marks = {"a": arb(0), "b": arb(math.radians(forth))}
        arc = window_arc(request, SimpleNamespace(name=window, kind=window), marks)
        assert [float(arc.start), float(arc.length)] == pytest.approx(
            [math.radians(start), math.radians(forth if start == 0 else 360 - forth)]
        )


#: Numbers of both signs.
ABOUT_0 = arb(0, 1e-9)


@pytest.mark.parametrize(
    ("name", "numbers", "value"),
    [
        ("atan2", (0, 0), None), ("atan2", (2, 0), 90), ("atan2", (-2, 0), -90), ("atan2", (0, 2), 0),
        ("sqrt", (0,), 0), ("sqrt", (4,), 2), ("sqrt", (-4,), None), ("log", (1,), 0), ("log", (-1,), None),
        ("**", (0, 2), 0), ("**", (2, 3), 8), ("/", (1, 2), 0.5), ("hypot", (3, 4), 5), ("tan", (45,), 1),
    ],
)  # fmt: skip
def test_functions_of_formulas_at_their_edges(name, numbers, value):
    """None where a formula has no value."""
    found = (UNARY if len(numbers) == 1 else BINARY)[name](*map(arb, numbers))
    assert found is None if value is None else found.contains(value)


@pytest.mark.parametrize(
    ("name", "numbers"),
    [
        ("atan2", (ABOUT_0, -2)), ("atan2", (ABOUT_0, 0)), ("atan2", (ABOUT_0, ABOUT_0)), ("sqrt", (ABOUT_0,)),
        ("log", (ABOUT_0,)), ("/", (1, ABOUT_0)), ("**", (ABOUT_0, -1)), ("**", (ABOUT_0, 0.5)), ("**", (0, ABOUT_0)),
        ("**", (-2, 1 + ABOUT_0)), ("tan", (90 + ABOUT_0,)),
    ],
)  # fmt: skip
def test_numbers_that_may_be_where_a_function_ends_or_jumps_decide_nothing(name, numbers):
    with pytest.raises(UndecidedError):
        (UNARY if len(numbers) == 1 else BINARY)[name](*map(arb, numbers))


def test_a_direction_about_0_is_decided_where_it_is_continuous():
    direction = BINARY["atan2"](ABOUT_0, arb(2))
    assert direction.contains(0)
    assert direction.rad() < 1e-7


@pytest.mark.parametrize(("power", "verdict"), [("time_ratio", "open"), ("time_ratio / 2", "proved")])
def test_a_power_that_may_be_whole_is_not_refuted(power, verdict):
    """Both strokes take the same time: -3 to the power 1 is -3, to the power 1/2 undefined."""
    formulas = {"own": {"formula": f"(0 - 3) ** ({power})", "unit": "1"}}
    ((proof, _),) = slider_rows([(40.0, 150.0, 0.0)], ["own"], formulas=formulas)
    assert proof.verdict == verdict, proof.reason


def test_clutches_agree_with_the_program():
    """Which finds the crossing by another road; at one phase, at rest between strokes, and without rest."""
    metrics = [f"output_velocity_{name}" for name in ("mean", "variance", "cv", "min", "max")]
    for phases in (1.0, 2.0, 3.0, 12.0):
        for branch in (1.0, -1.0):
            columns = {name: np.array([length]) for name, length in zip(LENGTHS, PUBLISHED, strict=True)}
            columns |= {"phases": np.array([phases]), "branch": np.array([branch])}
            table = explore.evaluate("crank-rocker", columns, metrics=metrics, window="clutch", tolerance=1e-12)
            (proof,) = certified(table.to_dict(orient="records"), metrics, window="clutch", tolerance=1e-12).values()
            assert proof.verdict == "proved", proof.reason


STUDY = box("""\
count = 4096
seed = 1
[evaluate]
window = "drive"
drive = "slow"
metrics = ["swing_angle", "transmission_angle_min", "cv", "spread"]
[metrics]
spread = { formula = "cv**2 * (1 + sqrt(swing_angle)) - min(cv, 0.3) / cos(swing_angle / 2)", unit = "1" }
[constraints]
transmission_angle_min = { min = 30 }
transmission_angle_max = { max = 150 }
[rank]
metrics = ["cv", "swing_angle:max", "transmission_angle_min:max"]
""")
results = swept(STUDY)


def test_a_front_is_proved(results):
    """Each number of the table lies in its interval up to its error, and the interval is two doubles wide."""
    front = explore.certify(results)
    assert list(front.index) == list(explore.rank(results).index)
    assert set(front["verdict"]) == {"proved"}
    stored = results.designs(front.index)
    for name in ("swing_angle", "transmission_angle_min", "cv", "spread"):
        low, high = front[f"{name}_lower"], front[f"{name}_upper"]
        assert (high - low <= 3 * np.spacing(np.abs(high))).all()
        # the terms of the formula are below 10
        scale = np.abs(stored[name]) if name != "spread" else 10.0
        assert (np.abs(stored[name] - low) <= (stored["error"] + 2e-15) * scale + high - low).all()
    assert front.attrs["units"]["swing_angle_upper"] == "deg"


def test_chosen_designs_of_every_status_are_proved(results):
    frame = results.to_pandas(["status"])
    numbers = frame.groupby("status").head(8).index.tolist()
    assert len(set(frame["status"])) >= 4
    assert set(explore.certify(results, numbers)["verdict"]) == {"proved"}


@pytest.mark.parametrize(("name", "verdict"), [("swing_angle", "proved"), ("rocker_acceleration_max", "refuted")])
def test_only_a_constraint_that_is_known_without_samples_screens(name, verdict):
    options = {"window": "cycle", "constraints": {name: {"max": 1e-3}}}
    metrics = ["swing_angle", "rocker_acceleration_max"]
    (row,) = evaluated([PUBLISHED], metrics, **options)
    assert row["feasible"] == 0
    (proof,) = certified([row | {"status": Status.SCREENED}], metrics, **options).values()
    assert proof.verdict == verdict, proof.reason
    assert ("no constraint fails that is known without samples" in proof.reason) == (verdict == "refuted")


def test_chosen_designs_need_no_objectives(tmp_path):
    study = explore.Study(
        mechanism="crank-rocker",
        parameters=dict(zip(LENGTHS, PUBLISHED, strict=True)),
        metrics=["rocker_velocity_rms_cycle"],
    )
    swept = explore.sweep(study, tmp_path / "one.h5")
    assert explore.certify(swept, 0)["verdict"].to_list() == ["proved"]
    with pytest.raises(explore.RequestError, match="no objective"):
        explore.certify(swept)


def false_results(results, path, number, column, change):
    """Results of a program that errs in one value of one design: sound checksums, the same study."""

    def evaluate(request, parameters):
        found = evaluate_columns(request, parameters)
        rows = np.flatnonzero(found.columns["coupler"] == results.design(number)["coupler"])
        found.columns[column][rows] = change(found.columns[column][rows])
        return found

    with mock.patch("explore.running.slices.evaluate_columns", evaluate):
        return explore.sweep(explore.load_study(results.path.with_suffix(".toml")), path, workers=1)


def test_a_false_value_of_a_front_is_found(results, tmp_path):
    best = int(explore.rank(results).index[0])
    front = explore.certify(false_results(results, tmp_path / "false.h5", best, "cv", lambda cv: cv * (1 + 1e-8)))
    assert front.index[front["verdict"] != "proved"].to_list() == [best]
    assert front.loc[best, "verdict"] == "refuted"
    assert front.loc[best, "reason"].startswith("cv 0.")


def test_a_dominated_design_in_a_front_is_found(results, tmp_path):
    """Its swing says 25 degrees too much, so that it seems to be Pareto-optimal."""
    honest = explore.rank(results)
    frame = results.to_pandas()
    candidates = frame[(frame["feasible"] == 1) & ~frame.index.isin(honest.index)].sort_values("cv")
    number = int(candidates.index[0])
    wrong = false_results(results, tmp_path / "false.h5", number, "swing_angle", lambda angle: angle + 25.0)
    assert number in explore.rank(wrong).index
    front = explore.certify(wrong)
    assert front.loc[number, "verdict"] == "refuted"
    assert re.match(r"swing_angle .* is off by 25, .*; design \d+ dominates it$", front.loc[number, "reason"])


def test_command(results, tmp_path, monkeypatch):
    best = [int(number) for number in explore.rank(results).index]
    code, out, err = call("certify", results.path, "-o", tmp_path / "proofs.csv", seconds=240)
    assert code == 0
    assert err.endswith(f"wrote {len(best)} designs to {tmp_path / 'proofs.csv'}\n")  # after progress, if it is slow
    assert out.startswith(
        f"{len(best)} designs of the Pareto set of {results.path}: {len(best)} proved, 0 open, 0 refuted"
    )
    assert len((tmp_path / "proofs.csv").read_text(encoding="utf-8").splitlines()) == len(best) + 1
    out, _ = succeed("certify", results.path, "--design", best[0], "--design", best[1], "--json", seconds=240)
    assert [record["design"] for record in json.loads(out)] == best[:2]
    wrong = false_results(results, tmp_path / "false.h5", best[1], "cv", lambda cv: cv + 1e-8)
    code, out, _ = call("certify", wrong.path, "--design", best[0], "--design", best[1], seconds=240)
    assert code == 1
    assert f"design {best[1]} is refuted: cv 0." in out
    assert "1 proved, 0 open, 1 refuted" in out
    opened = explore.certify(results, best[:2])
    opened["verdict"] = ["proved", "open"]
    monkeypatch.setattr("explore.analysis.certifying.public.certify_on", lambda *_: opened)
    code, out, _ = call("certify", results.path)
    assert (code, "1 proved, 1 open, 0 refuted" in out) == (1, True)
    monkeypatch.setattr("explore.cli.commands.certify._N_LINES", 1)
    assert "and 1 design more; -o FILE.csv writes all" in call("certify", results.path)[1]


def test_without_the_package_one_line_says_what_to_install(results):
    def find(name, *rest):
        return None if name == "flint" else find_spec(name, *rest)

    with mock.patch("explore.analysis.certifying.public.find_spec", find):
        code, out, err = call("certify", results.path)
    assert (code, out) == (2, "")
    assert err == 'error: certificates need python-flint: pip install "linkage-explore[certify]"\n'


def slider_rows(lengths, metrics, **options):
    """Proofs of slider-cranks as `explore.evaluate` computes them, and their designs."""
    columns = dict(zip(("crank", "rod", "offset"), map(np.array, zip(*lengths, strict=True)), strict=True))
    table = explore.evaluate("slider-crank", columns, metrics=metrics, tolerance=1e-12, **options)
    request = make_request(find_mechanism("slider-crank"), metrics=metrics, tolerance=1e-12, **options)
    rows = {number: dict(row) for number, row in enumerate(table.astype(float).to_dict(orient="records"))}
    return list(certify_designs(request, rows, [], is_front=False).values())


SLIDER_METRICS = (
    "stroke", "time_ratio", "outer_angle", "inner_angle", "pressure_angle_max", "transmission_angle_min",
    "turning_margin", "footprint",
)  # fmt: skip


def test_slider_cranks_of_all_classes_are_proved():
    lengths = [(40, 150, 20), (40, 150, 0), (40, 60, -19.5), (40, 30, 5), (40, 60, 20), (40, 50, 100)]
    designs = slider_rows([tuple(map(float, each)) for each in lengths], [*SLIDER_METRICS])
    assert [proof.reason for proof, _ in designs] == [""] * len(lengths)
    assert {design.status for _, design in designs} == {1, 2, 3, 4}


@pytest.mark.parametrize("lengths", [(40.0, 150.0, 20.0), (40.0, 60.0, -19.5)])
def test_slider_cranks_hold_the_numbers_of_mpmath(lengths):
    exact = ExactSliderCrank(*lengths)
    metrics = [f"{signal}_{name}" for signal in SLIDERS for name in ("mean", "variance", "min", "max")]
    metrics.remove("slider_acceleration_mean")  # 0 over a stroke, whose ends mpmath finds with 60 digits
    ((proof, design),) = slider_rows([lengths], metrics, window="outer_to_inner")
    assert (proof.verdict, proof.reason) == ("proved", "")
    statistics = dict(zip(SLIDERS, exact.statistics(exact.outer, exact.inner), strict=True))
    for metric in design.request.metrics:
        signal, name = metric.name.rsplit("_", 1)
        factor = 180 / mpmath.pi if signal == "rod_angle" else 1
        true = statistics[signal][("mean", "variance", "min", "max").index(name)]
        true = true * (factor**2 if name == "variance" else factor)
        assert is_close(design.enclose(metric), true, QUADRATURE), metric.name


def test_another_mechanism_is_refused():
    with pytest.raises(RequestError, match="designs of gears cannot be certified"):
        require_table(find_mechanism("gears"))


def test_metrics_without_a_road_are_open():
    """Sizes by rules of strength; the velocity of the rocker beside them is proved."""
    metrics, mechanism = ["rocker_velocity_max", "pin_diameter"], find_mechanism("test-rig")
    designs = dict(zip(LENGTHS, PUBLISHED, strict=True)) | {"opposing_torque": 1.0, "allowed_shear": 60.0}
    (row,) = explore.evaluate("test-rig", designs, metrics=metrics).astype(float).to_dict(orient="records")
    ((proof, _),) = certify_designs(make_request(mechanism, metrics=metrics), {0: row}, [], is_front=False).values()
    assert proof.open == ["pin_diameter cannot be certified: no enclosure is implemented"]
    assert proof.verdict == "open"


def test_a_double_crank_has_a_box():
    """Also where a metric needs strokes, of which it has none."""
    metrics = ["swing_angle", "envelope_width", "footprint"]
    rows = evaluated([(100.0, 110.0, 120.0, 50.0)], metrics, window="drive")
    assert math.isnan(rows[0]["swing_angle"])
    assert rows[0]["footprint"] > 0.0
    assert certified(rows, metrics, window="drive")[0].verdict == "proved"
    (proof,) = certified([rows[0] | {"footprint": rows[0]["footprint"] * (1 + 1e-9)}], metrics, window="drive").values()
    assert proof.verdict == "refuted"


@pytest.mark.parametrize(
    ("mechanism", "lengths"),
    [("crank-rocker", dict(zip(LENGTHS, PUBLISHED, strict=True))), ("slider-crank", {"crank": 100.0, "rod": 300.0})],
)
def test_a_box_with_points_is_proved(mechanism, lengths):
    """It is compared with the box of the links and of the path of the point."""
    metrics = ["envelope_width", "footprint", "arm_velocity_max"]
    request = make_request(find_mechanism(mechanism, ("arm",)), metrics=metrics, window="cycle")
    design = lengths | {"arm_along": 5000.0, "arm_across": 100.0}
    columns = evaluate_columns(request, {name: np.array([value]) for name, value in design.items()}).columns
    row = {name: float(column[0]) for name, column in columns.items()}
    ((proof, _),) = certify_designs(request, {0: row}, [], is_front=False).values()
    assert (proof.verdict, proof.reason) == ("proved", "")
