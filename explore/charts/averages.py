"""Error of statistics against the number of nodes, for each rule of averaging."""

from __future__ import annotations

from typing import TYPE_CHECKING

from explore.charts.style import BLUE, BROWN, GREEN, INK, MUTED, ORANGE, RED, Line

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FLOOR, CEILING = 1e-17, 1e2
_RULES = {
    "graded": Line(INK, "*"),
    "gauss": Line(BLUE, "o"),
    "trapezoid": Line(GREEN, "s"),
    "trapezoid-half-step": Line(GREEN, "s", ":", filled=False),
    "one-pass": Line(ORANGE, "^", "--", filled=False),
    "published": Line(RED, "D"),
}
_SPARE = Line(BROWN, "h")
#: Statistic and window of each column of the figure, with its heading.
_COLUMNS = {
    ("rocker_angle_variance_error", "drive"): "variance of the rocker angle\nover the stroke",
    ("rocker_velocity_cv_error", "drive"): "cv of the rocker velocity\nover the stroke",
    ("rocker_acceleration_variance_error", "cycle"): "variance of the rocker\nacceleration over the turn",
    ("rocker_acceleration_extremes_error", "cycle"): "extremes of the rocker\nacceleration over the turn",
}


def averages_chart(rows: pd.DataFrame, titles: dict[str, str]) -> Figure:
    """A line of panels for each scene, a column for each statistic that its model knows.

    Parameters
    ----------
    rows
        Of `explore.comparison.averaging.compare_rules`.
    titles
        Of the scenes, by name.
    """
    from matplotlib.figure import Figure

    scenes = [name for name in titles if (rows["scene"] == name).any()]
    columns = {key: heading for key, heading in _COLUMNS.items() if _known(rows, *key)}
    figure = Figure(figsize=(2.3 * max(len(columns), 2) + 0.9, 1.6 * len(scenes) + 1.2), layout="constrained")
    axes = figure.subplots(len(scenes), len(columns), squeeze=False, sharex=True, sharey=True)
    for line, scene in zip(axes, scenes, strict=True):
        of_scene = rows[rows["scene"] == scene]
        for chart, (error, window) in zip(line, columns, strict=True):
            if _known(of_scene, error, window):
                _draw(chart, of_scene[of_scene["window"] == window], error)
            else:
                chart.text(0.5, 0.5, "more than\nthe scene needs", ha="center", va="center", color=MUTED,
                           fontsize=8, transform=chart.transAxes)  # fmt: skip
                chart.set_axis_off()
        line[0].set_ylabel(titles[scene], fontsize=8)
    for chart, heading in zip(axes[0], columns.values(), strict=True):
        chart.set_title(heading, fontsize=9)
    for column in axes.T:
        lowest = [chart for chart in column if chart.axison][-1]
        lowest.tick_params(labelbottom=True)
        lowest.set_xlabel("nodes: crank angles solved", fontsize=8)
    figure.supylabel("relative error", fontsize=9)
    handles = dict(zip(*reversed(axes[0, 0].get_legend_handles_labels()), strict=True))
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", frameon=False, fontsize=8,
                  ncols=len(handles) if len(columns) > 2 else 3)  # fmt: skip
    return figure


def _known(rows: pd.DataFrame, error: str, window: str) -> bool:
    """Whether some scene's model knows the statistic."""
    return error in rows and bool(rows.loc[rows["window"] == window, error].notna().any())


def _draw(chart: Axes, rows: pd.DataFrame, error: str) -> None:
    chart.set_xscale("log")
    chart.set_yscale("log")
    chart.set_ylim(FLOOR / 3.0, CEILING)
    chart.grid(color=MUTED, alpha=0.25, lw=0.5)
    chart.set_xticks([10, 100, 1000])
    chart.set_yticks([1e-16, 1e-12, 1e-8, 1e-4, 1.0])
    chart.tick_params(labelsize=7)
    for name, of_rule in rows.groupby("rule", sort=False):
        look = _RULES.get(str(name), _SPARE)
        chart.plot(of_rule["nodes"], of_rule[error].clip(FLOOR, CEILING / 3.0), color=look.colour, marker=look.marker,
                   ls=look.style, lw=1.0, ms=8 if look.marker == "*" else 4, label=str(name),
                   mfc=look.colour if look.filled else "white")  # fmt: skip
