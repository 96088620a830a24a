"""What a user sees: data on stdout, everything else on stderr."""

from __future__ import annotations

import json
import math
import sys
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any


def complain(text: str) -> None:
    """Say what went wrong, on stderr."""
    from rich.console import Console

    Console(stderr=True, highlight=False, soft_wrap=True).print(f"[bold red]error:[/] {_escaped(text)}")


def say(text: str) -> None:
    """A message for people, on stderr; it may carry rich's markup."""
    from rich.console import Console

    Console(stderr=True, highlight=False, soft_wrap=True).print(text)


def _escaped(text: str) -> str:
    from rich.markup import escape

    return escape(text)


def number(value: object, digits: int = 6) -> str:
    """A value as a table shows it."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return "–" if math.isnan(value) else f"{value:.{digits}g}"
    return f"{value:,}" if isinstance(value, int) else str(value)


def print_table(
    title: str, columns: Sequence[tuple[str, str]], rows: Sequence[Sequence[str]], caption: str = ""
) -> None:
    """A table on stdout; columns are (name, unit)."""
    from rich import box
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(title=title or None, caption=caption or None, box=box.SIMPLE_HEAD, title_justify="left",
                  caption_justify="left", title_style="bold", pad_edge=False)  # fmt: skip
    for name, unit in columns:
        heading = Text(name)
        if unit and unit != "1":
            heading.append(f"\n{unit}", style="dim")
        table.add_column(heading, justify="right" if rows and _numeric(rows, len(table.columns)) else "left")
    for row in rows:
        table.add_row(*(Text(cell) for cell in row))
    # Not cut to 80 columns when piped: a file has no width.
    console = Console(highlight=False) if sys.stdout.isatty() else Console(highlight=False, width=_width(table))
    console.print(table)


def _numeric(rows: Sequence[Sequence[str]], column: int) -> bool:
    return any(row[column][:1].isdigit() or row[column][:2].lstrip("-–")[:1].isdigit() for row in rows)


def _width(table: Any) -> int:
    from rich.console import Console

    return max(80, int(Console(width=10_000).measure(table).maximum))


def print_json(value: object) -> None:
    """JSON on stdout, with null for what is not a number."""
    json.dump(_plain(value), sys.stdout, indent=2, ensure_ascii=False)
    sys.stdout.write("\n")


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if hasattr(value, "item"):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value


@contextmanager
def compiled_kernels() -> Iterator[None]:
    """Load the kernels; if that takes long they are being compiled, and the user is told why nothing happens."""
    timer = threading.Timer(
        1.5, say, ["[dim]preparing the compiled kernels; the first time on a machine takes about ten seconds …[/]"]
    )
    timer.daemon = True
    timer.start()
    try:
        import explore.mechanisms.registry
        import explore.sampling  # noqa: F401
    finally:
        timer.cancel()
    yield


def newest_results() -> str:
    """The results that a command means when none are named."""
    from pathlib import Path

    from explore.errors import ResultsError

    found = sorted(Path("results").glob("*.h5"), key=lambda path: path.stat().st_mtime)
    if not found:
        raise ResultsError("no results yet: run `explore sweep CONFIG` first, or name a results file")
    return str(found[-1])
