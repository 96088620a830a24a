"""`explore show`: print the contents of a results file, or one design of it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from explore.cli.options import JsonOption, ResultsArgument
from explore.cli.output import number, print_json, say, shown_unit
from explore.cli.paths import newest_results
from explore.cli.tables import print_table

if TYPE_CHECKING:
    from explore.store.results import Results


def show(
    results: ResultsArgument = None,
    design: Annotated[int | None, typer.Option(help="Show the design with this number.")] = None,
    as_json: JsonOption = False,
) -> None:
    """Show the contents of a results file, or one design in full."""
    from explore import open_results

    opened = open_results(results or newest_results())
    if design is None:
        _show_results(opened, as_json=as_json)
    else:
        _show_design(opened, design, as_json=as_json)


def _show_results(results: Results, *, as_json: bool) -> None:
    sentences = results.status_sentences
    if as_json:
        print_json(
            {
                "path": str(results.path),
                "complete": results.is_complete,
                "packed": results.is_packed,
                "keep": results.keep,
                "studied": results.n_studied,
                "designs": results.n_designs,
                "committed": results.n_committed,
                "counts": results.counts,
                "units": results.units,
                "attributes": {key: value for key, value in results.attributes.items() if key != "determines"},
            }
        )
        return
    state = "complete" if results.is_complete else f"not finished, {results.n_committed:,} designs so far"
    state += ", packed" if results.is_packed else ""
    say(
        f"{results.path}: {results.mechanism or 'unknown mechanism'}, {results.n_studied:,} designs, {state}", data=True
    )
    if results.keep != "all":
        say(f"{results.n_designs:,} of {results.n_studied:,} designs were kept, the Pareto-optimal ones", data=True)
    if not results.is_complete:
        command = "refine" if results.attributes.get("sampler") == "refinement" else "sweep"
        say(f"run its `explore {command}` again to continue", data=True)
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


def _show_design(results: Results, design: int, *, as_json: bool) -> None:
    """Print all columns of a design, with its status in words."""
    row = results.design(design)
    sentences = results.status_sentences
    labelled: dict[str, Any] = {
        column.name: column.labels.get(int(row[column.name]), row[column.name]) if column.labels else row[column.name]
        for column in results.columns
    }
    status = str(labelled["status"])
    if as_json:
        print_json({**labelled, "status_label": status, "status_sentence": sentences.get(status, "")})
        return
    print_table(
        f"design {design} of {results.path}",
        [("column", ""), ("value", ""), ("unit", ""), ("meaning", "")],
        [
            [column.name, number(labelled[column.name], 10), shown_unit(column.unit), column.long_name]
            for column in results.columns
            if column.role != "index"
        ],
        droppable=["meaning", "unit"],
    )
    say(f"{status}: {sentences.get(status, '')}", "bold", data=True)
