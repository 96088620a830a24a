"""How near infeasible designs are to feasible: tables for `rank --nearest`, and lines where little is feasible."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from explore.cli.output import is_or_are, number, say, shown_unit
from explore.cli.tables import print_table

if TYPE_CHECKING:
    from explore.results.ranking.exclusions import Exclusions
    from explore.results.ranking.nearest import Nearness
    from explore.results.store.results import Results

#: Number of designs, and of combinations of constraints, that a summary names.
_MOST_NAMED = 3
#: Numbers of designs to let in by relaxing a constraint.
_LET_IN = (1, 10, 100)


def print_nearest(results: Results, nearness: Nearness) -> None:
    """Print the designs nearest to feasible, and below what each constraint excludes."""
    frame, exclusions = nearness.frame, nearness.exclusions
    if frame.empty:
        say(f"no infeasible design of {results.path} has a known distance from feasible", "yellow")
    else:
        parameters = [column.name for column in results.columns if column.role == "parameter"]
        metrics = list(nearness.scales)
        units = [results.units.get(metric, results.units.get(f"{metric}_margin", "")) for metric in metrics]
        rows = [
            [str(design), number(float(row["violation"]), 4), *(_missed(row[f"{metric}_margin"]) for metric in metrics),
             *(number(float(row[name])) for name in parameters)]
            for design, row in zip(frame.index, frame.to_dict(orient="records"), strict=True)
        ]  # fmt: skip
        # A limit may be on a parameter, which has a column of its own.
        names = [f"{metric}_missed" if metric in parameters else metric for metric in metrics]
        columns = [("design", ""), ("violation", ""), *zip(names, units, strict=True)]
        print_table(
            "infeasible designs nearest to feasible, and by how much they miss each constraint",
            [*columns, *((name, results.units[name]) for name in parameters)], rows,
            _caption(frame["violation"].size, nearness), droppable=parameters[::-1], hint="-o FILE.csv writes all",
        )  # fmt: skip
        say("", data=True)
    _print_exclusions(results, nearness.scales, exclusions)


def _missed(margin: float) -> str:
    """By how much a constraint is missed, in a cell."""
    if math.isnan(margin):
        return "unknown"
    return number(-margin, 4) if margin < 0.0 else "met"


def _caption(count: int, nearness: Nearness) -> str:
    metrics = [f"{metric}_margin" for metric in nearness.scales]
    unknown = int(nearness.frame[metrics].isna().any(axis=1).sum())
    unsampled = f"; {unknown:,} of these {count:,} {is_or_are(unknown)} screened and may miss more" if unknown else ""
    return f"violation: the sum of what is missed, each over the distance of its quartiles among all designs{unsampled}"


def _print_exclusions(results: Results, scales: Mapping[str, float], exclusions: Exclusions) -> None:
    """Print a line for each constraint, then the constraints that are missed together."""
    rows = []
    for metric, scale in sorted(scales.items(), key=lambda entry: -exclusions.missed(entry[0])):
        widths = [exclusions.relaxation(metric, count) for count in _LET_IN]
        unit = shown_unit(results.units.get(f"{metric}_margin", results.units.get(metric, "")))
        rows.append([metric, unit, f"{exclusions.missed(metric):,}", f"{exclusions.alone(metric):,}",
                     *("–" if width is None else number(width, 4) for width in widths), number(scale, 4)])  # fmt: skip
    headings = ["constraint", "unit", "missed", "alone", *(f"lets_in_{count}" for count in _LET_IN), "scale"]
    print_table(
        "what each constraint excludes",
        [(heading, "") for heading in headings],
        rows,
        "alone: designs that miss no other; lets_in: by how much to relax it for so many of these; "
        "scale: the distance of quartiles",
        droppable=["scale", "unit"],
    )
    for line in [*_combination_lines(exclusions), *_unmeasured_lines(exclusions)]:
        say(line, data=True)


def _combination_lines(exclusions: Exclusions) -> list[str]:
    lines = [
        f"{count:,} {_verb(count)} {_listed(metrics)} together"
        for metrics, count in exclusions.together()[:_MOST_NAMED]
    ]
    if exclusions.n_partly_known:
        count = exclusions.n_partly_known
        lines.append(f"{count:,} {is_or_are(count)} screened before all constraints were checked, and may miss more")
    return lines


def _unmeasured_lines(exclusions: Exclusions) -> list[str]:
    count = exclusions.n_unmeasured
    verb = "has" if count == 1 else "have"
    why = "no motion, a constrained metric undefined, or the error bound missed"
    return [f"{count:,} {verb} no known distance: {why}"] if count else []


def summarise_nearest(results: Results, *, with_unmeasured: bool = False) -> None:
    """Say in lines which designs are nearest to feasible, what excludes the others, and what relaxing lets in.

    `with_unmeasured` counts also those whose distance is not known, where nothing else says so.
    """
    if results.keep != "all":
        say("  a sweep that keeps all designs shows which are nearest to feasible: explore sweep --keep all")
        return
    if not results.constraints:
        return
    from explore.results.ranking.nearest import find_nearest

    nearness = find_nearest(results, _MOST_NAMED)
    exclusions = nearness.exclusions
    for design, row in zip(nearness.frame.index, nearness.frame.to_dict(orient="records"), strict=True):
        say(f"  near: design {design:,} {_describe_misses(row, nearness.scales, results.units)}")
    missed = [metric for metric in nearness.scales if exclusions.missed(metric)]
    for metric in sorted(missed, key=lambda metric: -exclusions.missed(metric)):
        say(f"  {_describe_exclusion(metric, exclusions, results.units)}")
    for line in [*_combination_lines(exclusions), *(_unmeasured_lines(exclusions) if with_unmeasured else [])]:
        say(f"  {line}")
    if not nearness.frame.empty:
        say(f"  more: explore rank {results.path} --nearest 10")


def _describe_misses(row: Mapping[Any, Any], metrics: Mapping[str, float], units: Mapping[str, str]) -> str:
    margins = {metric: float(row[f"{metric}_margin"]) for metric in metrics}
    missed = [_with_unit(-margin, metric, units) for metric, margin in margins.items() if margin < 0.0]
    names = [metric for metric, margin in margins.items() if margin < 0.0]
    unknown = [metric for metric, margin in margins.items() if math.isnan(margin)]
    text = f"misses {_listed([f'{name} by {amount}' for name, amount in zip(names, missed, strict=True)])}"
    return f"{text}; {_listed(unknown)} {is_or_are(len(unknown))} not known" if unknown else text


def _describe_exclusion(metric: str, exclusions: Exclusions, units: Mapping[str, str]) -> str:
    missed, alone = exclusions.missed(metric), exclusions.alone(metric)
    text = f"{missed:,} {_verb(missed)} the constraint on {metric}, {f'{alone:,}' if alone else 'none'} of them alone"
    widths = {count: exclusions.relaxation(metric, count) for count in _LET_IN}
    known = [
        f"{_with_unit(width, metric, units)} lets in {count}" for count, width in widths.items() if width is not None
    ]
    return f"{text}: relaxed by {', '.join(known)}" if known else text


def _with_unit(amount: float, metric: str, units: Mapping[str, str]) -> str:
    return f"{number(amount, 4)} {shown_unit(units.get(f'{metric}_margin', ''))}".rstrip()


def _verb(count: int) -> str:
    return "misses" if count == 1 else "miss"


def _listed(names: Sequence[str]) -> str:
    """Names as a sentence lists them."""
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)
