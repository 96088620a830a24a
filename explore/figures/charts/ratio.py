"""Mean output ratio of a transmission and cv of its output over the length of the crank."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from explore.base.errors import RequestError
from explore.figures.charts.bounds import draw_metric_bounds
from explore.figures.charts.cells import edges_around
from explore.figures.charts.reasons import HATCH_COLOUR, ReasonMasks, reason_columns, reason_masks, region_style
from explore.figures.charts.style import (
    BLUE,
    GREEN,
    INFEASIBLE_OPACITY,
    INK,
    MUTED,
    PURPLE,
    RED,
    new_figure,
    write_title,
)
from explore.results.labels import axis_label, completeness_note, results_name
from explore.results.queries import choose_design, designs_like, numeric_column
from explore.results.store.open_results import ResultsOrPath, results_of
from explore.studies.config.linkage import mechanism_of

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

_CRANK, _RATIO, _CV = "crank", "mean_output_ratio", "cv"
_LOOKS = {_RATIO: (BLUE, "o"), _CV: (PURPLE, "s")}


def ratio_chart(results: ResultsOrPath, *, design: int | None = None) -> Figure:
    """Draw the mean output ratio and the cv of the designs that differ from one design only in the crank length.

    Parameters
    ----------
    results
        The results of a sweep over the crank, with the metrics mean_output_ratio and cv; or the path of their file.
    design
        Number of the design that fixes the other parameters; the best of the Pareto set unless given.

    Raises
    ------
    RequestError
        If a column is missing, no other design differs in the crank only, or no number is given and no design is
        feasible.
    ResultsError
        If the design is not in the file.
    """
    results = results_of(results)
    mechanism = mechanism_of(results)
    offered = {*(parameter.name for parameter in mechanism.parameters), *mechanism.metric_names()}
    missing = [name for name in (_CRANK, _RATIO) if name not in offered]
    if missing:
        raise RequestError(
            f"{results.path} is of {mechanism.name}, which has no {' and no '.join(missing)}: a ratio chart is of "
            "crank-rockers; a map or a pareto chart shows any results"
        )
    for name, role in ((_CRANK, "parameter"), (_RATIO, "metric"), (_CV, "metric")):
        numeric_column(results, name, role)
    chosen = choose_design(results, design)
    others = [c for c in results.columns if c.role == "parameter" and c.name != _CRANK]
    frame, common = designs_like(results, [_CRANK, *_LOOKS, *reason_columns(results)], others, chosen)
    frame = frame.sort_values(_CRANK, kind="stable")
    if frame[_CRANK].nunique() < 2:
        raise RequestError(
            f"no other design of {results.path} differs from design {chosen} in the crank only; "
            "sweep the crank as a grid"
        )
    masks = reason_masks(results, frame)

    figure = new_figure(9.0, 7.4)
    panels = figure.subplots(2, 1, sharex=True)
    for panel, name in zip(panels, _LOOKS, strict=True):
        _draw_curve(panel, frame, name, chosen, masks)
        draw_metric_bounds(panel, results, y=name)
        panel.set_ylabel(axis_label(numeric_column(results, name), 38))
        bands = _hatch_undefined(panel, frame, masks)
        panel.grid(color=MUTED, alpha=0.25, lw=0.5)
    panels[-1].set_xlabel(axis_label(numeric_column(results, _CRANK)))
    handles, labels = panels[0].get_legend_handles_labels()
    handles, labels = [*handles, *bands], [*labels, *(str(band.get_label()) for band in bands)]
    figure.legend(handles, labels, loc="outside lower center", ncols=2, frameon=False, fontsize=10, handleheight=1.6)
    count = f"{len(frame):,} crank lengths{completeness_note(results)}"
    write_title(figure, f"{results_name(results)}: {count}\n{common}", size=11)
    return figure


def _draw_curve(panel: Axes, frame: pd.DataFrame, name: str, chosen: int, masks: ReasonMasks) -> None:
    """Draw a metric over the crank: feasible designs as dots, infeasible ones as crosses, the chosen one as a star."""
    colour, marker = _LOOKS[name]
    crank, values, feasible = frame[_CRANK], frame[name], frame["feasible"].to_numpy(bool)
    few = len(frame) <= 60
    crosses = ~feasible & values.notna().to_numpy()
    reasons = ", ".join(reason for reason, mask in masks.items() if (mask & crosses).any())
    panel.plot(crank, values, color=colour, lw=1.4, zorder=2)
    panel.plot(crank[feasible], values[feasible], marker, color=INK, ms=5.5 if few else 2.0, ls="", zorder=3,
               label="feasible")  # fmt: skip
    if crosses.any():
        panel.plot(crank[crosses], values[crosses], "x", color=RED, ms=4.5 if few else 2.0, alpha=INFEASIBLE_OPACITY,
                   ls="", zorder=3, label=f"infeasible: {reasons}")  # fmt: skip
    panel.plot(crank.loc[[chosen]], values.loc[[chosen]], "*", color=GREEN, mec=INK, ms=16, ls="", zorder=4,
               label=f"design {chosen:,}")  # fmt: skip


def _hatch_undefined(panel: Axes, frame: pd.DataFrame, masks: ReasonMasks) -> list[Patch]:
    """Hatch the crank lengths where a metric is undefined, by reason; returns the entries of the legend."""
    edges = edges_around(frame[_CRANK].to_numpy(float))
    panel.set_xlim(edges[0], edges[-1])
    undefined = frame[_RATIO].isna().to_numpy() | frame[_CV].isna().to_numpy()
    entries = []
    for number, (reason, mask) in enumerate(masks.items()):
        style, hatched = region_style(number), mask & undefined
        for k in np.flatnonzero(hatched):
            panel.axvspan(edges[k], edges[k + 1], facecolor=style.face, edgecolor=HATCH_COLOUR, hatch=style.hatch,
                          lw=0, zorder=0)  # fmt: skip
        undefined &= ~mask
        if hatched.any():
            entries.append(style.legend_patch(f"no value: {reason}"))
    return entries
