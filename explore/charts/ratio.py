"""The ratio of a transmission and how steady its output is, against the crank length that sets it."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from explore.charts.columns import axis_label, choose_design, drawable, others_fixed, state, study_name
from explore.charts.reasons import in_words, look, needed_columns, reasons
from explore.charts.style import BLUE, GREEN, INK, MUTED, PURPLE, RED, new_figure
from explore.errors import RequestError
from explore.store.results import Results

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

#: Masks of designs by the reason why they are infeasible.
Reasons = dict[str, npt.NDArray[np.bool_]]
_CRANK, _RATIO, _CV = "crank", "mean_output_ratio", "cv"
_LOOKS = {_RATIO: (BLUE, "o"), _CV: (PURPLE, "s")}


def ratio_chart(results: Results, design: int | None = None) -> Figure:
    """Mean output ratio and coefficient of variation of the designs that differ from one in the crank length only.

    Parameters
    ----------
    results
        Of a sweep over the crank, with the metrics mean_output_ratio and cv.
    design
        The one that fixes the other parameters; the best of the Pareto set unless given.

    Raises
    ------
    RequestError
        If a column is missing, or no other design differs in the crank only.
    """
    drawable(results, _CRANK, ("parameter",))
    for name in _LOOKS:
        drawable(results, name, ("metric",))
    chosen = choose_design(results, design)
    others = [c for c in results.columns if c.role == "parameter" and c.name != _CRANK]
    frame, fixed = others_fixed(results, [_CRANK, *_LOOKS, *needed_columns(results)], others, chosen)
    frame = frame.sort_values(_CRANK, kind="stable")
    if frame[_CRANK].nunique() < 2:
        alone = f"no other design of {results.path} differs from design {chosen} in the crank only"
        raise RequestError(f"{alone}; sweep the crank as a grid")
    masks = reasons(results, frame)
    found = dict(zip(in_words(list(masks)), masks.values(), strict=True))
    figure = new_figure(9.0, 7.4)
    charts = figure.subplots(2, 1, sharex=True)
    for chart, name in zip(charts, _LOOKS, strict=True):
        _curve(chart, frame, name, chosen, found)
        _bounds(chart, results, name)
        chart.set_ylabel(axis_label(drawable(results, name), 38))
        bands = _bands(chart, frame, found)
        chart.grid(color=MUTED, alpha=0.25, lw=0.5)
    charts[-1].set_xlabel(axis_label(drawable(results, _CRANK)))
    handles, labels = charts[0].get_legend_handles_labels()
    known = dict(zip([*labels, *(str(band.get_label()) for band in bands)], [*handles, *bands], strict=True))
    figure.legend(known.values(), known.keys(), loc="outside lower center", ncols=2, frameon=False, fontsize=10,
                  handleheight=1.6)  # fmt: skip
    figure.suptitle(f"{study_name(results)}: {len(frame):,} crank lengths{state(results)}\n{fixed}", fontsize=11,
                    color=INK)  # fmt: skip
    return figure


def _curve(chart: Axes, frame: pd.DataFrame, name: str, chosen: int, found: Reasons) -> None:
    """The curve; feasible designs with a filled mark, others with a cross, the chosen one with a star."""
    colour, marker = _LOOKS[name]
    crank, values, feasible = frame[_CRANK], frame[name], frame["feasible"].to_numpy(bool)
    few = len(frame) <= 60
    shown = ~feasible & values.notna().to_numpy()
    why = ", ".join(reason for reason, mask in found.items() if (mask & shown).any())
    chart.plot(crank, values, color=colour, lw=1.4, zorder=2)
    chart.plot(crank[feasible], values[feasible], marker, color=INK, ms=5.5 if few else 2.0, ls="", zorder=3,
               label="feasible")  # fmt: skip
    if shown.any():
        chart.plot(crank[shown], values[shown], "x", color=RED, ms=6.0 if few else 2.5, ls="", zorder=3,
                   label=f"infeasible: {why}")  # fmt: skip
    chart.plot(crank.loc[[chosen]], values.loc[[chosen]], "*", color=GREEN, mec=INK, ms=16, ls="", zorder=4,
               label=f"design {chosen:,}")  # fmt: skip


def _bounds(chart: Axes, results: Results, name: str) -> None:
    """Lines at the bounds that the study sets on the metric."""
    constraints = json.loads(str(results.attributes.get("determines", "{}"))).get("constraints", {})
    for bound in constraints.get(name, {}).values():
        if bound is not None:
            chart.axhline(bound, color=RED, lw=1.1, ls="-.")


def _bands(chart: Axes, frame: pd.DataFrame, found: Reasons) -> list[Patch]:
    """Hatch the crank lengths at which a metric has no value; the entries of the legend."""
    crank = frame[_CRANK].to_numpy(float)
    middle = (crank[1:] + crank[:-1]) / 2.0
    edges = np.concatenate([[1.5 * crank[0] - 0.5 * crank[1]], middle, [1.5 * crank[-1] - 0.5 * crank[-2]]])
    chart.set_xlim(edges[0], edges[-1])
    silent = frame[_RATIO].isna().to_numpy() | frame[_CV].isna().to_numpy()
    entries = []
    for number, (reason, mask) in enumerate(found.items()):
        style, own = look(number), mask & silent
        for k in np.flatnonzero(own):
            chart.axvspan(
                edges[k], edges[k + 1], facecolor=style.face, edgecolor=INK, hatch=style.hatch, lw=0, zorder=0
            )
        silent &= ~mask
        if own.any():
            entries.append(style.patch(f"no value: {reason}"))
    return entries
