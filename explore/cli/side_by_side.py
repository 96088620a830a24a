"""Designs of results side by side, with their differences from the first."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from explore.cli.output import number, print_json, say, shown_unit
from explore.cli.tables import print_table
from explore.results.records import Record, with_status

if TYPE_CHECKING:
    import pandas as pd

    from explore.model.columns import Column
    from explore.results.store.results import Results

#: Roles of the columns whose differences mean something.
_COMPARED_ROLES = ("parameter", "metric", "margin")


def print_designs(results: Results, records: Sequence[Record]) -> None:
    """Print designs as columns of a table, and after each but the first its differences from that."""
    first, *others = records
    differences = [_differences(results.columns, first, other) for other in others]
    columns = [("column", ""), ("unit", ""), (str(first["design"]), "")]
    for other in others:
        name = str(other["design"])
        columns += [(name, ""), (f"Δ {name}", ""), (f"Δ% {name}", "")]
    rows = []
    for column in results.columns:
        if column.role == "index":
            continue
        row = [column.name, shown_unit(column.unit), number(first[column.name])]
        for other, by_column in zip(others, differences, strict=True):
            absolute, relative = by_column.get(column.name, ("", ""))
            row += [number(other[column.name]), _signed(absolute), _signed(relative, 100.0)]
        rows.append(row)
    names = [name for name, _ in columns]
    absolute_names, relative_names = names[4::3], names[5::3]
    print_table(
        f"designs of {results.path}, Δ and Δ% from design {first['design']}",
        columns,
        rows,
        # The unit goes last: a length without it may be read in another.
        droppable=[*absolute_names[::-1], *relative_names[::-1], *names[3::3][::-1], "unit"],
        hint="-o FILE.csv writes all",
    )
    sentences = results.status_sentences
    for record in records:
        status = str(record["status"])
        say(f"{record['design']}: {status}: {sentences.get(status, '')}", "bold", data=True)


def print_json_designs(results: Results, records: Sequence[Record]) -> None:
    """Print the designs as `explore show` prints one, and the differences of the others from the first."""
    from explore.base.units.shown import headings

    first, *others = records
    names = headings(results.scales, results.units)
    differences = []
    for other in others:
        by_column = _differences(results.columns, first, other)
        differences.append({
            "design": other["design"],
            "from": first["design"],
            "absolute": {names.get(name, name): absolute for name, (absolute, _) in by_column.items()},
            "relative": {names.get(name, name): relative for name, (_, relative) in by_column.items()},
        })  # fmt: skip
    print_json({"designs": [with_status(results, record) for record in records], "differences": differences})


def design_table(results: Results, records: Sequence[Record]) -> pd.DataFrame:
    """A row for each column of the results, with its unit, its value in each design and the differences."""
    import pandas as pd

    first, *others = records
    names = [column.name for column in results.columns if column.role != "index"]
    units = results.units
    table: dict[str, list[Any]] = {
        "unit": [units[name] for name in names],
        str(first["design"]): [first[name] for name in names],
    }
    for other in others:
        by_column = _differences(results.columns, first, other)
        table[str(other["design"])] = [other[name] for name in names]
        for place, kind in enumerate(("difference", "relative difference")):
            table[f"{kind} of {other['design']}"] = [by_column.get(name, (None, None))[place] for name in names]
    return pd.DataFrame(table, index=pd.Index(names, name="column"), dtype=object)


def _differences(columns: Sequence[Column], first: Record, other: Record) -> dict[str, tuple[float, float]]:
    """The difference from the first design and that over the first's value, by column of numbers."""
    differences = {}
    for column in columns:
        value, reference = other[column.name], first[column.name]
        if column.role not in _COMPARED_ROLES or column.labels:
            continue
        absolute = float(value) - float(reference)
        differences[column.name] = (absolute, _ratio(absolute, float(reference)))
    return differences


def _ratio(absolute: float, reference: float) -> float:
    """A difference over a value's size; 0 for none at all, NaN from zero."""
    if absolute == 0.0:
        return 0.0
    return absolute / abs(reference) if reference else math.nan


def _signed(value: float | str, factor: float = 1.0) -> str:
    """A difference as a table shows it: with its sign, and nothing where there is none to take."""
    if isinstance(value, str):
        return value
    text = number(value * factor, 4)
    return f"+{text}" if value > 0.0 else text
