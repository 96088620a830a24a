"""What a user sees: data on stdout, everything else on stderr."""

from __future__ import annotations

import json
import math
import sys
import tempfile
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import typer

from explore.errors import RequestError

#: What numbers, lists and ranges of them are written with.
_NUMERIC = frozenset("0123456789+-–.,e… ")
_PACKED = ".packed.h5"


def complain(text: str) -> None:
    """Say what went wrong, on stderr."""
    from rich.text import Text

    say(Text.assemble(("error: ", "bold red"), printable(text)))


def say(text: Any, style: str = "", *, data: bool = False) -> None:
    """A line for people: a message on stderr, or with `data` a part of what was asked for, on stdout."""
    from rich.console import Console
    from rich.text import Text

    # No markup: a path may hold brackets. No wrapping: a line that is cut into pieces cannot be copied.
    line = Text(printable(text), style) if isinstance(text, str) else text
    Console(stderr=not data, highlight=False, soft_wrap=True).print(line)


def printable(text: str) -> str:
    """The text without what a terminal would obey: a name or a results file may come from anywhere."""
    return "".join(letter if letter.isprintable() or letter == "\n" else "?" for letter in text)


def check_output(path: Path | None, endings: Sequence[str]) -> None:
    """Refuse a file that could not be written, before anything is computed; the name says the format."""
    if path is None:
        return
    if path.suffix.lower() not in endings:
        raise RequestError(f"-o {path}: the name must end in {', '.join(endings[:-1])} or {endings[-1]}")
    if path.is_dir() or not path.parent.is_dir():
        what = "it is a folder" if path.is_dir() else f"there is no folder {path.parent}"
        raise RequestError(f"-o {path}: {what}; name another file")


def refuse_same(output: Path | None, source: Path, what: str) -> None:
    """Refuse an output that is the very file that is read, `what` in words."""
    if output is not None and output.exists() and source.exists() and output.samefile(source):
        raise RequestError(f"-o {output} is {what} itself; name another file")


@contextmanager
def whole_files(folder: Path) -> Iterator[Path]:
    """Where to write the files of a folder: they move there when all are complete, or none does.

    Begun before anything is computed, so that a folder that takes no files is known at once.
    """
    if folder.exists() and not folder.is_dir():
        raise RequestError(f"-o {folder} is a file; name a folder")
    missing = not folder.exists()
    folder.mkdir(parents=True, exist_ok=True)
    try:
        unfinished = tempfile.TemporaryDirectory(prefix=".unfinished-", dir=folder)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(folder)) from None
    try:
        with unfinished as place:
            yield Path(place)
            for file in Path(place).iterdir():
                file.replace(folder / file.name)
    except BaseException as error:
        if missing:
            with suppress(OSError):
                folder.rmdir()
        if isinstance(error, KeyboardInterrupt):
            say(f"interrupted; nothing was written to {folder}", "yellow")
        raise


def say_left_out(methods: Mapping[str, Sequence[object]]) -> None:
    """Name the methods without a setting: those of packages that are not installed."""
    names = ", ".join(name for name, settings in methods.items() if not settings)
    if names:
        say(f"left out: {names}; pip install 'linkage-explore[peers]'", "yellow")


def number(value: object, digits: int = 6) -> str:
    """A value as a table shows it."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return "–" if math.isnan(value) else f"{value:.{digits}g}"
    return f"{value:,}" if isinstance(value, int) else str(value)


def counted(count: int, noun: str) -> str:
    """A number of things: "1 block", "2 blocks"."""
    return f"{count:,} {noun}{'s' * (count != 1)}"


def be(count: int) -> str:
    """The verb after a number of things."""
    return "is" if count == 1 else "are"


def shown_unit(unit: str) -> str:
    """A unit as a table shows it: that of a bare number is left out."""
    return "" if unit == "1" else unit


def print_table(
    title: str, columns: Sequence[tuple[str, str]], rows: Sequence[Sequence[str]], caption: str = ""
) -> None:
    """A table on stdout; columns are (name, unit)."""
    from rich import box
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(title=Text(printable(title)), caption=Text(caption) if caption else None, box=box.SIMPLE_HEAD,
                  title_justify="left", caption_justify="left", title_style="bold", pad_edge=False)  # fmt: skip
    least = 0
    for k, (name, unit) in enumerate(columns):
        heading = Text(printable(name))
        if shown_unit(unit):
            heading.append(f"\n{printable(unit)}", style="dim")
        cells = [row[k] for row in rows]
        numeric = any(cell and _NUMERIC.issuperset(cell) for cell in cells)
        # Numbers are never cut; text may wrap.
        width = max(map(len, (name, unit, *cells))) if numeric else 20
        least += width + 4
        table.add_column(heading, justify="right" if numeric else "left", min_width=width if numeric else None)
    for row in rows:
        table.add_row(*(Text(printable(cell)) for cell in row))
    console = Console(highlight=False)
    if not sys.stdout.isatty():
        # A file has no width.
        console.width = max(80, int(Console(width=10_000).measure(table).maximum))
    console.width = max(console.width, least)
    with console.capture() as drawn:
        console.print(table)
    # What is cut out of a terminal or kept in a file has no blanks at the ends of its lines.
    typer.echo("\n".join(line.rstrip() for line in drawn.get().splitlines()))


def print_json(value: object) -> None:
    """JSON on stdout, with null for what is not a number."""
    sys.stdout.write(json_text(value) + "\n")


def json_text(value: object) -> str:
    """JSON, with null for what is not a number."""
    return json.dumps(_plain(value), indent=2, ensure_ascii=False)


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
        1.5, say, ["preparing the compiled kernels; the first time on a machine takes about ten seconds …", "dim"]
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
    from explore.errors import ResultsError

    folder = Path("results")
    times = {path: path.stat().st_mtime for path in folder.glob("*.h5") if not _copy_of_another(path)}
    # A sweep that keeps the front has nothing but a journal before it is done.
    times |= {path.with_suffix(""): path.stat().st_mtime for path in folder.glob("*.h5.journal")}
    if not times:
        raise ResultsError("no results yet: run `explore sweep CONFIG` first, or name a results file")
    newest = max(times, key=times.__getitem__)
    if len(times) > 1:
        say(f"{newest} is the newest of {len(times)} results", "dim")
    return str(newest)


def _copy_of_another(path: Path) -> bool:
    """Whether this is the packed copy of results that are there too."""
    return path.name.endswith(_PACKED) and path.with_name(path.name.removesuffix(_PACKED) + ".h5").exists()
