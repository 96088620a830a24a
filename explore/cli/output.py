"""What a command prints: data on stdout, messages on stderr."""

import math
import sys
from collections.abc import Mapping, Sequence
from typing import Any

from explore.base.json_text import json_text


def complain(text: str) -> None:
    """Print an error on stderr."""
    from rich.text import Text

    say(Text.assemble(("error: ", "bold red"), printable(text)))


def say(text: Any, style: str = "", *, data: bool = False) -> None:
    """Print a line: a message on stderr, or with `data` a part of the requested output on stdout."""
    from rich.console import Console
    from rich.text import Text

    # No markup: a path may hold brackets. No wrapping: a wrapped path or command cannot be copied.
    line = Text(printable(text), style) if isinstance(text, str) else text
    Console(stderr=not data, highlight=False, soft_wrap=True).print(line)


def printable(text: str) -> str:
    """The text without control characters: a name or a results file may come from anywhere."""
    return "".join(letter if letter.isprintable() or letter == "\n" else "?" for letter in text)


def say_missing_peers(methods: Mapping[str, Sequence[object]]) -> None:
    """Name the methods left out because their packages are not installed."""
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


def count_of(count: int, noun: str) -> str:
    """A number of things: "1 block", "2 blocks"."""
    return f"{count:,} {noun}{'s' * (count != 1)}"


def is_or_are(count: int) -> str:
    """The verb after a number of things."""
    return "is" if count == 1 else "are"


def shown_unit(unit: str) -> str:
    """A unit as a table shows it: nothing for a dimensionless number."""
    return "" if unit == "1" else unit


def print_json(value: object) -> None:
    """JSON on stdout, with null for NaN and infinities."""
    sys.stdout.write(json_text(value) + "\n")


def announce_compiling() -> None:
    """Say so on stderr when this command compiles the first kernel."""
    from explore.base.compiling import announce_compilation

    announce_compilation(
        lambda: say("compiling the kernels, which the first command on a machine does; this takes seconds …", "dim")
    )
