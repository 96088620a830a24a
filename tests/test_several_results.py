"""Figures and pages of several results of one mechanism, with their joint Pareto set."""

import json
import re

import numpy as np
import pytest
from command_line import run
from studies import sweep_text

import explore
from explore.base.errors import RequestError
from explore.charts import joint_pareto_chart
from explore.figures.reporting.joint import collect_joint_contents
from explore.figures.reporting.packing import ColumnPacker

STUDY = """mechanism = "crank-rocker"
[parameters]
crank = {{ start = {start}, stop = 140, num = 9 }}
coupler = {{ start = 900, stop = 1300, num = 6 }}
rocker = {{ start = 450, stop = 660, num = 6 }}
ground = 700
[constraints]
transmission_angle_min = {{ min = 30 }}
[rank]
metrics = ["cv", "swing_angle:max"]
"""
SLIDER = """mechanism = "slider-crank"
[parameters]
crank = [40, 50]
rod = 200
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with two studies of a crank-rocker and one of a slider-crank."""
    folder = tmp_path_factory.mktemp("several")
    studies = {"low": STUDY.format(start=60), "high": STUDY.format(start=97), "slider": SLIDER}
    for name, text in studies.items():
        sweep_text(folder, text, name)
    return folder


@pytest.fixture(scope="module")
def paths(folder):
    return [folder / "low.h5", folder / "high.h5"]


def test_the_figure_shows_the_joint_ranking(paths):
    figure = joint_pareto_chart(paths)
    (panel,) = figure.axes
    lines = {line.get_label(): np.column_stack(line.get_data()) for line in panel.lines}
    joint = explore.rank(paths)
    objectives = ["cv", "swing_angle"]

    assert len(set(joint["results"])) == 2, "both files are in the joint Pareto set"
    label = f"joint Pareto set in cv (min), swing_angle (max): {len(joint)}"
    assert {tuple(point) for point in lines[label]} == {tuple(point) for point in joint[objectives].to_numpy()}
    for path in paths:
        own, best = explore.rank(path), joint[joint["results"] == str(path)]
        label = f"{path.stem}: {len(own)} Pareto-optimal designs, {len(best)} (filled) in the joint Pareto set"
        assert {tuple(point) for point in lines[label]} == {tuple(point) for point in best[objectives].to_numpy()}
    assert len({line.get_marker() for line in panel.lines if line.get_label().endswith("joint Pareto set")}) == 2


def test_statistics_over_another_drive_stroke_get_a_caveat(folder, tmp_path):
    """Of the objectives only cv is one: the swing is the same for both strokes."""
    text = STUDY.format(start=60).replace("[constraints]", '[evaluate]\ndrive = "fast"\n[constraints]')
    (tmp_path / "fast.toml").write_text(text)
    run("sweep", "fast.toml", "-o", "fast.h5", cwd=tmp_path)
    output = run("rank", folder / "low.h5", "fast.h5", cwd=tmp_path)
    line = f'the drive stroke is "slow" in {folder / "low.h5"}, but "fast" in fast.h5: cv may mean something else'
    assert (output.stdout + output.stderr).count(line) == 1
    same = run("rank", folder / "low.h5", folder / "high.h5", cwd=tmp_path)
    assert "drive stroke" not in same.stdout + same.stderr


def test_names_that_are_not_distinct_are_paths(paths, folder):
    (folder / "other").mkdir()
    (folder / "other/low.h5").write_bytes(paths[1].read_bytes())
    legend = joint_pareto_chart([paths[0], folder / "other/low.h5"]).legends[0]
    labels = [text.get_text() for text in legend.get_texts()]
    assert labels[0].startswith(f"{paths[0]}: ")
    assert labels[1].startswith(f"{folder / 'other/low.h5'}: ")


def test_an_objective_that_one_file_lacks_is_named_in_the_figure(paths, folder):
    text = STUDY.format(start=80).replace('"cv", "swing_angle:max"', '"cv", "rocker_acceleration_max"')
    text += '[evaluate]\nmetrics = ["cv", "swing_angle", "rocker_acceleration_max"]\n'
    lacks = sweep_text(folder, text, "lacks")
    title = joint_pareto_chart([lacks, paths[0]], x="cv", y="swing_angle").get_suptitle()
    assert "rocker_acceleration_max, an objective of" in title.replace("\n", " ")


@pytest.mark.parametrize("command", [["plot", "pareto"], ["report"]])
@pytest.mark.parametrize(
    ("names", "sentence"),
    [
        (["low.h5", "slider.h5"], "slider.h5 is of the mechanism slider-crank, but low.h5 of crank-rocker"),
        (["low.h5", "low.h5"], "low.h5 is named twice"),
        (["low.h5", "missing.h5"], "missing.h5"),
    ],
)
def test_results_that_do_not_belong_together_get_one_line(folder, command, names, sentence):
    output = run(*command, *names, cwd=folder, code=1 if "missing.h5" in names else 2)
    assert sentence in output.stderr
    assert output.stderr.count("\n") == 1
    assert not list(folder.glob("results/*"))


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (["map"], "'map' draws one results file, not 2"),
        (["pareto", "--design", "1"], "--design applies to one results file"),
    ],
)
def test_a_figure_of_one_file_refuses_several(folder, options, sentence):
    output = run("plot", options[0], "low.h5", "high.h5", *options[1:], cwd=folder, code=2)
    assert sentence in output.stderr


def test_more_results_than_colours_are_refused(paths, folder):
    copies = []
    for number in range(7):
        copies.append(folder / f"copy{number}.h5")
        copies[-1].write_bytes(paths[0].read_bytes())
    with pytest.raises(RequestError, match="7 results has no colours to tell them apart; name 6"):
        joint_pareto_chart(copies)


def test_a_column_in_two_units_is_on_no_page(folder):
    formulas = {"in_mm": ("crank + coupler", "mm"), "bare": ("crank / coupler", "1")}
    for name, (formula, unit) in formulas.items():
        text = f'{STUDY.format(start=80)}[metrics]\nsize = {{ formula = "{formula}", unit = "{unit}" }}\n'
        sweep_text(folder, text, name)
    output = run("report", "in_mm.h5", "bare.h5", cwd=folder, code=2)
    assert output.stderr.endswith("size is in mm in in_mm.h5 and 1 in bare.h5, so they cannot be on one page\n")


def test_the_page_of_several_results_begins_with_the_best_design(paths, monkeypatch):
    """Whichever file it is in."""
    monkeypatch.setattr(ColumnPacker, "add", lambda self, values: values)
    for order in (paths, paths[::-1]):
        best = explore.rank(order)
        sources = {str(path): explore.open_results(path) for path in order}
        study = collect_joint_contents(sources, None, "", lambda _: None).study
        assert study["designs"][study["chosen"]] == best.index[0]
        assert str(order[study["columns"][0]["packed"][study["chosen"]]]) == best["results"].iloc[0]


def test_the_page_of_several_results_moves_the_mechanism_as_that_of_one(paths, tmp_path):
    motions = []
    for sources in (paths, paths[:1]):
        run("report", *sources, "-o", "page.html", cwd=tmp_path)
        page = (tmp_path / "page.html").read_text(encoding="utf-8")
        motions.append(json.loads(re.search(r'id="study">(.*?)</script>', page)[1])["motion"])
    assert motions[0] == motions[1] is not None
