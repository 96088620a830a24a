"""Tables on stdout that fit the width of a terminal: no number is cut, and columns left out are named."""

from __future__ import annotations

import shutil
from collections.abc import Sequence, Set
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import typer

from explore.cli.output import count_of, printable, shown_unit

if TYPE_CHECKING:
    from rich.table import Table

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


def print_table(
    title: str,
    columns: Sequence[tuple[str, str]],
    rows: Sequence[Sequence[str]],
    caption: str = "",
    *,
    droppable: Sequence[str] | None = None,
    hint: str = "a wider terminal shows all",
) -> None:
    """Print a table that fits the terminal, or 80 letters where there is none.

    `droppable` names columns that may be left out, the least important first; by default all but the first, from the
    last. The hint, how to see all columns, is printed when some are.
    """
    from rich.console import Console
    from rich.text import Text

    width = shutil.get_terminal_size().columns
    columns = [(printable(name), printable(shown_unit(unit))) for name, unit in columns]
    rows = [[printable(cell) for cell in row] for row in rows]
    layout = lay_out(columns, rows, width, [name for name, _ in columns[:0:-1]] if droppable is None else droppable)
    lines = [caption] if caption else []
    if layout.left_out:
        names = ", ".join(layout.left_out)
        lines.insert(0, f"{count_of(len(layout.left_out), 'column')} left out: {names}; {hint}")
    room = max(width, layout.min_width)
    # More for the blanks behind the last column, which are stripped below.
    console = Console(highlight=False, width=room + layout.gap)
    with console.capture() as captured:
        console.print(Text(printable(title), "bold"), soft_wrap=True)
        console.print(_rich_table(layout, room))
        for line in lines:
            console.print(Text(line, "dim italic"), soft_wrap=True)
    # Lines copied from a terminal or kept in a file have no trailing blanks.
    typer.echo("\n".join(line.rstrip() for line in captured.get().splitlines()))


def _rich_table(layout: TableLayout, room: int) -> Table:
    from rich import box
    from rich.table import Table
    from rich.text import Text

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, layout.gap - 2))
    for column, width in zip(layout.columns, layout.column_widths(room), strict=True):
        heading = Text(column.heading)
        if column.unit:
            heading.append(f"\n{column.unit}", style="dim")
        justify: Literal["left", "right"] = "right" if column.is_numeric else "left"
        table.add_column(heading, justify=justify, width=width)
    for row in zip(*(column.cells for column in layout.columns), strict=True):
        table.add_row(*map(Text, row))
    return table


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
