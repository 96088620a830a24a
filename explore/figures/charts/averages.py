"""Error of statistics over the number of nodes, for each averaging rule."""

from __future__ import annotations

from typing import TYPE_CHECKING

from explore.figures.charts.style import BLUE, BROWN, GREEN, INK, MUTED, ORANGE, RED, LineStyle

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Smallest error on the axis.
FLOOR = 1e-17
#: Largest error on the axis.
CEILING = 1e2
#: Looks of the lines of the rules.
_RULES = {
    "graded": LineStyle(INK, "*"),
    "gauss": LineStyle(BLUE, "o"),
    "trapezoid": LineStyle(GREEN, "s"),
    "trapezoid-half-step": LineStyle(GREEN, "s", ":", filled=False),
    "one-pass": LineStyle(ORANGE, "^", "--", filled=False),
    "published": LineStyle(RED, "D"),
}

_OTHER_RULE = LineStyle(BROWN, "h")
#: Heading of each column of panels by error and window.
_COLUMNS = {
    ("position_variance_error", "drive"): "variance of the position\nover the stroke",
    ("velocity_cv_error", "drive"): "cv of the velocity\nover the stroke",
    ("acceleration_variance_error", "cycle"): "variance of the\nacceleration over the turn",
    ("acceleration_extremes_error", "cycle"): "extremes of the\nacceleration over the turn",
}


def averages_chart(rows: pd.DataFrame, titles: dict[str, str]) -> Figure:
    """Draw a row of panels for each scene, with titles by name, and a column for each statistic of `compare_rules`."""
    from matplotlib.figure import Figure

    scenes = [name for name in titles if (rows["scene"] == name).any()]
    columns = {key: heading for key, heading in _COLUMNS.items() if _has_values(rows, *key)}
    figure = Figure(figsize=(2.3 * max(len(columns), 2) + 0.9, 1.6 * len(scenes) + 1.2), layout="constrained")
    panels = figure.subplots(len(scenes), len(columns), squeeze=False, sharex=True, sharey=True)
    for row, scene in zip(panels, scenes, strict=True):
        of_scene = rows[rows["scene"] == scene]
        for panel, (error, window) in zip(row, columns, strict=True):
            _draw_panel(panel, of_scene, error, window)
        row[0].set_ylabel(titles[scene], fontsize=8)
    for panel, heading in zip(panels[0], columns.values(), strict=True):
        panel.set_title(heading, fontsize=9)
    for column in panels.T:
        lowest = [panel for panel in column if panel.axison][-1]
        lowest.tick_params(labelbottom=True)
        lowest.set_xlabel("nodes: crank angles solved", fontsize=8)
    figure.supylabel("relative error", fontsize=9)
    handles = dict(zip(*reversed(panels[0, 0].get_legend_handles_labels()), strict=True))
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", frameon=False, fontsize=8,
                  ncols=len(handles) if len(columns) > 2 else 3)  # fmt: skip
    return figure


def _has_values(rows: pd.DataFrame, error: str, window: str) -> bool:
    """Whether the error over the window is defined in some row."""
    return error in rows and bool(rows.loc[rows["window"] == window, error].notna().any())


def _draw_panel(panel: Axes, rows: pd.DataFrame, error: str, window: str) -> None:
    """Draw the error of each rule in one scene."""
    if not _has_values(rows, error, window):
        panel.text(0.5, 0.5, "not needed\nin this scene", ha="center", va="center", color=MUTED, fontsize=8,
                   transform=panel.transAxes)  # fmt: skip
        panel.set_axis_off()
        return
    panel.set_xscale("log")
    panel.set_yscale("log")
    panel.set_ylim(FLOOR / 3.0, CEILING)
    panel.grid(color=MUTED, alpha=0.25, lw=0.5)
    panel.set_xticks([10, 100, 1000])
    panel.set_yticks([1e-16, 1e-12, 1e-8, 1e-4, 1.0])
    panel.tick_params(labelsize=7)
    for name, of_rule in rows[rows["window"] == window].groupby("rule", sort=False):
        style = _RULES.get(str(name), _OTHER_RULE)
        errors = of_rule[error].clip(FLOOR, CEILING / 3.0)
        # hollow marks are larger, so that they enclose a filled mark in the same place
        marks = {"ms": 8 if style.marker == "*" else 4} if style.filled else {"ms": 6, "mfc": "none"}
        panel.plot(of_rule["nodes"], errors, color=style.colour, marker=style.marker, ls=style.style, lw=1.0,
                   label=str(name), **marks)  # fmt: skip
