"""What the service tells of indexed results: counts by bins and single points, in the shown units."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from explore.base.errors import RequestError
from explore.base.json_text import json_value
from explore.base.suggest import format_value, suggestion
from explore.model.columns import Arrays
from explore.results.browsing.counting import Range, count_density, count_histograms, find_designs, whole_range
from explore.results.browsing.fitting_bins import FittingBins, fitting_bins
from explore.results.browsing.index_files import IndexedColumn
from explore.results.browsing.selections import Selection
from explore.results.ranking.conditions import Condition, Mask
from explore.results.ranking.rankings import rankable_names
from explore.results.store.results import Results
from explore.service.indexes import Browsed

#: Roles of the columns that are browsed.
_KINDS = ("parameter", "metric", "margin")
#: Number of bins of the x axis of a density, unless values or the request choose it.
_BINS_X = 160
#: Number of bins of the y axis of a density, unless values or the request choose it.
_BINS_Y = 120
#: Largest number of values of a grid that have a bin each in a density.
_MOST_SINGLE = 320


@dataclass(frozen=True)
class Window:
    """Ends of two axes in shown units; None for the least or the largest value."""

    x_low: float | None
    x_high: float | None
    y_low: float | None
    y_high: float | None


def describe_browsing(results: Results, browsed: Browsed | None) -> dict[str, Any]:
    """What a page needs to start: columns, constraints and metrics to rank by; ranges only with an index."""
    indexed = browsed.index.columns if browsed else {}
    columns = []
    for column in results.columns:
        if column.role not in _KINDS or column.labels:
            continue
        facts, scale = indexed[column.name].facts if column.name in indexed else None, results.scales[column.name]
        columns.append(
            {
                "name": column.name,
                "unit": column.unit,
                "meaning": column.long_name,
                "kind": column.role,
                "low": scale.show(facts.low) if facts and facts.low is not None else None,
                "high": scale.show(facts.high) if facts and facts.high is not None else None,
                "distinct": facts.distinct if facts else None,
            }
        )
    units = results.units
    constraints = [
        {"metric": metric, "kind": side, "limit": bound, "unit": units.get(metric, units.get(f"{metric}_margin", ""))}
        for metric, sides in results.constraints.items()
        for side, bound in sides.items()
        if bound is not None
    ]
    return dict(
        json_value(
            {
                "designs": results.n_committed,
                "complete": results.is_complete,
                "keep": results.keep,
                "columns": columns,
                "constraints": constraints,
                "objectives": results.objectives,
                "rank_metrics": rankable_names(results),
            }
        )
    )


def describe_histograms(
    browsed: Browsed, columns: Sequence[str], where: Sequence[str], bins: int | None
) -> dict[str, Any]:
    """Counts of columns by the bins of each, of all designs and of those that the other columns' conditions leave.

    None for the bins chooses those that fit the values.
    """
    selection = browsed.selection(where)
    fitting = [_bins(browsed, name, bins) for name in columns]
    counted = count_histograms(browsed.index, selection, [own.range for own in fitting])
    return {
        "designs": browsed.index.n_designs,
        "selected": counted.n_selected,
        "columns": [
            {
                **_describe_range(browsed.results, own.range),
                "values_per_bin": own.values_per_bin,
                "all": everything.tolist(),
                "selected": selected.tolist(),
                "missing": browsed.index.columns[own.range.column].facts.missing,
            }
            for own, everything, selected in zip(fitting, counted.everything, counted.selected, strict=True)
        ],
    }


def describe_density(
    browsed: Browsed, x: str, y: str, where: Sequence[str], bins: tuple[int | None, int | None], window: Window
) -> dict[str, Any]:
    """Counts of two columns together within a window.

    None for bins chooses those that fit the values of a whole axis.
    """
    x_range = _axis(browsed, x, window.x_low, window.x_high, bins[0], _BINS_X)
    y_range = _axis(browsed, y, window.y_low, window.y_high, bins[1], _BINS_Y)
    counted = count_density(browsed.index, browsed.selection(where), x_range, y_range)
    everything = browsed.density_of_all(x_range, y_range)
    return {
        "x": _describe_range(browsed.results, x_range),
        "y": _describe_range(browsed.results, y_range),
        "bins_x": x_range.bins,
        "bins_y": y_range.bins,
        "counts": counted.counts.ravel().tolist(),
        "all": everything.ravel().tolist(),
        "selected": counted.n_selected,
        "shown": int(counted.counts.sum()),
    }


def list_points(browsed: Browsed, x: str, y: str, where: Sequence[str], window: Window, limit: int) -> dict[str, Any]:
    """The selected designs within a window: their number, and design, x and y of each if they are few enough."""
    x_range = _range(browsed, x, window.x_low, window.x_high, 1)
    y_range = _range(browsed, y, window.y_low, window.y_high, 1)
    inside = [_within(own) for own in (x_range, y_range)]
    selection = Selection(browsed.index, [*browsed.conditions(where), *inside])
    count, places = find_designs(browsed.index, selection, limit)
    if count > limit:
        return {"count": count, "points": None}
    columns, scales = browsed.index.columns, browsed.results.scales
    designs = columns["design"].values(places).astype(int).tolist()
    shown = [scales[name].show_all(columns[name].values(places)).tolist() for name in (x, y)]
    return {"count": count, "points": [list(point) for point in zip(designs, *shown, strict=True)]}


def _within(own: Range) -> Condition:
    """That a design is within a range."""

    def test(columns: Arrays) -> Mask:
        return np.asarray((columns[own.column] >= own.low) & (columns[own.column] <= own.high))

    return Condition(f"{own.column} from {own.low!r} to {own.high!r}", (own.column,), (own.low, own.high), test)


def _bins(browsed: Browsed, name: str, bins: int | None) -> FittingBins:
    """Bins of a column, as many as asked or as fit it."""
    column = _column(browsed, name)
    return fitting_bins(column) if bins is None else FittingBins(whole_range(column, bins), None)


def _column(browsed: Browsed, name: str) -> IndexedColumn:
    column = browsed.index.columns.get(name)
    if column is None:
        raise RequestError(f"no column {format_value(name)}; {suggestion(name, browsed.index.columns)}")
    return column


def _axis(
    browsed: Browsed, name: str, low: float | None, high: float | None, bins: int | None, usual_bins: int
) -> Range:
    """Bins of an axis: those that fit the column where neither its ends nor their number are given."""
    if bins is None and low is None and high is None:
        fitting = fitting_bins(_column(browsed, name), usual_bins, _MOST_SINGLE).range
        if fitting.low < fitting.high:
            return fitting
    return _range(browsed, name, low, high, bins or usual_bins)


def _range(browsed: Browsed, name: str, low: float | None, high: float | None, bins: int) -> Range:
    """Bins of a column between two ends in the shown unit."""
    column = _column(browsed, name)
    whole, scale = whole_range(column, bins), browsed.results.scales[name]
    # An end of the column as it is shown is that end: read, it may be a rounding error beside its designs.
    first, last = (
        end if given is None or given == scale.show(end) else scale.read(repr(given))
        for given, end in ((low, whole.low), (high, whole.high))
    )
    own = Range(name, first, last, bins)
    if own.low > own.high:
        raise RequestError(f"{name}: the window begins at {scale.show(own.low):g}, which is after its end")
    return own


def _describe_range(results: Results, own: Range) -> dict[str, Any]:
    scale = results.scales[own.column]
    low, high = scale.show(own.low), scale.show(own.high)
    return dict(json_value({"name": own.column, "unit": results.units[own.column], "low": low, "high": high}))
