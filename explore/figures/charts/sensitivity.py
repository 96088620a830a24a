"""Sensitivity indices: a panel for each output, with bars and intervals for each parameter."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from explore.figures.charts.style import BLUE, INK, MUTED, ORANGE, new_figure

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Height for each bar, inches.
_BAR_HEIGHT = 0.28
#: Height around the bars of a panel, inches.
_REST_HEIGHT = 0.5
#: Half the thickness of a bar, where parameters are 1 apart.
_HALF_BAR = 0.2


def sensitivity_chart(table: pd.DataFrame) -> Figure:
    """Draw the indices of each output with their intervals, the most influential parameter on top.

    A bar is hatched where the index has not converged over bins.

    Parameters
    ----------
    table
        The result of `explore.sensitivity`.
    """
    outputs = list(dict.fromkeys(table["output"]))
    groups = [table[table["output"] == output] for output in outputs]
    heights = [_REST_HEIGHT + _BAR_HEIGHT * int(group[["first_order", "total"]].count().sum()) for group in groups]
    figure = new_figure(8.0, sum(heights) + _REST_HEIGHT)
    panels = figure.subplots(len(groups), 1, squeeze=False, sharex=True, height_ratios=heights)[:, 0]
    for panel, output, group in zip(panels, outputs, groups, strict=True):
        _draw(panel, str(output), group)
    panels[-1].set_xlim(right=max(1.0, panels[-1].get_xlim()[1]))
    panels[-1].set_xlabel("share of the variance")
    return figure


def _draw(panel: Axes, output: str, group: pd.DataFrame) -> None:
    has_total = bool(group["total"].notna().any())
    group = group.sort_values("total" if has_total else "first_order")
    places = np.arange(len(group))
    thickness = 2 * _HALF_BAR if has_total else 3 * _HALF_BAR
    kinds = [("first_order", "alone: first order", BLUE, _HALF_BAR if has_total else 0.0)]
    if has_total:
        kinds.append(("total", "with interactions: total", ORANGE, -_HALF_BAR))
    for kind, label, colour, shift in kinds:
        values = group[kind].to_numpy()
        hatches = ["" if converged else "////" for converged in group["converged"]]
        panel.barh(places + shift, values, thickness, color=colour, label=label, hatch=hatches, edgecolor="white")
        sides = np.array([values - group[f"{kind}_low"], group[f"{kind}_high"] - values])
        panel.errorbar(values, places + shift, xerr=sides, fmt="none", ecolor=INK, capsize=3, lw=1.1)
    panel.set_yticks(places, list(group["parameter"]))
    panel.axvline(0.0, color=MUTED, lw=0.8)
    panel.grid(axis="x", color=MUTED, alpha=0.25, lw=0.5)
    panel.set_axisbelow(True)
    panel.set_title(_title(output, group, has_total=has_total), fontsize=10, loc="left")
    if has_total:
        panel.legend(
            frameon=False, fontsize=9, ncols=2, loc="lower right", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.1
        )


def _title(output: str, group: pd.DataFrame, *, has_total: bool) -> str:
    number = f"{int(group['designs'].max()):,}"
    if has_total:
        return f"feasibility of {number} designs"
    undefined = int(group["undefined"].max())
    left_out = f", without {undefined:,} where it is undefined" if undefined else ""
    hatched = "" if group["converged"].all() else "; hatched: not converged"
    return f"{output.replace('_', ' ')} of {number} feasible designs{left_out}{hatched}"
