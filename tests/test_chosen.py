"""Designs chosen from results, and the request that computed them."""

import re

import pytest
from command_line import succeed
from studies import swept

import explore
from explore.base.errors import NothingFeasibleWarning, RequestError, ResultsError
from explore.figures.charts.motion import motion_chart
from explore.figures.charts.parallel import parallel_chart
from explore.running.chosen import chosen_designs, request_of

STUDY = """
mechanism = "crank-rocker"
[parameters]
crank = { min = "50 mm", max = "20 cm" }
coupler = 900
rocker = 500
ground = { min = 700, max = 1000 }
[points.knife]
along = 120
across = { min = 0, max = 40 }
[sampling]
method = "sobol"
count = 256
seed = 1
[evaluate]
window = { from = 10, to = "2 rad" }
metrics = ["cv", "knife_x_max"]
tolerance = 1e-8
[metrics]
reach = { formula = "coupler + ground", unit = "mm" }
[constraints]
transmission_angle_min = { min = "0.5 rad" }
[rank]
metrics = ["cv", "reach:min"]
"""
results = swept(STUDY)


def test_the_request_of_results_is_that_of_their_study(results):
    assert request_of(results) == explore.load_study(results.path.with_suffix(".toml")).request


def test_without_numbers_the_pareto_set_is_chosen(results):
    frame = chosen_designs(results)
    assert list(frame.index) == list(explore.rank(results).index)
    assert len(frame) > 1


def test_numbers_are_kept_in_their_order(results):
    assert list(chosen_designs(results, [7, 3]).index) == [7, 3]
    assert list(chosen_designs(results, 5).index) == [5]
    with pytest.raises(ResultsError, match="256"):
        chosen_designs(results, [256])


def test_feasible_designs_without_an_objective_are_not_called_infeasible(tmp_path):
    study = explore.Study(
        mechanism="crank-rocker",
        parameters={"crank": [100, 110], "coupler": 900, "rocker": 500, "ground": 700},
        formulas={"excess": {"formula": "log(crank - 200)", "unit": "1"}},
        objectives=["cv", "excess:max"],
    )
    results = explore.sweep(study, tmp_path / "undefined.h5")
    begin = f"in each feasible design of {re.escape(str(results.path))} an objective is undefined or infinite"
    with pytest.warns(NothingFeasibleWarning, match=f"{begin}, so there is nothing to rank; left out: 2 in which"):
        explore.rank(results)
    for choose in (chosen_designs, motion_chart):
        with pytest.raises(RequestError, match=f"{begin}, so none is the best: choose one with `design`"):
            choose(results)
    with pytest.raises(RequestError, match=f"{begin}, so there is no Pareto set to draw"):
        parallel_chart(results)
    with pytest.warns(NothingFeasibleWarning, match="in each feasible design of .* that meets the request an"):
        explore.rank(results, where="crank > 105")
    with pytest.warns(NothingFeasibleWarning, match="no feasible design of .* meets the request"):
        explore.rank(results, where="crank > 200")


def test_without_a_feasible_design_none_is_the_best(tmp_path):
    study = explore.Study(
        mechanism="crank-rocker",
        parameters={"crank": [100, 110], "coupler": 900, "rocker": 500, "ground": 700},
        constraints={"transmission_angle_min": {"min": 80}},
    )
    with pytest.raises(RequestError, match="no design of .* is feasible"):
        chosen_designs(explore.sweep(study, tmp_path / "none.h5"))


def test_a_margin_is_an_objective_that_no_study_names(results, tmp_path):
    """Refined in it, designs are polished, tuned and certified, and the study of one has the other objective."""
    margin = "transmission_angle_min_margin:max"
    refined = explore.refine(results, tmp_path / "refined.h5", evaluations=400, objectives=[margin, "reach:min"])
    polished, name = explore.polish(refined), margin.partition(":")[0]
    assert polished[name].iloc[0] >= explore.rank(refined)[name].max()
    assert explore.certify(refined)["verdict"].isin(["proved", "open"]).all()
    said, _ = succeed("tune", refined.path, "--parameter", "crank")
    assert said.startswith("reach exists: crank ")
    succeed("export", refined.path, "-o", tmp_path / "one.toml")
    assert [each.metric for each in explore.load_study(tmp_path / "one.toml").objectives] == ["reach"]
