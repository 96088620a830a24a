"""`explore polish`: improve chosen designs in one objective by a local search."""

from pathlib import Path
from typing import Annotated

import typer

from explore.cli.options import JsonOption, ResultsArgument, objective_option, output_option
from explore.cli.output import announce_compiling, number
from explore.cli.paths import newest_results, refuse_overwriting
from explore.cli.progress import block_bar
from explore.cli.table_files import check_table, tell_designs, with_labels, with_units
from explore.cli.tables import print_table
from explore.cli.units import UnitsOption, open_shown


def polish(
    results: ResultsArgument = None,
    design: Annotated[
        list[int] | None,
        typer.Option(help="A feasible design to improve, several times for several; by default the best one."),
    ] = None,
    metric: Annotated[
        str | None,
        objective_option(
            help="What to improve: NAME, NAME:min or NAME:max; by default the first objective of the study."
        ),
    ] = None,
    units: UnitsOption = None,
    as_json: JsonOption = False,
    output: Annotated[
        Path | None, output_option(help="Also write the designs, as .csv, .json, .md or .parquet.")
    ] = None,
) -> None:
    """Improve designs in one objective as far as the constraints allow."""
    path = results or newest_results()
    refuse_overwriting(path, output, "the results file")
    check_table(output)
    import explore

    source = open_shown(path, units)
    announce_compiling()
    with block_bar("polishing"):  # how far a search has come is not known: the bar only moves
        found = explore.polish(source.declared, design, objective=metric)
    polished = source.show(found)
    table = with_units(with_labels(polished, source.columns), source.scales)
    if tell_designs(table, output, source.units, as_json=as_json):
        return
    name = (metric or source.objectives[0]).partition(":")[0]
    before = source.designs(polished.index)[name]
    swept = [column.name for column in source.columns if column.role == "parameter" and column.name != name]
    rows = [
        [str(number_of), number(float(old), 9), *(number(float(row[column]), 9) for column in (name, *swept))]
        for number_of, old, row in zip(polished.index, before, polished.to_dict(orient="records"), strict=True)
    ]
    shown = source.units
    columns = [
        ("from design", ""),
        (f"{name} before", shown[name]),
        *((column, shown[column]) for column in (name, *swept)),
    ]
    print_table(f"{name}, improved by a local search", columns, rows, droppable=swept[::-1])
