"""Which swings exchangeable cranks reach: over the coupler's length, and as a bar for each crank."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from explore.charts.style import BLUE, BROWN, GREEN, INK, MUTED, ORANGE, PURPLE, RED, SKY, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from explore.covering import Coverage

_COLOURS = (BLUE, ORANGE, GREEN, PURPLE, SKY, BROWN)


def coverage_chart(coverage: Coverage) -> Figure:
    """Swing over the coupler's length for each crank on the left, their ranges on the right; gaps are hatched.

    Parameters
    ----------
    coverage
        Of `explore.coverage`.
    """
    figure = new_figure(10.0, 6.0)
    lines, bars = figure.subplots(1, 2, sharey=True, width_ratios=[3, 2])
    table, curves = coverage.table, coverage.curves()
    for number, crank in enumerate(table["crank"]):
        curve = curves[curves["crank"] == crank]
        lines.plot(curve["coupler"], curve["swing_angle"], color=_colour(number), lw=1.8)
    _bars(bars, coverage)
    for start, end in coverage.gaps:
        for chart in (lines, bars):
            chart.axhspan(start, end, facecolor="none", edgecolor=RED, hatch="///", lw=0, alpha=0.6)
    lines.set_ylim(bottom=0.0)
    lines.set_xlabel("coupler length [mm]")
    lines.set_ylabel("swing of the rocker [deg]")
    low, high = coverage.total
    gaps = ", ".join(f"{start:.4g} to {end:.4g}" for start, end in coverage.gaps)
    heading = f"Swings from {low:.5g} to {high:.5g} deg, " + (f"but not {gaps} deg" if gaps else "without a gap")
    figure.suptitle(f"{heading}\nrocker {coverage.rocker:g} mm, ground {coverage.ground:g} mm", fontsize=12, color=INK)
    return figure


def _bars(chart: Axes, coverage: Coverage) -> None:
    """A bar for each crank, with its ends and what it has in common with smaller ones."""
    table = coverage.table
    for number, (low, high, overlap) in enumerate(table[["swing_min", "swing_max", "overlap"]].to_numpy(float)):
        if np.isnan(low):
            continue
        chart.bar(number, high - low, bottom=low, width=0.7, color=_colour(number))
        notes = [(high, 3, f"{low:.4g} to {high:.4g}", INK)]
        if overlap >= 0.0:
            notes.append((low, -12, f"overlap {overlap:.2g}", MUTED))
        elif overlap < 0.0:
            notes.append((low, -12, f"gap {-overlap:.3g}", RED))
        for height, shift, words, colour in notes:
            chart.annotate(words, (number, height), (0, shift), textcoords="offset points", ha="center", fontsize=9,
                           color=colour, bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.5})  # fmt: skip
    chart.set_xticks(range(len(table)), [f"{crank:g}" for crank in table["crank"]])
    chart.set_xlabel("crank length [mm]")
    chart.margins(y=0.08)


def _colour(number: int) -> str:
    return _COLOURS[number % len(_COLOURS)]
