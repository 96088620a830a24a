"""The points of a path in a task: from the task itself, or from a table of a program in which the path was drawn."""

from __future__ import annotations

import csv
import math
from pathlib import Path
from typing import Any

import numpy as np

from explore.errors import RequestError
from explore.model.quantities import FloatArray
from explore.model.targets import MOST_TARGET_POINTS
from explore.suggest import format_value
from explore.synthesis.linkages import ComplexArray

#: Largest table, in bytes.
_LARGEST_FILE = 1 << 24


def reason_against(points: ComplexArray, *, is_closed: bool) -> str:
    """What is wrong with points as a path; empty if nothing is."""
    if is_closed and points[0] == points[-1]:
        return f"points 1 and {len(points)} are equal; leave out the last: a closed path returns to the first by itself"
    equal = np.flatnonzero(points[1:] == points[:-1])
    return f"points {equal[0] + 1} and {equal[0] + 2} are equal; remove one" if len(equal) else ""


def read_path_table(folder: Path, file: Any) -> FloatArray:
    """The rows of a table of two or three columns of numbers; a first line of words names the columns.

    Commas, semicolons or tabs separate them, decimals may have a comma beside semicolons and tabs, and lines that
    begin with # are comments.

    Raises
    ------
    RequestError
        With the reason alone, or after the file and the line.
    """
    lines = _lines(folder, file)
    delimiter = next((mark for mark in (";", "\t") if mark in lines[0][1]), ",")
    rows: list[list[float]] = []
    for number, line in lines:
        cells = [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter))]
        values = [_number(cell if delimiter == "," else cell.replace(",", ".")) for cell in cells]
        if number == lines[0][0] and all(value is None for value in values):
            continue  # names of the columns
        row = [value for value in values if value is not None]
        if len(row) < len(values):
            wrong = next(cell for cell, value in zip(cells, values, strict=True) if value is None)
            raise RequestError(f"{file}:{number}: {format_value(wrong)} is not a number")
        if len(row) not in (2, 3) or (rows and len(row) != len(rows[0])):
            raise RequestError(f"{file}:{number}: has {len(row)} numbers; write x,y or x,y,crank_angle in every line")
        rows.append(row)
    if not rows:
        raise RequestError(f"{file} has no points; write a line x,y for each")
    if len(rows) > MOST_TARGET_POINTS:
        every = -(-len(rows) // MOST_TARGET_POINTS)
        raise RequestError(
            f"{file} has {len(rows):,} points, but a path has at most {MOST_TARGET_POINTS}; keep every {every:,}th"
        )
    return np.array(rows)


def _lines(folder: Path, file: Any) -> list[tuple[int, str]]:
    """The lines of a text file that are not blank or comments, with their numbers."""
    if not isinstance(file, str):
        raise RequestError(f"must be a string in quotes, got {format_value(file)}")
    path = folder / file
    try:
        is_file, size = path.is_file(), path.stat().st_size
        text = path.read_text(encoding="utf-8-sig") if is_file and size <= _LARGEST_FILE else ""
    except FileNotFoundError:
        raise RequestError(f"no such file: {path.absolute()}") from None
    except UnicodeDecodeError:
        raise RequestError(f"{file} is not UTF-8 text; save it as CSV in UTF-8") from None
    except OSError as error:
        raise RequestError(f"{file} cannot be read: {error.strerror}") from None
    except ValueError:
        raise RequestError("is not a valid file name") from None
    if not is_file:
        raise RequestError(f"{file} is not a file")
    if size > _LARGEST_FILE:
        raise RequestError(f"{file} has {size:,} bytes, but a path has at most {MOST_TARGET_POINTS} points; thin it")
    lines = [(n, line) for n, line in enumerate(text.splitlines(), 1) if line.strip() and not line.startswith("#")]
    if not lines:
        raise RequestError(f"{file} is empty; write a line x,y for each point")
    return lines


def _number(cell: str) -> float | None:
    """A finite number, or None."""
    try:
        value = float(cell)
    except ValueError:
        return None
    return value if math.isfinite(value) else None
