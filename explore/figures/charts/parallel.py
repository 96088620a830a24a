"""Parallel coordinates: parameters and objectives of the Pareto set, over a sample of the other feasible designs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from explore.base.errors import RequestError
from explore.figures.charts.style import GREEN, INK, MUTED, new_figure, write_title
from explore.model.columns import Column
from explore.model.quantities import FloatArray
from explore.results.labels import completeness_note, results_name, unit_text
from explore.results.queries import numeric_column, varying_parameters
from explore.results.ranking.rankings import Ranking, rank_source
from explore.results.ranking.reasons import nothing_ranked
from explore.results.store.open_results import ResultsOrPath, results_of
from explore.results.store.results import Results

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Largest number of lines of the Pareto set.
_MAX_OPTIMAL = 1000
#: Largest number of lines of the other feasible designs.
_MAX_OTHERS = 300
#: Number of lines of the Pareto set whose opacities add up to one.
_OPAQUE_OPTIMAL = 150.0
#: Number of lines of the other feasible designs whose opacities add up to one.
_OPAQUE_OTHERS = 60.0
#: Share of the other designs beyond each end of an axis; their lines leave the picture.
_OUTSIDE = 0.01
#: Line under the name of an objective.
_BETTER = {"min": "\n▼ better", "max": "\n▲ better", None: ""}


def parallel_chart(results: ResultsOrPath, *, metric: str | None = None) -> Figure:
    """Draw a line through parallel axes for each Pareto-optimal design, and pale ones for a sample of the others.

    The axes are the parameters that vary and the objectives of the study.

    Parameters
    ----------
    results
        The results of a sweep, finished or not, or the path of their file.
    metric
        Name of the column that colours the lines; the first objective of the study unless given.

    Raises
    ------
    RequestError
        If no feasible design has all objectives, there are fewer than two axes, or the column is unknown or holds no
        numbers.
    """
    results = results_of(results)
    ranking = rank_source(results)
    colour = numeric_column(results, metric or ranking.objectives[0].metric)
    if ranking.frame.empty:
        raise RequestError(f"{nothing_ranked(ranking, results.path)}, so there is no Pareto set to draw")
    senses = {o.metric: o.sense for o in ranking.objectives}
    columns = _choose_axes(results, list(senses))
    names = [c.name for c in columns]
    optimal = ranking.frame[names].to_numpy(float)[spread(len(ranking.frame), _MAX_OPTIMAL)]
    others = _sample_others(results, ranking, names)
    low, high = _axis_ranges(optimal, others)

    figure = new_figure(2.6 + 1.5 * len(columns), 6.4)
    panel = figure.subplots()
    _draw_others(panel, (others - low) / (high - low))
    _draw_optimal(figure, panel, (optimal - low) / (high - low), ranking, colour)
    for place, column in enumerate(columns):
        _draw_axis(panel, place, column, (low[place], high[place]), senses.get(column.name))
    panel.set_xlim(-0.35, len(columns) - 0.55)
    panel.set_ylim(-0.02, 1.02)
    panel.set_xticks([])
    panel.set_yticks([])
    panel.spines[:].set_visible(False)
    counts = _count_text(results, ranking, len(optimal), len(others))
    write_title(figure, f"{results_name(results)}: {counts}")
    return figure


def _choose_axes(results: Results, objectives: list[str]) -> list[Column]:
    """The columns of the axes: parameters that vary, then the objectives."""
    parameters = [c for c in varying_parameters(results) if c.name not in objectives]
    columns = [*parameters, *(numeric_column(results, name) for name in objectives)]
    if len(columns) < 2:
        raise RequestError(
            f"{results.path} has one objective and no parameter that varies: nothing to draw lines between"
        )
    return columns


def spread(count: int, most: int) -> npt.NDArray[np.int64]:
    """Row numbers of at most `most` of `count` rows, evenly spread from the first to the last."""
    return np.unique(np.linspace(0, max(count - 1, 0), min(count, most)).round().astype(np.int64))


def _sample_others(results: Results, ranking: Ranking, names: list[str]) -> FloatArray:
    """Values of evenly chosen feasible designs that are not Pareto-optimal, shape (lines, axes)."""
    frame = results.to_pandas([*names, "feasible"])
    values = frame[names].to_numpy(float)
    usable = frame["feasible"].to_numpy(bool) & np.isfinite(values).all(axis=1)
    rows = np.flatnonzero(usable & ~frame.index.isin(ranking.frame.index))
    sample: FloatArray = values[rows[spread(len(rows), _MAX_OTHERS)] if len(rows) else rows]
    return sample


def _count_text(results: Results, ranking: Ranking, optimal: int, others: int) -> str:
    """The numbers of drawn designs and of all, for the heading."""
    total = len(ranking.frame)
    front = f"{total:,} Pareto-optimal" if optimal == total else f"{optimal:,} of {total:,} Pareto-optimal"
    rest = ranking.tally.n_feasible - total
    pale = f"{others:,} of {rest:,} other feasible designs, pale" if rest else "no other feasible design"
    return f"{front}; {pale}{completeness_note(results)}"


def _axis_ranges(optimal: FloatArray, others: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Lower and upper end of each axis, different even where all values are equal; shape (axes,)."""
    bulk = np.quantile(others, [_OUTSIDE, 1.0 - _OUTSIDE], axis=0) if len(others) else optimal
    extremes = np.vstack([optimal, bulk])
    low, high = extremes.min(axis=0), extremes.max(axis=0)
    margin = np.where(high > low, 0.0, 0.05 * np.abs(high) + (high == 0.0))
    return low - margin, high + margin


def opacity(lines: int, opaque: float) -> float:
    """Opacity of each line such that `opaque` lines add up to one, within limits that keep a line visible."""
    return float(np.clip(opaque / max(lines, 1), 0.12, 0.85))


def _draw_others(panel: Axes, lines: FloatArray) -> None:
    """Draw pale lines; heights on each axis from 0 to 1, shape (lines, axes)."""
    from matplotlib.collections import LineCollection

    alpha = opacity(len(lines), _OPAQUE_OTHERS)
    panel.add_collection(LineCollection(_paths(lines), colors=MUTED, lw=0.6, alpha=alpha, zorder=1, label="others",
                                        rasterized=True))  # fmt: skip


def _draw_optimal(figure: Figure, panel: Axes, lines: FloatArray, ranking: Ranking, colour: Column) -> None:
    """Draw coloured lines with their scale, and the best design; heights from 0 to 1, shape (lines, axes)."""
    from matplotlib import colormaps
    from matplotlib.collections import LineCollection

    values = ranking.frame[colour.name].to_numpy(float)[spread(len(ranking.frame), _MAX_OPTIMAL)]
    # The ranking lists the best design first; it is drawn last, above the others.
    colours = colormaps["viridis"].with_extremes(bad=INK)  # without a value it would be transparent
    collection = LineCollection(_paths(lines[::-1]), array=values[::-1], cmap=colours, lw=1.1,
                                alpha=opacity(len(lines), _OPAQUE_OPTIMAL), zorder=2, label="Pareto set",
                                rasterized=True)  # fmt: skip
    panel.add_collection(collection)
    first = ranking.objectives[0]
    if ranking.order_by == first:
        (best,) = panel.plot(lines[0], "*-", color=GREEN, mec=INK, mew=0.6, ms=12, lw=2.0, zorder=4, clip_on=False,
                             label=f"best {first.metric}: design {ranking.frame.index[0]:,}")  # fmt: skip
        figure.legend(handles=[best], loc="outside lower center", frameon=False)
    finite = values[np.isfinite(values)]
    if len(finite) and finite.min() < finite.max():
        from matplotlib.cm import ScalarMappable

        label = f"{colour.name} of the Pareto set [{unit_text(colour.unit)}]"
        scale = ScalarMappable(collection.norm, collection.cmap)  # not of the lines, whose opacity it would take
        figure.colorbar(scale, ax=panel, label=label, pad=0.01, shrink=0.8)


def _paths(lines: FloatArray) -> list[FloatArray]:
    places = np.arange(lines.shape[1], dtype=np.float64)
    return [np.column_stack([places, line]) for line in lines]


def tick_texts(ticks: Sequence[float]) -> list[str]:
    """Evenly spaced ticks with six digits, or as many as tell them apart."""
    size = max((abs(tick) for tick in ticks), default=0.0)
    step = abs(ticks[1] - ticks[0]) if len(ticks) > 1 else size
    digits = math.ceil(math.log10(size / step)) + 2 if step > 0.0 else 0
    return [f"{tick:.{min(max(digits, 6), 15)}g}" for tick in ticks]


def _draw_axis(panel: Axes, place: int, column: Column, ends: tuple[float, float], sense: str | None) -> None:
    """Draw a vertical axis with ticks, name, unit and, of an objective, its better side."""
    from matplotlib.ticker import MaxNLocator

    low, high = ends
    panel.plot([place, place], [0.0, 1.0], color=INK, lw=1.2, zorder=3)
    ticks = [tick for tick in MaxNLocator(5).tick_values(low, high) if low <= tick <= high]
    for tick, text in zip(ticks, tick_texts(ticks), strict=True):
        height = (tick - low) / (high - low)
        panel.plot([place - 0.03, place], [height, height], color=INK, lw=1.2, zorder=3)
        panel.text(place - 0.05, height, text, ha="right", va="center", fontsize=9, zorder=5,
                   bbox={"facecolor": "white", "alpha": 0.8, "lw": 0, "pad": 0.6})  # fmt: skip
    words = column.name.replace("_", "_\n", 1) if len(column.name) > 12 else column.name
    panel.text(place, -0.05, f"{words}\n[{unit_text(column.unit)}]{_BETTER[sense]}", ha="center", va="top", fontsize=10)
