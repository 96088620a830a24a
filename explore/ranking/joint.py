"""The joint Pareto set of several results: which designs of one are beaten by those of another."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import accumulate

from explore.errors import RequestError
from explore.ranking.pareto import fronts as find_fronts
from explore.ranking.rankings import Ranking, RankRequest, Source, Step, arranged, rank_source
from explore.ranking.tallies import Tally
from explore.vocabulary import Columns

#: The column that names the results that a design is from.
RESULTS = "results"


@dataclass(frozen=True)
class JointRanking:
    """The ranking of all results together, whose column ``results`` names where a design is from, and that of each.

    `doubts` are sentences on metrics that have one name and two meanings.
    """

    whole: Ranking
    parts: Mapping[str, Ranking]
    doubts: tuple[str, ...]


def rank_sources(sources: Mapping[str, Source], request: RankRequest, step: Step | None = None) -> JointRanking:
    """Rank several results together, in the objectives of the first unless others are asked for.

    A step follows each block, counted over all of them.

    Raises
    ------
    RequestError
        If an objective is not in all of them, or not in the same unit.
    """
    import pandas as pd

    (first, source), *others = sources.items()
    asked = replace(request, quality=False)
    steps = _steps(sources, step)
    parts = {first: _named(first, source, asked, steps[first])}
    objectives, order = parts[first].objectives, parts[first].order_by
    aims = [f"{objective.metric}:{objective.sense}" for objective in objectives]
    same = replace(asked, metrics=aims, order_by=f"{order.metric}:{order.sense}")
    parts |= {name: _named(name, other, same, steps[name]) for name, other in others}
    metrics = [objective.metric for objective in (*objectives, order)]
    doubts = [line for name, other in others for line in _differences(first, source, name, other, metrics)]

    # A design behind the first fronts of its own results is behind them in all.
    tables = [part.frame.assign(**{RESULTS: name}) for name, part in parts.items()]
    names = dict.fromkeys(name for table in tables for name in table.columns)
    frame = pd.concat([table for table in tables if not table.empty] or tables[:1]).reindex(columns=list(names))
    columns: Columns = {objective.metric: frame[objective.metric].to_numpy() for objective in objectives}
    rows, numbers = find_fronts([columns], objectives, request.fronts)
    best = arranged(frame.iloc[rows], numbers, objectives, order, request)
    tally = Tally(ranked=sum(part.tally.ranked for part in parts.values()))
    incomplete = any(part.incomplete for part in parts.values())
    return JointRanking(
        Ranking(best, objectives, order, tally, incomplete=incomplete), parts, tuple(dict.fromkeys(doubts))
    )


def _steps(sources: Mapping[str, Source], step: Step | None) -> dict[str, Step | None]:
    """For each of several results a step that goes on where the one before it ended."""
    counts = [source.n_committed for source in sources.values()]
    before = accumulate(counts, initial=0)
    return {name: step and _going_on(step, start, sum(counts)) for name, start in zip(sources, before, strict=False)}


def _going_on(step: Step, start: int, total: int) -> Step:
    return lambda done, _: step(start + done, total)


def _named(name: str, source: Source, request: RankRequest, step: Step | None) -> Ranking:
    """The ranking of one of several results; what is wrong is said with its name."""
    try:
        return rank_source(source, request, step)
    except RequestError as error:
        raise RequestError(f"{name}: {error}") from None


def _differences(first: str, source: Source, name: str, other: Source, metrics: list[str]) -> list[str]:
    """Sentences on what metrics mean in the first results and in others."""
    here, there = ({column.name: column for column in each.columns} for each in (source, other))
    for metric in metrics:
        if here[metric].unit != there[metric].unit:
            units = f"{here[metric].unit or 'a number'} in {first} and {there[metric].unit or 'a number'} in {name}"
            raise RequestError(f"{metric} is in {units}, so they cannot be ranked together")
    return [
        f"{metric} is the {here[metric].long_name} in {first}, but the {there[metric].long_name} in {name}"
        for metric in dict.fromkeys(metrics)
        if here[metric].long_name != there[metric].long_name
    ]
