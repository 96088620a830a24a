"""A table of designs, CSV, becomes columns of numbers, or a list of what is wrong in which line."""

from __future__ import annotations

import csv
import itertools
import re
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

import numpy as np

from explore.config.axes import read_value
from explore.config.toml_text import one_line
from explore.errors import ConfigError, RequestError
from explore.suggest import closest, suggestion
from explore.vocabulary import FloatArray, Mechanism, Parameter

if TYPE_CHECKING:
    from _csv import Reader

#: The columns are held in memory.
MOST_ROWS = 10**7
_MOST_PROBLEMS = 20
# Few enough that a file with a mistake in every cell is given up soon.
_ROWS_AT_A_TIME = 4096
_BREAK = re.compile(r"[\r\n]")


def read_table(folder: Path, file: str, mechanism: Mechanism, given: Collection[str]) -> dict[str, FloatArray]:
    """Columns of a table of designs.

    Parameters
    ----------
    folder
        Where a relative name starts.
    file
        The name as written: a CSV file, UTF-8, whose first line names parameters.
    mechanism
        Whose parameters.
    given
        The parameters that have a value elsewhere and are no columns.

    Returns
    -------
    dict
        In declared order, for each column its values in the declared unit, shape (rows,).

    Raises
    ------
    RequestError
        The file as a whole cannot be used: the reason alone.
    ConfigError
        One line ``file:line: column: reason; advice`` for each problem in the file, up to a limit.
    """
    path = folder / file
    try:
        if "\0" in file:
            raise RequestError("is not a file name")
        if path.is_dir():
            raise RequestError("is a folder, not a table")
        if path.exists() and not path.is_file():
            raise RequestError("is not a plain file")
        # utf-8-sig: spreadsheet programs begin a file with a byte-order mark.
        with path.open(encoding="utf-8-sig", newline="") as stream:
            return _Table(one_line(file), mechanism, given).columns(stream)
    except FileNotFoundError:
        raise RequestError(f"no such file: {one_line(str(path))}; a name starts at the study file's folder") from None
    except UnicodeDecodeError:
        raise RequestError("is not a UTF-8 text; save it as CSV in UTF-8") from None
    except OSError as error:
        raise RequestError(f"cannot be read: {error.strerror}") from None


class _Table:
    """Reads one file."""

    def __init__(self, file: str, mechanism: Mechanism, given: Collection[str]) -> None:
        self.file = file
        self.parameters = {parameter.name: parameter for parameter in (*mechanism.geometry, mechanism.speed)}
        self.required = [parameter.name for parameter in mechanism.parameters if parameter.default is None]
        self.given = given
        # Line, position in the line (0 for the line itself) and text of each.
        self.problems: list[tuple[int, int, str]] = []
        self.given_up = False

    def note(self, line: int, reason: str, position: int = 0) -> None:
        self.problems.append((line, position, reason))

    def columns(self, stream: TextIO) -> dict[str, FloatArray]:
        reader = csv.reader(stream, strict=True)
        try:
            names = next((row for row in reader if not _blank(row)), [])
            header = self.header(reader.line_num if names else 1, [name.strip() for name in names])
            pieces = self.pieces(reader, header) if any(header) else {}
        except csv.Error as error:
            self.note(reader.line_num, f"not CSV: {error}; is a quotation mark left open, or a cell not closed?")
        if self.problems:
            raise self.error()
        return {name: np.concatenate(pieces[name]) for name in self.parameters if name in pieces}

    def header(self, line: int, names: list[str]) -> list[Parameter | None]:
        """The parameter of each column; None where it is none."""
        if not names:
            self.note(line, f"is empty; begin with a line of names, such as {','.join(self.required)}")
        elif not any(name in self.parameters for name in names) and _no_header(names):
            self.note(line, _no_header(names))
        else:
            for position, name in enumerate(names, 1):
                reason = self.wrong_name(name, names.index(name) < position - 1)
                if reason:
                    self.note(line, f"{one_line(name[:40]) or f'column {position}'}: {reason}", position)
            meant = {closest(name, self.parameters) for name in names}
            missing = [name for name in self.required if name not in self.given and name not in meant]
            if missing:
                self.note(line, f"missing {', '.join(missing)}; add a column, or one value for all in [parameters]")
        return [self.parameters.get(name) for name in names]

    def wrong_name(self, name: str, again: bool) -> str:
        """What is wrong with the name of a column; empty when nothing is."""
        if not name:
            return "has no name; name it, or remove the column"
        if name not in self.parameters:
            return f"unknown parameter; {suggestion(name, self.parameters)}"
        if again:
            return "the column occurs twice; remove one"
        if name in self.given:
            return "is in [parameters] as well; remove it there, or the column here"
        return ""

    def pieces(self, reader: Reader, header: list[Parameter | None]) -> dict[str, list[FloatArray]]:
        """Values of each column, some thousand rows at a time; reading ends early when too much is wrong."""
        pieces: dict[str, list[FloatArray]] = {parameter.name: [] for parameter in header if parameter}
        read = 0
        before = reader.line_num
        while rows := list(itertools.islice(reader, _ROWS_AT_A_TIME)):
            lines: Sequence[int] = range(before + 1, reader.line_num + 1)
            if len(lines) > len(rows):
                index = next(index for index, row in enumerate(rows) if _BREAK.search("".join(row)))
                self.note(lines[index], "a cell goes on in the next line; is a quotation mark left open?")
                return pieces
            if set(map(len, rows)) != {len(header)}:
                rows, lines = self.complete(rows, lines, len(header))
            read += len(rows)
            if read > MOST_ROWS:
                raise RequestError(f"has more than {MOST_ROWS} rows, the most that a table may have; split it")
            for position, cells in enumerate(zip(*rows, strict=True)):
                parameter = header[position]
                if parameter:
                    pieces[parameter.name].append(self.values(parameter, cells, lines, position + 1))
            before = reader.line_num
            if len(self.problems) > _MOST_PROBLEMS:
                self.given_up = next(reader, None) is not None
                return pieces
        if not read and not self.problems:
            self.note(1, "has no designs; add a line of values below the names")
        return pieces

    def complete(
        self, rows: list[list[str]], lines: Sequence[int], width: int
    ) -> tuple[list[list[str]], Sequence[int]]:
        """The rows that have a cell for each column, and their lines."""
        kept = []
        for line, row in zip(lines, rows, strict=True):
            if len(row) == width:
                kept.append((line, row))
            elif not _blank(row):
                cells = f"{len(row)} cell{'s' if len(row) > 1 else ''}"
                self.note(line, f"has {cells} where the first line has {width}; write one for each column")
        return [row for _, row in kept], [line for line, _ in kept]

    def values(self, parameter: Parameter, cells: tuple[str, ...], lines: Sequence[int], position: int) -> FloatArray:
        """The values of cells; NaN where one is wrong."""
        try:
            values = np.fromiter(map(float, cells), np.float64, len(cells))
        except ValueError:
            values = np.full(len(cells), np.nan)
        if parameter.allows(values).all():
            return values
        known: dict[str, float | str] = {}  # a unit takes a while to read, and a column often repeats itself
        for index, (cell, line) in enumerate(zip(cells, lines, strict=True)):
            if cell not in known:
                known[cell] = _value(parameter, cell)
            value = known[cell]
            if isinstance(value, str):
                self.note(line, f"{parameter.name}: {value}", position)
            else:
                values[index] = value
        return values

    def error(self) -> ConfigError:
        """The first problems, and how many there are more."""
        found = sorted(self.problems)
        lines = [f"{self.file}:{line}: {reason}" for line, _, reason in found[:_MOST_PROBLEMS]]
        if len(found) > _MOST_PROBLEMS:
            least = "at least " if self.given_up else ""
            lines.append(f"{self.file}: and {least}{len(found) - _MOST_PROBLEMS} more")
        return ConfigError(lines)


def _blank(row: list[str]) -> bool:
    return len(row) <= 1 and not "".join(row).strip()


def _no_header(names: list[str]) -> str:
    """What a first line without a single known name may be; empty for none of these."""
    for separator, word in ((";", "semicolons"), ("\t", "tabs")):
        if separator in names[0]:
            return f"cells are separated by commas, not by {word}; save it with commas and points in the numbers"
    try:
        list(map(float, names))
    except ValueError:
        return ""
    return "the first line must name the parameters, but holds numbers; add a line of names"


def _value(parameter: Parameter, cell: str) -> float | str:
    """The value of a cell, or what is wrong with it."""
    text = cell.strip()
    if not text:
        return "the cell is empty; write a number, or remove the line"
    try:
        number: float | str = float(text)
    except ValueError:
        number = text
    try:
        return read_value(parameter, number)
    except RequestError as error:
        return str(error)
