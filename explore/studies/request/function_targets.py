"""Read targets of the kind "function": the output angle as a function of the input angle."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

from explore.base.errors import Problems, RequestError
from explore.base.suggest import format_value
from explore.base.units.quantities import quantity
from explore.model.mechanism import Mechanism
from explore.model.targets import MOST_TARGET_POINTS, FunctionTarget
from explore.studies.request.target_entries import is_list, note_unknown_keys, read_rows
from explore.studies.request.target_files import FileColumn

_KEYS = ("kind", "table", "file")
#: Columns of a file of pairs.
_COLUMNS = (FileColumn("input", "deg"), FileColumn("output", "deg"))
#: Smallest number of pairs of a function.
_FEWEST = 3

_EXAMPLE = "[[0, 0], [30, 12], [60, 31]]"


def read_function_target(
    _: Mechanism, entries: Mapping[str, Any], problems: Problems, folder: Path = Path()
) -> FunctionTarget | None:
    """The function that a section describes; see `explore.studies.request.targets.read_target`."""
    before = len(problems)
    note_unknown_keys(entries, _KEYS, problems)
    rows, source = read_rows(entries, "table", _COLUMNS, folder, problems)
    table = _pairs(rows, source, problems) if source else ()
    return None if len(problems) > before else FunctionTarget(table)


def _pairs(value: object, source: str, problems: Problems) -> tuple[tuple[float, float], ...]:
    """The pairs of a table, deg; `source` is the key that has them."""
    if value is None:
        problems.append(((), f"the key 'table' is missing; give angles of input and output in deg as {_EXAMPLE}"))
        return ()
    if not is_list(value):
        problems.append(((source,), f"must be a list of pairs such as {_EXAMPLE}, got {format_value(value)}"))
        return ()
    if not _FEWEST <= len(value) <= MOST_TARGET_POINTS:
        few = f"a function has at least {_FEWEST}"
        reason = few if len(value) < _FEWEST else f"at most {MOST_TARGET_POINTS} are possible; thin it"
        problems.append(((source,), f"{len(value):,} pairs; {reason}"))
        return ()
    pairs: list[tuple[float, float]] = []
    for number, pair in enumerate(value):
        if not is_list(pair) or len(pair) != 2:
            problems.append(((source, number), f"pair {number + 1} must be [input, output], got {format_value(pair)}"))
            continue
        try:
            pairs.append((quantity(pair[0], "deg"), quantity(pair[1], "deg")))
        except RequestError as error:
            problems.append(((source, number), f"pair {number + 1}: {error}"))
    steps = [after[0] - before[0] for before, after in pairwise(pairs)]
    if len(pairs) == len(value) and not (all(step > 0.0 for step in steps) or all(step < 0.0 for step in steps)):
        problems.append(((source,), "the input angles must ascend, or descend, from pair to pair"))
    return tuple(pairs)
