"""All designs in the plane of two columns: infeasible, feasible and Pareto-optimal ones, and one chosen design."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from explore.base.errors import RequestError
from explore.figures.charts.bounds import draw_metric_bounds
from explore.figures.charts.style import (
    BLUE,
    BROWN,
    GREEN,
    INFEASIBLE_OPACITY,
    INK,
    ORANGE,
    PURPLE,
    RED,
    SKY,
    new_figure,
    write_legend,
    write_title,
)
from explore.model.columns import Column
from explore.model.quantities import FloatArray
from explore.results.labels import axis_label, completeness_note, results_name
from explore.results.queries import choose_design, numeric_column, violation_columns, violations
from explore.results.ranking.rankings import Ranking, rank_source
from explore.results.store.open_results import ResultsOrPath, results_of
from explore.results.store.results import Results

if TYPE_CHECKING:
    from pathlib import Path

    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Number of feasible designs from which on a density takes the place of dots, which would merge.
DENSITY_THRESHOLD = 100_000
#: Columns and rows of the cells of a density.
_DENSITY_CELLS = (240, 160)
#: Columns and rows of the cells that hold one cross each when there are more infeasible designs than cells.
_CROSS_CELLS = (72, 48)
#: Opacity of crosses up to each violation: the nearer to feasible, the darker.
_OPACITIES = ((0.1, 0.48), (0.5, INFEASIBLE_OPACITY), (np.inf, 0.2))
#: Largest number of feasible designs whose kinds are told apart, as the marks are large.
_MOST_CANDIDATES = 500
#: Size of a ring about such a mark, points.
_RING = 9.0
#: Share of the feasible designs outside the axes on each side: a few outliers would compress all others.
_OUTSIDE = 0.005
#: Marks of kinds of candidates in the order of their codes' labels; more kinds share the last.
_MARKS = (("o", INK), ("^", ORANGE), ("s", PURPLE), ("D", BROWN), ("v", SKY))
#: Words of the column of cognates of candidates.
_COGNATES = {0: "0, as found", 1: "1", 2: "2"}
#: Columns with labels that every results file has.
_OF_ALL = ("feasible", "status")


def pareto_chart(
    results: ResultsOrPath, *, x: str | None = None, y: str | None = None, design: int | None = None
) -> Figure:
    """Draw all designs in the plane of two columns, with the Pareto set of the study's objectives.

    Parameters
    ----------
    results
        The results of a sweep, finished or not, or the path of their file.
    x, y
        Names of columns; the first two objectives of the study unless given. If these are all the objectives, a line
        joins the Pareto set.
    design
        Number of the design to mark; the best of the Pareto set by the first objective unless given.

    Raises
    ------
    RequestError
        If a column is unknown or holds no numbers, or both are the same.
    ResultsError
        If the design is not in the file.
    """
    results = results_of(results)
    figure = new_figure()
    panel = figure.subplots()
    ranking = draw_designs(figure, panel, results, x=x, y=y, design=design)
    count = f"{ranking.tally.n_feasible:,} feasible of {results.n_studied:,} designs{completeness_note(results)}"
    write_title(figure, f"{results_name(results)}: {len(ranking.frame):,} Pareto-optimal of {count}")
    write_legend(figure, panel)
    return figure


def draw_designs(
    figure: Figure,
    panel: Axes,
    results: Results,
    *,
    x: str | None = None,
    y: str | None = None,
    design: int | None = None,
) -> Ranking:
    """Draw the designs of `pareto_chart` into existing axes; returns the ranking of the study."""
    ranking = rank_source(results)
    x, y = choose_columns(results.path, ranking, x, y)
    columns = [numeric_column(results, name) for name in (x, y)]
    kinds = kinds_of_candidates(results)
    names = [x, y, "feasible", *violation_columns(results), *([kinds.name] if kinds else [])]
    frame = results.to_pandas(list(dict.fromkeys(names)))
    front = ranking.frame[[x, y]].to_numpy(float)
    chosen = None
    if design is not None or len(front):
        chosen = results.designs([choose_design(results, design, ranking)])[[x, y]]
    marked = front if chosen is None else np.vstack([front, chosen.to_numpy(float)])
    points, feasible = frame[[x, y]].to_numpy(float), frame["feasible"].to_numpy(bool)
    set_limits(panel, points[feasible] if feasible.any() else points, marked)
    shows_kinds = kinds is not None and results.keep == "all" and feasible.sum() <= _MOST_CANDIDATES
    if results.keep == "all":
        _draw_infeasible(panel, points[~feasible], violations(results, frame)[~feasible])
        if kinds and shows_kinds:
            draw_kinds(panel, points[feasible], frame[kinds.name].to_numpy()[feasible], kinds)
        else:
            _draw_feasible(figure, panel, points[feasible])
    _draw_front(panel, front, ranking, (x, y), least_size=_RING if shows_kinds else 2.0)
    if chosen is not None:
        _mark_design(panel, chosen)
    draw_metric_bounds(panel, results, x=x, y=y)
    panel.set_xlabel(axis_label(columns[0]))
    panel.set_ylabel(axis_label(columns[1], 48))
    return ranking


def choose_columns(path: Path | str, ranking: Ranking, x: str | None, y: str | None) -> tuple[str, str]:
    """Names of the columns of both axes: the given ones, else the first objectives."""
    available = [o.metric for o in ranking.objectives if o.metric not in (x, y)]
    names = [name or (available.pop(0) if available else None) for name in (x, y)]
    if names[0] is None or names[1] is None:
        raise RequestError(f"{path} has fewer than two objectives: name the columns with `x` and `y`")
    if names[0] == names[1]:
        raise RequestError(f"`x` and `y` are both '{names[0]}'; name two columns")
    return names[0], names[1]


def set_limits(panel: Axes, points: FloatArray, marked: FloatArray) -> None:
    """Set limits that hold all marked points and, apart from outliers, all others; arrays of shape (n, 2)."""
    points = points[np.isfinite(points).all(axis=1)]
    marked = marked[np.isfinite(marked).all(axis=1)]
    if len(points) == 0 and len(marked) == 0:
        panel.text(0.5, 0.5, "no design has both values", ha="center", color=INK, transform=panel.transAxes)
        panel.set_xticks([])
        panel.set_yticks([])
        return
    bulk = np.quantile(points, [_OUTSIDE, 1.0 - _OUTSIDE], axis=0, method="nearest") if len(points) else marked
    extremes = np.vstack([bulk, marked])
    low, high = extremes.min(axis=0), extremes.max(axis=0)
    margin = np.where(high > low, 0.04 * (high - low), 0.05 * np.abs(high) + (high == 0.0))
    panel.set_xlim(low[0] - margin[0], high[0] + margin[0])
    panel.set_ylim(low[1] - margin[1], high[1] + margin[1])


def _draw_infeasible(panel: Axes, points: FloatArray, violation: FloatArray) -> None:
    """Draw crosses; designs without values, most of which were not simulated, are only counted."""
    if len(points) == 0:
        return
    has_values = np.isfinite(points).all(axis=1)
    shown, violation = points[has_values], violation[has_values]
    label = f"infeasible: {len(shown):,}"
    if len(shown) == 0:
        label = f"infeasible: {len(points):,}, all without values"
    elif len(points) > len(shown):
        label += f" (and {len(points) - len(shown):,} without values)"
    if len(shown) > _CROSS_CELLS[0] * _CROSS_CELLS[1]:
        shown, violation = _nearest_in_cells(panel, shown, violation)
        label += ", × where there are any"
    if len(shown):
        label += ", darker nearer to feasible"
    style: dict[str, Any] = {"marker": "x", "color": RED, "ms": 3.0, "mew": 0.6, "ls": "", "zorder": 1}
    low = -np.inf
    for high, opacity in _OPACITIES:
        own = shown[(violation > low) & (violation <= high)]
        panel.plot(*own.T, alpha=opacity, rasterized=True, **style)
        low = high
    panel.plot([], [], alpha=INFEASIBLE_OPACITY, label=label, **style)


def _nearest_in_cells(panel: Axes, points: FloatArray, violation: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Centres of the cells of the axes that hold points, (k, 2), and the least violation in each, (k,)."""
    x, y = np.linspace(*panel.get_xlim(), _CROSS_CELLS[0] + 1), np.linspace(*panel.get_ylim(), _CROSS_CELLS[1] + 1)
    column, row = np.searchsorted(x, points[:, 0], "right") - 1, np.searchsorted(y, points[:, 1], "right") - 1
    inside = (column >= 0) & (column < _CROSS_CELLS[0]) & (row >= 0) & (row < _CROSS_CELLS[1])
    least = np.full(_CROSS_CELLS, np.nan)
    np.fmin.at(least, (column[inside], row[inside]), violation[inside])
    i, j = np.nonzero(~np.isnan(least))
    return np.column_stack([(x[i] + x[i + 1]) / 2.0, (y[j] + y[j + 1]) / 2.0]), least[i, j]


def _with_values(points: FloatArray) -> tuple[FloatArray, str]:
    """Those points that have both values, (k, 2), and their number in words, with that of the others if any."""
    shown = points[np.isfinite(points).all(axis=1)]
    left_out = f" (and {len(points) - len(shown):,} without values)" if len(shown) < len(points) else ""
    return shown, f"{len(shown):,}{left_out}"


def _draw_feasible(figure: Figure, panel: Axes, points: FloatArray) -> None:
    """Draw dots, or of many designs their number in each cell."""
    from matplotlib.colors import LinearSegmentedColormap, LogNorm
    from matplotlib.ticker import LogFormatter

    points, count = _with_values(points)
    label = f"feasible: {count}"
    if len(points) < DENSITY_THRESHOLD:
        size = float(np.clip(240.0 / np.sqrt(max(len(points), 1)), 2.2, 7.0))
        panel.plot(*points.T, ".", color=INK, ms=size, mew=0, ls="", zorder=2, rasterized=True)
        panel.plot([], [], ".", color=INK, ms=7, ls="", label=label)
        return
    counts, x, y = np.histogram2d(points[:, 0], points[:, 1], _DENSITY_CELLS, [panel.get_xlim(), panel.get_ylim()])
    ink = LinearSegmentedColormap.from_list("ink", ["#b9bfc6", INK])
    image = panel.pcolormesh(x, y, np.ma.masked_equal(counts.T, 0), cmap=ink, norm=LogNorm(1, counts.max()), zorder=2,
                             rasterized=True)  # fmt: skip
    bar = figure.colorbar(image, ax=panel, label="feasible designs in a cell [1]", pad=0.01, format=LogFormatter())
    bar.minorformatter = LogFormatter()  # by default both write powers as formulas, which `explore plot` turns off
    panel.plot([], [], "s", color=INK, ms=6, ls="", label=f"{label}, darker where there are more")


def _draw_front(panel: Axes, front: FloatArray, ranking: Ranking, names: tuple[str, str], least_size: float) -> None:
    """Draw rings; if the axes are all the objectives, joined by the border of the dominated region."""
    if len(front) == 0:
        return
    front, count = _with_values(front)
    senses = {o.metric: o.sense for o in ranking.objectives}
    line: dict[str, Any] = {"ls": ""}
    if set(senses) == set(names):
        front = front[np.argsort(front[:, 0], kind="stable")]
        line = {"drawstyle": "steps-post" if senses[names[0]] == "min" else "steps-pre", "lw": 1.2}
    objectives = ", ".join(f"{metric} ({sense})" for metric, sense in senses.items())
    size = float(np.clip(60.0 / np.sqrt(max(len(front), 1)), least_size, max(least_size, 6.0)))
    panel.plot(*front.T, color=BLUE, marker="o", ms=size, mfc="white" if size > 3.5 else BLUE, mew=1.1, zorder=3,
               label=f"Pareto set in {objectives}: {count}", **line)  # fmt: skip


def _mark_design(panel: Axes, chosen: pd.DataFrame) -> None:
    point = chosen.to_numpy(float)[0]
    label = f"chosen: design {chosen.index[0]:,}"
    if not np.isfinite(point).all():
        label += " (without values here)"
    panel.plot(*point, "*", color=GREEN, mec=INK, mew=0.8, ms=17, ls="", label=label, zorder=4, clip_on=False)


def kinds_of_candidates(results: Results) -> Column | None:
    """The column that says of which kind each candidate is; None where there is none.

    Of linkages with cognates it is which of them a candidate is, else the first that has labels.
    """
    own = [c for c in results.columns if c.role == "bookkeeping" and c.name not in _OF_ALL]
    cognates = (replace(c, labels=_COGNATES) for c in own if c.name == "cognate")
    return next(cognates, None) or next((c for c in own if c.labels), None)


def draw_kinds(panel: Axes, points: FloatArray, codes: np.ndarray, column: Column) -> None:
    """Draw feasible designs, (n, 2), with a mark for each kind, a code of a column, and their numbers in the legend."""
    for number, (code, label) in enumerate(column.labels.items()):
        marker, colour = _MARKS[min(number, len(_MARKS) - 1)]
        own = points[codes == code]
        if not len(own):
            continue
        own, count = _with_values(own)
        text = f"feasible, {column.name} {label.replace('_', ' ')}: {count}"
        panel.plot(*own.T, ls="", marker=marker, color=colour, ms=5, mew=0, zorder=3.5, label=text)
