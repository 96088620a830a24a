"""Read the points, poses or pairs of a target from a CSV file, for studies and for tasks.

* The first row is a heading if it names a column, or if none of its cells begins like a number. Its columns may have
  any order, and a unit as in ``x [in]``. Without a heading the columns have their declared order and units.
* A cell is a number in the unit of its column, or has a unit of its own, ``0 in``. There are no columns but those of
  the target, and each row has a cell for each.
* Semicolons separate cells if the first row has one, else tabs, else commas. Beside semicolons and tabs decimals may
  have a comma, but then none has a point: in ``1,234`` beside ``1.5`` the comma may mean thousands.
* Rows without content and lines that begin with # are left out; a byte-order mark may lead.
"""

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from explore.base.errors import RequestError
from explore.base.suggest import format_value, one_line, suggestion
from explore.base.units.quantities import quantity
from explore.base.units.shown import split_heading
from explore.model.targets import MOST_TARGET_POINTS

#: Largest size of a file, bytes.
_LARGEST = 1 << 24
#: Ends of lines; others, such as a form feed, belong to the cell.
_LINE_END = re.compile(r"\r\n|\r|\n")
#: Beginning of a cell with a number.
_NUMBER_LIKE = re.compile(r"[+-]?(?:\.?\d|(?:nan|inf|infinity)$)", re.IGNORECASE)
#: Number without a unit, also one that is not finite.
_PLAIN = re.compile(r"[+-]?(?:(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?|nan|inf|infinity)", re.IGNORECASE | re.ASCII)


@dataclass(frozen=True)
class FileColumn:
    """A column of a file: its name, the unit of its numbers, and whether it may be missing."""

    name: str
    unit: str
    is_optional: bool = False


def read_target_file(folder: Path, file: object, columns: Sequence[FileColumn]) -> list[list[float]]:
    """The rows of a file, in the declared order and units of the columns, without optional ones that it lacks.

    A `RequestError` has the reason after the file, and the line and the column where these are known.
    """
    if not isinstance(file, str):
        raise RequestError(f"must be the name of a CSV file in quotes, got {format_value(file)}")
    return _Table(one_line(file), columns).read(_content(folder, file))


def _content(folder: Path, file: str) -> str:
    """The text of a file."""
    path, name = folder / file, one_line(file)
    try:
        if not path.exists():
            raise RequestError(f"no such file: {one_line(str(path.absolute()))}")
        if not path.is_file():
            raise RequestError(f"{name} is not a file")
        if (size := path.stat().st_size) > _LARGEST:
            raise RequestError(f"{name} has {size:,} bytes; at most {MOST_TARGET_POINTS} rows are possible, thin it")
        # utf-8-sig: spreadsheet programs write a byte-order mark.
        return path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise RequestError(f"{name} is not UTF-8 text; save it as CSV in UTF-8") from None
    except OSError as error:
        raise RequestError(f"{name} cannot be read: {error.strerror}") from None


class _Table:
    """Reads the text of a file."""

    def __init__(self, file: str, columns: Sequence[FileColumn]) -> None:
        self.file, self.declared = file, list(columns)
        names = [column.name for column in columns if not column.is_optional]
        optional = [column.name for column in columns if column.is_optional]
        self.wanted = ",".join(names) + "".join(f" or {','.join([*names, name])}" for name in optional)
        # Of the first number with decimals: what marks them, and its line.
        self.decimals = ("", 0)

    def error(self, line: int, reason: str) -> RequestError:
        return RequestError(f"{self.file}:{line}: {reason}")

    def read(self, text: str) -> list[list[float]]:
        """The rows; see `read_target_file`."""
        lines = [(n, line) for n, line in enumerate(_LINE_END.split(text), 1) if line.strip(" ,;\t\f\v")]
        lines = [(n, line) for n, line in lines if not line.lstrip().startswith("#")]
        if not lines:
            raise RequestError(f"{self.file} is empty; write {self.wanted} in every line")
        separator = next((mark for mark in (";", "\t") if mark in lines[0][1]), ",")
        number, first = lines[0][0], self.cells(*lines[0], separator)
        columns = self.heading(number, first)
        if columns:
            del lines[0]
        elif not sum(not column.is_optional for column in self.declared) <= len(first) <= len(self.declared):
            raise self.error(number, f"has {_count(first)}; write {self.wanted} in every line")
        if not lines:
            raise RequestError(f"{self.file} has no rows below its heading; write {self.wanted} in every line")
        if len(lines) > MOST_TARGET_POINTS:
            every = -(-len(lines) // MOST_TARGET_POINTS)
            most = f"but at most {MOST_TARGET_POINTS} are possible"
            raise RequestError(f"{self.file} has {len(lines):,} rows, {most}; keep every {every:,}th")
        used = columns or self.declared[: len(first)]
        rows = [self.row(n, self.cells(n, line, separator), used, separator) for n, line in lines]
        names = [column.name for column in used]
        order = [names.index(column.name) for column in self.declared if column.name in names]
        return [[row[position] for position in order] for row in rows]

    def cells(self, line: int, text: str, separator: str) -> list[str]:
        try:
            return [
                cell.strip()
                for cell in next(csv.reader([text], delimiter=separator, skipinitialspace=True, strict=True))
            ]
        except csv.Error as error:
            raise self.error(line, f"not CSV: {error}; check the quotation marks") from None

    def heading(self, line: int, cells: Sequence[str]) -> list[FileColumn]:
        """The columns that the first row names; none if it is no heading."""
        known = {column.name: column for column in self.declared}
        headings = [split_heading(cell) for cell in cells]
        if not any(name.lower() in known for name, _ in headings) and any(map(_NUMBER_LIKE.match, cells)):
            return []
        columns: list[FileColumn] = []
        for position, (name, unit) in enumerate(headings, 1):
            column, place = known.get(name.lower()), f"column {position}"
            if column is None:
                words = "has no name" if not name else f"unknown column {format_value(name)}"
                raise self.error(line, f"{place}: {words}; {suggestion(name, known)}")
            if column.name in {other.name for other in columns}:
                raise self.error(line, f"{place}: {column.name} occurs twice; remove one")
            try:
                if unit:
                    quantity(f"1 {unit}", column.unit)
            except RequestError as error:
                raise self.error(line, f"{place} ({column.name}): {error}") from None
            columns.append(replace(column, unit=unit or column.unit))
        missing = [name for name, column in known.items() if not column.is_optional and column.name not in
                   {other.name for other in columns}]  # fmt: skip
        if missing:
            raise self.error(line, f"the heading lacks {' and '.join(missing)}; write {self.wanted}")
        return columns

    def row(self, line: int, cells: Sequence[str], columns: Sequence[FileColumn], separator: str) -> list[float]:
        """The numbers of a row in declared units."""
        if len(cells) != len(columns):
            raise self.error(line, f"has {_count(cells)}, but the first has {len(columns)}; write one for each column")
        return [
            self.value(line, position, cell, columns[position - 1], separator) for position, cell in enumerate(cells, 1)
        ]

    def value(self, line: int, position: int, cell: str, column: FileColumn, separator: str) -> float:
        """The number of a cell in the declared unit."""
        place = f"column {position} ({column.name})"
        if not cell:
            raise self.error(line, f"{place}: the cell is empty; write a number")
        mark = "." if "." in cell else "," if separator != "," and "," in cell else ""
        if mark and mark != self.decimals[0]:
            if self.decimals[0]:
                other = f"that of line {self.decimals[1]} has '{self.decimals[0]}'"
                raise self.error(line, f"{place}: {format_value(cell)} has '{mark}', but {other}; write one of the two")
            self.decimals = (mark, line)
        text = cell.replace(",", ".") if mark == "," else cell
        declared = next(each.unit for each in self.declared if each.name == column.name)
        try:
            if not _PLAIN.fullmatch(text):
                return quantity(text, declared)
            return quantity(float(text) if column.unit == declared else f"{text} {column.unit}", declared)
        except RequestError as error:
            raise self.error(line, f"{place}: {error}") from None


def _count(cells: Sequence[str]) -> str:
    return f"{len(cells)} column{'s' * (len(cells) != 1)}"
