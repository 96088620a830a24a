"""A map of random starts of the blind solution of a gear pair's law, by what they lead to."""

from __future__ import annotations

from typing import TYPE_CHECKING

from explore.figures.charts.style import BLUE, GREEN, MUTED, ORANGE, PURPLE, RED, new_figure

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

#: Colour of each outcome: of use, useless, and failures.
_COLOURS = {
    "branch 1": GREEN,
    "branch 2": ORANGE,
    "branch 3": RED,
    "higher branches": PURPLE,
    "inaccurate": BLUE,
    "reported failure": "#c3c9d0",
}


def starts_chart(starts: pd.DataFrame, counts: pd.DataFrame) -> Figure:
    """Draw each start at its frequency C1 and amplitude C0, and the shares of the outcomes of `count_outcomes`."""
    figure = new_figure(10.0, 4.6)
    chart, bars = figure.subplots(1, 2, width_ratios=[1.6, 1.0])
    for outcome in reversed(_COLOURS):
        chosen = starts[starts["outcome"] == outcome]
        chart.plot(chosen["start_c1"], chosen["start_c0"], "o", ms=3.5, mew=0, color=_COLOURS[outcome])
    chart.set_xlabel("start of the frequency C1")
    chart.set_ylabel("start of the amplitude C0")
    chart.set_title(f"fsolve on the five equations from {len(starts):,} random starts", fontsize=10, loc="left")
    present = counts[counts["starts"] > 0].iloc[::-1]
    bars.barh(present["outcome"], present["starts"], color=[_COLOURS[name] for name in present["outcome"]])
    for y, (number, share) in enumerate(zip(present["starts"], present["share"], strict=True)):
        bars.text(number, y, f" {number:,} ({share:.1%})", va="center", fontsize=8.5)
    bars.set_xlim(0, 1.35 * present["starts"].max())
    bars.set_xlabel("starts")
    bars.set_title("the scalar equation: branch 1, always", fontsize=10, loc="left")
    for panel in (chart, bars):
        panel.spines[["top", "right"]].set_visible(False)
        panel.tick_params(colors=MUTED, labelcolor="black")
    return figure
