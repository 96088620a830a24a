"""`explore rank`: the Pareto set as a table."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from explore.cli.bars import block_bar
from explore.cli.explanations import explain
from explore.cli.output import be, counted, newest_results, number, print_json, print_table, refuse_same, say
from explore.cli.tables import check_table, write_table

#: Columns that --quality adds.
QUALITY = ("knee", "crowding", "hypervolume_share")
#: Lines of the table unless --top says otherwise.
USUAL_LINES = 10

if TYPE_CHECKING:
    import pandas as pd

    from explore.ranking.rankings import Ranking, RankRequest
    from explore.store.results import Results


@dataclass(frozen=True)
class RankOptions:
    """What a user asked of a ranking."""

    results: list[Path]
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
    """Rank results files and print their Pareto set."""
    from explore.store.opening import open_several

    paths = options.results or [Path(newest_results())]
    for path in paths:
        refuse_same(options.output, path, "the results file")
    check_table(options.output)
    several = open_several(paths)
    for results in several.values():
        if not results.complete:
            say(f"{results.path} is not finished: {results.n_committed:,} of {results.n_designs:,} designs", "yellow")
    ranking, parts = _ranked(several, options)
    units = {column.name: column.unit for results in several.values() for column in results.columns}
    if options.output is not None:
        write_table(ranking.frame, options.output, units)
        say(f"wrote {counted(len(ranking.frame), 'design')} to {options.output}")
    if as_json:
        frame = ranking.frame.head(options.top) if options.top else ranking.frame
        print_json(frame.reset_index().to_dict(orient="records"))
        return
    for name, part in parts.items():
        explain(several[name], part, f"{name}: " if len(parts) > 1 else "")
    if len(parts) > 1:
        _say_shares(ranking, parts)
    if options.quality and ranking.frame["hypervolume_share"].isna().any():
        say("hypervolume_share is left out: of so many designs in so many objectives it would take long", "yellow")
    if not ranking.frame.empty:
        swept = dict.fromkeys(c.name for r in several.values() for c in r.columns if c.role == "parameter")
        _print_front(ranking, list(swept), units, options)


def _ranked(several: dict[str, Results], options: RankOptions) -> tuple[Ranking, Mapping[str, Ranking]]:
    """The ranking of all results together, and that of each."""
    from explore.ranking.joint import rank_sources
    from explore.ranking.rankings import rank_source

    if len(several) == 1:
        ((name, results),) = several.items()
        with block_bar("ranking") as step:
            ranking = rank_source(results, options.request(), step)
        return ranking, {name: ranking}
    with block_bar("ranking") as step:
        joint = rank_sources(several, options.request(), step)
    for doubt in joint.doubts:
        say(doubt, "yellow")
    return joint.whole, joint.parts


def _say_shares(ranking: Ranking, parts: Mapping[str, Ranking]) -> None:
    """Say how much of the joint Pareto set is from each of the results."""
    best = ranking.frame[ranking.frame["front"] == 1]
    counts = [f"{int((best['results'] == name).sum()):,}" for name in parts]
    shares = ", ".join(f"{count} from {name}" for count, name in zip(counts, parts, strict=True))
    say(f"together {counted(len(best), 'design')} {be(len(best))} Pareto-optimal: {shares}", "bold")


def _print_front(ranking: Ranking, parameters: list[str], units: Mapping[str, str], options: RankOptions) -> None:
    """Designs with equal objectives as one line, in the order of the ranking."""
    names = [objective.metric for objective in ranking.objectives]
    if ranking.order_by.metric not in names:
        names.insert(0, ranking.order_by.metric)
    # The front is not part of what designs have in common: equal objectives are always in the same one.
    line = ranking.frame.groupby(names, sort=False, dropna=False).ngroup()
    lines = int(line.max()) + 1
    top = USUAL_LINES if options.top is None else options.top
    # Only what is shown is taken apart: of a hundred thousand designs that takes ten seconds.
    shown = list(ranking.frame[line < (top or lines)].groupby(names, sort=False, dropna=False))
    marks = ["front"] if options.fronts > 1 else []
    origins = ["results"] if len(options.results) > 1 else []
    figures = list(QUALITY) if options.quality else []
    rows = [
        [str(group.index[0]), number(len(group)), *(number(group[name].iloc[0].item()) for name in marks),
         *(", ".join(dict.fromkeys(group[name])) for name in origins), *(_spread(group[name]) for name in parameters),
         *(number(float(group[name].iloc[0])) for name in names),
         *(number(group[name].iloc[0].item(), 3) for name in figures)]
        for _, group in shown
    ]  # fmt: skip
    columns = [(name, "") for name in ("design", "alike", *marks, *origins)]
    columns += [*((name, units[name]) for name in (*parameters, *names)), *((name, "") for name in figures)]
    more = (
        f"{lines - len(shown):,} more lines: --top 0 prints all, -o FILE.csv writes them" if lines > len(shown) else ""
    )
    print_table(f"Pareto set, best {ranking.order_by.metric} first", columns, rows, more)


def _spread(values: pd.Series[float]) -> str:
    """One value, a few, or a range."""
    different = sorted(set(values.dropna())) or [math.nan]  # results beside others may lack a parameter
    if len(different) <= 3:
        return ", ".join(number(float(value)) for value in different)
    return f"{number(float(different[0]))} … {number(float(different[-1]))}"
