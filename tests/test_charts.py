"""Charts of the comparisons: their panels, marks and legends, with one row and with many."""

import pandas as pd
import pytest

from explore.comparison.methods.registry import METHODS
from explore.comparison.verdicts import Verdict
from explore.figures.charts.precision import REPORTED_FAILURE, SILENT_FAILURE, overview_chart, scene_chart
from explore.figures.charts.stability import VERDICTS, stability_chart
from explore.figures.charts.style import line_style, save_figure


def rows(**changes):
    row = {"scene": "s", "method": "newton", "setting": "newton(1)", "failed": 0, "silently_wrong": 0,
             "verdict": "accurate", "cpu_seconds": 1e-3, "evaluations": 100.0, "position_error_max": 1e-9,
             "velocity_error_max": 1e-8}  # fmt: skip
    return pd.DataFrame([row, {**row, "cpu_seconds": 2e-3, "position_error_max": 0.0, **changes}])


def points(chart):
    return [tuple(xy) for line in chart.get_lines() for xy in zip(*line.get_data(), strict=True)]


def test_a_panel_for_each_error_and_cost():
    figure = scene_chart(rows(), "title")
    assert len(figure.axes) == 4
    assert {chart.get_xlabel() for chart in figure.axes} == {"CPU time per design [s]", "evaluations per design"}
    assert points(figure.axes[0]) == [(1e-3, 1e-9), (2e-3, 1e-17)], "an error of 0 is drawn at the lower limit"


def test_failures_are_drawn_in_the_bands_at_the_top():
    reported = scene_chart(rows(failed=1, verdict="reported failure"), "title")
    assert (2e-3, REPORTED_FAILURE) in points(reported.axes[0])
    silent = scene_chart(rows(failed=1, silently_wrong=1, verdict="wrong branch"), "title")
    assert (2e-3, SILENT_FAILURE) in points(silent.axes[0])


def test_an_overview_has_a_panel_for_each_scene():
    table = pd.concat([rows(), rows(failed=1).assign(scene="t", velocity_error_max=float("nan"))])
    figure = overview_chart(table, {"s": "first", "t": "second"})
    assert [chart.get_title() for chart in figure.axes if chart.axison] == ["first", "second (angles)"]


def test_the_legend_shows_the_line_of_a_method_that_only_fails():
    table = pd.concat([rows(), rows().assign(method="rk45", failed=1)])
    (legend,) = overview_chart(table, {"s": "first"}).legends
    assert [text.get_text() for text in legend.get_texts()] == ["newton", "rk45"]
    styles = [line_style(name).style for name in ("newton", "rk45")]
    assert [line.get_linestyle() for line in legend.get_lines()] == styles


def test_charts_of_one_row_are_written(tmp_path):
    save_figure(scene_chart(rows().head(1), "title"), tmp_path / "one.svg")
    save_figure(overview_chart(rows().head(1), {"s": "first"}), tmp_path / "one.pdf")
    assert b"<svg" in (tmp_path / "one.svg").read_bytes()
    assert (tmp_path / "one.pdf").read_bytes().startswith(b"%PDF")


def cells(verdict, error=1e-9):
    return [
        {
            "method": name,
            "setting": f"{name}(tolerance={k})",
            "angles": 72,
            "margin": margin,
            "verdict": verdict,
            "error": error,
        }
        for name, count in (("newton", 2), ("closed-form", 1))
        for k in range(count)
        for margin in (1e-1, 1e-5, 0.0, -1e-5)
    ]


@pytest.mark.parametrize("verdict", list(Verdict))
def test_every_verdict_is_drawn_in_the_map(verdict, tmp_path):
    assert set(VERDICTS) == {member.label for member in Verdict}
    figure = stability_chart(pd.DataFrame(cells(verdict.label)), 1e-6, "margin", "no full turn exists")
    (legend,) = figure.legends
    assert [text.get_text().startswith(verdict.label) for text in legend.get_texts()] == [True]
    assert [len(chart.patches) for chart in figure.axes] == [4, 8]
    assert [[bar.get_xdata()[0] for bar in chart.lines] for chart in figure.axes] == [[2], [2]]  # after margins above 0
    texts = {text.get_text() for chart in figure.axes for text in chart.texts}
    assert texts == {VERDICTS[verdict.label][1] or "9"}
    save_figure(figure, tmp_path / "map.png")


def test_every_method_has_its_own_line_style():
    styles = [(line_style(name).colour, line_style(name).marker, line_style(name).filled) for name in METHODS]
    assert len(set(styles)) == len(METHODS)


@pytest.mark.parametrize("kind", ["png", "svg", "pdf"])
def test_the_same_figure_gives_the_same_bytes(tmp_path, kind):
    for name in ("a", "b"):
        save_figure(scene_chart(rows(), "title"), tmp_path / f"{name}.{kind}")
    assert (tmp_path / f"a.{kind}").read_bytes() == (tmp_path / f"b.{kind}").read_bytes()
