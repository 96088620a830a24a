"""What can be ranked in: parameters as well as metrics, in a study as on the command line, and in several results."""

import json
from pathlib import Path

import pytest
from command_line import call, succeed
from studies import box, sweep_text

import explore

STUDY = box("""\
count = 4096
[evaluate]
metrics = ["cv", "swing_angle", "time_ratio"]
[constraints]
transmission_angle_min = { min = 30 }
""")
SOLVED = STUDY.replace("coupler = { min = 50, max = 1000 }", 'coupler = { solve = "swing_angle", value = 40 }')
#: Derived metrics, and a crank that is solved for.
RIG = (Path(__file__).parents[1] / "configs/rig_20deg.toml").read_text(encoding="utf-8").partition("[rank]")[0]


def numbers(*arguments):
    """The designs of a ranking, and the messages."""
    out, err = succeed("rank", *arguments, "--json")
    return [record["design"] for record in json.loads(out)], err


@pytest.mark.parametrize(
    ("text", "objectives"),
    [
        (STUDY, ["cv:min", "coupler:min"]),
        (STUDY, ["ground:min", "rocker:max"]),
        (STUDY, ["crank:min", "cv:min"]),  # one value: nothing is better in it
        (SOLVED, ["cv:min", "coupler:min"]),
        (RIG, ["pin_force_peak:min", "crank:min", "size:min"]),
    ],
)
def test_parameters_are_objectives_of_a_study_as_of_the_command_line(tmp_path, text, objectives):
    plain = sweep_text(tmp_path, text, "plain").path
    options = [word for objective in objectives for word in ("--metric", objective)]
    expected, _ = numbers(plain, *options)
    text += f"[rank]\nmetrics = {json.dumps(objectives)}\n"

    designs, _ = numbers(sweep_text(tmp_path, text, "objectives").path)
    front_designs, _ = numbers(sweep_text(tmp_path, text, "front", keep="front").path)

    assert designs == front_designs == expected
    assert len(expected) > 0
    assert explore.rank(tmp_path / "objectives.h5").index.tolist() == expected


def test_every_figure_and_the_report_take_a_parameter_as_an_objective(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "results").mkdir()
    path = sweep_text(tmp_path, STUDY + '[rank]\nmetrics = ["coupler:min", "cv"]\n', "objectives").path

    out, _ = succeed("rank", path, "--top", 3)
    heading = out.partition("─")[0].partition("best coupler first\n")[2].split()
    assert heading.count("coupler") == 1, "a parameter that is an objective is one column, not two"
    for kind in ("pareto", "parallel", "map"):
        succeed("plot", kind, path)
    succeed("report", path)


@pytest.fixture(scope="module")
def boxes(tmp_path_factory):
    """Results of three studies whose objectives differ, as are their columns, by name."""
    folder = tmp_path_factory.mktemp("boxes")
    metrics = 'metrics = ["cv", "swing_angle", "time_ratio"]'
    texts = {
        "first": STUDY + '[rank]\nmetrics = ["time_ratio:min", "swing_angle:max"]\n',
        "second": STUDY.replace(metrics, 'metrics = ["cv", "swing_angle"]') + '[rank]\nmetrics = ["cv"]\n',
        "third": STUDY.replace(metrics, 'metrics = ["cv"]') + '[rank]\nmetrics = ["cv"]\n',
        "other_metric": STUDY.replace(metrics, 'metrics = ["rocker_velocity_max"]'),
    }
    return {name: sweep_text(folder, text, name).path for name, text in texts.items()}


def test_results_of_other_objectives_are_ranked_in_those_that_all_have(boxes):
    files = [boxes["first"], boxes["second"]]
    together = explore.rank(files, objectives=["swing_angle:max"], order_by="cv")

    designs, messages = numbers(*files, "--metric", "cv")

    assert designs == together.index.tolist()
    assert len(designs) > 0
    assert f"time_ratio, an objective of {files[0]}, is not in {files[1]}, so it is left out\n" in messages
    with pytest.warns(RuntimeWarning, match="time_ratio, an objective of .*first.h5, is not in .*second.h5"):
        assert explore.rank(files).index.tolist() == explore.rank(files, objectives="swing_angle:max").index.tolist()


def test_one_metric_is_the_objective_where_the_studies_share_none(boxes):
    files = [boxes["first"], boxes["third"]]

    designs, messages = numbers(*files, "--metric", "cv")

    assert designs == explore.rank(files, objectives="cv").index.tolist()
    assert messages.count("so it is left out") == 2
    alone, _ = numbers(boxes["other_metric"], "--metric", "rocker_velocity_max:min")
    assert len(alone) == 1
    code, _, err = call("rank", *files)
    assert (code, err) == (
        2, f"error: no objective of {files[0]} is in all of these results; name objectives that all have\n",
    )  # fmt: skip
    code, _, err = call("rank", *files, "--metric", "swing_angle:max")
    assert (code, err.count("\n")) == (2, 1)
    assert f"{files[1]}: no column 'swing_angle' to rank by in these results" in err


def test_columns_of_two_mechanisms_are_in_one_unit_each(tmp_path):
    """`rod` is of the second alone, and `mean` in rad/s of the first and in mm/s of the second."""
    metrics = '[evaluate]\nmetrics = ["cv", "mean"]\n[rank]\nmetrics = ["crank:min", "cv"]\n'
    rocker = 'mechanism = "crank-rocker"\n[parameters]\ncrank = "1 in"\ncoupler="9 dm"\nrocker="5 dm"\nground="7 dm"\n'
    slider = 'mechanism = "slider-crank"\n[parameters]\ncrank = "2 in"\nrod = "10 in"\n'
    first = sweep_text(tmp_path, rocker + metrics + '[units]\nlength = "in"\n', "rocker").path
    second = sweep_text(tmp_path, slider + metrics, "slider").path

    out, err = succeed("rank", first, second, "--metric", "cv:max", "--metric", "crank:min", "--json")
    of_rocker, of_slider = sorted(json.loads(out), key=lambda record: record["results"])
    assert (of_rocker["crank [in]"], of_slider["crank [in]"]) == (1, 2)
    assert (of_rocker["rod [in]"], of_slider["rod [in]"]) == (None, 10)
    assert of_slider["mean"] is None
    assert f"left out of the designs of {second}, in other units than in results before: mean\n" in err
