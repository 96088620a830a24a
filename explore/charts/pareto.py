"""Two metrics of all designs against each other: infeasible, feasible, Pareto-optimal, and the chosen one."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from explore.charts.columns import axis_label, choose_design, drawable, state, study_name
from explore.charts.style import BLUE, GREEN, INK, RED, new_figure
from explore.errors import RequestError
from explore.ranking.rankings import Ranking, rank_source
from explore.store.results import Results
from explore.vocabulary import FloatArray

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: From this many points on, feasible designs are drawn as a density: dots would be one black area.
MANY = 100_000
#: Infeasible designs are drawn one in each cell of a grid this fine: crosses on top of each other tell nothing more.
_CROSSES = (72, 48)
_CELLS = (240, 160)
#: Points of a mark in the legend, at least.
_LEAST_MARK = 6.0
#: Share of the feasible designs that the axes leave out on each side: a few far outliers would hide all others.
_TAIL = 0.005


def pareto_chart(results: Results, x: str | None = None, y: str | None = None, design: int | None = None) -> Figure:
    """Designs in the plane of two columns, with the Pareto set of the study's objectives.

    Parameters
    ----------
    results
        Of a sweep, finished or not.
    x, y
        Names of columns; the first two objectives of the study unless given. When the two are all objectives, the
        Pareto set is joined to the border of what can be had.
    design
        The chosen one; the best of the Pareto set by its first objective unless given.

    Raises
    ------
    RequestError
        If a name is none of a column of numbers, or both are the same.
    ResultsError
        If the design is not there.
    """
    ranking = rank_source(results)
    x, y = _two_columns(results, ranking, x, y)
    columns = [drawable(results, name) for name in (x, y)]
    frame = results.to_pandas([x, y, "feasible"])
    figure = new_figure()
    chart = figure.subplots()
    front = ranking.frame[[x, y]].to_numpy(float)
    chosen = None
    if design is not None or len(front):
        chosen = results.rows([choose_design(results, design, ranking)])[[x, y]]
    marked = front if chosen is None else np.vstack([front, chosen.to_numpy(float)])
    points, feasible = frame[[x, y]].to_numpy(float), frame["feasible"].to_numpy(bool)
    _limit(chart, points[feasible] if feasible.any() else points, marked)
    if results.keep == "all":
        _infeasible(chart, points[~feasible])
        _feasible(figure, chart, points[feasible], ranking)
    _front(chart, front, ranking, (x, y))
    if chosen is not None:
        _chosen(chart, chosen)
    chart.set_xlabel(axis_label(columns[0]))
    chart.set_ylabel(axis_label(columns[1]))
    count = f"{ranking.tally.ranked:,} feasible of {results.n_studied:,} designs{state(results)}"
    figure.suptitle(f"{study_name(results)}: {len(front):,} Pareto-optimal of {count}", fontsize=12, color=INK)
    handles, labels = chart.get_legend_handles_labels()
    legend = figure.legend(handles, labels, loc="outside lower left", ncols=1, frameon=False, fontsize=10)
    for mark in legend.get_lines():  # a mark is small where there are many
        mark.set_markersize(max(mark.get_markersize(), _LEAST_MARK))
    return figure


def _two_columns(results: Results, ranking: Ranking, x: str | None, y: str | None) -> tuple[str, str]:
    """The columns asked for, the first objectives in the place of those that were not."""
    left = [o.metric for o in ranking.objectives if o.metric not in (x, y)]
    names = [name or (left.pop(0) if left else None) for name in (x, y)]
    if names[0] is None or names[1] is None:
        raise RequestError(f"{results.path} has fewer than two objectives: name the columns with --x and --y")
    if names[0] == names[1]:
        raise RequestError(f"--x and --y are both '{names[0]}'; name two columns")
    return names[0], names[1]


def _limit(chart: Axes, points: FloatArray, marked: FloatArray) -> None:
    """Axes that hold what is marked and nearly all designs."""
    points = points[np.isfinite(points).all(axis=1)]
    marked = marked[np.isfinite(marked).all(axis=1)]
    if len(points) == 0 and len(marked) == 0:
        chart.text(0.5, 0.5, "no design has both values", ha="center", color=INK, transform=chart.transAxes)
        chart.set_xticks([])
        chart.set_yticks([])
        return
    bulk = np.quantile(points, [_TAIL, 1.0 - _TAIL], axis=0, method="nearest") if len(points) else marked
    both = np.vstack([bulk, marked])
    low, high = both.min(axis=0), both.max(axis=0)
    room = np.where(high > low, 0.04 * (high - low), 0.05 * np.abs(high) + (high == 0.0))
    chart.set_xlim(low[0] - room[0], high[0] + room[0])
    chart.set_ylim(low[1] - room[1], high[1] + room[1])


def _cells(chart: Axes, points: FloatArray, shape: tuple[int, int]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Designs in each cell of the axes, shape (x, y), and the edges of the cells."""
    counts, x, y = np.histogram2d(points[:, 0], points[:, 1], shape, [chart.get_xlim(), chart.get_ylim()])
    return counts, x, y


def _infeasible(chart: Axes, points: FloatArray) -> None:
    """Crosses; most infeasible designs were never simulated and have no values."""
    if len(points) == 0:
        return
    known = points[np.isfinite(points).all(axis=1)]
    label = f"infeasible: {len(known):,}"
    if len(known) == 0:
        label = f"infeasible: {len(points):,}, all without values"
    elif len(points) > len(known):
        label += f" (and {len(points) - len(known):,} without values)"
    shown = known
    if len(known) > _CROSSES[0] * _CROSSES[1]:
        counts, x, y = _cells(chart, known, _CROSSES)
        i, j = np.nonzero(counts)
        shown = np.column_stack([(x[i] + x[i + 1]) / 2.0, (y[j] + y[j + 1]) / 2.0])
        label += ", × where there are any"
    chart.plot(*shown.T, "x", color=RED, ms=3.5, mew=0.7, alpha=0.7, ls="", label=label, zorder=1, rasterized=True)


def _feasible(figure: Figure, chart: Axes, points: FloatArray, ranking: Ranking) -> None:
    """Dots, or where there are many the number in each cell."""
    from matplotlib.colors import LinearSegmentedColormap, LogNorm

    points = points[np.isfinite(points).all(axis=1)]
    label = f"feasible: {ranking.tally.ranked:,}"
    if len(points) < MANY:
        size = float(np.clip(240.0 / np.sqrt(max(len(points), 1)), 2.2, 7.0))
        chart.plot(*points.T, ".", color=INK, ms=size, mew=0, ls="", zorder=2, rasterized=True)
        chart.plot([], [], ".", color=INK, ms=7, ls="", label=label)
        return
    counts, x, y = _cells(chart, points, _CELLS)
    ink = LinearSegmentedColormap.from_list("ink", ["#b9bfc6", INK])
    image = chart.pcolormesh(x, y, np.ma.masked_equal(counts.T, 0), cmap=ink, norm=LogNorm(1, counts.max()), zorder=2,
                             rasterized=True)  # fmt: skip
    figure.colorbar(image, ax=chart, label="feasible designs in a cell [1]", pad=0.01)
    chart.plot([], [], "s", color=INK, ms=6, ls="", label=f"{label}, darker where there are more")


def _front(chart: Axes, front: FloatArray, ranking: Ranking, names: tuple[str, str]) -> None:
    """Circles, joined by the border of what can be had when the axes are all objectives."""
    if len(front) == 0:
        return
    senses = {o.metric: o.sense for o in ranking.objectives}
    look: dict[str, Any] = {"ls": ""}
    if set(senses) == set(names):
        front = front[np.argsort(front[:, 0], kind="stable")]
        look = {"drawstyle": "steps-post" if senses[names[0]] == "min" else "steps-pre", "lw": 1.2}
    aims = ", ".join(f"{metric} ({sense})" for metric, sense in senses.items())
    size = float(np.clip(60.0 / np.sqrt(len(front)), 2.0, 6.0))
    chart.plot(*front.T, color=BLUE, marker="o", ms=size, mfc="white" if size > 3.5 else BLUE, mew=1.1, zorder=3,
               label=f"Pareto set in {aims}: {len(front):,}", **look)  # fmt: skip


def _chosen(chart: Axes, chosen: pd.DataFrame) -> None:
    point = chosen.to_numpy(float)[0]
    label = f"chosen: design {chosen.index[0]:,}"
    if not np.isfinite(point).all():
        label += " (has no such values)"
    chart.plot(*point, "*", color=GREEN, mec=INK, mew=0.8, ms=17, ls="", label=label, zorder=4, clip_on=False)
