"""The control curve of a design: its metrics over one parameter, with the intervals where one is within a range."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from explore.figures.charts.style import BLUE, GREEN, INK, MUTED, PURPLE, RED, new_figure, write_heading
from explore.results.labels import unit_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from explore.analysis.tuning.control_curve import Tuning

#: Height of a panel, inches.
_PANEL_HEIGHT = 2.2
#: Height around the panels, inches.
_REST_HEIGHT = 1.6
#: Share of the lowest and of the highest values outside the axis: some metrics grow without bound.
_OUTSIDE = 0.01


def tuning_chart(tuning: Tuning) -> Figure:
    """Draw the metrics of a control curve, one above the other.

    Green marks where the first metric is within its bounds, which are dash-dotted, and a dotted line the design's own
    value of the parameter.

    Parameters
    ----------
    tuning
        The result of `explore.tune`.
    """
    units = tuning.curve.attrs["units"]
    names = [str(name) for name in tuning.curve if name not in (tuning.parameter, "error", "piece")]
    figure = new_figure(9.0, _REST_HEIGHT + _PANEL_HEIGHT * len(names))
    panels = figure.subplots(len(names), 1, sharex=True, squeeze=False)[:, 0]
    for number, (panel, name) in enumerate(zip(panels, names, strict=True)):
        for _, piece in tuning.curve.groupby("piece"):
            panel.plot(piece[tuning.parameter], piece[name], color=PURPLE if number else BLUE, lw=1.6)
        _set_limits(panel, tuning, name)
        for interval in tuning.intervals:
            panel.axvspan(interval.start.parameter, interval.stop.parameter, color=GREEN, alpha=0.12, lw=0)
        if not math.isnan(tuning.own):
            panel.axvline(tuning.own, color=MUTED, lw=1.0, ls=":")
        panel.set_ylabel(_label(name, units[name]))
        panel.grid(color=MUTED, alpha=0.25, lw=0.5)
    for bound in filter(math.isfinite, tuning.bounds):
        panels[0].axhline(bound, color=RED, lw=1.1, ls="-.")
    for end in (end for interval in tuning.intervals for end in (interval.start, interval.stop)):
        panels[0].plot(end.parameter, end.value, "o", color=GREEN, mec=INK, mew=0.8, ms=6, zorder=4)
    panels[-1].set_xlabel(_label(tuning.parameter, units[tuning.parameter]))
    others = ", ".join(f"{name} = {value:.6g}" for name, value in tuning.design.items())
    write_heading(figure, f"{tuning.metric} over {tuning.parameter}, {others}", 90)
    return figure


def _set_limits(panel: Axes, tuning: Tuning, name: str) -> None:
    """Set limits that hold the curve apart from outliers, and for the first metric its bounds."""
    values = tuning.curve[name].dropna()
    if values.empty:
        return
    low, high = float(values.quantile(_OUTSIDE)), float(values.quantile(1.0 - _OUTSIDE))
    if name == tuning.metric:
        ends = [end.value for interval in tuning.intervals for end in (interval.start, interval.stop)]
        finite = [bound for bound in tuning.bounds if math.isfinite(bound)]
        low, high = min([low, *ends, *finite]), max([high, *ends, *finite])
    margin = 0.06 * (high - low) or 0.05 * abs(high) or 1.0
    panel.set_ylim(low - margin, high + margin)


def _label(name: str, unit: str) -> str:
    words = name.replace("_", " ")
    return f"{words} [{unit_text(unit)}]" if unit not in ("", "1") else words
