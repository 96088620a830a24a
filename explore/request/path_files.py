"""Read the points of a path from a CSV file: x, y and perhaps crank angles, after a heading or without one."""

from __future__ import annotations

import csv
from pathlib import Path

from explore.errors import RequestError
from explore.model.targets import MOST_TARGET_POINTS
from explore.units.quantities import quantity

#: The columns in their order, their names in a heading, and their units.
_COLUMNS = (("x", "mm"), ("y", "mm"), ("crank_angle", "deg"))
#: Largest size of a file, bytes.
_LARGEST = 1 << 20


def read_path_file(path: Path) -> tuple[list[tuple[float, float]], list[float]]:
    """The points, mm, and the crank angles, deg; none of these where the file has two columns.

    Raises
    ------
    RequestError
        With the reason and the line, if the file cannot be read or a line is wrong.
    """
    try:
        if not path.is_file():
            raise RequestError(f"no such file: {path.absolute()}")
        if path.stat().st_size > _LARGEST:
            raise RequestError(f"larger than 1 MB; a path has at most {MOST_TARGET_POINTS} points: thin it")
        # utf-8-sig: spreadsheet programs write a byte-order mark.
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise RequestError("is not UTF-8 text; save it as CSV in UTF-8") from None
    except (OSError, ValueError) as error:
        if isinstance(error, RequestError):
            raise
        raise RequestError(f"cannot be read: {error}") from None
    lines = [(number, line) for number, line in enumerate(text.splitlines(), 1) if line.strip(" ,;\t")]
    separator = next((mark for mark in (";", ",", "\t") if lines and mark in lines[0][1]), ",")
    rows = [(number, _cells(line, separator)) for number, line in lines]
    if rows and not _is_number(rows[0][1][0]):
        rows = rows[1:]
    widths = {len(cells) for _, cells in rows}
    if not rows or len(widths) > 1 or not widths <= {2, 3}:
        raise RequestError("must have two or three columns: x, y and perhaps crank_angle, in each line")
    values = [[_read(number, cells[k], *_COLUMNS[k]) for k in range(len(cells))] for number, cells in rows]
    return [(row[0], row[1]) for row in values], [row[2] for row in values if len(row) > 2]


def _cells(line: str, separator: str) -> list[str]:
    return [cell.strip() for cell in next(csv.reader([line], delimiter=separator))]


def _is_number(cell: str) -> bool:
    return cell[:1].isdigit() or cell[:1] in ("-", "+", ".")


def _read(line: int, cell: str, name: str, unit: str) -> float:
    try:
        return quantity(float(cell) if _is_plain(cell) else cell, unit)
    except RequestError as error:
        raise RequestError(f"line {line}: {name}: {error}") from None


def _is_plain(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True
