"""Certificates of dwells: numbers of the program are proved, false ones refuted, and balls hold simulated travels."""

import numpy as np
import pytest
from flint import ctx
from test_certify_linkages import proofs_of
from test_dwell_targets import LENGTHS, TABLES, Output, angle_of, table_designs, travel_of

import explore
from explore.analysis.certifying.designs import Design
from explore.mechanisms.linkages.declaration import linkage_mechanism
from explore.studies.request.names import find_mechanism
from explore.studies.request.requests import make_request
from explore.studies.request.targets import add_target

SIX_BAR = {"r1": 30.69, "r2": 72.17, "r3": 101.35, "r4": 100, "rd": 132.72, "ad": -15.41, "l1": 86.27, "l2": 64.9}
DESIGNS = {"crank-rocker": LENGTHS, "slider-crank": {"crank": 30, "rod": 80, "offset": 15}, "stephenson-3": SIX_BAR}


def mechanism_of(name, target):
    """What `evaluate` takes, and the mechanism with the target."""
    if name in ("crank-rocker", "slider-crank"):
        return name, add_target(find_mechanism(name), target)
    linkage = explore.load_linkage(TABLES / f"{name}.toml")
    return linkage, add_target(linkage_mechanism(linkage.table), target)


def verdicts_of(name, design, target):
    """The row of a design, and verdicts on it and on rows with a number that is wrong by more than its bound."""
    metrics = ["dwell_error" if "angle" in target else "dwell_angle", "dwell_start"]
    called, mechanism = mechanism_of(name, target)
    (row,) = explore.evaluate(called, design, target=target, metrics=metrics).astype(float).to_dict(orient="records")
    wrong = max(1e-7, 3.0 * row["error"]) * 360.0  # both numbers are in deg, or travels of less than 360 mm
    false = [row | {metric: row[metric] + wrong} for metric in metrics]
    return row, proofs_of(mechanism, [row, *false], metrics)


@pytest.mark.parametrize("target", [angle_of(60), angle_of(200), travel_of(5.0)], ids=["short", "long", "travel"])
@pytest.mark.parametrize("name", DESIGNS)
def test_dwells_are_proved(name, target):
    row, (true, *false) = verdicts_of(name, DESIGNS[name], target)
    assert row["status"] == 1
    assert true == ("proved", "")
    assert [verdict for verdict, _ in false] == ["refuted"] * 2


@pytest.mark.parametrize("name", ["watt-2", "whitworth", "jansen", "oscillating-cylinder"])
def test_dwells_of_random_designs_are_proved(name):
    """Of links and slots; what is not decided is open."""
    rng = np.random.default_rng(11)
    linkage, designs = table_designs(name, 6, rng)
    turning = [design for design in designs if explore.evaluate(linkage, design)["status"][0] == 1][:1]
    verdicts = []
    for design in turning:
        _, (true, *false) = verdicts_of(name, design, angle_of(rng.uniform(20, 320)))
        assert true[0] != "refuted", true
        assert all(verdict != "proved" for verdict, _ in false)
        verdicts.append(true[0])
    assert "proved" in verdicts


def test_the_least_travel_is_that_of_the_simulated_output():
    """To the error of the spline of 3,600 samples; a plateau of starts has its middle as start."""
    called, mechanism = mechanism_of("stephenson-3", angle_of(80))
    request = make_request(mechanism, metrics=["dwell_error", "dwell_start"])
    parameters = {p.name: p.default for p in mechanism.parameters} | {k: float(v) for k, v in SIX_BAR.items()}
    found = {metric.name: float(Design(parameters, request).enclose(metric).ball) for metric in request.metrics}
    output = Output(called, SIX_BAR, "output_angle")
    assert ctx.prec == 53
    assert found["dwell_error"] == pytest.approx(output.least(80), abs=1e-9)
    assert output.travel(found["dwell_start"], 80) == pytest.approx(found["dwell_error"], abs=1e-9)


def test_a_dwell_at_both_ends_of_the_stroke_has_no_proved_start():
    """The slot of a yoke moves as a cosine, so that two starts serve as well."""
    linkage, (design, *_) = table_designs("scotch-yoke", 1, np.random.default_rng(11))
    assert explore.evaluate(linkage, design)["status"][0] == 1
    _, (true, *_) = verdicts_of("scotch-yoke", design, angle_of(50))
    assert true == ("open", "dwell_start is not decided with 1024 bits")


def test_an_output_that_moves_less_than_the_travel_rests_for_the_whole_turn():
    row, (true, *_) = verdicts_of("slider-crank", DESIGNS["slider-crank"], travel_of(500.0))
    assert row["dwell_angle"] == 360.0
    assert true == ("open", "dwell_start is not decided with 1024 bits")  # all starts serve as well
