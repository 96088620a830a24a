"""Read and rank results."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from explore.base.errors import NothingFeasibleWarning
from explore.results.ranking.joint import RESULTS_COLUMN, first_of_each, rank_sources
from explore.results.ranking.limits import Limits
from explore.results.ranking.nearest import VIOLATION, find_nearest, find_nearest_rows
from explore.results.ranking.rankings import RankRequest, rank_frame, rank_source
from explore.results.ranking.reasons import warning_of_nothing
from explore.results.store.open_results import open_results, open_several
from explore.results.store.results import Results

if TYPE_CHECKING:
    import pandas as pd


def read_results(path: Path | str, *, columns: Sequence[str] | str | None = None) -> pd.DataFrame:
    """Read the committed designs of a results file as a table.

    Parameters
    ----------
    path
        The HDF5 file of a sweep, finished or not.
    columns
        Names of the columns to read, or one name; None for all.

    Returns
    -------
    DataFrame
        One row for each committed design, index ``design``; ``attrs`` as of `Results.to_pandas`.
    """
    return open_results(path).to_pandas(columns)


def rank(
    results: Results | pd.DataFrame | Path | str | Sequence[Results | Path | str],
    *,
    objectives: Sequence[str] | str | None = None,
    order_by: str | None = None,
    fronts: int = 1,
    where: str | None = None,
    limits: Limits | None = None,
    quality: bool = False,
) -> pd.DataFrame:
    """Find the Pareto-optimal designs, best first.

    Parameters
    ----------
    results
        Results, the path of a results file, or any table. Several results or paths are ranked together; the column
        ``results`` has the results of each design. Left out are designs that are not feasible, and those with an
        objective that is undefined or infinite.
    objectives
        Metrics or parameters, such as ``["cv", "swing_angle:max"]``; None for those of the (first) study.
    order_by
        The metric that orders the designs; None for the first objective.
    fronts
        Number of fronts to return; column ``front`` numbers them from 1.
    where
        Only designs that meet a condition on any columns, such as ``"swing_angle > 20 and not crank >= 4 in"``; see
        `explore.results.ranking.conditions`. Comparisons with an undefined value are false.
    limits
        Constraints narrower than those of the sweep, by metric, numbers in its unit or strings with a unit: a value
        moves the bound of the sweep, ``{"min": 1, "max": "2 rpm"}`` names the sides.
    quality
        Add columns that compare the designs of a front: ``knee``, ``crowding`` and ``hypervolume_share``; see
        `explore.results.ranking.quality`.

    Returns
    -------
    DataFrame
        One row for each design of the fronts, under its number, with the columns of the results and those named above.
        ``attrs["units"]`` has the unit of each column that has one in the results, ``attrs["labels"]`` the words for
        the codes of columns such as ``status``. A `NothingFeasibleWarning` says why a ranking is empty.

    Raises
    ------
    RequestError
        If a name is unknown, a condition is invalid, or a limit is wider than the constraint of the sweep.
    """
    import pandas as pd

    request = RankRequest(objectives, order_by, fronts, where, limits, quality)
    if isinstance(results, pd.DataFrame):
        ranked = rank_frame(results, request)
        if ranked.empty:
            reason = "no row is feasible, meets the request and has finite objectives"
            warnings.warn(reason, NothingFeasibleWarning, stacklevel=2)
        units = dict.fromkeys(results, None) | results.attrs.get("units", {})
        return _with_attrs(ranked, units, results.attrs.get("labels", {}))
    is_joint = not isinstance(results, (Results, Path, str))
    sources = open_several(results if is_joint else [results])  # type: ignore[arg-type, list-item]  # checked above
    if is_joint:
        joint = rank_sources(sources, request)
        ranking, parts, caveats = joint.whole, joint.parts, joint.caveats
    else:
        ranking = rank_source(next(iter(sources.values())), request)
        parts, caveats = dict.fromkeys(sources, ranking), ()
    incomplete = "keeps only the Pareto set of its study: the best in this request may be missing"
    for text in (*(f"{name} {incomplete}" for name, part in parts.items() if part.is_incomplete), *caveats):
        warnings.warn(text, RuntimeWarning, stacklevel=2)
    for name, part in parts.items():
        if reason := warning_of_nothing(part, name, sources[name].status_sentences):
            warnings.warn(reason, NothingFeasibleWarning, stacklevel=2)
    columns = first_of_each({column.name: column for column in source.columns} for source in sources.values())
    units = {name: column.unit for name, column in columns.items()} | {RESULTS_COLUMN: ""}
    return _with_attrs(ranking.frame, units, {name: dict(c.labels) for name, c in columns.items() if c.labels})


def nearest(
    results: Results | pd.DataFrame | Path | str,
    count: int = 10,
    *,
    where: str | None = None,
    limits: Limits | None = None,
) -> pd.DataFrame:
    """Find the infeasible designs that are nearest to feasible, the nearest first.

    Parameters
    ----------
    results
        Results, the path of a results file, or a table of `evaluate` with constraints.
    count
        Number of designs.
    where
        Only designs that meet a condition, as of `rank`.
    limits
        Constraints narrower than those of the sweep, as of `rank`.

    Returns
    -------
    DataFrame
        The designs with all columns and ``violation``, the sum over the constraints of the distance to the allowed
        range, each divided by the distance between the quartiles of its margin among all designs. A margin is NaN where
        a design was screened before the metric was sampled; its violation is then at least the one given. Designs
        without a motion are left out. ``attrs["scales"]`` has the divisors, ``attrs["combinations"]`` the number of
        designs by the constraints that they miss, ``attrs["units"]`` and ``attrs["labels"]`` as of `rank`.

    Raises
    ------
    RequestError
        If there is no constraint, or only the Pareto set was kept.
    """
    import pandas as pd

    if isinstance(results, pd.DataFrame):
        nearness = find_nearest_rows(results, count, where=where, limits=limits)
        units, labels = dict.fromkeys(results, None) | results.attrs.get("units", {}), results.attrs.get("labels", {})
    else:
        source = results if isinstance(results, Results) else open_results(results)
        nearness = find_nearest(source, count, where=where, limits=limits)
        units, labels = source.units, {c.name: dict(c.labels) for c in source.columns if c.labels}
    frame = _with_attrs(nearness.frame, {**units, VIOLATION: "1"}, labels)
    frame.attrs["scales"] = dict(nearness.scales)
    frame.attrs["combinations"] = dict(nearness.exclusions.combinations)
    return frame


def _with_attrs(
    ranked: pd.DataFrame, units: Mapping[str, str | None], labels: Mapping[str, Mapping[int, str]]
) -> pd.DataFrame:
    """The table with the units and labels of its columns; columns that the ranking added are numbers without a unit."""
    by_name = {str(name): units.get(str(name), "1") for name in ranked.columns}
    ranked.attrs["units"] = {name: unit for name, unit in by_name.items() if unit is not None}
    ranked.attrs["labels"] = {name: words for name, words in labels.items() if name in ranked}
    return ranked
