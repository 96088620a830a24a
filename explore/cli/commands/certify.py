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
from explore.cli.units import UnitsOption, units_of

if TYPE_CHECKING:
    import pandas as pd

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
) -> None:
    """Prove what results say of designs, in ball arithmetic: numbers, feasibility, and that none is dominated."""
    path = results or newest_results()
    refuse_overwriting(path, output, "the results file")
    check_table(output)
    import explore

    source = explore.open_results(path)
    shown = units_of(source, units)
    start = time.perf_counter()
    with block_bar("certifying") as progress:
        certified = explore.certify(source, design, report_progress=progress)
    seconds = time.perf_counter() - start
    if not tell_designs(certified, output, certified.attrs["units"], as_json=as_json):
        _print(certified, source.in_units(shown), seconds, is_front=design is None)
    if (certified["verdict"] != "proved").any():
        raise typer.Exit(1)


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
