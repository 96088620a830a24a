"""Read a table of designs from CSV as columns of numbers, or report the problems of all lines."""

from __future__ import annotations

import csv
import itertools
import math
import re
from collections.abc import Collection, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

import numpy as np

from explore.base.errors import ConfigError, RequestError
from explore.base.suggest import closest_name, one_line, suggestion
from explore.base.units.quantities import quantity
from explore.base.units.shown import split_heading
from explore.model.mechanism import Mechanism
from explore.model.quantities import FloatArray, Parameter
from explore.studies.config.schema import MOST_PROBLEMS
from explore.studies.config.toml_text import first_problems
from explore.studies.request.parameters import read_value

if TYPE_CHECKING:
    from _csv import Reader

#: Largest number of rows, because the columns are held in memory.
MOST_TABLE_ROWS = 10**7
#: Largest number of columns: more than any mechanism has parameters.
_MOST_COLUMNS = 1000
#: Largest number of characters of a line.
_LONGEST_LINE = 1 << 20
#: Number of rows after which reading stops if there are too many problems.
_ROWS_AT_A_TIME = 4096

_LINE_BREAK = re.compile(r"[\r\n]")


def read_table(folder: Path, file: str, mechanism: Mechanism, fixed: Collection[str]) -> dict[str, FloatArray]:
    """Read a table of designs: the values of each column in the declared unit, shape (rows,), in declared order.

    The file, of a name relative to `folder`, is CSV, UTF-8. Its first line names parameters, perhaps with units,
    ``crank [in]``, but not those that are `fixed` in [parameters]. A `RequestError` has the reason alone why the file
    as a whole cannot be read; a `ConfigError` one line ``file:line: column: reason; advice`` for each problem, or for
    the first and the number of others.
    """
    path = folder / file
    try:
        if "\0" in file:
            raise RequestError("is not a valid file name")
        if any("\ud800" <= character <= "\udfff" for character in file):  # which TOML and HDF5 cannot store
            raise RequestError("the name is not valid Unicode; rename the file")
        if path.is_dir():
            raise RequestError("is a folder, not a table")
        if path.exists() and not path.is_file():
            raise RequestError("is not a regular file")
        # utf-8-sig: spreadsheet programs write a byte-order mark.
        with path.open(encoding="utf-8-sig", newline="") as stream:
            return _TableReader(one_line(file), mechanism, fixed).columns(stream)
    except FileNotFoundError:
        raise RequestError(f"no such file: {one_line(str(path.absolute()))}") from None
    except UnicodeDecodeError:
        raise RequestError("is not UTF-8 text; save it as CSV in UTF-8") from None
    except OSError as error:
        raise RequestError(f"cannot be read: {error.strerror}") from None


class _TableReader:
    """Reads one table and collects its problems."""

    def __init__(self, file: str, mechanism: Mechanism, fixed: Collection[str]) -> None:
        self.file = file
        self.parameters = {parameter.name: parameter for parameter in mechanism.axis_order}
        self.required = [parameter.name for parameter in mechanism.parameters if parameter.default is None]
        self.fixed = fixed
        # For each the line, the column from 1 (0 for the whole line) and the reason.
        self.problems: list[tuple[int, int, str]] = []
        self.is_abandoned = False
        # The unit in the heading of each column; empty for the declared one.
        self.units: list[str] = []

    def note(self, line: int, reason: str, position: int = 0) -> None:
        self.problems.append((line, position, reason))

    def columns(self, stream: TextIO) -> dict[str, FloatArray]:
        reader = csv.reader(_lines(stream), strict=True)
        try:
            names = next((row for row in reader if not _is_blank(row)), [])
            headings = [split_heading(name) for name in names]
            self.units = [unit for _, unit in headings]
            header = self.header(reader.line_num if names else 1, [name for name, _ in headings])
            pieces = self.pieces(reader, header) if any(header) else {}
        except csv.Error as error:
            self.note(reader.line_num, f"not CSV: {error}; check the quotation marks")
        if self.problems:
            raise self.error()
        return {name: np.concatenate(pieces[name]) for name in self.parameters if name in pieces}

    def header(self, line: int, names: list[str]) -> list[Parameter | None]:
        """The parameter of each column; None for an unknown name."""
        if not names:
            self.note(line, f"is empty; begin with a header line, such as {','.join(self.required)}")
        elif not any(name in self.parameters for name in names) and (reason := _explain_missing_header(names)):
            self.note(line, reason)
        elif len(names) > _MOST_COLUMNS:
            self.note(line, f"has {len(names):,} columns; a design has at most {len(self.parameters)} parameters")
            return []
        else:
            for position, name in enumerate(names, 1):
                reason = self.name_problem(name, is_repeated=names.index(name) < position - 1)
                reason = reason or _unit_problem(self.parameters[name], self.units[position - 1])
                if reason:
                    self.units[position - 1] = ""  # its cells have no second problem
                    self.note(line, f"{one_line(name[:40]) or f'column {position}'}: {reason}", position)
            corrections = {closest_name(name, self.parameters) for name in names}
            missing = [name for name in self.required if name not in self.fixed and name not in corrections]
            if missing:
                self.note(
                    line, f"missing {', '.join(missing)}; add a column, or one value for all designs to the parameters"
                )
        return [self.parameters.get(name) for name in names]

    def name_problem(self, name: str, *, is_repeated: bool) -> str:
        """The problem with the name of a column; empty when there is none."""
        if not name:
            return "has no name; name it or remove the column"
        if name not in self.parameters:
            return f"unknown parameter; {suggestion(name, self.parameters)}"
        if is_repeated:
            return "the column occurs twice; remove one"
        if name in self.fixed:
            return "is also among the parameters; remove it there or remove this column"
        return ""

    def pieces(self, reader: Reader, header: list[Parameter | None]) -> dict[str, list[FloatArray]]:
        """The values of each column in pieces; reading stops early if there are too many problems."""
        pieces: dict[str, list[FloatArray]] = {parameter.name: [] for parameter in header if parameter}
        n_rows = 0
        last_line = reader.line_num
        while rows := list(itertools.islice(reader, _ROWS_AT_A_TIME)):
            lines: Sequence[int] = range(last_line + 1, reader.line_num + 1)
            if len(lines) > len(rows):
                index = next(index for index, row in enumerate(rows) if _LINE_BREAK.search("".join(row)))
                self.note(lines[index], "a cell continues on the next line; check for an unclosed quotation mark")
                return pieces
            if set(map(len, rows)) != {len(header)}:
                rows, lines = self.drop_incomplete(rows, lines, len(header))
            n_rows += len(rows)
            if n_rows > MOST_TABLE_ROWS:
                raise RequestError(f"has more than {MOST_TABLE_ROWS} rows, the limit of a table; split it")
            for position, cells in enumerate(zip(*rows, strict=True)):
                parameter = header[position]
                if parameter:
                    pieces[parameter.name].append(self.values(parameter, cells, lines, position + 1))
            last_line = reader.line_num
            if len(self.problems) > MOST_PROBLEMS:
                self.is_abandoned = next(reader, None) is not None
                return pieces
        if not n_rows and not self.problems:
            self.note(1, "has no designs; add a line of values below the header")
        return pieces

    def drop_incomplete(
        self, rows: list[list[str]], lines: Sequence[int], width: int
    ) -> tuple[list[list[str]], Sequence[int]]:
        """Return the rows that have a cell for each column, and their lines."""
        complete = []
        for line, row in zip(lines, rows, strict=True):
            if len(row) == width:
                complete.append((line, row))
            elif not _is_blank(row):
                cells = f"{len(row)} cell{'s' if len(row) > 1 else ''}"
                self.note(line, f"has {cells}, but the header has {width}; write one for each column")
        return [row for _, row in complete], [line for line, _ in complete]

    def values(self, parameter: Parameter, cells: tuple[str, ...], lines: Sequence[int], position: int) -> FloatArray:
        """The values of cells; NaN where one is invalid."""
        unit = self.units[position - 1]
        try:
            # One search for underscores in all cells is faster than one in each.
            parse = _number if "_" in "".join(cells) else float
            values = np.fromiter(map(parse, cells), np.float64, len(cells))
        except ValueError:
            values = np.full(len(cells), np.nan)
        if not unit and parameter.allows(values).all():
            return values
        value_by_cell: dict[str, float | str] = {}  # units are slow to read, and cells of a column often repeat
        for index, (cell, line) in enumerate(zip(cells, lines, strict=True)):
            if cell not in value_by_cell:
                value_by_cell[cell] = _value_or_problem(parameter, cell, unit)
            value = value_by_cell[cell]
            if isinstance(value, str):
                self.note(line, f"{parameter.name}: {value}", position)
            else:
                values[index] = value
        return values

    def error(self) -> ConfigError:
        """The error with the first problems and the number of the others."""
        lines = [f"{self.file}:{line}: {reason}" for line, _, reason in sorted(self.problems)]
        return ConfigError(first_problems(f"{self.file}: ", lines, is_abandoned=self.is_abandoned))


def _lines(stream: TextIO) -> Iterator[str]:
    """Yield the lines of the file; `RequestError` for one that is too long."""
    for number in itertools.count(1):
        line = stream.readline(_LONGEST_LINE + 1)
        if len(line) > _LONGEST_LINE:
            raise RequestError(f"line {number} has more than {_LONGEST_LINE:,} characters; each line is one design")
        if not line:
            return
        yield line


def _is_blank(row: list[str]) -> bool:
    return len(row) <= 1 and not "".join(row).strip()


def _explain_missing_header(names: list[str]) -> str:
    """The usual mistake in a first line without names of parameters; empty when there is none."""
    for separator, word in ((";", "semicolons"), ("\t", "tabs")):
        if separator in names[0]:
            return f"cells are separated by {word}; save it with commas between cells and decimal points"
    try:
        list(map(_number, names))
    except ValueError:
        return ""
    return "the first line must name the parameters, but it holds numbers; add a header line"


def _number(text: str) -> float:
    """The number of a text. `float` also accepts ``1_00``, which is refused here."""
    if "_" in text:
        raise ValueError("not a number")
    return float(text)


def _unit_problem(parameter: Parameter, unit: str) -> str:
    """Why a heading cannot have a unit; empty if it can, or has none."""
    try:
        if unit:
            quantity(f"1 {unit}", parameter.unit)
    except RequestError as error:
        return str(error)
    return ""


def _value_or_problem(parameter: Parameter, cell: str, unit: str) -> float | str:
    """The value of a cell below a heading with a unit or an empty one, or the reason why it has none."""
    text = cell.strip()
    if not text:
        return "the cell is empty; write a number, or remove the line"
    try:
        value = _number(text)
        number: float | str = f"{text} {unit}" if unit and math.isfinite(value) else value
    except ValueError:
        number = text
    try:
        return read_value(parameter, number)
    except RequestError as error:
        return str(error)
