"""Layout of tables that fit the width of a terminal: no number is cut, and columns left out are named."""

from __future__ import annotations

from collections.abc import Sequence, Set
from dataclasses import dataclass, replace

#: Characters of numbers, and of lists and ranges of numbers.
_NUMERIC = frozenset("0123456789+-–.,e… ")
#: Number of blanks between columns.
_GAP = 3
#: Number of blanks between columns of a table that would else be too wide.
_NARROW_GAP = 2
#: Largest number of rows that are shown as columns.
_MOST_TRANSPOSED_ROWS = 10
#: Number of letters from which on a word, such as a path, may be cut.
_LONGEST_WORD = 40


@dataclass(frozen=True)
class TableColumn:
    """A column as it is printed: its heading, which may have several lines, its unit beneath it, and its cells."""

    name: str
    heading: str
    unit: str
    cells: tuple[str, ...]

    @property
    def is_numeric(self) -> bool:
        """Whether it holds numbers, which are never cut; other texts may wrap."""
        return any(cell and _NUMERIC.issuperset(cell) for cell in self.cells)

    @property
    def width(self) -> int:
        """Letters of its longest line."""
        return max(map(len, (*self.heading.split("\n"), self.unit, *self.cells)))

    @property
    def min_width(self) -> int:
        """Letters that it needs at least."""
        if self.is_numeric:
            return self.width
        words = " ".join((self.heading, self.unit, *self.cells)).split()
        return min(max(map(len, words), default=0), _LONGEST_WORD)

    def with_folded_heading(self) -> TableColumn:
        """The same with a heading no wider than its longest word, or than its cells."""
        pieces = [f"{piece}_" for piece in self.name.split("_")]
        pieces[-1] = pieces[-1][:-1]
        room = max(map(len, (*pieces, self.unit, *self.cells)))
        lines = [""]
        for piece in pieces:
            if len(lines[-1] + piece) > room:
                lines.append("")
            lines[-1] += piece
        return replace(self, heading="\n".join(lines)) if self.is_numeric else self


@dataclass(frozen=True)
class TableLayout:
    """A table as it is printed, the blanks between its columns, and the names of columns that are left out."""

    columns: tuple[TableColumn, ...]
    gap: int = _GAP
    left_out: tuple[str, ...] = ()

    @property
    def min_width(self) -> int:
        """Letters that it needs at least, with the blank before it."""
        return 1 + sum(column.min_width for column in self.columns) + self.gap * (len(self.columns) - 1)

    def column_widths(self, room: int) -> list[int]:
        """Letters of each column on lines of so many letters; the narrowest grow first, none beyond its longest line.

        rich by itself narrows columns without regard to what they need at least, and then cuts the last one.
        """
        widths = [column.min_width for column in self.columns]
        for _ in range(room - self.min_width):
            wanting = [k for k, column in enumerate(self.columns) if widths[k] < column.width]
            if not wanting:
                break
            widths[min(wanting, key=widths.__getitem__)] += 1
        return widths

    def without(self, names: Set[str]) -> TableLayout:
        """The table without these columns."""
        shown = tuple(column for column in self.columns if column.name not in names)
        return TableLayout(shown, self.gap, tuple(column.name for column in self.columns if column.name in names))


def lay_out(
    columns: Sequence[tuple[str, str]], rows: Sequence[Sequence[str]], width: int, droppable: Sequence[str]
) -> TableLayout:
    """Lay out a table as it is, with folded headings, transposed, or with columns left out: the first that fits.

    The names and units of the columns, the cells of each row, and the letters of a line. Droppable columns, the least
    important first, are kept as far as there is room.
    """
    plain = TableLayout(tuple(
        TableColumn(name, name, unit, tuple(row[place] for row in rows)) for place, (name, unit) in enumerate(columns)
    ))  # fmt: skip
    narrow = TableLayout(tuple(column.with_folded_heading() for column in plain.columns), _NARROW_GAP)
    for layout in (plain, narrow, *([_transposed(plain)] if 0 < len(rows) <= _MOST_TRANSPOSED_ROWS else [])):
        if layout.min_width <= width:
            return layout
    left_out = set(droppable)
    layout = narrow.without(left_out)
    for name in reversed(droppable):
        wider = narrow.without(left_out - {name})
        if wider.min_width <= width:
            layout, left_out = wider, left_out - {name}
    return layout


def _transposed(table: TableLayout) -> TableLayout:
    """The table with a line for each column; the cells of the first become the headings."""
    first, *others = table.columns
    names = TableColumn(first.name, first.name, "", tuple(column.name for column in others))
    units = TableColumn("unit", "unit", "", tuple(column.unit for column in others))
    rows = [
        TableColumn(heading, heading, "", tuple(column.cells[place] for column in others))
        for place, heading in enumerate(first.cells)
    ]
    return TableLayout((names, *([units] if any(units.cells) else []), *rows))
