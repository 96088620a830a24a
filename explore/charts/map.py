"""A metric over two parameters, with the reasons where no design is feasible."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from explore.charts.cells import Axis, axis_of, gather, rectangles, tally
from explore.charts.columns import axis_label, choose_design, drawable, others_fixed, state, study_name, varying
from explore.charts.reasons import in_words, look, needed_columns, reasons
from explore.charts.style import GREEN, INK, MUTED, new_figure
from explore.errors import RequestError
from explore.ranking.objectives import senses_of
from explore.ranking.rankings import rank_source
from explore.store.results import Results
from explore.vocabulary import Column, FloatArray, Sense

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

_HOW: dict[Sense | None, str] = {"min": "smallest", "max": "largest", None: "mean"}


def map_chart(
    results: Results,
    x: str | None = None,
    y: str | None = None,
    metric: str | None = None,
    design: int | None = None,
) -> Figure:
    """The best value of a metric in each cell of two parameters, over all feasible designs that lie in it.

    Where none of a cell is feasible, a hatch says the most common reason. A metric without a better side is averaged.

    Parameters
    ----------
    results
        Of a sweep, finished or not.
    x, y
        Names of swept parameters; the first two unless given.
    metric
        Name of a column; the first objective of the study unless given.
    design
        Only designs are shown that equal this one in all other parameters; all designs unless given.

    Raises
    ------
    RequestError
        If a name is wrong, or fewer than two parameters or designs are there to be shown.
    """
    from matplotlib.patheffects import withStroke

    ranking = rank_source(results)
    swept = varying(results)
    names = _two_parameters(results, [c.name for c in swept], x, y)
    shown = drawable(results, metric or ranking.objectives[0].metric)
    others = [c for c in swept if c.name not in names]
    frame, fixed = others_fixed(results, [*names, shown.name, *needed_columns(results)], others, design)
    frame = frame.dropna(subset=names)  # a length solved for is not known where there is none
    if min(frame[name].nunique() for name in names) < 2:
        raise RequestError(f"too few designs of {results.path} share {fixed}; leave out --design to show all")
    axes = (axis_of(frame[names[0]].to_numpy(float)), axis_of(frame[names[1]].to_numpy(float)))
    senses = {o.metric: o.sense for o in ranking.objectives} | {ranking.order_by.metric: ranking.order_by.sense}
    sense = senses.get(shown.name) or senses_of(results.attributes).get(shown.name)
    figure = new_figure(9.0, 7.0)
    chart = figure.subplots()
    usable = frame["feasible"].to_numpy(bool) & np.isfinite(frame[shown.name].to_numpy(float))
    _colour(figure, chart, axes, gather(*axes, frame[shown.name].to_numpy(float), usable, sense), shown)
    handles: list[Any] = [*_hatch(chart, axes, results, frame)]
    title = "hatched: no feasible design, mostly because of" if handles else None
    if design is not None or not ranking.frame.empty:
        star = choose_design(results, design, ranking)
        place = results.rows([star])[names].to_numpy(float)[0]
        handles += chart.plot(*place, "*", color=GREEN, mec=INK, mew=0.8, ms=17, ls="", label=f"design {star:,}",
                              clip_on=False, path_effects=[withStroke(linewidth=3.5, foreground="white")])  # fmt: skip
    chart.set_xlabel(axis_label(drawable(results, names[0])))
    chart.set_ylabel(axis_label(drawable(results, names[1])))
    what = shown.name if fixed else f"{_HOW[sense]} {shown.name} in each cell"
    count = f"{np.count_nonzero(usable):,} feasible of {len(frame):,} designs"
    heading = f"{study_name(results)}: {what}, {count if results.keep == 'all' else f'{len(frame):,} designs'}"
    figure.suptitle(heading + state(results) + (f"\n{fixed}" if fixed else ""), fontsize=11, color=INK)
    figure.legend(handles=handles, loc="outside lower center", ncols=2, frameon=False, fontsize=10, title=title,
                  handleheight=1.6, handlelength=3.0)  # fmt: skip
    return figure


def _two_parameters(results: Results, swept: list[str], x: str | None, y: str | None) -> list[str]:
    """The parameters asked for, the first swept ones in the place of those that were not."""
    for name in (x, y):
        if name is not None and drawable(results, name, ("parameter",)).name not in swept:
            raise RequestError(f"parameter '{name}' has one value in {results.path}; a map needs one that varies")
    left = [name for name in swept if name not in (x, y)]
    names = [name or (left.pop(0) if left else "") for name in (x, y)]
    if "" in names:
        raise RequestError(f"a map needs two parameters that vary; {results.path} has {', '.join(swept) or 'none'}")
    if names[0] == names[1]:
        raise RequestError(f"--x and --y are both '{names[0]}'; name two parameters")
    return names


def _colour(figure: Figure, chart: Axes, axes: tuple[Axis, Axis], values: FloatArray, shown: Column) -> None:
    """Colours, the few far outliers in those of the ends."""
    known = values[np.isfinite(values)]
    chart.set_xlim(axes[0].edges[0], axes[0].edges[-1])
    chart.set_ylim(axes[1].edges[0], axes[1].edges[-1])
    if len(known) == 0:
        chart.text(0.5, 0.5, "no feasible design", ha="center", color=INK, transform=chart.transAxes, zorder=5,
                   bbox={"facecolor": "white", "edgecolor": MUTED})  # fmt: skip
        return
    low, high = np.quantile(known, [0.01, 0.99], method="nearest")
    ends = {(False, False): "neither", (True, False): "min", (False, True): "max", (True, True): "both"}
    mesh = chart.pcolormesh(axes[0].edges, axes[1].edges, np.ma.masked_invalid(values), cmap="viridis", vmin=low,
                            vmax=high, rasterized=True)  # fmt: skip
    beyond = ends[bool(known.min() < low), bool(known.max() > high)]
    figure.colorbar(mesh, ax=chart, label=axis_label(shown), extend=beyond, pad=0.01)


def _hatch(chart: Axes, axes: tuple[Axis, Axis], results: Results, frame: pd.DataFrame) -> list[Patch]:
    """Hatch the cells with designs of which none is feasible; the entries of the legend."""
    from matplotlib.collections import PolyCollection

    everyone = np.ones(len(frame), dtype=np.bool_)
    barren = (tally(*axes, everyone) > 0) & (tally(*axes, frame["feasible"].to_numpy(bool)) == 0)
    found = reasons(results, frame)
    if not found or not barren.any():
        return []
    most = np.argmax([tally(*axes, mask) for mask in found.values()], axis=0)
    entries = []
    for number, words in enumerate(in_words(list(found))):
        mask = barren & (most == number)
        if mask.any():
            style = look(number)
            chart.add_collection(PolyCollection(list(rectangles(*axes, mask)), facecolor=style.face, edgecolor=INK,
                                                hatch=style.hatch, lw=0))  # fmt: skip
            entries.append(style.patch(words))
    return entries
