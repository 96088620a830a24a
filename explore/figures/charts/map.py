"""A metric over two parameters, and where no design is feasible the most frequent reason."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from explore.base.errors import RequestError
from explore.figures.charts.cells import CellAxis, aggregate_cells, cell_axes, cell_rectangles, count_designs
from explore.figures.charts.reasons import HATCH_COLOUR, ReasonMasks, reason_columns, reason_masks, region_style
from explore.figures.charts.style import GREEN, INK, MUTED, new_figure, write_title
from explore.model.columns import Column
from explore.model.quantities import FloatArray, Sense
from explore.results.labels import axis_label, completeness_note, results_name
from explore.results.queries import (
    choose_design,
    designs_like,
    numeric_column,
    varying_parameters,
    violations,
)
from explore.results.ranking.rankings import rank_source
from explore.results.store.open_results import ResultsOrPath, results_of
from explore.results.store.results import Results

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

_AGGREGATES: dict[Sense | None, str] = {"min": "smallest", "max": "largest", None: "mean"}
#: Opacity of the shade of a cell whose nearest design is just infeasible.
_DARKEST = 0.3
#: Violation that halves the opacity of a shade.
_HALF_SHADE = 0.2
#: Ends of the colour bar by whether values lie below and above it.
_EXTENDS = {(False, False): "neither", (True, False): "min", (False, True): "max", (True, True): "both"}


def map_chart(
    results: ResultsOrPath,
    *,
    x: str | None = None,
    y: str | None = None,
    metric: str | None = None,
    design: int | None = None,
) -> Figure:
    """Draw the best value of a metric among the feasible designs in each cell of two parameters.

    A metric without a better side is averaged. Cells without a feasible design are hatched by the most frequent reason.

    Parameters
    ----------
    results
        The results of a sweep, finished or not, or the path of their file.
    x, y
        Names of swept parameters; the first two unless given.
    metric
        Name of a column; the first objective of the study unless given.
    design
        Draw only the designs that equal this one in all other parameters, and mark it; otherwise all designs, and the
        best of the Pareto set is marked.

    Raises
    ------
    RequestError
        If a name is unknown, or fewer than two parameters or values of one vary among the designs to draw.
    ResultsError
        If the design is not in the file.
    """
    results = results_of(results)
    ranking = rank_source(results)
    swept = varying_parameters(results)
    names = _choose_parameters(results, [c.name for c in swept], x, y)
    shown = numeric_column(results, metric or ranking.objectives[0].metric)
    others = [c for c in swept if c.name not in names]
    frame, common = designs_like(results, [*names, shown.name, *reason_columns(results)], others, design)
    n_designs = len(frame)
    frame = frame.dropna(subset=names)  # a length that is solved for is undefined where the equation has no solution
    if min(frame[name].nunique() for name in names) < 2:
        raise RequestError(f"too few designs of {results.path} share {common}; leave out `design` to show all")
    axes = cell_axes(frame[names[0]].to_numpy(float), frame[names[1]].to_numpy(float))
    senses = {o.metric: o.sense for o in (*ranking.objectives, ranking.order_by)}
    sense = senses.get(shown.name) or results.senses.get(shown.name)
    values = frame[shown.name].to_numpy(float)
    feasible = frame["feasible"].to_numpy(bool)
    usable = feasible & np.isfinite(values)

    figure = new_figure(9.0, 7.0)
    panel = figure.subplots()
    _draw_values(
        figure, panel, axes, aggregate_cells(*axes, values, usable, sense), shown, any_feasible=bool(feasible.any())
    )
    handles: list[Artist] = [*_hatch_infeasible(panel, axes, reason_masks(results, frame), frame)]
    title = "hatched: no feasible design, mostly because of (darker: nearer to feasible)" if handles else None
    _shade_infeasible(panel, axes, violations(results, frame), feasible)
    if design is not None or not ranking.frame.empty:
        handles.append(_mark_design(panel, results, names, choose_design(results, design, ranking)))
    panel.set_xlabel(axis_label(numeric_column(results, names[0])))
    panel.set_ylabel(axis_label(numeric_column(results, names[1])))
    content = shown.name if common else f"{_AGGREGATES[sense]} {shown.name} in each cell"
    count = _count_text(results, frame, n_designs, shown.name)
    heading = f"{results_name(results)}: {content}, {count}{completeness_note(results)}"
    write_title(figure, f"{heading}\n{common}".rstrip(), size=11)
    figure.legend(handles=handles, loc="outside lower center", ncols=2, frameon=False, fontsize=10, title=title,
                  handleheight=1.6, handlelength=3.0)  # fmt: skip
    return figure


def _count_text(results: Results, frame: pd.DataFrame, n_designs: int, metric: str) -> str:
    """The numbers of feasible designs and of all, for the heading, with those that no cell shows."""
    feasible = frame.loc[frame["feasible"].to_numpy(bool), metric].to_numpy(float)
    without = np.count_nonzero(~np.isfinite(feasible))
    lacks_metric = f" ({without:,} without {metric})" if without else ""
    lacks_place = f" ({n_designs - len(frame):,} without a place)" if n_designs > len(frame) else ""
    count = f"{n_designs:,} designs{lacks_place}"
    return f"{len(feasible):,} feasible{lacks_metric} of {count}" if results.keep == "all" else f"{count}{lacks_metric}"


def _choose_parameters(results: Results, swept: list[str], x: str | None, y: str | None) -> list[str]:
    """Names of the parameters of both axes: the given ones, else the first swept ones."""
    for name in (x, y):
        if name is not None and numeric_column(results, name, "parameter").name not in swept:
            raise RequestError(f"parameter '{name}' has one value in {results.path}; a map needs one that varies")
    available = [name for name in swept if name not in (x, y)]
    names = [name or (available.pop(0) if available else "") for name in (x, y)]
    if "" in names:
        raise RequestError(f"a map needs two parameters that vary; {results.path} has {', '.join(swept) or 'none'}")
    if names[0] == names[1]:
        raise RequestError(f"`x` and `y` are both '{names[0]}'; name two parameters")
    return names


def _draw_values(
    figure: Figure, panel: Axes, axes: tuple[CellAxis, CellAxis], values: FloatArray, shown: Column, *,
    any_feasible: bool,
) -> None:  # fmt: skip
    """Draw values in colours; the lowest and the highest percent have the colours of the ends of the scale."""
    finite = values[np.isfinite(values)]
    panel.set_xlim(axes[0].edges[0], axes[0].edges[-1])
    panel.set_ylim(axes[1].edges[0], axes[1].edges[-1])
    if len(finite) == 0:
        text = "no feasible design has a value" if any_feasible else "no feasible design"
        panel.text(0.5, 0.5, text, ha="center", color=INK, transform=panel.transAxes, zorder=5,
                   bbox={"facecolor": "white", "edgecolor": MUTED})  # fmt: skip
        return
    low, high = np.quantile(finite, [0.01, 0.99], method="nearest")
    mesh = panel.pcolormesh(axes[0].edges, axes[1].edges, np.ma.masked_invalid(values), cmap="viridis", vmin=low,
                            vmax=high, rasterized=True)  # fmt: skip
    extend = _EXTENDS[bool(finite.min() < low), bool(finite.max() > high)]
    figure.colorbar(mesh, ax=panel, label=axis_label(shown), extend=extend, pad=0.01)


def _mark_design(panel: Axes, results: Results, names: list[str], design: int) -> Line2D:
    from matplotlib.patheffects import withStroke

    point = results.designs([design])[names].to_numpy(float)[0]
    (mark,) = panel.plot(*point, "*", color=GREEN, mec=INK, mew=0.8, ms=17, ls="", label=f"design {design:,}",
                         clip_on=False, path_effects=[withStroke(linewidth=3.5, foreground="white")])  # fmt: skip
    return mark


def _shade_infeasible(
    panel: Axes, axes: tuple[CellAxis, CellAxis], violation: FloatArray, feasible: npt.NDArray[np.bool_]
) -> None:
    """Darken the cells without a feasible design, the more the nearer their nearest one is to feasible."""
    least = aggregate_cells(*axes, violation, ~feasible, "min")
    least[(count_designs(*axes, feasible) > 0) | ~np.isfinite(least)] = np.nan
    if np.isnan(least).all():
        return
    opacity = _DARKEST / (1.0 + least / _HALF_SHADE)
    image = np.zeros((*least.shape, 4))
    image[..., 3] = np.nan_to_num(opacity)
    panel.pcolormesh(axes[0].edges, axes[1].edges, image, zorder=1.5, rasterized=True)


def _hatch_infeasible(
    panel: Axes, axes: tuple[CellAxis, CellAxis], masks: ReasonMasks, frame: pd.DataFrame
) -> list[Patch]:
    """Hatch the cells with designs of which none is feasible; returns the entries of the legend."""
    from matplotlib.collections import PolyCollection

    feasible = frame["feasible"].to_numpy(bool)
    infeasible = (count_designs(*axes, np.ones_like(feasible)) > 0) & (count_designs(*axes, feasible) == 0)
    if not masks or not infeasible.any():
        return []
    most_frequent = np.argmax([count_designs(*axes, mask) for mask in masks.values()], axis=0)
    entries = []
    for number, reason in enumerate(masks):
        mask = infeasible & (most_frequent == number)
        if mask.any():
            style = region_style(number)
            corners = list(cell_rectangles(*axes, mask))
            panel.add_collection(
                PolyCollection(corners, facecolor=style.face, edgecolor=HATCH_COLOUR, hatch=style.hatch, lw=0)
            )
            entries.append(style.legend_patch(reason))
    return entries
