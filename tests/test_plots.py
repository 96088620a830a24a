"""Figures of results: what they say is what the results hold, for one design as for many."""

import numpy as np
import pytest

import explore
from explore.charts.pareto import MANY, pareto_chart
from explore.charts.style import save
from explore.errors import ExploreError, RequestError

STUDY = """mechanism = "crank-rocker"
[parameters]
crank = {crank}
coupler = 1083.4236
rocker = {rocker}
ground = {ground}
[evaluate]
metrics = ["cv", "swing_angle", "transmission_angle_min", "rocker_acceleration_max"]
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
    "metrics": '["cv", "swing_angle:max"]',
}
ONE = {"crank": "100", "rocker": "541.7118", "ground": "780"}


@pytest.fixture(scope="session")
def make(tmp_path_factory):
    """Results of a study of so many designs, made once."""
    made = {}

    def results_of(count, **changes):
        key = (count, *sorted(changes.items()))
        if key not in made:
            folder = tmp_path_factory.mktemp("plots")
            text = STUDY.format(**{**RANGES, **(ONE if count == 1 else {}), **changes})
            if count > 1:
                text += f'[sampling]\nmethod = "sobol"\ncount = {count}\nseed = 3\n'
            (folder / "study.toml").write_text(text)
            made[key] = explore.sweep(explore.load_study(folder / "study.toml"), folder / "study.h5")
        return made[key]

    return results_of


def labelled(chart):
    """Lines of axes by the first words of their label."""
    return {line.get_label().split(":")[0]: line for line in chart.get_lines() if not line.get_label().startswith("_")}


def count_of(line):
    return int(line.get_label().split(": ")[1].split(" ")[0].replace(",", ""))


def brute_front(points):
    """Rows that no other beats in the first (smaller) and the second (larger)."""
    return {
        tuple(p) for p in points
        if not any((q[0] <= p[0] and q[1] >= p[1]) and (q[0] < p[0] or q[1] > p[1]) for q in points)
    }  # fmt: skip


def test_pareto_draws_what_the_results_hold(make):
    results = make(300)
    table = results.to_pandas()
    figure = pareto_chart(results)
    (chart,) = figure.axes
    lines = labelled(chart)
    good = table[table["feasible"]][["cv", "swing_angle"]].to_numpy()
    bad = table[~table["feasible"]][["cv", "swing_angle"]].dropna()

    front = lines["Pareto set in cv (min), swing_angle (max)"]
    assert {tuple(p) for p in np.column_stack(front.get_data())} == brute_front(good)
    assert front.get_drawstyle() == "steps-post"
    assert np.all(np.diff(front.get_xdata()) > 0.0)
    assert count_of(lines["feasible"]) == len(good)
    assert len(lines["infeasible"].get_xdata()) == count_of(lines["infeasible"]) == len(bad) > 0
    assert f"and {np.isnan(table['cv']).sum()} without values" in lines["infeasible"].get_label()
    (dots,) = [line for line in chart.get_lines() if line.get_marker() == "." and len(line.get_xdata())]
    assert {tuple(p) for p in np.column_stack(dots.get_data())} == {tuple(p) for p in good}
    best = good[good[:, 0].argmin()]
    assert np.array_equal(np.ravel(lines["chosen"].get_data()), best)
    assert "[1]" in chart.get_xlabel()
    assert "[deg]" in chart.get_ylabel()
    assert min(mark.get_markersize() for mark in figure.legends[0].get_lines()) >= 6.0


def test_the_border_of_a_maximum_lies_on_the_other_side(make):
    """Between two optima the border goes at the value that the one with the better x can still have."""
    (chart,) = pareto_chart(make(300), "swing_angle", "cv").axes
    front = labelled(chart)["Pareto set in cv (min), swing_angle (max)"]
    assert front.get_drawstyle() == "steps-pre"


def test_a_front_of_other_aims_is_not_joined(make):
    (chart,) = pareto_chart(make(300), y="rocker_acceleration_max").axes
    assert labelled(chart)["Pareto set in cv (min), swing_angle (max)"].get_linestyle() == "None"


def test_another_design_is_chosen(make):
    results = make(300)
    (chart,) = pareto_chart(results, design=7).axes
    star = labelled(chart)["chosen"]
    assert "design 7" in star.get_label()
    row = results.design(7)
    assert np.array_equal(np.ravel(star.get_data()), [row["cv"], row["swing_angle"]], equal_nan=True)


def test_many_designs_become_a_density_that_counts_all_within_the_axes(make):
    results = make(400_000)
    table = results.to_pandas(["cv", "swing_angle", "feasible"])
    chart, bar = pareto_chart(results).axes
    good = table[table["feasible"]]
    assert len(good) > MANY
    inside = good["cv"].between(*chart.get_xlim()) & good["swing_angle"].between(*chart.get_ylim())
    (mesh,) = chart.collections
    assert mesh.get_array().sum() == inside.sum() > 0.97 * len(good)
    assert "in a cell" in bar.get_ylabel()
    assert len(labelled(chart)["infeasible"].get_xdata()) <= 72 * 48


@pytest.mark.parametrize("changes", [{}, {"ground": "600", "crank": "300"}], ids=["feasible", "blocked"])
def test_pareto_of_one_design(make, changes, tmp_path):
    figure = pareto_chart(make(1, **changes))
    lines = labelled(figure.axes[0])
    assert ("chosen" in lines) == (changes == {})
    save(figure, tmp_path / "one.png")
    assert [path.name for path in tmp_path.iterdir()] == ["one.png"]


def test_pareto_names_what_is_wrong(make):
    results = make(300)
    with pytest.raises(RequestError, match="no column of numbers 'swing_angel'; did you mean 'swing_angle'"):
        pareto_chart(results, "swing_angel")
    with pytest.raises(RequestError, match="both 'cv'"):
        pareto_chart(results, "cv", "cv")
    with pytest.raises(RequestError, match="fewer than two objectives"):
        pareto_chart(make(1, metrics='["cv"]'))
    with pytest.raises(ExploreError, match="no design 300"):
        pareto_chart(results, design=300)
