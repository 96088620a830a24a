"""Work-precision charts: error against cost, failures on the upper edge."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from explore.figures.charts.style import INK, MUTED, RED, line_style

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Height at which smaller errors are drawn, which rounding makes meaningless.
FLOOR = 1e-17
#: Height above all errors at which failures are drawn that the method reports.
REPORTED_FAILURE = 3.0
#: Height above all errors at which silent failures are drawn.
SILENT_FAILURE = 100.0
#: Verdict on designs without a motion that a method rejects.
REJECTED = "correctly rejected"
#: Titles of panels by their column of errors.
_ERRORS = {
    "position_error_max": "positions [rad, over the link]",
    "velocity_error_max": "velocities, over the peak",
    "acceleration_error_max": "accelerations, over the peak",
    "cv_error": "cv of the stroke, relative",
}

_COSTS = {"cpu_seconds": "CPU time per design [s]", "evaluations": "evaluations per design"}
#: Width and height of a panel, inches: small, so that texts stay readable at half the size in a page.
_PANEL = (2.5, 2.2)
#: Width and height of the frame around all panels, inches.
_FRAME = (0.9, 1.5)
#: Number of columns of the legend.
_LEGEND_COLUMNS = 6
#: Errors with a label on the axis.
_TICKS = [10.0**exponent for exponent in range(-17, 0, 4)]
#: Labels of failures that the method reports, and of silent ones.
_FAILURES = ("reported failure", "silently wrong")


def scene_chart(rows: pd.DataFrame, title: str) -> Figure:
    """Draw each error of `compare_methods` in one scene over CPU time (above) and over evaluations (below)."""
    errors = [name for name in _ERRORS if name in rows and rows[name].notna().any()] or ["position_error_max"]
    figure = _figure(2, max(len(errors), 3))
    axes = figure.subplots(2, len(errors), squeeze=False, sharey=True)
    for line, cost in zip(axes, _COSTS, strict=True):
        for panel, error in zip(line, errors, strict=True):
            # The cv is computed in a separate run over the stroke.
            _draw_panel(panel, rows, f"cv_{cost}" if error == "cv_error" else cost, error)
            panel.set_xlabel(_COSTS[cost], fontsize=8)
    for panel, error in zip(axes[0], errors, strict=True):
        panel.set_title(_ERRORS[error], fontsize=9)
    figure.supylabel("largest error of …", fontsize=9)
    _legend(figure, rows)
    figure.suptitle(title, fontsize=11, color=INK)
    return figure


def overview_chart(rows: pd.DataFrame, titles: dict[str, str]) -> Figure:
    """Draw the error of the velocities over CPU time, of the angles in scenes without velocities, a panel a scene."""
    columns = 3
    lines = -(-len(titles) // columns)
    figure = _figure(lines, columns)
    axes = figure.subplots(lines, columns, squeeze=False, sharex=True, sharey=True).ravel()
    for panel, (scene, title) in zip(axes, titles.items(), strict=False):
        of_scene = rows[rows["scene"] == scene]
        has_velocities = "velocity_error_max" in of_scene and of_scene["velocity_error_max"].notna().any()
        _draw_panel(panel, of_scene, "cpu_seconds", "velocity_error_max" if has_velocities else "position_error_max")
        panel.set_title(title if has_velocities else f"{title} (angles)", fontsize=9)
    for panel in axes[len(titles) :]:
        panel.set_axis_off()
    for panel in axes[-columns:]:
        panel.set_xlabel("CPU time per design and turn [s]", fontsize=8)
    figure.supylabel("largest error of the velocities, over the peak", fontsize=9)
    _legend(figure, rows)
    return figure


def _figure(lines: int, columns: int) -> Figure:
    from matplotlib.figure import Figure

    size = (_PANEL[0] * columns + _FRAME[0], _PANEL[1] * lines + _FRAME[1])
    return Figure(figsize=size, layout="constrained")


def _draw_panel(panel: Axes, rows: pd.DataFrame, cost: str, error: str) -> None:
    panel.set_xscale("log")
    panel.set_yscale("log")
    panel.set_ylim(FLOOR / 3.0, SILENT_FAILURE * 5.0)
    panel.axhspan(REPORTED_FAILURE / 4.0, SILENT_FAILURE / 6.0, color=MUTED, alpha=0.12, lw=0)
    panel.axhspan(SILENT_FAILURE / 6.0, SILENT_FAILURE * 5.0, color=RED, alpha=0.15, lw=0)
    panel.set_yticks(
        [*_TICKS, REPORTED_FAILURE, SILENT_FAILURE], [*(f"$10^{{{round(math.log10(y))}}}$" for y in _TICKS), *_FAILURES]
    )
    solved = error in rows and rows[error].notna().any()
    if not solved and (rows["verdict"] == REJECTED).any():
        panel.text(0.5, 0.45, "no motion exists:\nrejecting it is correct", ha="center", va="center", color=MUTED,
                   fontsize=8, transform=panel.transAxes)  # fmt: skip
    panel.grid(color=MUTED, alpha=0.25, lw=0.5)
    panel.tick_params(labelsize=7)
    for name, of_method in rows.groupby("method", sort=False):
        _draw_method(panel, of_method, cost, error, str(name))


def _draw_method(panel: Axes, rows: pd.DataFrame, cost: str, error: str, name: str) -> None:
    """Draw the errors of one method as a line, and its failures as marks on the upper edge."""
    look = _look(name)
    has_error = rows[error] >= 0.0 if error in rows else rows["failed"] < 0
    failed = (rows["failed"] > 0) | ~has_error
    solved = rows[~failed]
    if len(solved):
        panel.plot(solved[cost], solved[error].clip(lower=FLOOR), **look)
    if failed.any():
        failures = rows[failed]
        heights = [SILENT_FAILURE if silent else REPORTED_FAILURE for silent in failures["silently_wrong"] > 0]
        panel.plot(failures[cost].fillna(failures["cpu_seconds"]), heights, **look | {"ls": ""})


def _look(name: str) -> dict[str, Any]:
    """Line and marks of a method; hollow marks are larger, so that they enclose a filled mark in the same place."""
    line = line_style(name)
    look: dict[str, Any] = {"color": line.colour, "marker": line.marker, "ls": line.style, "lw": 1.1, "label": name}
    return look | ({"ms": 9 if line.marker == "*" else 5} if line.filled else {"ms": 7, "mfc": "none"})


def _legend(figure: Figure, rows: pd.DataFrame) -> None:
    """Write one entry per method, with its line also where it only fails."""
    from matplotlib.lines import Line2D

    handles = [Line2D([], [], **_look(name)) for name in rows["method"].drop_duplicates()]
    figure.legend(handles=handles, loc="outside lower center", frameon=False, fontsize=8, ncols=_LEGEND_COLUMNS)
