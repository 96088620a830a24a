"""Parallel coordinates: the Pareto set through its parameters and objectives, over a sample of the others."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from explore.charts.columns import drawable, state, study_name, unit_text, varying
from explore.charts.style import GREEN, INK, MUTED, new_figure
from explore.errors import RequestError
from explore.ranking.rankings import Ranking, rank_source
from explore.store.results import Results
from explore.vocabulary import Column, FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Lines that can still be told apart, of the Pareto set and of the other feasible designs.
_MOST_OPTIMAL, _MOST_OTHERS = 200, 300
#: Share of the others that the axes leave out on each side; their lines run out of the picture.
_TAIL = 0.01


def parallel_chart(results: Results) -> Figure:
    """A line for each Pareto-optimal design, coloured by the first objective, and pale ones for a sample of the others.

    Parameters
    ----------
    results
        Of a sweep, finished or not. Parameters of one value are left out.

    Raises
    ------
    RequestError
        If no design is feasible, or there are fewer than two axes.
    """
    ranking = rank_source(results)
    if ranking.frame.empty:
        raise RequestError(f"no design of {results.path} is feasible, so there is no Pareto set to draw")
    senses = {o.metric: o.sense for o in ranking.objectives}
    swept = [c for c in varying(results) if c.name not in senses]
    columns = [*swept, *(drawable(results, name) for name in senses)]
    if len(columns) < 2:
        raise RequestError(
            f"{results.path} has one objective and no parameter that varies: nothing to draw lines between"
        )
    names = [c.name for c in columns]
    optimal = ranking.frame[names].to_numpy(float)[spread(len(ranking.frame), _MOST_OPTIMAL)]
    others = _others(results, ranking, names)
    figure = new_figure(2.6 + 1.5 * len(columns), 6.4)
    chart = figure.subplots()
    low, high = _ranges(optimal, others)
    _lines(figure, chart, (others - low) / (high - low), (optimal - low) / (high - low), ranking)
    for place, column in enumerate(columns):
        _axis(chart, place, column, (low[place], high[place]), senses.get(column.name))
    chart.set_xlim(-0.35, len(columns) - 0.55)
    chart.set_ylim(-0.02, 1.02)
    chart.set_xticks([])
    chart.set_yticks([])
    chart.spines[:].set_visible(False)
    figure.suptitle(f"{study_name(results)}: {_counts(results, ranking, len(optimal), len(others))}", fontsize=12,
                    color=INK)  # fmt: skip
    return figure


def spread(count: int, most: int) -> npt.NDArray[np.int64]:
    """Numbers of at most so many rows, evenly spread from the first to the last."""
    return np.unique(np.linspace(0, max(count - 1, 0), min(count, most)).round().astype(np.int64))


def _others(results: Results, ranking: Ranking, names: list[str]) -> FloatArray:
    """Feasible designs that are not Pareto-optimal, an even sample of them, shape (n, columns)."""
    frame = results.to_pandas([*names, "feasible"])
    values = frame[names].to_numpy(float)
    usable = frame["feasible"].to_numpy(bool) & np.isfinite(values).all(axis=1)
    rows = np.flatnonzero(usable & ~frame.index.isin(ranking.frame.index))
    chosen: FloatArray = values[rows[spread(len(rows), _MOST_OTHERS)] if len(rows) else rows]
    return chosen


def _counts(results: Results, ranking: Ranking, optimal: int, others: int) -> str:
    """How many designs are drawn of how many."""
    total = len(ranking.frame)
    front = f"{total:,} Pareto-optimal" if optimal == total else f"{optimal:,} of {total:,} Pareto-optimal"
    rest = ranking.tally.ranked - total
    pale = f"{others:,} of {rest:,} other feasible designs, pale" if rest else "no other feasible design"
    return f"{front}; {pale}{state(results)}"


def _ranges(optimal: FloatArray, others: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Ends of each axis, apart even where all values are the same."""
    bulk = np.quantile(others, [_TAIL, 1.0 - _TAIL], axis=0) if len(others) else optimal
    both = np.vstack([optimal, bulk])
    low, high = both.min(axis=0), both.max(axis=0)
    room = np.where(high > low, 0.0, 0.05 * np.abs(high) + (high == 0.0))
    return low - room, high + room


def _lines(figure: Figure, chart: Axes, others: FloatArray, optimal: FloatArray, ranking: Ranking) -> None:
    from matplotlib.collections import LineCollection

    places = np.arange(optimal.shape[1], dtype=np.float64)
    first = ranking.objectives[0]
    pale = [np.column_stack([places, line]) for line in others]
    chart.add_collection(
        LineCollection(pale, colors=MUTED, lw=0.6, alpha=0.3, zorder=1, label="others", rasterized=True)
    )
    best = ranking.frame[first.metric].to_numpy(float)[spread(len(ranking.frame), _MOST_OPTIMAL)]
    order = np.argsort(best if first.sense == "max" else -best, kind="stable")
    lines = LineCollection([np.column_stack([places, optimal[k]]) for k in order], array=best[order], cmap="viridis",
                           lw=1.1, alpha=0.85, zorder=2, label="Pareto set", rasterized=True)  # fmt: skip
    chart.add_collection(lines)
    if ranking.order_by == first:
        chart.plot(places, optimal[0], "*-", color=GREEN, mec=INK, mew=0.6, ms=12, lw=2.0, zorder=4, clip_on=False,
                   label=f"best {first.metric}: design {ranking.frame.index[0]:,}")  # fmt: skip
        figure.legend(handles=[chart.get_lines()[-1]], loc="outside lower center", frameon=False)
    if best.min() < best.max():
        figure.colorbar(lines, ax=chart, label=f"{first.metric} of the Pareto set", pad=0.01, shrink=0.8)


def _axis(chart: Axes, place: int, column: Column, ends: tuple[float, float], sense: str | None) -> None:
    """A vertical axis with its own ticks, name, unit and, of an objective, its better side."""
    from matplotlib.ticker import MaxNLocator

    low, high = ends
    chart.plot([place, place], [0.0, 1.0], color=INK, lw=1.2, zorder=3)
    ticks = [tick for tick in MaxNLocator(5).tick_values(low, high) if low <= tick <= high]
    for tick in ticks:
        height = (tick - low) / (high - low)
        chart.plot([place - 0.03, place], [height, height], color=INK, lw=1.2, zorder=3)
        chart.text(place - 0.05, height, f"{tick:.6g}", ha="right", va="center", fontsize=9, zorder=5,
                   bbox={"facecolor": "white", "alpha": 0.8, "lw": 0, "pad": 0.6})  # fmt: skip
    better = {"min": "\n▼ better", "max": "\n▲ better", None: ""}[sense]
    words = column.name.replace("_", "_\n", 1) if len(column.name) > 12 else column.name
    chart.text(place, -0.05, f"{words}\n[{unit_text(column.unit)}]{better}", ha="center", va="top", fontsize=10)
