"""Errors of tasks are objectives: of `rank`, of task files, and of searches where the study computes them."""

import json
from importlib import import_module
from importlib.util import find_spec

import numpy as np
import pytest
from command_line import run
from studies import synthesize_text

import explore
from explore.base.errors import ConfigError, RequestError
from explore.model.columns import Column
from explore.studies.config.study_file import parse_study
from explore.synthesis.candidates import BOOKKEEPING
from explore.synthesis.tasks.registry import TASK_TYPES
from explore.synthesis.tasks.task_files import parse_task, task_starter

#: Modules of the types of tasks.
TASK_MODULES = ("dead_positions", "dwell", "function", "motion", "placed_four_bars", "slider_path")

FUNCTION = """task = "function"
[target]
formula = "log(x)"
from = 1
to = 2
input_angle = 60
output_angle = 90
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Candidates for the logarithm of the starter, whose errors come to 0.1, 0.6, 1.2, 1.5 and 1.7 deg."""
    folder = tmp_path_factory.mktemp("function")
    (folder / "log.toml").write_text(task_starter("function"), encoding="utf-8")
    output = run("synthesize", "log.toml", cwd=folder)
    assert "5 within the bounds, best output_error_max first" in output.stdout
    return folder


DWELL = 'task = "dwell"\n[target]\ndwell_angle = 90\nstroke = 30\n'


@pytest.fixture(scope="module")
def dwell(tmp_path_factory):
    """Candidates for the dwell of the starter, whose errors only the solver measures."""
    folder = tmp_path_factory.mktemp("dwell")
    (folder / "dwell.toml").write_text(task_starter("dwell"), encoding="utf-8")
    run("synthesize", "dwell.toml", cwd=folder)
    return folder


@pytest.fixture(scope="module")
def results(folder):
    return explore.open_results(folder / "results" / "log.h5")


def test_the_error_is_the_first_objective(results):
    assert results.objectives == ("output_error_max:min", "transmission_angle_worst:max", "footprint:min")
    assert results.senses["output_error_max"] == results.senses["output_error_rms"] == "min"
    assert {c.name: c.role for c in results.columns}["output_error_max"] == "metric"
    assert {c.name: c.role for c in results.columns}["output_start"] == "parameter"
    errors = explore.rank(results)["output_error_max"]
    assert errors.iloc[0] == errors.min() == pytest.approx(0.10183, abs=1e-4)
    assert errors.is_monotonic_increasing


def test_the_table_and_json_begin_with_the_least_error(folder):
    record = json.loads(run("synthesize", "log.toml", "--json", "--quiet", cwd=folder).stdout)
    errors = [each["output_error_max"] for each in record["candidates"] if each["feasible"]]
    assert errors == sorted(errors)
    assert len(errors) == 5


def test_rank_by_the_error_and_under_a_condition(folder, results):
    best = explore.rank(results, objectives="output_error_max")
    assert best["output_error_max"].tolist() == [results.to_pandas()["output_error_max"].min()]
    within = explore.rank(results, where="output_error_max < 0.6")
    assert (within["output_error_max"] < 0.6).all()
    assert len(within) == 2
    assert "best output_error_rms first" in run("rank", "--metric", "output_error_rms", cwd=folder).stdout
    output = run("rank", "--where", "output_error_max < 0.5", cwd=folder)
    assert "1 of 1 feasible design" in output.stderr
    assert "did you mean 'output_error_max'?" in run("rank", "--metric", "output_eror_max", cwd=folder, code=2).stderr


def test_charts_and_the_report_have_the_error(folder):
    run("plot", "pareto", "results/log.h5", "-o", "pareto.png", cwd=folder)
    run("report", "results/log.h5", "-o", "log.html", cwd=folder)
    assert "output_error_max" in (folder / "log.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("command", "metrics"),
    [
        ("refine", []),
        ("refine", ["slider_pressure_angle_max", "footprint:min"]),
        ("polish", []),
        ("polish", ["dwell_error"]),
    ],
)
def test_searches_refuse_what_only_the_solver_computes(dwell, command, metrics):
    options = [word for metric in metrics for word in ("--metric", metric)]
    output = run(command, "results/dwell.h5", *options, cwd=dwell, code=2)
    (line,) = output.stderr.splitlines()[-1:]
    name = metrics[0] if metrics else "dwell_error"
    assert f"only the solver of the task computes {name}, not the study" in line
    assert line.endswith("such as transmission_angle_worst:max and footprint:min")
    assert not (dwell / "results" / "dwell-refined.h5").exists()


def test_show_says_what_the_labels_of_a_design_mean(folder, results):
    text = run("show", "--design", "1", cwd=folder).stdout
    assert text.splitlines()[-1] == f"least_error: {results.label_sentences['least_error']}"
    assert "precision_points: " not in text


def test_a_refinement_in_objectives_of_the_study(dwell):
    metrics = ("--metric", "transmission_angle_worst:max", "--metric", "footprint:min")
    run("refine", "results/dwell.h5", *metrics, "--evaluations", "256", "-o", "study.h5", cwd=dwell)
    assert len(explore.rank(dwell / "study.h5"))
    assert explore.open_results(dwell / "results" / "dwell.h5").senses["dwell_error"] == "min"


def test_the_study_of_a_design_has_the_objectives_that_it_computes(dwell):
    run("export", "results/dwell.h5", "--design", "0", "-o", "one.toml", cwd=dwell)
    study = explore.load_study(dwell / "one.toml")
    assert [objective.metric for objective in study.objectives] == ["transmission_angle_worst", "footprint"]


def test_tuning_shows_what_the_study_computes(dwell):
    output = run("tune", "results/dwell.h5", "--design", "0", "--parameter", "rocker", "--json", cwd=dwell)
    (first, *_) = json.loads(output.stdout)["curve"]
    assert set(first) == {"rocker", "transmission_angle_worst", "footprint", "error", "piece"}
    assert "slider_stroke" not in output.stderr


def test_searches_lower_the_error_of_a_function(folder, results):
    """The solver's candidates have the least mean error; the largest error can be made less."""
    best = explore.rank(results).iloc[0]
    run("refine", "results/log.h5", "--evaluations", "4096", cwd=folder)
    refined = explore.open_results(folder / "results" / "log-refined.h5")
    assert refined.target == results.target
    assert refined.constraints["output_error_max"] == {"min": None, "max": 2.0}
    found = explore.rank(refined)
    assert found["output_error_max"].min() < best["output_error_max"]
    assert found["transmission_angle_worst"].min() >= 20.0
    run("rank", "results/log-refined.h5", cwd=folder)
    options = ("--tolerance", "crank=0.1", "--draws", "64", "--design", found.index[0])
    run("tolerance", "results/log-refined.h5", *options, cwd=folder)
    run("report", "results/log-refined.h5", "-o", "refined.html", cwd=folder)
    polished = run("polish", "results/log.h5", "--json", cwd=folder).stdout
    assert json.loads(polished)[0]["output_error_max"] < 0.8 * best["output_error_max"]


@pytest.mark.skipif(find_spec("flint") is None, reason="certificates need python-flint")
def test_certificates_of_a_front_need_objectives_of_the_study(dwell):
    results = explore.open_results(dwell / "results" / "dwell.h5")
    with pytest.raises(RequestError, match="does not compute dwell_error"):
        explore.certify(results)
    table = explore.certify(results, [1])
    assert table["verdict"].tolist() == ["proved"]


def test_a_task_file_names_errors_as_objectives(tmp_path):
    ranked = FUNCTION + '[search]\ncount = 2\n[rank]\nmetrics = ["link_ratio:min", "output_error_rms"]\n'
    assert synthesize_text(tmp_path, ranked).objectives == ("link_ratio:min", "output_error_rms:min")
    alone = synthesize_text(tmp_path, ranked.replace('"link_ratio:min", ', ""), "alone")
    assert alone.objectives == ("output_error_rms:min",)
    assert len(explore.rank(alone)) == 1


def test_mistakes_in_objectives_have_their_line():
    text = (
        FUNCTION
        + """[rank]
metrics = [
    "output_error_max:mix",
    "output_error_rms",
    "footprnt",
    "output_error_rms:max",
    3,
]
"""
    )
    with pytest.raises(ConfigError) as caught:
        parse_task(text, "task.toml")
    assert sorted(line.split(": ", 2)[2] for line in caught.value.problems) == [
        "must be a string in quotes, got 3",
        "output_error_rms is listed twice; remove one",
        "unknown metric 'footprnt'; did you mean 'footprint'?",
        "unknown sense 'mix' of output_error_max; write output_error_max:min or output_error_max:max",
    ]
    with pytest.raises(ConfigError, match="the list is empty"):
        parse_task(FUNCTION + "[rank]\nmetrics = []\n", "task.toml")
    with pytest.raises(ConfigError, match="rank.metrics"):
        parse_task(FUNCTION + "[rank]\nmetrics = 3\n", "task.toml")


def test_a_misspelled_error_of_the_task_is_known():
    with pytest.raises(ConfigError, match="unknown metric 'output_eror_rms'; did you mean 'output_error_rms'"):
        parse_task(FUNCTION + '[rank]\nmetrics = ["output_eror_rms"]\n', "task.toml")


def test_constraints_on_errors_of_the_task(tmp_path):
    text = FUNCTION + "[search]\ncount = 5\n[constraints]\noutput_error_rms = { max = 0.3 }\n"
    results = synthesize_text(tmp_path, text)
    frame = results.to_pandas()
    assert results.constraints["output_error_rms"] == {"min": None, "max": 0.3}
    assert results.constraints["output_error_max"] == {"min": None, "max": 2.0}
    assert 0 < frame["feasible"].sum() < len(frame)
    assert (frame["feasible"] == (frame["output_error_rms"] <= 0.3)).all()
    assert (frame["output_error_rms_margin"] == 0.3 - frame["output_error_rms"]).all()


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("dwell_error = 3", "dwell_error: at least one bound is needed, such as { max = 0.5 }, got 3"),
        ("dwell_error = { most = 3 }", "constraints.dwell_error.most: unknown key; available: min, max"),
    ],
)
def test_wrong_constraints_on_errors_of_the_task(text, problem):
    with pytest.raises(ConfigError) as caught:
        parse_task(DWELL + f"[constraints]\n{text}\n", "task.toml")
    (line,) = caught.value.problems
    assert line.endswith(problem)


def test_what_the_solver_measures_is_listed_bounded_and_ranked_as_any_metric(tmp_path):
    more = (
        '[search]\ncount = 2\n[evaluate]\nmetrics = ["dwell_error"]\n[constraints]\ndwell_error = { max = "0.5 um" }\n'
    )
    results = synthesize_text(tmp_path, f'{DWELL}{more}[rank]\nmetrics = ["footprint:min", "dwell_error"]\n')
    frame = results.to_pandas()
    assert [column.name for column in results.columns].count("dwell_error") == 1
    assert results.constraints["dwell_error"] == {"min": None, "max": pytest.approx(5e-4)}
    np.testing.assert_array_equal(
        frame["dwell_error_margin"], results.constraints["dwell_error"]["max"] - frame["dwell_error"]
    )
    assert (frame["feasible"] <= (frame["dwell_error_margin"] >= 0)).all()
    assert results.objectives == ("footprint:min", "dwell_error:min")
    # other designs have none of it, so the study that searches follow does not ask for it
    study = parse_study(results.config, "dwell.toml", tmp_path)
    assert [objective.metric for objective in study.objectives] == ["footprint"]
    assert {constraint.metric.name for constraint in study.request.constraints} == {
        "link_ratio",
        "transmission_angle_worst",
    }
    assert "dwell_error" not in {metric.name for metric in study.request.metrics}


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ('[rank]\nmetrics = ["dwell_eror"]', "rank.metrics: unknown metric 'dwell_eror'; did you mean 'dwell_error'?"),
        (
            '[metrics]\nshare = { formula = "dwell_error / crank", unit = "1" }',
            "metrics.share.formula: at character 1: dwell_error comes with the designs, so a formula cannot use it",
        ),
    ],
)
def test_mistakes_in_what_only_the_solver_measures_have_their_line(text, problem):
    with pytest.raises(ConfigError) as caught:
        parse_task(f"{DWELL}{text}\n", "task.toml")
    (line,) = caught.value.problems
    assert line.startswith(f"task.toml:6: {problem}")


@pytest.mark.parametrize("name", ["solution", "method", "link_ratio"])
def test_formulas_do_not_take_the_names_of_a_task(name):
    """They replaced the bound on link_ratio, and were replaced by the number of the solution."""
    with pytest.raises(ConfigError) as caught:
        parse_task(f'{FUNCTION}[metrics]\n{name} = {{ formula = "crank", unit = "mm" }}\n', "task.toml")
    (line,) = caught.value.problems
    assert line.endswith(f"metrics.{name}: this is the name of a column of the task; choose another")


def test_all_columns_that_solvers_add_have_taken_names():
    modules = [import_module(f"explore.synthesis.tasks.{name}") for name in TASK_MODULES]
    listed = [value if isinstance(value, tuple) else (value,) for module in modules for value in vars(module).values()]
    added = {each.name for values in listed for each in values if isinstance(each, Column)}
    measured = {
        metric.name for name in TASK_TYPES for metric in parse_task(task_starter(name), "task.toml").task.measured
    }
    assert added <= {*BOOKKEEPING, *measured, "timed_error_rms", "timed_error_max"}, "the last with crank angles"


def test_errors_of_another_task_are_unknown():
    with pytest.raises(ConfigError, match="unknown metric 'dwell_error'"):
        parse_task(FUNCTION + '[rank]\nmetrics = ["dwell_error"]\n', "task.toml")


def test_poses_that_are_met_exactly_are_not_ranked_by_rounding_errors():
    task = parse_task(task_starter("motion"), "task.toml").task
    assert task.objectives == ("transmission_angle_worst:max", "footprint:min")


def test_the_error_comes_first_without_a_section_rank():
    for text, first in ((FUNCTION, "output_error_max:min"), (DWELL, "dwell_error:min")):
        task = parse_task(text, "task.toml").task
        assert task.objectives == (first, "transmission_angle_worst:max", "footprint:min")
