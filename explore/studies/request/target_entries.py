"""Parts of the section [target] of a study: its point, lists of numbers and of places."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeGuard

from explore.base.entries import read_number
from explore.base.errors import Problems, RequestError
from explore.base.suggest import format_value, suggestion
from explore.base.units.quantities import quantity
from explore.model.mechanism import Mechanism
from explore.model.targets import MOST_TARGET_POINTS
from explore.studies.request.target_files import FileColumn, read_target_file

#: Largest number of a row, whose square is far from the largest double.
_MOST = 1e12


def read_point(mechanism: Mechanism, kind: str, name: object, problems: Problems) -> str:
    """The point that is to meet a target of a kind."""
    points = mechanism.targets[kind].points or mechanism.points
    if not points:
        reason = "the mechanism has no point to follow it; give it one, [points] M = { along = 120, across = 40 }"
        problems.append(((), reason))
    elif name is None and len(points) == 1:
        return points[0]
    elif name is None:
        problems.append(((), f"which point follows it? Write point = {' or '.join(map(repr, points))}"))
    elif name not in points:
        problems.append((("point",), f"unknown point {format_value(name)}; {suggestion(str(name), points)}"))
    return str(name)


def read_numbers(key: str, value: object, unit: str, problems: Problems) -> tuple[float, ...]:
    """Numbers of a list, in a unit; none after a mistake."""
    if not is_list(value):
        problems.append(((key,), f"must be a list of numbers, got {format_value(value)}"))
        return ()
    read = [read_number(entry, unit, (key, position), problems) for position, entry in enumerate(value)]
    numbers = tuple(number for number in read if number is not None)
    return numbers if len(numbers) == len(read) else ()


def read_rows(
    entries: Mapping[str, Any], key: str, columns: Sequence[FileColumn], folder: Path, problems: Problems
) -> tuple[Any, str]:
    """The rows of a key or of the file in place of it, and which of the two it was.

    They are None, and the name is empty, after a problem of the file.
    """
    if "file" not in entries:
        return entries.get(key), key
    reason = f"'{key}' and 'file' are given; leave out one of the two"
    if key not in entries:
        try:
            return read_target_file(folder, entries["file"], columns), "file"
        except RequestError as error:
            reason = str(error)
    problems.append((("file",), reason))
    return None, ""


@dataclass(frozen=True)
class RowKind:
    """Rows of a target: their key, what one of them is called, their columns, the smallest number, and an example."""

    key: str
    noun: str
    columns: tuple[FileColumn, ...]
    fewest: int
    example: str


def read_number_rows(
    entries: Mapping[str, Any], kind: RowKind, folder: Path, problems: Problems, most: int = MOST_TARGET_POINTS
) -> tuple[tuple[float, ...], ...]:
    """The numbers of the rows of a key or of a file, in the units of the columns; a row with a mistake is empty.

    The rows of a file may also have an optional column.
    """
    value, source = read_rows(entries, kind.key, kind.columns, folder, problems)
    if not source:
        return ()
    rows = f"{kind.noun}s"
    if value is None:
        problems.append(((), f"the key '{kind.key}' is missing; give {rows} as {kind.example}"))
    elif not is_list(value):
        problems.append(((source,), f"must be a list of {rows} such as {kind.example}, got {format_value(value)}"))
    elif not kind.fewest <= len(value) <= most:
        few = f"give {kind.fewest} or more"
        advice = few if len(value) < kind.fewest else f"at most {most} are possible; thin them"
        count = f"1 {kind.noun}" if len(value) == 1 else f"{len(value):,} {rows}"
        problems.append(((source,), f"{count}; {advice}"))
    else:
        found = [
            tuple(row) if source == "file" else _read_row(row, number, kind, problems)
            for number, row in enumerate(value)
        ]
        far = [number for number, row in enumerate(found) if any(abs(entry) > _MOST for entry in row)]
        problems += [((source,), f"{kind.noun} {number + 1} is too far away: at most {_MOST:g}") for number in far]
        return tuple(found)
    return ()


def _read_row(row: object, number: int, kind: RowKind, problems: Problems) -> tuple[float, ...]:
    """The numbers of a row; none after a mistake."""
    columns = [column for column in kind.columns if not column.is_optional]
    words = f"{kind.noun} {number + 1}"
    if not is_list(row) or len(row) != len(columns):
        names = ", ".join(column.name for column in columns)
        problems.append(((kind.key, number), f"{words} must be [{names}], got {format_value(row)}"))
        return ()
    try:
        return tuple(quantity(entry, column.unit) for entry, column in zip(row, columns, strict=True))
    except RequestError as error:
        problems.append(((kind.key, number), f"{words}: {error}"))
        return ()


def is_list(value: Any) -> TypeGuard[Sequence[Any]]:
    """Whether an entry of a file is a list."""
    return isinstance(value, Sequence) and not isinstance(value, str)
