"""Tables on stdout."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal

import typer

from explore.cli.output import count_of, printable, shown_unit
from explore.cli.table_layout import TableLayout, lay_out

if TYPE_CHECKING:
    from rich.table import Table


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
