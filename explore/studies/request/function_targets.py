"""Read targets of the kind "function": the output angle as a function of the input angle."""

from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

from explore.base.errors import Problems
from explore.model.mechanism import Mechanism
from explore.model.targets import FunctionTarget
from explore.studies.request.target_entries import RowKind, note_unknown_keys, read_number_rows
from explore.studies.request.target_files import FileColumn

_KEYS = ("kind", "table", "file")
_PAIRS = RowKind(
    "table",
    "pair",
    (FileColumn("input", "deg"), FileColumn("output", "deg")),
    fewest=3,
    example="[[0, 0], [30, 12], [60, 31]]",
)


def read_function_target(
    _: Mechanism, entries: Mapping[str, Any], problems: Problems, folder: Path = Path()
) -> FunctionTarget | None:
    """The function that a section describes; see `explore.studies.request.targets.read_target`."""
    before = len(problems)
    note_unknown_keys(entries, _KEYS, problems)
    table = [(row[0], row[1]) for row in read_number_rows(entries, _PAIRS, folder, problems) if row]
    if len(problems) > before:
        return None
    steps = [after[0] - previous[0] for previous, after in pairwise(table)]
    if not (all(step > 0.0 for step in steps) or all(step < 0.0 for step in steps)):
        key = "file" if "file" in entries else "table"
        problems.append(((key,), "the input angles must ascend, or descend, from pair to pair"))
        return None
    return FunctionTarget(tuple(table))
