"""The joint Pareto set of several results."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import accumulate
from typing import TYPE_CHECKING, TypeVar

from explore.base.errors import RequestError
from explore.base.units.shown import in_units
from explore.model.columns import Arrays
from explore.model.progress import ReportProgress
from explore.results.ranking.pareto import find_fronts
from explore.results.ranking.rankings import (
    Ranking,
    RankRequest,
    rank_declared,
    rankable_names,
    sort_fronts,
)
from explore.results.ranking.tallies import Tally

if TYPE_CHECKING:
    from explore.results.store.results import Results

_Entry = TypeVar("_Entry")
#: Column with the name of the results that a design is from.
RESULTS_COLUMN = "results"
#: Endings of the long names of statistics over a stroke of the drive.
_STROKES = ("window drive", "window return", "window clutch")


@dataclass(frozen=True)
class JointRanking:
    """The ranking of several results together (`whole`) and of each (`parts`).

    The frame of `whole` has a column ``results`` with the name of the results that a design is from. `caveats` are
    sentences on metrics that mean different things in the results, and on objectives that some results do not have.
    """

    whole: Ranking
    parts: Mapping[str, Ranking]
    caveats: tuple[str, ...]


def rank_sources(
    sources: Mapping[str, Results], request: RankRequest, report_progress: ReportProgress | None = None
) -> JointRanking:
    """Rank several results together.

    Without objectives in the request, the objectives are those of the first results that all results have; a
    `RequestError` says that there is none, that one is missing, or that units differ. Progress is reported after each
    block, over all results.
    """
    (first, source), *others = sources.items()
    part_request = replace(request, quality=False)
    caveats: list[str] = []
    if request.objectives is None:
        shared, caveats = _shared_objectives(sources)
        if caveats and not shared and request.order_by is None:
            raise RequestError(f"no objective of {first} is in all of these results; name objectives that all have")
        part_request = replace(part_request, objectives=shared or request.order_by)
    reports = _split_progress(sources, report_progress)
    parts = {first: _rank_part(first, source, part_request, reports[first])}
    objectives, order = parts[first].objectives, parts[first].order_by
    part_request = replace(
        part_request,
        objectives=[f"{objective.metric}:{objective.sense}" for objective in objectives],
        order_by=f"{order.metric}:{order.sense}",
    )
    parts |= {name: _rank_part(name, other, part_request, reports[name]) for name, other in others}
    metrics = [objective.metric for objective in (*objectives, order)]
    caveats += [line for name, other in others for line in _differences(first, source, name, other, metrics)]
    unlike = _unlike_columns(sources)
    caveats += [
        f"left out of the designs of {name}, in other units than in results before: {', '.join(columns)}"
        for name, columns in unlike.items()
        if columns
    ]
    whole = _merge_rankings(parts, request, unlike)
    shown = {name: replace(part, frame=sources[name].show(part.frame)) for name, part in parts.items()}
    frame = in_units(whole.frame, first_of_each(each.scales for each in sources.values()))
    return JointRanking(replace(whole, frame=frame), shown, tuple(dict.fromkeys(caveats)))


def other_constraints(sources: Mapping[str, Results]) -> list[str]:
    """A sentence on each of the results that constrains metrics in another way than the first: both keep their own."""
    (first, source), *others = sources.items()
    own, found = source.declared.constraints, []
    for name, other in others:
        bounds = other.declared.constraints
        unlike = [metric for metric in {**own, **bounds} if own.get(metric) != bounds.get(metric)]
        if unlike:
            found.append(f"{name} has other constraints than {first}, on {', '.join(unlike)}: each keeps its own")
    return found


def first_of_each(tables: Iterable[Mapping[str, _Entry]]) -> dict[str, _Entry]:
    """The entries of all tables by name, each of the first table that has it."""
    merged: dict[str, _Entry] = {}
    for table in tables:
        merged |= {name: entry for name, entry in table.items() if name not in merged}
    return merged


def _unlike_columns(sources: Mapping[str, Results]) -> dict[str, list[str]]:
    """The columns of each of the results whose declared unit is another in those before."""
    declared = {name: source.declared.units for name, source in sources.items()}
    first = first_of_each(declared.values())
    return {name: [column for column in units if units[column] != first[column]] for name, units in declared.items()}


def _merge_rankings(parts: Mapping[str, Ranking], request: RankRequest, unlike: Mapping[str, Sequence[str]]) -> Ranking:
    """The fronts of all results, without the `unlike` columns of each.

    A design behind the first fronts of its own results is behind those of all.
    """
    import pandas as pd

    first = next(iter(parts.values()))
    objectives, order = first.objectives, first.order_by
    tables = [
        part.frame.drop(columns=list(unlike[name])).assign(**{RESULTS_COLUMN: name}) for name, part in parts.items()
    ]
    names = dict.fromkeys(name for table in tables for name in table.columns)
    frame = pd.concat([table for table in tables if not table.empty] or tables[:1]).reindex(columns=list(names))
    columns: Arrays = {objective.metric: frame[objective.metric].to_numpy() for objective in objectives}
    rows, numbers = find_fronts([columns], objectives, request.fronts)
    ranked = sort_fronts(frame.iloc[rows], numbers, objectives, order, request)
    tally = Tally()
    for part in parts.values():
        tally.n_ranked += part.tally.n_ranked
        tally.n_not_finite += part.tally.n_not_finite
    is_incomplete = any(part.is_incomplete for part in parts.values())
    return Ranking(ranked, objectives, order, tally, is_incomplete=is_incomplete)


def _shared_objectives(sources: Mapping[str, Results]) -> tuple[list[str], list[str]]:
    """Objectives of the first results that all results have as a column, and a sentence on each other objective."""
    (first, source), *others = sources.items()
    shared, caveats = [], []
    for text in source.objectives:
        metric = text.partition(":")[0]
        without = [name for name, other in others if metric not in rankable_names(other)]
        if without:
            caveats.append(f"{metric}, an objective of {first}, is not in {' and '.join(without)}, so it is left out")
        else:
            shared.append(text)
    return shared, caveats


def _split_progress(
    sources: Mapping[str, Results], report_progress: ReportProgress | None
) -> dict[str, ReportProgress | None]:
    """A callback for each of the results, which counts the designs of those before it as done."""
    counts = [source.n_committed for source in sources.values()]
    before = accumulate(counts, initial=0)
    return {
        name: report_progress and _shift_progress(report_progress, start, sum(counts))
        for name, start in zip(sources, before, strict=False)
    }


def _shift_progress(report_progress: ReportProgress, start: int, total: int) -> ReportProgress:
    return lambda done, _: report_progress(start + done, total)


def _rank_part(name: str, source: Results, request: RankRequest, report_progress: ReportProgress | None) -> Ranking:
    """The ranking of one of several results; errors begin with its name."""
    try:
        return rank_declared(source, request, report_progress)
    except RequestError as error:
        raise RequestError(f"{name}: {error}") from None


def _differences(first: str, source: Results, name: str, other: Results, metrics: list[str]) -> list[str]:
    """Sentences on metrics that mean something else in the first results than in others."""
    here, there = ({column.name: column for column in each.columns} for each in (source, other))
    for metric in metrics:
        if here[metric].unit != there[metric].unit:
            units = f"{here[metric].unit or 'a number'} in {first} and {there[metric].unit or 'a number'} in {name}"
            raise RequestError(f"{metric} is in {units}, so they cannot be ranked together")
    distinct = list(dict.fromkeys(metrics))
    lines = [
        f"{metric} is the {here[metric].long_name} in {first}, but the {there[metric].long_name} in {name}"
        for metric in distinct
        if here[metric].long_name != there[metric].long_name
    ]
    over_strokes = [metric for metric in distinct if here[metric].long_name.endswith(_STROKES)]
    if over_strokes and source.drive != other.drive:
        strokes = f'"{source.drive}" in {first}, but "{other.drive}" in {name}'
        lines.append(f"the drive stroke is {strokes}: {', '.join(over_strokes)} may mean something else")
    return lines
