"""`explore rank`: the Pareto set as a table."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from explore.cli.output import newest_results, number, print_json, print_table, refuse_same, say

#: Columns that --quality adds.
QUALITY = ("knee", "crowding", "hypervolume_share")
#: Lines of the table unless --top says otherwise.
USUAL_LINES = 10

if TYPE_CHECKING:
    import pandas as pd

    from explore.ranking.rankings import Ranking, RankRequest
    from explore.ranking.tallies import Tally
    from explore.store.results import Results


@dataclass(frozen=True)
class RankOptions:
    """What a user asked of a ranking."""

    results: Path | None
    metrics: list[str]
    fronts: int
    where: str | None
    limits: list[str]
    quality: bool
    top: int | None
    output: Path | None

    def request(self) -> RankRequest:
        """The same for the library: one metric orders the Pareto set, several replace the study's objectives."""
        from explore.ranking.limits import parse_limits
        from explore.ranking.rankings import RankRequest

        several = len(self.metrics) > 1
        return RankRequest(
            metrics=self.metrics if several else None,
            order_by=self.metrics[0] if self.metrics and not several else None,
            fronts=self.fronts,
            where=self.where,
            limits=parse_limits(self.limits),
            quality=self.quality,
        )


def print_ranking(options: RankOptions, *, as_json: bool) -> None:
    """Rank a results file and print its Pareto set."""
    from explore.ranking.rankings import rank_source
    from explore.store.results import open_results

    results = open_results(options.results or newest_results())
    refuse_same(options.output, results.path, "the results file")
    if not results.complete:
        say(f"{results.path} is not finished: {results.n_committed:,} of {results.n_designs:,} designs", "yellow")
    ranking = rank_source(results, options.request())
    if options.output is not None:
        ranking.frame.to_csv(options.output)
        say(f"wrote {len(ranking.frame):,} designs to {options.output}")
    if as_json:
        frame = ranking.frame.head(options.top) if options.top else ranking.frame
        print_json(frame.reset_index().to_dict(orient="records"))
        return
    _explain(results, ranking)
    if not ranking.frame.empty:
        _print_front(results, ranking, options)


def _explain(results: Results, ranking: Ranking) -> None:
    """Say what was ranked, what was left out and why."""
    tally = ranking.tally
    if ranking.incomplete:
        kept = ", ".join(json.loads(str(results.attributes["objectives"])))
        say(f"{results.path} keeps only the Pareto set in {kept}: the best in this request may be missing", "yellow")
    senses = ", ".join(f"{o.metric} ({o.sense})" for o in ranking.objectives)
    if tally.ranked:
        first = int((ranking.frame["front"] == 1).sum())
        chosen = " that meet the request" if ranking.left_out else ""
        say(f"{first:,} of {tally.ranked:,} feasible designs{chosen} are Pareto-optimal in {senses}")
        if len(ranking.frame) > first:
            say(f"  {len(ranking.frame) - first:,} more are in fronts 2 to {ranking.frame['front'].max()}")
    elif any(ranking.left_out.values()):
        say(f"no feasible design of {results.path} meets the request, so there is nothing to rank", "bold yellow")
    else:
        say(f"no design of {results.path} is feasible, so there is nothing to rank", "bold yellow")
    sentences = json.loads(str(results.attributes.get("status_sentences", "{}")))
    for reason, count in ranking.left_out.items():
        say(f"  left out: {count:,} feasible ones that {reason}")
    for line in _left_out(tally, sentences):
        say(f"  left out: {line}")
    speed = str(results.attributes.get("speed", ""))
    powers = json.loads(str(results.attributes.get("speed_powers", "{}")))
    swept = {c.name for c in results.columns if c.role == "parameter"}
    aims = {o.metric for o in (*ranking.objectives, ranking.order_by)}
    if speed in swept and all(powers.get(aim) == 0 for aim in aims):
        say(f"  {speed} changes none of these objectives; designs that differ only in it are shown as one line")


def _left_out(tally: Tally, sentences: dict[str, str]) -> list[str]:
    missed = [(name.removesuffix("_margin"), count) for name, count in tally.by_constraint.most_common() if count]
    unknown = [(name.removesuffix("_margin"), count) for name, count in tally.undefined.most_common() if count]
    return [
        *(f"{count:,} miss the constraint on {name}" for name, count in missed),
        *(f"{count:,} in which {name}, a constraint, is undefined" for name, count in unknown),
        *(f"{count:,} {label}: {sentences.get(label, '')}" for label, count in tally.by_status.most_common()),
        *([f"{tally.not_finite:,} in which an objective is undefined"] if tally.not_finite else []),
    ]


def _print_front(results: Results, ranking: Ranking, options: RankOptions) -> None:
    """Designs with equal objectives as one line, in the order of the ranking."""
    names = [objective.metric for objective in ranking.objectives]
    if ranking.order_by.metric not in names:
        names.insert(0, ranking.order_by.metric)
    parameters = [column.name for column in results.columns if column.role == "parameter"]
    # The front is not part of what designs have in common: equal objectives are always in the same one.
    groups = list(ranking.frame.groupby(names, sort=False, dropna=False))
    units = results.units
    top = USUAL_LINES if options.top is None else options.top
    shown = groups if top == 0 else groups[:top]
    marks = ["front"] if options.fronts > 1 else []
    figures = list(QUALITY) if options.quality else []
    rows = [
        [str(group.index[0]), number(len(group)), *(number(group[name].iloc[0].item()) for name in marks),
         *(_spread(group[name]) for name in parameters), *(number(float(group[name].iloc[0])) for name in names),
         *(number(group[name].iloc[0].item(), 3) for name in figures)]
        for _, group in shown
    ]  # fmt: skip
    columns = [(name, "") for name in ("design", "alike", *marks)]
    columns += [*((name, units[name]) for name in (*parameters, *names)), *((name, "") for name in figures)]
    more = (
        f"{len(groups) - len(shown):,} more lines: --top 0 prints all, -o FILE.csv writes them"
        if len(groups) > len(shown)
        else ""
    )
    print_table(f"Pareto set, best {ranking.order_by.metric} first", columns, rows, more)


def _spread(values: pd.Series[float]) -> str:
    """One value, a few, or a range."""
    different = sorted(set(values))
    if len(different) <= 3:
        return ", ".join(number(float(value)) for value in different)
    return f"{number(float(different[0]))} … {number(float(different[-1]))}"
