"""`explore show`: a results file, or one design of it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from explore.cli.output import newest_results, number, print_json, print_table, say, shown_unit


def show_results(path: Path | None, *, as_json: bool) -> None:
    """Print what a results file holds."""
    from explore.store.opening import open_results

    results = open_results(path or newest_results())
    sentences = json.loads(str(results.attributes.get("status_sentences", "{}")))
    if as_json:
        print_json(
            {
                "path": str(results.path),
                "complete": results.complete,
                "packed": results.packed,
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
    state = "complete" if results.complete else f"not finished, {results.n_committed:,} designs so far"
    state += ", packed" if results.packed else ""
    say(f"{results.path}: {results.attributes.get('mechanism')}, {results.n_studied:,} designs, {state}", data=True)
    if results.keep != "all":
        say(f"{results.n_designs:,} of {results.n_studied:,} designs were kept, the Pareto-optimal ones", data=True)
    counts = results.counts
    if not results.complete:
        say("to go on with it, run its `explore sweep` again", data=True)
    print_table(
        "designs by status",
        [("status", ""), ("designs", ""), ("meaning", "")],
        [[label, f"{count:,}", sentences.get(label, "")] for label, count in counts.items()],
    )
    print_table(
        "columns",
        [("column", ""), ("unit", ""), ("meaning", "")],
        [[column.name, shown_unit(column.unit), column.long_name] for column in results.columns],
    )


def show_design(path: Path | None, design: int, *, as_json: bool) -> None:
    """Print one design in full: parameters, metrics, margins, status in words."""
    from explore.store.opening import open_results

    results = open_results(path or newest_results())
    row = results.design(design)
    sentences = json.loads(str(results.attributes.get("status_sentences", "{}")))
    labelled: dict[str, Any] = {
        column.name: column.labels.get(int(row[column.name]), row[column.name]) if column.labels else row[column.name]
        for column in results.columns
    }
    status = str(labelled["status"])
    if as_json:
        print_json({**labelled, "status_sentence": sentences.get(status, "")})
        return
    print_table(
        f"design {design} of {results.path}",
        [("", ""), ("value", ""), ("unit", ""), ("", "")],
        [
            [
                column.name,
                number(labelled[column.name], 10),
                shown_unit(column.unit),
                column.long_name,
            ]
            for column in results.columns
            if column.role != "index"
        ],
    )
    say(f"{status}: {sentences.get(status, '')}", "bold", data=True)
