"""`explore rank`: the Pareto set as a table."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

from explore.cli.output import newest_results, number, print_json, print_table, say

if TYPE_CHECKING:
    import pandas as pd

    from explore.ranking import Ranking, Tally
    from explore.store.results import Results


def print_ranking(path: Path | None, metrics: list[str], top: int, output: Path | None, *, as_json: bool) -> None:
    """Rank a results file and print its Pareto set; one metric orders, several replace the objectives."""
    from explore.ranking import rank_source
    from explore.store.results import open_results

    results = open_results(path or newest_results())
    if not results.complete:
        say(f"[yellow]{results.path} is not finished: {results.n_committed:,} of {results.n_designs:,} designs[/]")
    ranking = rank_source(results, metrics if len(metrics) > 1 else None, metrics[0] if len(metrics) == 1 else None)
    if output is not None:
        ranking.frame.to_csv(output)
        say(f"wrote {len(ranking.frame):,} designs to {output}")
    if as_json:
        frame = ranking.frame if top == 0 else ranking.frame.head(top)
        print_json(frame.reset_index().to_dict(orient="records"))
        return
    _explain(results, ranking)
    if not ranking.frame.empty:
        _print_front(results, ranking, top)


def _explain(results: Results, ranking: Ranking) -> None:
    """Say what was ranked, what was left out and why."""
    tally = ranking.tally
    aims = ", ".join(f"{o.metric} ({o.sense})" for o in ranking.objectives)
    if tally.ranked:
        say(f"{len(ranking.frame):,} of {tally.ranked:,} feasible designs are Pareto-optimal in {aims}")
    else:
        say(f"[bold yellow]no design of {results.path} is feasible, so there is nothing to rank[/]")
    sentences = json.loads(str(results.attributes.get("status_sentences", "{}")))
    for line in _left_out(tally, sentences):
        say(f"  left out: {line}")
    speed = str(results.attributes.get("speed", ""))
    powers = json.loads(str(results.attributes.get("speed_powers", "{}")))
    swept = {c.name for c in results.columns if c.role == "parameter"}
    if speed in swept and all(powers.get(o.metric, 0) == 0 for o in ranking.objectives):
        say(f"  {speed} changes none of these objectives; designs that differ only in it are shown as one line")


def _left_out(tally: Tally, sentences: dict[str, str]) -> list[str]:
    lines = [f"{count:,} miss the constraint on {name}" for name, count in tally.by_constraint.most_common()]
    lines += [f"{count:,} {label}: {sentences.get(label, '')}" for label, count in tally.by_status.most_common()]
    if tally.not_finite:
        lines.append(f"{tally.not_finite:,} in which an objective is undefined")
    return lines


def _print_front(results: Results, ranking: Ranking, top: int) -> None:
    """Designs with equal objectives as one line, in the order of the ranking."""
    names = [objective.metric for objective in ranking.objectives]
    if ranking.order_by.metric not in names:
        names.insert(0, ranking.order_by.metric)
    parameters = [column.name for column in results.columns if column.role == "parameter"]
    groups = list(ranking.frame.groupby(names, sort=False))
    units = results.units
    shown = groups if top == 0 else groups[:top]
    rows = [
        [number(int(group.index[0])), number(len(group)), *(_spread(group[name]) for name in parameters),
         *(number(float(group[name].iloc[0])) for name in names)]
        for _, group in shown
    ]  # fmt: skip
    columns = [("design", ""), ("alike", ""), *((name, units[name]) for name in (*parameters, *names))]
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
