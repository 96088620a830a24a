"""Parts of the section [target] of a study: its point, lists of numbers and of places."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeGuard

from explore.base.errors import Problems, RequestError
from explore.base.suggest import format_value, suggestion
from explore.base.units.quantities import quantity
from explore.model.mechanism import Mechanism
from explore.studies.request.target_files import FileColumn, read_target_file


def note_unknown_keys(entries: Mapping[str, Any], known: Sequence[str], problems: Problems) -> None:
    """Note the keys that a kind of target does not have."""
    problems += [((key,), f"unknown key; {suggestion(str(key), known)}") for key in entries if key not in known]


def read_point(mechanism: Mechanism, name: object, problems: Problems) -> str:
    """The point that is to meet the target."""
    points = mechanism.points
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
    """Numbers of a list, in a unit."""
    if not is_list(value):
        problems.append(((key,), f"must be a list of numbers, got {format_value(value)}"))
        return ()
    numbers: list[float] = []
    for position, entry in enumerate(value):
        try:
            numbers.append(quantity(entry, unit))
        except RequestError as error:
            problems.append(((key, position), str(error)))
    return tuple(numbers)


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


def is_list(value: Any) -> TypeGuard[Sequence[Any]]:
    """Whether an entry of a file is a list."""
    return isinstance(value, Sequence) and not isinstance(value, str)
