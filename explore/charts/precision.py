"""Work-precision charts: error against cost, failures on the upper edge."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from explore.charts.style import INK, MUTED, RED, line_of

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Errors below are drawn here: they are zero, or luck within the rounding of doubles.
FLOOR = 1e-17
#: Where failures are drawn, above every error that is still one: those that the method tells, and those it does not.
TOLD, SILENT = 3.0, 100.0
REFUSED = "rightly refused"
_ERRORS = {
    "angle_error_max": "angles [rad]",
    "velocity_error_max": "velocities, over the peak",
    "acceleration_error_max": "accelerations, over the peak",
    "cv_error": "cv of the stroke, relative",
}
_COSTS = {"cpu_seconds": "CPU time per design [s]", "evaluations": "evaluations per design"}
#: Width and height of a panel, and of what surrounds the panels, inches: small, so that the words of a figure are still
#: readable where a page shows it at half its size.
_PANEL, _AROUND = (2.5, 2.2), (0.9, 1.5)
_LEGEND_COLUMNS = 5
_TICKS = [10.0**exponent for exponent in range(-17, 0, 4)]
#: The words beside the failures: who gave up and said so, and who did not.
_EDGES = ("failed, refused", "silently wrong")


def scene_chart(rows: pd.DataFrame, title: str) -> Figure:
    """Every error of one scene against CPU time (above) and against evaluations (below).

    Parameters
    ----------
    rows
        Of `explore.comparison.precision.compare_methods`, for one scene.
    title
        In words.
    """
    errors = [name for name in _ERRORS if name in rows and rows[name].notna().any()] or ["angle_error_max"]
    figure = _figure(2, max(len(errors), 3))
    axes = figure.subplots(2, len(errors), squeeze=False, sharey=True)
    for line, cost in zip(axes, _COSTS, strict=True):
        for chart, error in zip(line, errors, strict=True):
            _draw(chart, rows, _cost_of(error, cost), error)
            chart.set_xlabel(_COSTS[cost], fontsize=8)
    for chart, error in zip(axes[0], errors, strict=True):
        chart.set_title(_ERRORS[error], fontsize=9)
    figure.supylabel("largest error of …", fontsize=9)
    _legend(figure, axes[0, 0])
    figure.suptitle(title, fontsize=11, color=INK)
    return figure


def overview_chart(rows: pd.DataFrame, titles: dict[str, str]) -> Figure:
    """Error of the velocities, or of the angles where no more is asked, against CPU time: one panel a scene."""
    columns = 3
    lines = -(-len(titles) // columns)
    figure = _figure(lines, columns)
    axes = figure.subplots(lines, columns, squeeze=False, sharex=True, sharey=True).ravel()
    for chart, (scene, title) in zip(axes, titles.items(), strict=False):
        of_scene = rows[rows["scene"] == scene]
        has_velocities = "velocity_error_max" in of_scene and of_scene["velocity_error_max"].notna().any()
        _draw(chart, of_scene, "cpu_seconds", "velocity_error_max" if has_velocities else "angle_error_max")
        chart.set_title(title if has_velocities else f"{title} (angles)", fontsize=9)
    for chart in axes[len(titles) :]:
        chart.set_axis_off()
    for chart in axes[-columns:]:
        chart.set_xlabel("CPU time per design and turn [s]", fontsize=8)
    figure.supylabel("largest error of the velocities, over the peak", fontsize=9)
    _legend(figure, axes[0])
    return figure


def _figure(lines: int, columns: int) -> Figure:
    from matplotlib.figure import Figure

    size = (_PANEL[0] * columns + _AROUND[0], _PANEL[1] * lines + _AROUND[1])
    return Figure(figsize=size, layout="constrained")


def _cost_of(error: str, cost: str) -> str:
    """The cv is that of a run of its own, over the stroke."""
    return f"cv_{cost}" if error == "cv_error" else cost


def _draw(chart: Axes, rows: pd.DataFrame, cost: str, error: str) -> None:
    chart.set_xscale("log")
    chart.set_yscale("log")
    chart.set_ylim(FLOOR / 3.0, SILENT * 5.0)
    chart.axhspan(TOLD / 4.0, SILENT / 6.0, color=MUTED, alpha=0.12, lw=0)
    chart.axhspan(SILENT / 6.0, SILENT * 5.0, color=RED, alpha=0.15, lw=0)
    chart.set_yticks([*_TICKS, TOLD, SILENT], [*(f"$10^{{{round(math.log10(y))}}}$" for y in _TICKS), *_EDGES])
    solved = error in rows and rows[error].notna().any()
    if not solved and (rows["verdict"] == REFUSED).any():
        chart.text(0.5, 0.45, "no motion exists:\nwho says so is right", ha="center", va="center", color=MUTED,
                   fontsize=8, transform=chart.transAxes)  # fmt: skip
    chart.grid(color=MUTED, alpha=0.25, lw=0.5)
    chart.tick_params(labelsize=7)
    for name, of_method in rows.groupby("method", sort=False):
        look = line_of(str(name))
        style: dict[str, Any] = {"color": look.colour, "marker": look.marker, "ms": 9 if look.marker == "*" else 5}
        style |= {} if look.filled else {"mfc": "white"}
        known = of_method[error] >= 0.0 if error in of_method else of_method["failed"] < 0
        failed = (of_method["failed"] > 0) | ~known
        sound = of_method[~failed]
        if len(sound):
            values = sound[error].clip(lower=FLOOR)
            chart.plot(sound[cost], values, ls=look.style, lw=1.1, label=str(name), **style)
        if failed.any():
            lost = of_method[failed]
            edge = [SILENT if wrong else TOLD for wrong in lost["silently_wrong"] > 0]
            chart.plot(lost[cost].fillna(lost["cpu_seconds"]), edge, ls="", label=str(name), **style)


def _legend(figure: Figure, chart: Axes) -> None:
    """One entry a method, whether it failed everywhere or not."""
    entries: dict[str, Any] = {}
    for handle, name in zip(*chart.get_legend_handles_labels(), strict=True):
        entries.setdefault(name, handle)
    figure.legend(entries.values(), entries.keys(), loc="outside lower center", frameon=False, fontsize=8,
                  ncols=_LEGEND_COLUMNS)  # fmt: skip
