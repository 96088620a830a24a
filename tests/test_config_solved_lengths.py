"""Entries { solve, value } in [parameters], and messages about invalid ones."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from simple_slider import SIMPLE_SLIDER
from studies import GOOD

from explore.evaluation.evaluate import evaluate_columns
from explore.mechanisms.registry import MECHANISMS
from explore.model.window import Window
from explore.studies.designs.solved_lengths import SolvedSpace
from explore.studies.designs.spaces import SolvedLength


def with_entry(entry, name="crank", others=""):
    return GOOD.replace(f"{name} = ", f"{name} = {entry}  # ") + others


def test_a_solved_length(load):
    space = load(with_entry('{ solve = "swing_angle", value = "0.25 rad", min = "1 cm", max = 90 }')).space
    assert isinstance(space, SolvedSpace)
    assert space.solved_length.name == "crank"
    assert (space.solved_length.metric.name, space.solved_length.low, space.solved_length.high) == (
        "swing_angle",
        10.0,
        90.0,
    )
    assert space.solved_length.value == pytest.approx(14.3239448782706, rel=1e-14)
    assert [axis.name for axis in space.axes] == ["crank", "coupler", "rocker", "ground"]
    assert space.n_designs == 1
    assert 10.0 < space.designs(0, 1)["crank"][0] < 90.0


@pytest.mark.parametrize("name", ["crank", "coupler", "rocker", "ground"])
def test_any_length_of_the_loop(load, name):
    space = load(with_entry('{ solve = "time_ratio", value = 1.2 }', name)).space
    assert isinstance(next(axis for axis in space.axes if axis.name == name), SolvedLength)


def test_with_a_table_and_with_drawn_designs(load, tmp_path):
    (tmp_path / "designs.csv").write_text("coupler,rocker\n1000,500\n900,450\n")
    text = 'mechanism = "crank-rocker"\n[parameters]\ncrank = { solve = "swing_angle", value = 20 }\nground = 700\n'
    space = load(text + '[sampling]\nmethod = "table"\nfile = "designs.csv"\n').space
    assert space.n_designs == 2
    assert space.method == "table"
    drawn = text + "coupler = { min = 900, max = 1000 }\nrocker = 500\n"
    space = load(drawn + '[sampling]\nmethod = "sobol"\ncount = 9\nseed = 4\n').space
    assert (space.n_designs, space.method, space.seed) == (9, "sobol", 4)


def test_what_determines_the_results(load):
    """The metric, the value, the bounds, the count and the seed change the hash; the way of writing does not."""
    entry = '{ solve = "swing_angle", value = 20 }'
    drawn = '[sampling]\nmethod = "sobol"\ncount = 9\nseed = 4\n'
    text = with_entry(entry).replace("coupler = 1000", "coupler = { min = 900, max = 1000 }") + drawn
    study = load(text)
    content = json.loads(study.identity)
    assert content["parameters"]["crank"] == {"solve": "swing_angle", "value": 20.0, "min": 0.0, "max": None}
    assert content["sampling"] == {"method": "sobol", "count": 9, "seed": 4}
    same = load(text.replace(entry, '{ value = "20 deg", solve = "swing_angle" }'))
    assert same.sha256 == study.sha256
    others = [
        entry.replace("20", "21"), entry.replace("swing_angle", "mid_angle"), entry.replace(" }", ", min = 1 }"),
        entry.replace(" }", ", max = 99 }"),
    ]  # fmt: skip
    different = [load(text.replace(entry, other)) for other in others]
    different += [load(text.replace("count = 9", "count = 8")), load(text.replace("seed = 4", "seed = 5"))]
    assert len({study.sha256, *(other.sha256 for other in different)}) == 7


def test_objectives_leave_out_the_prescribed_metric(load, problems):
    study = load(with_entry('{ solve = "swing_angle", value = 20 }'))
    assert [objective.metric for objective in study.objectives] == ["cv", "transmission_angle_min"]
    text = with_entry('{ solve = "swing_angle", value = 20 }', others='[rank]\nmetrics = ["cv", "swing_angle"]\n')
    assert problems(text) == [
        "study.toml:8: rank.metrics: swing_angle is prescribed, so it is the same in all designs; leave it out"
    ]


SLIDER_STUDY = """mechanism = "simple-slider"
[parameters]
crank = 50
rod = [120, 150]
offset = { solve = "stroke", value = 105 }
[evaluate]
metrics = ["stroke"]
"""


def test_a_length_may_be_negative_where_its_range_says_so(load, problems):
    with MECHANISMS.including(SIMPLE_SLIDER):
        study = load(SLIDER_STUDY)
        assert (study.space.solved_length.low, study.space.solved_length.high) == (-math.inf, math.inf)
        content = json.loads(study.identity, parse_constant=pytest.fail)  # no infinities, which are not JSON
        assert content["parameters"]["offset"] == {"solve": "stroke", "value": 105.0, "min": None, "max": None}
        assert (study.space.designs(0, 2)["offset"] < -30.0).all()
        (least,) = load(SLIDER_STUDY.replace("105", "105, min = -40").replace(", 150", "")).space.designs(0, 1)[
            "offset"
        ]
        assert -40.0 < least < -30.0
        rod = SLIDER_STUDY.replace("[120, 150]", '{ solve = "margin", value = 1, min = -5 }')
        (problem,) = problems(rod.replace('{ solve = "stroke", value = 105 }', "0"))
        assert problem == "study.toml:4: parameters.rod.min: must be greater than 0 mm, got -5"
        (problem,) = problems(SLIDER_STUDY.replace("rod = [120, 150]\n", ""))
        assert problem == "study.toml:2: parameters: missing rod; simple-slider needs crank, rod"


def test_a_mechanism_whose_loops_are_not_declared_needs_bounds(load, problems):
    """Any metric and parameter then, found among values between the bounds; here beside the mechanism's own road."""
    bounded = SLIDER_STUDY.replace("105", "105, min = -60, max = 60")
    with MECHANISMS.including(SIMPLE_SLIDER):
        expected = load(bounded).space.designs(0, 2)["offset"]
    with MECHANISMS.including(replace(SIMPLE_SLIDER, loop_lengths=())):
        (problem,) = problems(SLIDER_STUDY)
        assert problem.endswith("offset: needs bounds between which values are tried, such as min = 10, max = 100")
        np.testing.assert_allclose(load(bounded).space.designs(0, 2)["offset"], expected, rtol=1e-12)
        open_form = bounded.replace('"stroke", value = 105', '"position_peak_to_peak_cycle", value = 105')
        np.testing.assert_allclose(load(open_form).space.designs(0, 2)["offset"], expected, rtol=1e-9)


@pytest.mark.parametrize("window", ['"cycle"', "{ from = 20, to = 80 }"])
def test_a_metric_is_solved_for_over_the_window_of_the_study(load, window):
    """And a formula of the study is a metric as others are."""
    text = f"""{SLIDER_STUDY.split("offset")[0]}offset = {{ solve = "reach", value = "16 cm", min = -20, max = 40 }}
[evaluate]
window = {window}
metrics = ["position_max"]
[metrics]
reach = {{ formula = "position_max + 2 * offset", unit = "mm" }}
"""
    windows = (*SIMPLE_SLIDER.windows, Window("interval", "of crank angles", "interval", needs_stroke=False))
    with MECHANISMS.including(replace(SIMPLE_SLIDER, loop_lengths=(), windows=windows)):
        study = load(text)
        columns = evaluate_columns(study.request, study.space.designs(0, 2)).columns
    np.testing.assert_allclose(columns["reach"], 160.0, rtol=1e-9)


SOLVABLE = ", ".join(metric.name for metric in MECHANISMS["crank-rocker"].metrics[1:])


@pytest.mark.parametrize(
    ("entry", "key", "reason"),
    [
        ('{ solve = "swing", value = 20 }', ".solve", "unknown metric 'swing'; did you mean 'swing_angle'?"),
        ('{ solve = "xyz", value = 20 }', ".solve", f"unknown metric 'xyz'; available: {SOLVABLE}"),
        ('{ solve = "cv", value = 1 }', ".solve", "cv is not a closed-form metric; only these can be solved for: gra"),
        (
            '{ solve = "rocker_velocity_max_cycle", value = 1 }',
            ".solve",
            f"rocker_velocity_max_cycle is not a closed-form metric; only these can be solved for: {SOLVABLE}",
        ),
        (
            '{ solve = "linkage_class", value = 0 }',
            ".solve",
            f"linkage_class is a label, not a quantity; available: {SOLVABLE}",
        ),
        ("{ solve = 3, value = 20 }", ".solve", "must be a string in quotes, got 3"),
        ('{ solve = "swing_angle" }', "", "the key 'value' is missing; a complete table has solve, value, min, max"),
        ("{ value = 20 }", "", "the key 'solve' is missing; a complete table has solve, value, min, max"),
        ('{ solve = "swing_angle", vaule = 20 }', ".vaule", "unknown key; did you mean 'value'?"),
        ('{ solve = "swing_angle", value = "20" }', ".value", "'20' has no unit; write 20 without quotes"),
        ('{ solve = "swing_angle", value = "20 mm" }', ".value", "'mm' cannot be converted to 'deg'"),
        ('{ solve = "swing_angle", value = nan }', ".value", "nan is not a finite number"),
        ('{ solve = "swing_angle", value = 181 }', ".value", "swing_angle is at most 180 deg, got 181"),
        ('{ solve = "swing_angle", value = -1 }', ".value", "swing_angle is at least 0 deg, got -1"),
        ('{ solve = "time_ratio", value = 0.9 }', ".value", "time_ratio is at least 1, got 0.9"),
        ('{ solve = "swing_angle", value = 20, min = 0 }', ".min", "must be greater than 0 mm, got 0"),
        ('{ solve = "swing_angle", value = 20, max = "5 kg" }', ".max", "'kg' cannot be converted to 'mm'"),
        ('{ solve = "swing_angle", value = 20, min = 9, max = 9 }', "", "min = 9 must be below max = 9"),
    ],
)  # fmt: skip
def test_bad_entries(problems, entry, key, reason):
    (problem,) = problems(with_entry(entry))
    assert problem.startswith(f"study.toml:3: parameters.crank{key}: {reason}")


def test_lengths_that_cannot_be_solved_for(problems):
    entry = '{ solve = "swing_angle", value = 20 }'
    (problem,) = problems(GOOD + f"speed = {entry}\n")
    assert problem == (
        "study.toml:7: parameters.speed: cannot be solved for; "
        "a crank-rocker can be solved for crank, coupler, rocker, ground"
    )
    (problem,) = problems(with_entry(entry).replace("ground = 700", f"ground = {entry}"))
    assert problem == (
        "study.toml:6: parameters.ground: another length is already solved for; "
        "one prescribed value determines one length"
    )
