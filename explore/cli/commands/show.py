"""`explore show`: print the contents of a results file, or some designs of it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from explore.base.errors import RequestError
from explore.cli.options import JsonOption, ResultsArgument, output_option
from explore.cli.output import count_of, number, print_json, say, shown_unit
from explore.cli.paths import check_output, newest_results, refuse_overwriting
from explore.cli.side_by_side import design_table, print_designs, print_json_designs
from explore.cli.table_files import write_table
from explore.cli.tables import print_table
from explore.cli.units import UnitsOption, open_shown
from explore.results.records import Record, label_record, with_status

if TYPE_CHECKING:
    from explore.results.store.results import Results

#: Formats of a table with numbers and words in one column, which Parquet does not hold.
_ENDINGS = (".csv", ".json", ".md")
#: Command that continues unfinished results, by how their designs were chosen; `sweep` for others.
_COMMANDS = {"refinement": "refine", "tolerances": "tolerance", "synthesis": "synthesize"}


def show(
    results: ResultsArgument = None,
    design: Annotated[
        list[int] | None,
        typer.Option(help="Show the design with this number; several times for several side by side."),
    ] = None,
    units: UnitsOption = None,
    as_json: JsonOption = False,
    output: Annotated[Path | None, output_option(help="Also write the designs, as .csv, .json or .md.")] = None,
) -> None:
    """Show the contents of a results file, one design in full, or several with their differences."""
    path = results or newest_results()
    refuse_overwriting(path, output, "the results file")
    check_output(output, _ENDINGS)
    opened = open_shown(path, units)
    if not design:
        if output is not None:
            raise RequestError(f"-o {output}: there is no design to write; name one with --design")
        _show_results(opened, as_json=as_json)
        return
    _show_designs(opened, design, output, as_json=as_json)


def _command_of(results: Results) -> str:
    """The command that continues results."""
    from explore.studies.config.study_file import atlas_text

    if results.config == atlas_text(results.n_studied):
        return f"atlas --count {results.n_studied}"
    return _COMMANDS.get(str(results.attributes.get("sampler")), "sweep")


def _show_results(results: Results, *, as_json: bool) -> None:
    from explore.results.records import summarise

    sentences = results.status_sentences
    if as_json:
        print_json({"path": str(results.path), **summarise(results)})
        return
    state = "complete" if results.is_complete else f"not finished, {results.n_committed:,} designs so far"
    state += ", packed" if results.is_packed else ""
    designs = count_of(results.n_studied, "design")
    say(f"{results.path}: {results.mechanism or 'unknown mechanism'}, {designs}, {state}", data=True)
    if results.keep != "all":
        say(f"{results.n_designs:,} of {results.n_studied:,} designs were kept, the Pareto-optimal ones", data=True)
    if not results.is_complete:
        say(f"run its `explore {_command_of(results)}` again to continue", data=True)
    print_table(
        "designs by status",
        [("status", ""), ("designs", ""), ("meaning", "")],
        [[label, f"{count:,}", sentences.get(label, "")] for label, count in results.counts.items()],
    )
    print_table(
        "columns",
        [("column", ""), ("unit", ""), ("meaning", "")],
        [[column.name, shown_unit(column.unit), column.long_name] for column in results.columns],
    )


def _show_designs(results: Results, numbers: list[int], output: Path | None, *, as_json: bool) -> None:
    """Print all columns of designs, with their status in words."""
    repeated = next((number_of for number_of in numbers if numbers.count(number_of) > 1), None)
    if repeated is not None:
        raise RequestError(f"--design {repeated} is named twice; name each design once")
    records = [label_record(results, results.design(number_of)) for number_of in numbers]
    if output is not None:
        write_table(design_table(results, records), output, {})
        say(f"wrote {count_of(len(records), 'design')} to {output}")
    if len(records) > 1:
        (print_json_designs if as_json else print_designs)(results, records)
    else:
        _show_design(results, records[0], as_json=as_json)


def _show_design(results: Results, record: Record, *, as_json: bool) -> None:
    """Print all columns of a design, with its status in words."""
    if as_json:
        print_json(with_status(results, record))
        return
    status, sentences = str(record["status"]), results.status_sentences
    print_table(
        f"design {record['design']} of {results.path}",
        [("column", ""), ("value", ""), ("unit", ""), ("meaning", "")],
        [
            [column.name, number(record[column.name], 10), shown_unit(column.unit), column.long_name]
            for column in results.columns
            if column.role != "index"
        ],
        droppable=["meaning", "unit"],
    )
    say(f"{status}: {sentences.get(status, '')}", "bold", data=True)
    for column in results.columns:
        word = str(record[column.name])
        if column.labels and column.name != "status" and word in results.label_sentences:
            say(f"{word}: {results.label_sentences[word]}", data=True)
