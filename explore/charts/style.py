"""What all charts share: colours that most people can tell apart, marks, and how a figure is saved."""

from __future__ import annotations

import textwrap
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from explore.store.creation import new_file
from explore.store.names import real_path

if TYPE_CHECKING:
    from matplotlib.figure import Figure

INK, MUTED, PAPER = "#222222", "#8a949e", "#ffffff"
BLUE, ORANGE, GREEN, RED, PURPLE, SKY, YELLOW, BROWN = (
    "#0072b2", "#e69f00", "#009e73", "#d55e00", "#cc79a7", "#56b4e9", "#c9b800", "#7f4f24"
)  # fmt: skip
"""Okabe and Ito's palette, the yellow darkened to be seen on white, and a brown."""


@dataclass(frozen=True)
class Line:
    """How the settings of a method are drawn."""

    colour: str
    marker: str
    style: str = "-"
    filled: bool = True


_METHODS = {
    "closed-form": Line(INK, "*"),
    "textbook": Line(MUTED, "P"),
    "newton": Line(BLUE, "o"),
    "newton-unchecked": Line(BLUE, "o", ":", filled=False),
    "fsolve": Line(SKY, "d", "--"),
    "pylinkage": Line(YELLOW, "p", "--"),
    "rk4": Line(GREEN, "s"),
    "rk4-projected": Line(GREEN, "s", ":", filled=False),
    "rk45": Line(ORANGE, "^"),
    "rk45-projected": Line(ORANGE, "^", ":", filled=False),
    "dop853": Line(RED, "v"),
    "dop853-projected": Line(RED, "v", ":", filled=False),
    "radau": Line(PURPLE, "D"),
    "radau-projected": Line(PURPLE, "D", ":", filled=False),
}
_SPARE = (BROWN, GREEN, BLUE, RED)


def line_of(name: str) -> Line:
    """How a method or a rule is drawn, the same in all charts; those without a place of their own share four."""
    return _METHODS.get(name) or Line(_SPARE[sum(map(ord, name)) % len(_SPARE)], "h")


def new_figure(width: float = 9.0, height: float = 6.2) -> Figure:
    """An empty figure, inches, whose text is still read when a page shows it at half the size."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def heading(figure: Figure, text: str, letters: int) -> None:
    """Write the parameters of a design above a figure, in lines of so many letters that end at commas only.

    A length stays beside its name and its unit.
    """
    words = text.replace(" ", "\xa0").replace(",\xa0", ", ")
    figure.suptitle("\n".join(textwrap.wrap(words, letters)), fontsize=12, color=INK)


def save(figure: Figure, path: Path) -> None:
    """Write a figure as the file's name says: .png, .svg or .pdf; the same figure gives the same bytes.

    The file appears when it is complete.

    Raises
    ------
    ResultsError
        If the file cannot be written; nothing is left behind.
    """
    import matplotlib as mpl

    undated: dict[str, dict[str, None]] = {".svg": {"Date": None}, ".pdf": {"CreationDate": None}}
    ending = path.suffix.lower()
    with new_file(real_path(path)) as unfinished, mpl.rc_context({"svg.hashsalt": "explore"}):
        figure.savefig(unfinished, format=ending[1:], dpi=130, metadata=undated.get(ending))
