"""The Pareto figure: its marks, counts and axes agree with the results file."""

import json
import shutil

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from studies import TABLE, sweep_text

import explore
from explore.base.errors import ExploreError, RequestError
from explore.figures.charts.bounds import draw_metric_bounds
from explore.figures.charts.joint_pareto import joint_pareto_chart
from explore.figures.charts.map import map_chart
from explore.figures.charts.parallel import parallel_chart
from explore.figures.charts.pareto import DENSITY_THRESHOLD, pareto_chart
from explore.figures.charts.ratio import ratio_chart
from explore.figures.charts.style import new_figure, save_figure

STUDY = """mechanism = "crank-rocker"
[parameters]
crank = {crank}
coupler = 1083.4236
rocker = {rocker}
ground = {ground}
[evaluate]
metrics = {computed}
[constraints]
transmission_angle_min = {{ min = 20 }}
rocker_acceleration_max = {{ max = 0.5 }}
[rank]
metrics = {metrics}
"""
RANGES = {
    "crank": "{ min = 40, max = 170 }",
    "rocker": "{ min = 450, max = 650 }",
    "ground": "{ min = 600, max = 800 }",
    "computed": '["cv", "swing_angle", "transmission_angle_min", "rocker_acceleration_max", "mean_output_ratio"]',
    "metrics": '["cv", "swing_angle:max"]',
}
SINGLE = {"crank": "100", "rocker": "541.7118", "ground": "780"}


@pytest.fixture(scope="session")
def results_of(tmp_path_factory):
    """A function that sweeps a study of `count` designs, once for the same arguments."""
    cache = {}

    def sweep_study(count, **changes):
        key = (count, *sorted(changes.items()))
        if key not in cache:
            folder = tmp_path_factory.mktemp("plots")
            text = STUDY.format(**{**RANGES, **(SINGLE if count == 1 else {}), **changes})
            if count > 1:
                text += f'[sampling]\nmethod = "sobol"\ncount = {count}\nseed = 3\n'
            cache[key] = sweep_text(folder, text)
        return cache[key]

    return sweep_study


def lines_by_label(chart):
    """Labelled lines of a chart by their label up to the colon."""
    return {line.get_label().split(":")[0]: line for line in chart.get_lines() if not line.get_label().startswith("_")}


def crosses_of(chart):
    """Coordinates of all infeasible designs, and the opacity of each."""
    lines = [line for line in chart.get_lines() if line.get_marker() == "x"]
    points = np.vstack([np.column_stack(line.get_data()) for line in lines])
    return points, np.concatenate([np.full(len(line.get_xdata()), line.get_alpha()) for line in lines])


def count_of(line):
    return int(line.get_label().split(": ")[1].split(" ")[0].replace(",", ""))


def pareto_set(points):
    """Points that no other dominates; the first coordinate is minimised, the second maximised."""
    return {
        tuple(p) for p in points
        if not any((q[0] <= p[0] and q[1] >= p[1]) and (q[0] < p[0] or q[1] > p[1]) for q in points)
    }  # fmt: skip


def test_pareto_draws_the_designs_of_the_results(results_of):
    results = results_of(300)
    table = results.to_pandas()
    figure = pareto_chart(results)
    (chart,) = figure.axes
    lines = lines_by_label(chart)
    feasible = table[table["feasible"]][["cv", "swing_angle"]].to_numpy()
    infeasible = table[~table["feasible"]][["cv", "swing_angle"]].dropna()

    front = lines["Pareto set in cv (min), swing_angle (max)"]
    assert {tuple(p) for p in np.column_stack(front.get_data())} == pareto_set(feasible)
    assert front.get_drawstyle() == "steps-post"
    assert np.all(np.diff(front.get_xdata()) > 0.0)
    assert count_of(lines["feasible"]) == len(feasible)
    crosses, _ = crosses_of(chart)
    assert len(crosses) == count_of(lines["infeasible"]) == len(infeasible) > 0
    assert {tuple(p) for p in crosses} == {tuple(p) for p in infeasible.to_numpy()}
    assert f"and {np.isnan(table['cv']).sum()} without values" in lines["infeasible"].get_label()
    (dots,) = [line for line in chart.get_lines() if line.get_marker() == "." and len(line.get_xdata())]
    assert {tuple(p) for p in np.column_stack(dots.get_data())} == {tuple(p) for p in feasible}
    best = feasible[feasible[:, 0].argmin()]
    assert np.array_equal(np.ravel(lines["chosen"].get_data()), best)
    assert "[1]" in chart.get_xlabel()
    assert "[deg]" in chart.get_ylabel()
    assert min(mark.get_markersize() for mark in figure.legends[0].get_lines()) >= 6.0


def test_titles_and_legends_end_within_the_picture(results_of, tmp_path):
    metrics = ["cv", "swing_angle:max", "transmission_angle_min:max", "rocker_acceleration_max", "mean_output_ratio"]
    computed = [metric.partition(":")[0] for metric in metrics]
    swept = results_of(300, metrics=json.dumps(metrics), computed=json.dumps(computed))
    long = tmp_path / f"{'linkages_of_the_third_series_' * 4}.h5"
    shutil.copy(swept.path, long)
    ratio = tmp_path / f"{'ratios_of_the_third_series_' * 4}.h5"
    shutil.copy(results_of(300, rocker="541.7118", ground="780").path, ratio)
    charts = [
        pareto_chart(long),
        map_chart(long),
        parallel_chart(long),
        joint_pareto_chart([swept, long]),
        ratio_chart(ratio),
    ]
    for figure in charts:
        renderer = FigureCanvasAgg(figure).get_renderer()
        figure.draw(renderer)
        texts = [figure._suptitle, *(text for legend in figure.legends for text in legend.get_texts())]
        for text in texts:
            extent = text.get_window_extent(renderer)
            assert 0.0 <= extent.x0 < extent.x1 <= figure.bbox.x1, text.get_text()


def test_infeasible_designs_are_paler_than_feasible_ones(results_of):
    (chart,) = pareto_chart(results_of(300)).axes
    dots = lines_by_label(chart)["feasible"]
    assert dots.get_alpha() is None
    for crosses in (line for line in chart.get_lines() if line.get_marker() == "x"):
        assert crosses.get_alpha() < 0.5
        assert crosses.get_zorder() < dots.get_zorder()


@pytest.mark.parametrize("count", [300, 40_000])  # each design, the nearest of each cell
def test_infeasible_designs_are_darker_the_nearer_they_are_to_feasible(results_of, count):
    results = results_of(count)
    (chart,) = pareto_chart(results, x="transmission_angle_min", y="rocker").axes
    points, opacities = crosses_of(chart)
    table = explore.nearest(results, count).dropna(subset=["transmission_angle_min"])
    sizes = ((chart.get_xlim(), 72), (chart.get_ylim(), 48))
    width, height = (1e-9, 1e-9) if count == 300 else (np.ptp(limits) / n for limits, n in sizes)
    checked = 0
    for (x, y), opacity in list(zip(points, opacities, strict=True))[::7]:
        is_near = (table["transmission_angle_min"] - x).abs() <= width / 2
        own = table[is_near & ((table["rocker"] - y).abs() <= height / 2)]
        if len(own):  # others have no known distance
            least = own["violation"].min()
            assert opacity == (0.48 if least <= 0.1 else 0.35 if least <= 0.5 else 0.2)
            checked += 1
    assert checked > 10
    assert len(set(opacities)) == 3


def test_bounds_of_the_study_are_lines_within_the_axes(results_of):
    results = results_of(300)
    (chart,) = pareto_chart(results, x="transmission_angle_min", y="rocker_acceleration_max").axes
    lines = [line for line in chart.get_lines() if line.get_linestyle() == "-."]
    assert [line.get_xdata()[0] for line in lines[:1]] == [20.0]
    assert [line.get_ydata()[0] for line in lines[1:]] == [0.5]
    assert [line.get_label() for line in lines] == ["bound of the study", "_further bound"]
    (without,) = pareto_chart(results).axes
    assert "-." not in [line.get_linestyle() for line in without.get_lines()]


def test_a_bound_beyond_the_axes_is_not_named(results_of):
    panel = new_figure(4.0, 3.0).subplots()
    panel.set_xlim(30.0, 40.0)
    draw_metric_bounds(panel, results_of(300), x="transmission_angle_min")
    assert panel.get_lines() == []


def test_the_steps_of_the_front_follow_the_objective_of_the_x_axis(results_of):
    """Between two optima the line has the y of the one with the better x."""
    (chart,) = pareto_chart(results_of(300), x="swing_angle", y="cv").axes
    front = lines_by_label(chart)["Pareto set in cv (min), swing_angle (max)"]
    assert front.get_drawstyle() == "steps-pre"


def test_a_front_in_other_objectives_than_the_axes_is_not_joined(results_of):
    (chart,) = pareto_chart(results_of(300), y="rocker_acceleration_max").axes
    assert lines_by_label(chart)["Pareto set in cv (min), swing_angle (max)"].get_linestyle() == "None"


def test_the_option_design_chooses_a_design(results_of):
    results = results_of(300)
    (chart,) = pareto_chart(results, design=7).axes
    star = lines_by_label(chart)["chosen"]
    assert "design 7" in star.get_label()
    row = results.design(7)
    assert np.array_equal(np.ravel(star.get_data()), [row["cv"], row["swing_angle"]], equal_nan=True)


def test_feasible_designs_without_values_are_told(tmp_path):
    """Designs that assemble over one interval have no second one: they are counted, and their lines are seen."""
    metrics = ["rocker_velocity_max", "rocker_velocity_min", "assembles_from_1", "assembles_from_2"]
    rank = '[rank]\nmetrics = ["rocker_velocity_max", "rocker_velocity_min:max"]\n'
    results = sweep_text(tmp_path, f"{TABLE}[evaluate]\nmetrics = {metrics}\n{rank}", "one")
    assert results.to_pandas()["feasible"].all()
    (panel,) = pareto_chart(results, x="assembles_from_1", y="assembles_from_2").axes
    labels = [str(line.get_label()) for line in panel.get_lines()]
    (front,) = [label for label in labels if label.startswith("Pareto set")]
    assert "feasible: 0 (and 2 without values)" in labels
    assert front.endswith(": 0 (and 1 without values)")
    figure = parallel_chart(results, metric="assembles_from_2")
    FigureCanvasAgg(figure).draw()
    (lines,) = [each for each in figure.axes[0].collections if each.get_label() == "Pareto set"]
    assert (lines.get_edgecolor()[:, 3] > 0.0).all()


def test_headings_count_feasible_designs_without_objectives(tmp_path):
    """The sixth of the cranks has the objective; all are feasible."""
    parameters = "crank = [50, 60, 70, 80, 90, 100]\nground = [690, 720]\ncoupler = 1083\nrocker = 541"
    metrics = '[metrics]\nexcess = { formula = "log(crank - 95)", unit = "1" }\n'
    text = f'mechanism = "crank-rocker"\n[parameters]\n{parameters}\n{metrics}[rank]\nmetrics = ["cv", "excess:max"]\n'
    results = sweep_text(tmp_path, text, "excess")
    assert results.to_pandas()["feasible"].sum() == 12
    titles = [
        pareto_chart(results), map_chart(results, metric="excess"), parallel_chart(results),
        joint_pareto_chart([results, shutil.copy(results.path, tmp_path / "copy.h5")]),
    ]  # fmt: skip
    words = ["1 Pareto-optimal of 12 feasible of 12 designs", "12 feasible (10 without excess) of 12 designs",
             "1 of 11 other feasible designs", "Pareto-optimal of 24 feasible designs of 2 results"]  # fmt: skip
    for figure, counts in zip(titles, words, strict=True):
        assert counts in figure.get_suptitle()


def test_many_designs_become_a_density_that_counts_all_within_the_axes(results_of):
    results = results_of(400_000)
    table = results.to_pandas(["cv", "swing_angle", "feasible"])
    figure = pareto_chart(results)
    chart, bar = figure.axes
    feasible = table[table["feasible"]]
    assert len(feasible) > DENSITY_THRESHOLD
    inside = feasible["cv"].between(*chart.get_xlim()) & feasible["swing_angle"].between(*chart.get_ylim())
    (mesh,) = chart.collections
    assert mesh.get_array().sum() == inside.sum() > 0.97 * len(feasible)
    assert "in a cell" in bar.get_ylabel()
    figure.draw_without_rendering()
    ticks = [label.get_text() for label in bar.get_yticklabels(which="both")]
    assert "10" in ticks  # no formula: `explore plot` has them off, so that a file's name may have a dollar sign
    assert 0 < len(crosses_of(chart)[0]) <= 72 * 48


@pytest.mark.parametrize("changes", [{}, {"ground": "600", "crank": "300"}], ids=["feasible", "blocked"])
def test_pareto_of_one_design(results_of, changes, tmp_path):
    figure = pareto_chart(results_of(1, **changes))
    lines = lines_by_label(figure.axes[0])
    assert ("chosen" in lines) == (changes == {})
    save_figure(figure, tmp_path / "one.png")
    assert [path.name for path in tmp_path.iterdir()] == ["one.png"]


def test_errors_of_pareto_name_the_cause(results_of):
    results = results_of(300)
    with pytest.raises(RequestError, match="no column of numbers 'swing_angel'; did you mean 'swing_angle'"):
        pareto_chart(results, x="swing_angel")
    with pytest.raises(RequestError, match="both 'cv'"):
        pareto_chart(results, x="cv", y="cv")
    with pytest.raises(RequestError, match="fewer than two objectives"):
        pareto_chart(results_of(1, metrics='["cv"]'))
    with pytest.raises(ExploreError, match="no design 300"):
        pareto_chart(results, design=300)
