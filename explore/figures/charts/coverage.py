"""Swing angles that exchangeable cranks reach: over the length of the coupler, and as a bar for each crank."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from explore.figures.charts.style import (
    BLUE,
    BROWN,
    GREEN,
    INK,
    MUTED,
    ORANGE,
    PURPLE,
    RED,
    SKY,
    new_figure,
    write_title,
)
from explore.results.labels import unit_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from explore.analysis.covering import Coverage

_COLOURS = (BLUE, ORANGE, GREEN, PURPLE, SKY, BROWN)


def coverage_chart(coverage: Coverage) -> Figure:
    """Draw the swing angle of each crank over the length of the coupler (left), and its range (right).

    Gaps between the ranges are hatched.

    Parameters
    ----------
    coverage
        The result of `explore.coverage`; lengths in mm, swing angles in deg.
    """
    length, angle = (unit_text(unit) for unit in coverage.units)
    figure = new_figure(10.0, 6.0)
    lines, bars = figure.subplots(1, 2, sharey=True, width_ratios=[3, 2])
    table, curves = coverage.table, coverage.curves()
    for number, crank in enumerate(table["crank"]):
        curve = curves[curves["crank"] == crank]
        lines.plot(curve["coupler"], curve["swing_angle"], color=_COLOURS[number % len(_COLOURS)], lw=1.8)
    _draw_bars(bars, coverage)
    for start, end in coverage.gaps:
        for panel in (lines, bars):
            panel.axhspan(start, end, facecolor="none", edgecolor=RED, hatch="///", lw=0, alpha=0.6)
    lines.set_ylim(bottom=0.0)
    lines.set_xlabel(f"coupler length [{length}]")
    lines.set_ylabel(f"swing of the rocker [{angle}]")
    low, high = coverage.total
    gaps = ", ".join(f"{start:.4g} to {end:.4g}" for start, end in coverage.gaps)
    heading = f"Swings from {low:.5g} to {high:.5g} {angle}, " + (
        f"but not {gaps} {angle}" if gaps else "without a gap"
    )
    if np.isnan(low):
        heading = "No crank turns with any of these couplers"
    rig = f"rocker {coverage.rocker:g} {length}, ground {coverage.ground:g} {length}"
    write_title(figure, f"{heading}\n{rig}")
    return figure


def _draw_bars(panel: Axes, coverage: Coverage) -> None:
    """Draw a bar for each crank, with its ends and its overlap with smaller cranks."""
    table = coverage.table
    for number, (low, high, overlap) in enumerate(table[["swing_min", "swing_max", "overlap"]].to_numpy(float)):
        if np.isnan(low):
            continue
        panel.bar(number, high - low, bottom=low, width=0.7, color=_COLOURS[number % len(_COLOURS)])
        notes = [(high, 3, f"{low:.4g} to {high:.4g}", INK)]
        if overlap >= 0.0:
            notes.append((low, -12, f"overlap {overlap:.2g}", MUTED))
        elif overlap < 0.0:
            notes.append((low, -12, f"gap {-overlap:.3g}", RED))
        for height, shift, words, colour in notes:
            panel.annotate(words, (number, height), (0, shift), textcoords="offset points", ha="center", fontsize=9,
                           color=colour, bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.5})  # fmt: skip
    panel.set_xticks(range(len(table)), [f"{crank:g}" for crank in table["crank"]])
    panel.set_xlabel(f"crank length [{unit_text(coverage.units[0])}]")
    panel.margins(y=0.08)
