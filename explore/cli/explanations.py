"""Messages on how many designs are ranked, and why the others are not."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from explore.cli.nearness import summarise_nearest
from explore.cli.output import count_of, is_or_are, number, say, shown_unit

if TYPE_CHECKING:
    from explore.base.units.shown import ShownUnits
    from explore.results.ranking.rankings import Ranking
    from explore.results.store.results import Results
    from explore.studies.designs.spaces import SolvedLength

#: Largest number of wasteful ranges that are listed.
_MOST_RANGES = 3


def explain_ranking(results: Results, ranking: Ranking, prefix: str = "") -> None:
    """Say which designs are ranked and why the others are not; `prefix` names the results."""
    from explore.results.ranking.nearest import is_little
    from explore.results.ranking.reasons import left_out, left_out_by_request

    if ranking.is_incomplete:
        kept = ", ".join(results.objectives)
        say(f"{results.path} keeps only the Pareto set in {kept}: the best in this request may be missing", "yellow")
    _say_counts(results, ranking, prefix)
    sentences = results.status_sentences
    shows_nearest = is_little(ranking.tally.n_feasible, results.n_studied) and not ranking.exclusions
    with_missed = not shows_nearest or results.keep != "all"
    for line in (*left_out_by_request(ranking), *left_out(ranking.tally, sentences, with_missed=with_missed)):
        say(f"  left out: {line}")
    _say_wasteful_bounds(results, ranking.tally.by_status["unreachable"])
    if shows_nearest:
        summarise_nearest(results)
    speed = results.speed
    powers = results.speed_powers
    swept = {c.name for c in results.columns if c.role == "parameter"}
    metrics = {o.metric for o in (*ranking.objectives, ranking.order_by)}
    is_fixed = isinstance(results.sections.get("parameters", {}).get(speed), int | float | str)
    if speed in swept and not is_fixed and all(powers.get(metric) == 0 for metric in metrics):
        say(f"  {speed} changes none of these objectives; designs that differ only in it are shown as one line")


def explain_unreachable(results: Results, solved: SolvedLength, units: ShownUnits) -> None:
    """Say if most designs have no solved length, and in which ranges of the other parameters they lie."""
    unreachable = results.counts.get("unreachable", 0)
    if not _are_most(results, unreachable):
        return
    bounds = (results.scales[solved.name].show(bound) for bound in (solved.low, solved.high))
    low, high = (f"{number(bound)} {results.units[solved.name]}" for bound in bounds)
    within = f" from {low}" * (solved.low not in (0.0, -math.inf)) + f" up to {high}" * (solved.high < math.inf)
    scale = units.scale(solved.metric.unit)
    target = f"{solved.metric.name} = {number(scale.show(solved.value))} {shown_unit(scale.shown)}".rstrip()
    say(
        f"{unreachable:,} of {count_of(results.n_studied, 'design')} {is_or_are(unreachable)} unreachable: "
        f"no {solved.name}{within} gives {target}"
    )
    _say_wasteful_bounds(results, unreachable)


def _are_most(results: Results, unreachable: int) -> bool:
    """Whether most designs of the study are unreachable."""
    return 2 * unreachable > results.n_studied


def _say_wasteful_bounds(results: Results, unreachable: int) -> None:
    """Say which ends of ranges are mostly unreachable, if most designs are."""
    from explore.results.ranking.wasteful_ranges import find_wasteful_ranges

    if not _are_most(results, unreachable):
        return
    if results.keep != "all":
        say("  a smaller sweep that keeps all designs shows which bounds waste them")
        return
    ranges = find_wasteful_ranges(results)
    for part in ranges[:_MOST_RANGES]:
        end = f"{part.parameter} {part.side} {number(part.value, 12)} {shown_unit(results.units[part.parameter])}"
        say(f"  wasteful: {end.rstrip()}, where {part.n_reachable:,} of {part.n_designs:,} are reachable")
    if not ranges and unreachable < results.n_studied:
        say("  no end of a swept range is much worse than the rest of it, so no single bound wastes them")


def _say_counts(results: Results, ranking: Ranking, prefix: str) -> None:
    """Say how many designs are Pareto-optimal, of how many."""
    from explore.results.ranking.reasons import reason_for_nothing

    senses = ", ".join(f"{o.metric} ({o.sense})" for o in ranking.objectives)
    if reason := reason_for_nothing(ranking, results.path):
        say(reason, "bold yellow")
        return
    first = int((ranking.frame["front"] == 1).sum())
    meet = "meets" if ranking.tally.n_ranked == 1 else "meet"
    condition = f" that {meet} the request" if ranking.exclusions else ""
    ranked = f"{count_of(ranking.tally.n_ranked, 'feasible design')}{condition}"
    say(f"{prefix}{first:,} of {ranked} {is_or_are(first)} Pareto-optimal in {senses}")
    if len(ranking.frame) > first:
        last = int(ranking.frame["front"].max())
        behind = len(ranking.frame) - first
        say(f"  {behind:,} more {is_or_are(behind)} in front{'' if last == 2 else 's 2 to'} {last}")
