"""What a ranking says beside its table: how many designs were ranked, and why the others were not."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from explore.cli.output import be, counted, say

if TYPE_CHECKING:
    from explore.ranking.rankings import Ranking
    from explore.ranking.tallies import Tally
    from explore.store.results import Results


def explain(results: Results, ranking: Ranking, prefix: str = "") -> None:
    """Say what was ranked, what was left out and why."""
    if ranking.incomplete:
        kept = ", ".join(json.loads(str(results.attributes["objectives"])))
        say(f"{results.path} keeps only the Pareto set in {kept}: the best in this request may be missing", "yellow")
    _say_counts(results, ranking, prefix)
    sentences = json.loads(str(results.attributes.get("status_sentences", "{}")))
    for reason, count in ranking.left_out.items():
        if count:
            say(f"  left out: {count:,} feasible ones that {reason}")
    for line in _left_out(ranking.tally, sentences):
        say(f"  left out: {line}")
    speed = str(results.attributes.get("speed", ""))
    powers = json.loads(str(results.attributes.get("speed_powers", "{}")))
    swept = {c.name for c in results.columns if c.role == "parameter"}
    aims = {o.metric for o in (*ranking.objectives, ranking.order_by)}
    if speed in swept and all(powers.get(aim) == 0 for aim in aims):
        say(f"  {speed} changes none of these objectives; designs that differ only in it are shown as one line")


def _say_counts(results: Results, ranking: Ranking, prefix: str) -> None:
    """Say how many designs are Pareto-optimal, of how many."""
    senses = ", ".join(f"{o.metric} ({o.sense})" for o in ranking.objectives)
    if not ranking.tally.ranked:
        what = (
            "feasible design of {} meets the request" if any(ranking.left_out.values()) else "design of {} is feasible"
        )
        say(f"no {what.format(results.path)}, so there is nothing to rank", "bold yellow")
        return
    first = int((ranking.frame["front"] == 1).sum())
    chosen = " that meet the request" if ranking.left_out else ""
    ranked = f"{counted(ranking.tally.ranked, 'feasible design')}{chosen}"
    say(f"{prefix}{first:,} of {ranked} {be(first)} Pareto-optimal in {senses}")
    if len(ranking.frame) > first:
        last = int(ranking.frame["front"].max())
        say(f"  {len(ranking.frame) - first:,} more are in front{'' if last == 2 else 's 2 to'} {last}")


def _left_out(tally: Tally, sentences: dict[str, str]) -> list[str]:
    missed = [(name.removesuffix("_margin"), count) for name, count in tally.by_constraint.most_common() if count]
    unknown = [(name.removesuffix("_margin"), count) for name, count in tally.undefined.most_common() if count]
    return [
        *(f"{count:,} miss the constraint on {name}" for name, count in missed),
        *(f"{count:,} in which {name}, a constraint, is undefined" for name, count in unknown),
        *(f"{count:,} {label}: {sentences.get(label, '')}" for label, count in tally.by_status.most_common()),
        *([f"{tally.not_finite:,} in which an objective is undefined"] if tally.not_finite else []),
    ]
