"""Maps of verdicts on methods, distance to a singular position over setting; errors over a turn; starts of gears."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING

from explore.figures.charts import style
from explore.figures.charts.style import BLUE, GREEN, MUTED, ORANGE, PURPLE, RED, new_figure

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.patches import Rectangle

#: Colour and letter of each verdict: reported failures are pale, silent ones strong.
VERDICTS = {
    "accurate": (style.GREEN, ""),
    "inaccurate": (style.ORANGE, ""),
    "correctly rejected": ("#d9dee3", "·"),
    "reported failure": (style.SKY, "f"),
    "raised": (style.BLUE, "e"),
    "unreported NaN": (style.PURPLE, "N"),
    "false success": (style.BROWN, "!"),
    "wrong branch": (style.RED, "B"),
}
#: Number of letters of a line of a panel's label.
_LABEL_WIDTH = 75
#: Panel of the methods that have one setting each.
_SHARED_PANEL = "methods of one setting"
#: Height of the heading of a panel, inches.
_HEADING_HEIGHT = 0.3
#: Height of a line of a panel, inches.
_LINE_HEIGHT = 0.17
#: Height of the frame above all panels, inches.
_ABOVE = 0.45
#: Height of the frame below all panels, inches.
_BELOW = 0.8
#: Left edges of both columns, inches.
_LEFT_EDGES = (1.5, 6.95)
#: Width of a panel, inches.
_PANEL_WIDTH = 3.95
#: Width of the figure, inches.
_WIDTH = 11.0
#: Smallest error over a turn that is drawn.
_SMALLEST_ERROR = 1e-17
#: Largest error over a turn that is drawn.
_TOP_ERROR = 10.0
#: Colour of each outcome: of use, useless, and failures.
_COLOURS = {
    "branch 1": GREEN,
    "branch 2": ORANGE,
    "branch 3": RED,
    "higher branches": PURPLE,
    "inaccurate": BLUE,
    "reported failure": "#c3c9d0",
}


def stability_chart(rows: pd.DataFrame, goal: float, distance: str, beyond: str) -> Figure:
    """Draw a panel per method, with margins as columns and settings as lines; a cell shows the verdict and the digits.

    The goal is the largest error of a motion that counts as accurate; for the texts see `StabilityCase`.
    """
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

    lines_of = _split_panels(rows)
    columns = _split_columns({name: _HEADING_HEIGHT + _LINE_HEIGHT * len(lines) for name, lines in lines_of.items()})
    height = _ABOVE + max(sum(column.values()) for column in columns) + _BELOW
    figure = Figure(figsize=(_WIDTH, height))
    margins = rows["margin"].drop_duplicates()
    label = "\n".join(textwrap.wrap(f"{distance}; right of the bar {beyond}", _LABEL_WIDTH))
    for left, column in zip(_LEFT_EDGES, columns, strict=True):
        bottom = height - _ABOVE
        for name, panel_height in column.items():
            bottom -= panel_height
            panel = figure.add_axes((
                left / _WIDTH, bottom / height, _PANEL_WIDTH / _WIDTH, (panel_height - _HEADING_HEIGHT) / height,
            ))  # fmt: skip
            _draw_panel(panel, name, lines_of[name])
        panel.set_xticks([x + 0.5 for x in range(len(margins))], map(_margin_text, margins), fontsize=7, rotation=90)
        panel.set_xlabel(label, fontsize=8)
    present = [verdict for verdict in VERDICTS if (rows["verdict"] == verdict).any()]
    patches = [Patch(color=VERDICTS[v][0], label=f"{v} {VERDICTS[v][1]}".strip()) for v in present]
    title = f"Accurate: errors up to {goal:g}. The number in a cell is the number of correct digits."
    figure.legend(handles=patches, loc="upper center", ncols=len(present), frameon=False, fontsize=8.5,
                  title=title, title_fontsize=9.5, borderaxespad=0.2)  # fmt: skip
    return figure


def _split_panels(rows: pd.DataFrame) -> dict[str, dict[str, pd.DataFrame]]:
    """Lines by label, by heading of the panel; methods with one line share the first panel."""
    shared: dict[str, pd.DataFrame] = {}
    panels: dict[str, dict[str, pd.DataFrame]] = {}
    for name, of_method in rows.groupby("method", sort=False):
        several = len(set(of_method["angles"])) > 1
        lines = {
            (str(setting), f"{angles} angles" if several else ""): line
            for (setting, angles), line in of_method.groupby(["setting", "angles"], sort=False)
        }
        if len(lines) == 1:
            shared[next(iter(lines))[0]] = next(iter(lines.values()))
            continue
        parts = [(*_parse_setting(setting), angles) for setting, angles in lines]
        heading = ", ".join(filter(None, [f"{name}: {parts[0][0]}".rstrip(": "), "angles a turn" * several]))
        labels = [", ".join(filter(None, part[1:])) for part in parts]
        panels[heading] = dict(zip(labels, lines.values(), strict=True))
    return {_SHARED_PANEL: shared, **panels} if shared else panels


def _parse_setting(setting: str) -> tuple[str, str]:
    """Name and value of the option in a label such as ``rk45(rtol=1e-06)``; empty without an option."""
    name, _, value = setting.partition("(")[2].rstrip(")").partition("=")
    return name, value


def _split_columns(heights: dict[str, float]) -> tuple[dict[str, float], dict[str, float]]:
    """Split panels, given by name and height, into a left and a right column of about the same height."""
    names, total, used, split = list(heights), sum(heights.values()), 0.0, 0
    while split < len(names) - 1 and used + heights[names[split]] / 2.0 < total / 2.0:
        used, split = used + heights[names[split]], split + 1
    split = max(split, 1)
    left, right = names[:split], names[split:] or names[-1:]
    return {name: heights[name] for name in left}, {name: heights[name] for name in right}


def _draw_panel(panel: Axes, name: str, lines: dict[str, pd.DataFrame]) -> None:
    margins = next(iter(lines.values()))["margin"].tolist()
    for y, line in enumerate(lines.values()):
        for x, (verdict, error) in enumerate(zip(line["verdict"], line["error"], strict=True)):
            colour, letter = VERDICTS[verdict]
            panel.add_patch(_cell(x, y, colour))
            text = letter or _correct_digits(error)
            panel.text(x + 0.5, y + 0.5, text, ha="center", va="center", fontsize=7, color=_text_colour(colour))
    panel.set_xlim(0, len(margins))
    panel.set_ylim(len(lines), 0)
    blocked = sum(margin > 0.0 for margin in margins)
    panel.axvline(blocked, color=style.INK, lw=2)
    panel.set_xticks([])
    panel.set_yticks([y + 0.5 for y in range(len(lines))], list(lines), fontsize=7)
    panel.tick_params(length=0)
    panel.set_title(name, fontsize=9, loc="left", pad=3)
    for spine in panel.spines.values():
        spine.set_color(style.MUTED)


def _cell(x: int, y: int, colour: str) -> Rectangle:
    from matplotlib.patches import Rectangle

    return Rectangle((x, y), 1, 1, facecolor=colour, edgecolor="white", lw=0.6)


def _correct_digits(error: float) -> str:
    """Number of correct digits, at most the 16 of a double."""
    return "" if math.isnan(error) else str(int(min(max(-math.log10(max(error, 1e-16)), 0.0), 16.0)))


def _text_colour(colour: str) -> str:
    red, green, blue = (int(colour[k : k + 2], 16) for k in (1, 3, 5))
    return style.INK if 0.3 * red + 0.6 * green + 0.1 * blue > 130 else "white"


def _margin_text(margin: float) -> str:
    if margin == 0.0:
        return "0"
    digit, exponent = f"{margin:.0e}".replace("-", "−", margin < 0.0).split("e")
    return f"{digit}e{int(exponent)}"


def turn_chart(rows: pd.DataFrame, singular_angles: Sequence[float], title: str) -> Figure:
    """Draw the error of every method over a turn on a logarithmic scale, and the singular positions, deg, as bars."""
    figure = style.new_figure(9.5, 5.0)
    panel = figure.subplots()
    for angle in singular_angles:
        panel.axvline(angle, color=style.MUTED, lw=5, alpha=0.35)
        top = panel.get_xaxis_transform()
        panel.text(angle, 0.99, f" {angle:.2f}°", transform=top, va="top", fontsize=8, color=style.INK)
    for name, line in rows.groupby("method", sort=False):
        look = style.line_style(str(name))
        errors = line["error"].clip(_SMALLEST_ERROR, _TOP_ERROR)
        panel.plot(line["crank_angle"], errors, color=look.colour, ls=look.style, lw=1.2, label=line["setting"].iloc[0])
        ended = errors.isna().to_numpy().nonzero()[0]
        if len(ended) and ended[0] > 0:
            last = ended[0] - 1
            panel.plot(line["crank_angle"].iloc[last], errors.iloc[last], "x", color=look.colour, ms=8, mew=2)
    panel.set_yscale("log")
    panel.set_xlabel("crank angle [deg]; a cross is where a method fails and says so")
    panel.set_ylabel("error of positions and velocities")
    panel.set_title(textwrap.fill(title, _LABEL_WIDTH), fontsize=10, loc="left")
    figure.legend(loc="outside right upper", frameon=False, fontsize=7.5)
    return figure


def starts_chart(starts: pd.DataFrame, counts: pd.DataFrame) -> Figure:
    """Draw each start at its frequency C1 and amplitude C0, and the shares of the outcomes of `count_outcomes`."""
    figure = new_figure(10.0, 4.6)
    chart, bars = figure.subplots(1, 2, width_ratios=[1.6, 1.0])
    for outcome in reversed(_COLOURS):
        chosen = starts[starts["outcome"] == outcome]
        chart.plot(chosen["start_c1"], chosen["start_c0"], "o", ms=3.5, mew=0, color=_COLOURS[outcome])
    chart.set_xlabel("start of the frequency C1")
    chart.set_ylabel("start of the amplitude C0")
    chart.set_title(f"fsolve on the five equations from {len(starts):,} random starts", fontsize=10, loc="left")
    present = counts[counts["starts"] > 0].iloc[::-1]
    bars.barh(present["outcome"], present["starts"], color=[_COLOURS[name] for name in present["outcome"]])
    for y, (number, share) in enumerate(zip(present["starts"], present["share"], strict=True)):
        bars.text(number, y, f" {number:,} ({share:.1%})", va="center", fontsize=8.5)
    bars.set_xlim(0, 1.35 * present["starts"].max())
    bars.set_xlabel("starts")
    bars.set_title("the scalar equation: branch 1, always", fontsize=10, loc="left")
    for panel in (chart, bars):
        panel.spines[["top", "right"]].set_visible(False)
        panel.tick_params(colors=MUTED, labelcolor="black")
    return figure
