"""`explore certify`: prove what results say of designs."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from explore.cli.options import JsonOption, ResultsArgument, output_option
from explore.cli.output import count_of, number, say
from explore.cli.paths import newest_results, refuse_overwriting
from explore.cli.progress import block_bar
from explore.cli.table_files import check_table, tell_designs
from explore.cli.tables import print_table
from explore.cli.termination import terminable
from explore.cli.units import UnitsOption, units_of
from explore.cli.workers import SchedulerOption, WorkerOptions

if TYPE_CHECKING:
    import pandas as pd

    from explore.analysis.certifying.certifiers import Certifiers
    from explore.results.store.results import Results

#: Colours of the verdicts, in the order in which the table lists them.
_VERDICTS = {"refuted": "red", "open": "yellow", "proved": "green"}
#: Number of lines of the table; -o and --json have all designs.
_N_LINES = 20


def certify(
    results: ResultsArgument = None,
    design: Annotated[
        list[int] | None,
        typer.Option(help="A design to certify, several times for several; by default the Pareto set of the study."),
    ] = None,
    units: UnitsOption = None,
    as_json: JsonOption = False,
    output: Annotated[
        Path | None, output_option(help="Also write verdicts and enclosures, as .csv, .json, .md or .parquet.")
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option(
            min=1, help="Number of processes if it takes longer than some seconds; default: one per processor."
        ),
    ] = None,
    scheduler: SchedulerOption = None,
) -> None:
    """Prove what results say of designs, in ball arithmetic: numbers, feasibility, and that none is dominated."""
    path = results or newest_results()
    refuse_overwriting(path, output, "the results file")
    check_table(output)
    import explore
    from explore.analysis.certifying.public import certify_on

    source = explore.open_results(path)
    shown = units_of(source, units)
    certifiers = _certifiers(WorkerOptions(workers, scheduler=scheduler))
    start = time.perf_counter()
    try:
        with terminable(), block_bar("certified", lines=True) as progress:
            certified = certify_on(certifiers, source, design, progress)
    except KeyboardInterrupt:
        say("interrupted; nothing was written")
        raise typer.Exit(130) from None
    seconds = time.perf_counter() - start
    if not tell_designs(certified, output, certified.attrs["units"], as_json=as_json):
        _print(certified, source.in_units(shown), seconds, is_front=design is None)
    if (certified["verdict"] != "proved").any():
        raise typer.Exit(1)


def _certifiers(work: WorkerOptions) -> Certifiers | None:
    """The workers of a scheduler, or processes of this machine."""
    from explore.analysis.certifying.certifiers import find_certifiers
    from explore.running.clusters import processors

    if work.scheduler is not None:
        return find_certifiers(scheduler=work.scheduler)
    return find_certifiers(workers=work.workers or processors())


def _print(certified: pd.DataFrame, source: Results, seconds: float, *, is_front: bool) -> None:
    """Print the counts, a line for each design, and what is refuted or open."""
    counts = {verdict: int((certified["verdict"] == verdict).sum()) for verdict in _VERDICTS}
    what = "of the Pareto set " if is_front else ""
    say(
        f"{count_of(len(certified), 'design')} {what}of {source.path}: {counts['proved']:,} proved, "
        f"{counts['open']:,} open, {counts['refuted']:,} refuted; in {seconds:.1f} s",
        data=True,
    )
    if is_front and counts["proved"] == len(certified):
        is_one = len(certified) == 1
        say(
            "it is feasible with room" if is_one else "each is feasible with room, and none dominates another",
            data=True,
        )
    order = certified["verdict"].map(list(_VERDICTS).index)
    lines = certified.loc[order.sort_values(kind="stable").index].head(_N_LINES)
    names = [text.partition(":")[0] for text in source.objectives]
    names = [name for name in names if f"{name}_lower" in certified]
    columns = [("design", ""), ("verdict", ""), ("bits", ""), *((name, source.units[name]) for name in names)]
    more = len(certified) - len(lines)
    print_table(
        "certified designs",
        columns,
        [
            [str(line), str(row["verdict"]), str(row["bits"]), *_values(row, names, source)]
            for line, row in _records(lines)
        ],
        f"and {count_of(more, 'design')} more; -o FILE.csv writes all" if more else "",
    )
    for line, row in _records(lines):
        if row["reason"]:
            say(f"design {line} is {row['verdict']}: {row['reason']}", _VERDICTS[row["verdict"]], data=True)


def _records(frame: pd.DataFrame) -> list[tuple[int, dict[str, Any]]]:
    """The rows by number."""
    rows = ({str(name): value for name, value in row.items()} for row in frame.to_dict(orient="records"))
    return list(zip(map(int, frame.index), rows, strict=True))


def _values(row: dict[str, Any], names: list[str], source: Results) -> list[str]:
    """The middles of enclosures in the shown units, with the digits of a double."""
    middles = {name: 0.5 * (row[f"{name}_lower"] + row[f"{name}_upper"]) for name in names}
    return [number(source.scales[name].show(middle), 15) for name, middle in middles.items()]
