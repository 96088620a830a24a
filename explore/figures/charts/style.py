"""Colours, marks and files of all charts."""

from __future__ import annotations

import textwrap
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

from explore.results.store.outputs import new_output

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INK, MUTED = "#222222", "#8a949e"
BLUE, ORANGE, GREEN, RED, PURPLE, SKY, YELLOW, BROWN = (
    "#0072b2", "#e69f00", "#009e73", "#d55e00", "#cc79a7", "#56b4e9", "#c9b800", "#7f4f24"
)  # fmt: skip
"""Okabe and Ito's palette for colour-blind readers, its yellow darkened for a white ground, and a brown."""
#: Opacity of infeasible designs: they must not hide the feasible ones.
INFEASIBLE_OPACITY = 0.35
#: Smallest size of a mark in the legend of many designs, points.
_LEGEND_MARK = 6.0


@dataclass(frozen=True)
class LineStyle:
    """Look of the line of a method or of a rule."""

    colour: str
    marker: str
    style: str = "-"
    filled: bool = True


_METHODS = {
    "closed-form": LineStyle(INK, "*"),
    "textbook": LineStyle(MUTED, "P"),
    "circles": LineStyle(BROWN, "X"),
    "newton": LineStyle(BLUE, "o"),
    "newton-compiled": LineStyle(BLUE, ">", "--"),
    "newton-unchecked": LineStyle(BLUE, "o", ":", filled=False),
    "fsolve": LineStyle(SKY, "d", "--"),
    "pylinkage": LineStyle(YELLOW, "p", "--"),
    "rk4": LineStyle(GREEN, "s"),
    "rk4-projected": LineStyle(GREEN, "s", ":", filled=False),
    "rk45": LineStyle(ORANGE, "^"),
    "rk45-projected": LineStyle(ORANGE, "^", ":", filled=False),
    "dop853": LineStyle(RED, "v"),
    "dop853-projected": LineStyle(RED, "v", ":", filled=False),
    "radau": LineStyle(PURPLE, "D"),
    "radau-projected": LineStyle(PURPLE, "D", ":", filled=False),
}
_OTHER_COLOURS = (BROWN, GREEN, BLUE, RED)


def line_style(name: str) -> LineStyle:
    """Look of a method, the same in all charts; methods that are not listed above share four colours."""
    return _METHODS.get(name) or LineStyle(_OTHER_COLOURS[sum(map(ord, name)) % len(_OTHER_COLOURS)], "h")


def new_figure(width: float = 9.0, height: float = 6.2) -> Figure:
    """An empty figure of a width and a height in inches."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def write_heading(figure: Figure, text: str, width: int) -> None:
    """Write a text above a figure, wrapped at `width` characters and only after commas.

    A parameter stays on one line with its value and unit.
    """
    words = text.replace(" ", "\xa0").replace(",\xa0", ", ")
    figure.suptitle("\n".join(textwrap.wrap(words, width)), fontsize=12, color=INK)


def write_title(figure: Figure, text: str, size: int = 12) -> None:
    """Write lines above a figure, wrapped so that none is cut at its sides."""
    figure.suptitle("\n".join(textwrap.fill(line, 88) for line in text.splitlines()), fontsize=size, color=INK)


def write_legend(figure: Figure, panel: Axes) -> None:
    """Write what the marks of a chart are below it, one under the other, wrapped as titles are."""
    handles, labels = panel.get_legend_handles_labels()
    wrapped = [textwrap.fill(label, 96) for label in labels]
    legend = figure.legend(handles, wrapped, loc="outside lower left", frameon=False, fontsize=10)
    for mark in legend.get_lines():  # the marks of many designs are small
        mark.set_markersize(max(mark.get_markersize(), _LEGEND_MARK))


def save_figure(figure: Figure, path: Path) -> None:
    """Write a figure as .png, .svg or .pdf, after the ending of the name; the same figure gives the same bytes.

    Raises `ResultsError` if the file cannot be written; no partial file stays.
    """
    content = content_of(figure, path.suffix.lower())  # matplotlib stumbles over a full disk
    with new_output(path) as unfinished:
        unfinished.write_bytes(content)


def content_of(figure: Figure, ending: str) -> bytes:
    """What a file of a figure holds; the same figure gives the same bytes."""
    import matplotlib as mpl

    file = BytesIO()
    undated: dict[str, dict[str, None]] = {".svg": {"Date": None}, ".pdf": {"CreationDate": None}}
    with mpl.rc_context({"svg.hashsalt": "explore"}):
        figure.savefig(file, format=ending[1:], dpi=130, metadata=undated.get(ending))
    return file.getvalue()
