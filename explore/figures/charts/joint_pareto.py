"""The designs of several results in the plane of two columns, and their joint Pareto set."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from explore.base.errors import RequestError
from explore.figures.charts.pareto import choose_columns, set_limits
from explore.figures.charts.style import (
    BLUE,
    BROWN,
    GREEN,
    INK,
    ORANGE,
    PURPLE,
    SKY,
    new_figure,
    write_legend,
    write_title,
)
from explore.model.columns import Column
from explore.model.quantities import FloatArray
from explore.results.labels import axis_label, distinct_names
from explore.results.queries import numeric_column
from explore.results.ranking.joint import RESULTS_COLUMN, JointRanking, rank_sources
from explore.results.ranking.rankings import RankRequest
from explore.results.store.open_results import ResultsOrPath, open_comparable
from explore.results.store.results import Results

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Colours and marks of the results, in their order.
_LOOKS = ((BLUE, "o"), (ORANGE, "s"), (PURPLE, "^"), (GREEN, "D"), (SKY, "v"), (BROWN, "P"))


def joint_pareto_chart(results: Sequence[ResultsOrPath], *, x: str | None = None, y: str | None = None) -> Figure:
    """Draw the feasible designs of several results in the plane of two columns, with their joint Pareto set.

    Parameters
    ----------
    results
        Up to six results of one mechanism, or the paths of their files.
    x, y
        Names of columns that all results have; the first two objectives unless given. If these are all the objectives,
        a line joins the Pareto set.

    Raises
    ------
    RequestError
        If the mechanisms differ, a column is unknown or has another unit in some results, or `explore.rank` refuses to
        rank them together.
    """
    sources = open_comparable(results)
    if len(sources) > len(_LOOKS):
        raise RequestError(f"a figure of {len(sources)} results has no colours to tell them apart; name {len(_LOOKS)}")
    joint = rank_sources(sources, RankRequest())
    names = choose_columns(next(iter(sources)), joint.whole, x, y)
    columns = [_shared_column(sources, name) for name in names]
    points = {name: _feasible_points(source, names) for name, source in sources.items()}
    front = joint.whole.frame[[*names, RESULTS_COLUMN]]
    figure = new_figure()
    panel = figure.subplots()
    set_limits(panel, np.vstack(list(points.values())), front[list(names)].to_numpy(float))
    short = distinct_names(sources)
    for name, (colour, mark) in zip(sources, _LOOKS, strict=False):
        own = joint.parts[name].frame[list(names)].to_numpy(float)
        best = front.loc[front[RESULTS_COLUMN] == name, list(names)].to_numpy(float)
        style: dict[str, Any] = {"marker": mark, "color": colour, "ls": "", "rasterized": True}
        size = float(np.clip(240.0 / np.sqrt(max(len(points[name]), 1)), 1.4, 4.0))
        panel.plot(*points[name].T, ms=size, mew=0, alpha=0.35, zorder=1, **style)
        panel.plot(*own.T, ms=5.0, mew=0.9, mfc="white", zorder=2, **style)
        label = f"{short[name]}: {len(own):,} Pareto-optimal designs, {len(best):,} (filled) in the joint Pareto set"
        panel.plot(*best.T, ms=5.0, mew=0.9, zorder=4, label=label, **style)
    _draw_front(panel, front[list(names)].to_numpy(float), joint, names)
    panel.set_xlabel(axis_label(columns[0]))
    panel.set_ylabel(axis_label(columns[1]))
    count = f"{joint.whole.tally.n_feasible:,} feasible designs of {len(sources)} results"
    incomplete = [short[name] for name, part in joint.parts.items() if part.is_incomplete]
    missing = [f"{name} keeps only the Pareto set of its study: the best here may be missing" for name in incomplete]
    heading = [f"{len(front):,} Pareto-optimal of {count}", *joint.caveats, *missing]
    write_title(figure, "\n".join(heading))
    write_legend(figure, panel)
    return figure


def _shared_column(sources: Mapping[str, Results], name: str) -> Column:
    """A column that all results have in the same unit."""
    first, *others = [numeric_column(source, name) for source in sources.values()]
    for path, column in zip(list(sources)[1:], others, strict=True):
        if column.unit != first.unit:
            units = f"{first.unit or 'a number'} in {next(iter(sources))} and {column.unit or 'a number'} in {path}"
            raise RequestError(f"{name} is in {units}, so they cannot be drawn together")
    return first


def _feasible_points(results: Results, names: Sequence[str]) -> FloatArray:
    """Values of the feasible designs in two columns, shape (n, 2), where both are defined."""
    frame = results.to_pandas([*names, "feasible"])
    points: FloatArray = frame.loc[frame["feasible"].to_numpy(bool), list(names)].to_numpy(float)
    return points[np.isfinite(points).all(axis=1)]


def _draw_front(panel: Axes, front: FloatArray, joint: JointRanking, names: tuple[str, str]) -> None:
    """Draw a ring around each design of the joint Pareto set; if the axes are all the objectives, joined by a line."""
    senses = {objective.metric: objective.sense for objective in joint.whole.objectives}
    line: dict[str, Any] = {"ls": ""}
    if set(senses) == set(names):
        front = front[np.argsort(front[:, 0], kind="stable")]
        line = {"drawstyle": "steps-post" if senses[names[0]] == "min" else "steps-pre", "lw": 1.0}
    objectives = ", ".join(f"{metric} ({sense})" for metric, sense in senses.items())
    label = f"joint Pareto set in {objectives}: {len(front):,}"
    panel.plot(*front.T, color=INK, marker="o", ms=9.0, mfc="none", mew=0.9, zorder=3, label=label, **line)
