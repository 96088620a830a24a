"""`explore rank`: print the Pareto set of results."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from explore.base.errors import RequestError
from explore.cli.explanations import explain_ranking
from explore.cli.nearness import print_nearest
from explore.cli.options import JsonOption, objective_option, output_option, results_argument
from explore.cli.output import count_of, is_or_are, number, say
from explore.cli.paths import newest_results, refuse_overwriting
from explore.cli.progress import block_bar
from explore.cli.table_files import check_table, tell_designs, with_labels, with_units
from explore.cli.tables import print_table
from explore.cli.units import UnitsOption, units_of

if TYPE_CHECKING:
    import pandas as pd

    from explore.results.ranking.rankings import Ranking, RankRequest
    from explore.results.store.results import Results

#: Columns that --quality adds.
QUALITY = ("knee", "crowding", "hypervolume_share")
#: Number of lines of the table without --top.
DEFAULT_LINES = 10


def rank(
    results: Annotated[
        list[Path] | None,
        results_argument(help="Results files, several of them ranked together; by default the newest results/*.h5."),
    ] = None,
    metric: Annotated[
        list[str] | None,
        objective_option(
            help="NAME, NAME:min or NAME:max. Once: order the Pareto set by it. Several times: replace the study's "
            "objectives."
        ),
    ] = None,
    where: Annotated[
        str | None,
        typer.Option(
            metavar="CONDITION", help='Rank only these designs, such as "swing_angle > 20 and not crank >= 4 in".'
        ),
    ] = None,
    limit: Annotated[
        list[str] | None,
        typer.Option(
            help="A constraint narrower than the sweep's: METRIC=VALUE, METRIC>=VALUE or METRIC<=VALUE; "
            "a unit may follow."
        ),
    ] = None,
    fronts: Annotated[
        int,
        typer.Option(
            min=1,
            metavar="K",
            help="Number of fronts to list; front 2 is the Pareto set of the designs left when front 1 is removed.",
        ),
    ] = 1,
    quality: Annotated[
        bool, typer.Option("--quality", help="Also the knee, crowding distance and share of the hypervolume.")
    ] = False,
    nearest: Annotated[
        int | None,
        typer.Option(
            min=1,
            metavar="K",
            help="List instead the K infeasible designs nearest to feasible, and what each constraint excludes.",
        ),
    ] = None,
    top: Annotated[
        int | None, typer.Option(min=0, help="Lines to print, 0 for all; by default 10, with --json all.")
    ] = None,
    units: UnitsOption = None,
    as_json: JsonOption = False,
    output: Annotated[
        Path | None, output_option(help="Also write the Pareto set, as .csv, .json, .md or .parquet.")
    ] = None,
) -> None:
    """Print the Pareto-optimal designs, best first."""
    paths = results or [newest_results()]
    for path in paths:
        refuse_overwriting(path, output, "the results file")
    check_table(output)
    sources = _open(paths, units)
    if nearest is not None:
        if len(sources) > 1 or metric or fronts > 1 or quality or top is not None:
            raise RequestError("--nearest takes one results file, and no --metric, --fronts, --quality or --top")
        (source,) = sources.values()
        _rank_nearest(source, nearest, where, limit or [], output, as_json=as_json)
        return
    from explore.results.ranking.rankings import RankRequest

    request = RankRequest.from_words(metric or [], where, limit or [], fronts=fronts, quality=quality)
    _rank_fronts(sources, request, output, top, as_json=as_json)


def _rank_fronts(
    sources: dict[str, Results], request: RankRequest, output: Path | None, top: int | None, *, as_json: bool
) -> None:
    """Write or print the first fronts of all results together, and say what was ranked."""
    from explore.results.ranking.joint import first_of_each

    ranking, parts = _rank_sources(sources, request)
    columns = first_of_each({column.name: column for column in source.columns} for source in sources.values())
    shown_units = {name: column.unit for name, column in columns.items()}
    scales = first_of_each(source.scales for source in sources.values())
    table = with_units(with_labels(ranking.frame, columns.values()), scales)
    tell_designs(table, output, shown_units, as_json=False)
    if tell_designs(table.head(top) if top else table, None, shown_units, as_json=as_json):
        return
    _explain(ranking, parts, sources, request)
    if not ranking.frame.empty:
        swept = [name for name, column in columns.items() if column.role == "parameter"]
        _print_front(ranking, swept, shown_units, request, DEFAULT_LINES if top is None else top)


def _open(paths: list[Path], units: list[str] | None) -> dict[str, Results]:
    """Several results by name, in the units of the study of the first and of --units."""
    from explore.results.store.open_results import open_several

    opened = open_several(paths)
    chosen = units_of(next(iter(opened.values())), units)
    sources = {name: source.in_units(chosen) for name, source in opened.items()}
    for source in sources.values():
        if not source.is_complete:
            say(f"{source.path} is not finished: {source.n_committed:,} of {source.n_designs:,} designs", "yellow")
    return sources


def _rank_nearest(
    results: Results, count: int, where: str | None, limits: list[str], output: Path | None, *, as_json: bool
) -> None:
    """Print the designs nearest to feasible, and what each constraint excludes."""
    from explore.results.ranking.limits import parse_limits
    from explore.results.ranking.nearest import find_nearest

    with block_bar("measuring") as report_progress:
        nearness = find_nearest(
            results, count, where=where, limits=parse_limits(limits), report_progress=report_progress
        )
    table = with_units(with_labels(nearness.frame, results.columns), results.scales)
    if not tell_designs(table, output, results.units, as_json=as_json):
        print_nearest(results, nearness)


def _rank_sources(sources: dict[str, Results], request: RankRequest) -> tuple[Ranking, Mapping[str, Ranking]]:
    """The ranking of all results together, and that of each."""
    from explore.results.ranking.joint import other_constraints, rank_sources
    from explore.results.ranking.rankings import rank_source

    if len(sources) == 1:
        ((name, results),) = sources.items()
        with block_bar("ranking") as report_progress:
            ranking = rank_source(results, request, report_progress)
        return ranking, {name: ranking}
    with block_bar("ranking") as report_progress:
        joint = rank_sources(sources, request, report_progress)
    for caveat in (*joint.caveats, *other_constraints(sources)):
        say(caveat, "yellow")
    return joint.whole, joint.parts


def _explain(
    ranking: Ranking, parts: Mapping[str, Ranking], sources: Mapping[str, Results], request: RankRequest
) -> None:
    """Say what was ranked in each of the results, and how much of the joint Pareto set is from each."""
    for name, part in parts.items():
        explain_ranking(sources[name], part, f"{name}: " if len(parts) > 1 else "")
    if len(parts) > 1:
        best = ranking.frame[ranking.frame["front"] == 1]
        shares = ", ".join(f"{int((best['results'] == name).sum()):,} from {name}" for name in parts)
        say(f"together {count_of(len(best), 'design')} {is_or_are(len(best))} Pareto-optimal: {shares}", "bold")
    if request.quality and ranking.frame["hypervolume_share"].isna().any():
        say("hypervolume_share is left out: it takes too long for so many designs and objectives", "yellow")


def _print_front(
    ranking: Ranking, swept: Iterable[str], units: Mapping[str, str], request: RankRequest, top: int
) -> None:
    """Print a line for all designs with equal objectives, in the order of the ranking; `top` lines, 0 for all."""
    objectives = [objective.metric for objective in ranking.objectives]
    if ranking.order_by.metric not in objectives:
        objectives.insert(0, ranking.order_by.metric)
    parameters = [name for name in swept if name not in objectives]
    # Equal objectives are always in the same front, so it need not be grouped by.
    line = ranking.frame.groupby(objectives, sort=False, dropna=False).ngroup()
    n_lines = int(line.max()) + 1
    # Only the lines shown become groups: those of a hundred thousand designs take ten seconds.
    shown = ranking.frame[line < (top or n_lines)]
    shown.attrs = {}  # pandas would copy them with each column of each group
    groups = list(shown.groupby(objectives, sort=False, dropna=False))
    marks = ["front"] if request.fronts > 1 else []
    origins = ["results"] if "results" in ranking.frame else []
    qualities = list(QUALITY) if request.quality else []
    rows = [
        [str(group.index[0]), number(len(group)), *(number(group[name].iloc[0].item()) for name in marks),
         *(", ".join(dict.fromkeys(group[name])) for name in origins), *(_spread(group[name]) for name in parameters),
         *(number(float(group[name].iloc[0])) for name in objectives),
         *(number(group[name].iloc[0].item(), 3) for name in qualities)]
        for _, group in groups
    ]  # fmt: skip
    columns = [(name, "") for name in ("design", "alike", *marks, *origins)]
    columns += [*((name, units[name]) for name in (*parameters, *objectives)), *((name, "") for name in qualities)]
    hidden = n_lines - len(groups)
    caption = f"{count_of(hidden, 'more line')}: --top 0 prints all, -o FILE.csv writes them" if hidden else ""
    others = [name for name in objectives if name != ranking.order_by.metric]
    print_table(
        f"Pareto set, best {ranking.order_by.metric} first", columns, rows, caption,
        droppable=_constant_first(columns, rows, ["alike", *reversed(parameters), *reversed([*others, *qualities])]),
        hint="-o FILE.csv writes all",
    )  # fmt: skip


def _constant_first(columns: list[tuple[str, str]], rows: list[list[str]], names: list[str]) -> list[str]:
    """The names of columns, those with the same value in all rows first."""
    cells = {name: {row[place] for row in rows} for place, (name, _) in enumerate(columns)}
    return sorted(names, key=lambda name: len(cells[name]) > 1)


def _spread(values: pd.Series[float]) -> str:
    """One value, a few, or a range."""
    distinct = sorted(set(values.dropna())) or [math.nan]  # one of several results may lack a parameter
    if len(distinct) <= 3:
        return ", ".join(number(float(value)) for value in distinct)
    return f"{number(float(distinct[0]))} … {number(float(distinct[-1]))}"
