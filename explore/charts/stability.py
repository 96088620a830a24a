"""Maps of the verdicts on methods: distance to the change point over setting."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from explore.charts.style import BLUE, BROWN, GREEN, INK, MUTED, ORANGE, PURPLE, RED, SKY

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.patches import Rectangle

#: Colour and letter of each verdict: reported failures are pale, silent ones strong.
VERDICTS = {
    "accurate": (GREEN, ""),
    "inaccurate": (ORANGE, ""),
    "correctly rejected": ("#d9dee3", "·"),
    "reported failure": (SKY, "g"),
    "raised": (BLUE, "e"),
    "unreported NaN": (PURPLE, "N"),
    "false success": (BROWN, "!"),
    "wrong branch": (RED, "B"),
}
#: Panel of the methods that have one setting each.
_SHARED_PANEL = "methods of one setting"
#: Height of the heading of a panel and of each of its lines, inches.
_HEADING_HEIGHT, _LINE_HEIGHT = 0.3, 0.17


def stability_chart(rows: pd.DataFrame, goal: float) -> Figure:
    """Draw a panel per method, with margins as columns and settings as lines; a cell shows the verdict and the digits.

    Parameters
    ----------
    rows
        The rows of `explore.comparison.stability.map_stability`.
    goal
        Largest error of a motion that counts as accurate.
    """
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

    lines_of = _split_panels(rows)
    heights = [_HEADING_HEIGHT + _LINE_HEIGHT * len(lines) for lines in lines_of.values()]
    left, right = _split_columns(list(lines_of), heights)
    height = max(sum(h for _, h in left), sum(h for _, h in right)) + 1.3
    figure = Figure(figsize=(11.0, height), layout="constrained")
    columns = figure.subfigures(1, 2, squeeze=False)[0]
    for column, names in zip(columns, (left, right), strict=True):
        panels = column.subplots(len(names), 1, squeeze=False, height_ratios=[h for _, h in names]).ravel()
        for panel, (name, _) in zip(panels, names, strict=True):
            _draw_panel(panel, name, lines_of[name])
        margins = rows["margin"].drop_duplicates()
        panels[-1].set_xticks(
            [x + 0.5 for x in range(len(margins))], map(_margin_text, margins), fontsize=7, rotation=90
        )
        panels[-1].set_xlabel("Grashof margin over the longest link; right of the bar no full turn exists", fontsize=8)
    present = [verdict for verdict in VERDICTS if (rows["verdict"] == verdict).any()]
    patches = [Patch(color=VERDICTS[v][0], label=f"{v} {VERDICTS[v][1]}".strip()) for v in present]
    title = f"Accurate: errors up to {goal:g}. The number in a cell is the number of correct digits."
    figure.legend(handles=patches, loc="outside upper center", ncols=len(present), frameon=False, fontsize=8.5,
                  title=title, title_fontsize=9.5)  # fmt: skip
    return figure


def _split_panels(rows: pd.DataFrame) -> dict[str, dict[str, pd.DataFrame]]:
    """Lines by label, by heading of the panel; methods with one line share a panel."""
    panels: dict[str, dict[str, pd.DataFrame]] = {}
    for name, of_method in rows.groupby("method", sort=False):
        several = len(set(of_method["angles"])) > 1
        lines = {
            (str(setting), f"{angles} angles" if several else ""): line
            for (setting, angles), line in of_method.groupby(["setting", "angles"], sort=False)
        }
        if len(lines) == 1:
            panels.setdefault(_SHARED_PANEL, {})[next(iter(lines))[0]] = next(iter(lines.values()))
            continue
        parts = [(*_parse_setting(setting), angles) for setting, angles in lines]
        heading = ", ".join(filter(None, [f"{name}: {parts[0][0]}".rstrip(": "), "angles a turn" * several]))
        labels = [", ".join(filter(None, part[1:])) for part in parts]
        panels[heading] = dict(zip(labels, lines.values(), strict=True))
    return panels


def _parse_setting(setting: str) -> tuple[str, str]:
    """Name and value of the option in a label such as ``rk45(rtol=1e-06)``; empty without an option."""
    name, _, value = setting.partition("(")[2].rstrip(")").partition("=")
    return name, value


def _split_columns(names: list[str], heights: list[float]) -> tuple[list[tuple[str, float]], list[tuple[str, float]]]:
    """Names and heights of the panels of the left and of the right column, which have about the same height."""
    total, used, split = sum(heights), 0.0, 0
    while split < len(names) - 1 and used + heights[split] / 2.0 < total / 2.0:
        used, split = used + heights[split], split + 1
    pairs = list(zip(names, heights, strict=True))
    split = max(split, 1)
    return pairs[:split], pairs[split:] or pairs[-1:]


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
    panel.axvline(blocked, color=INK, lw=2)
    panel.set_xticks([])
    panel.set_yticks([y + 0.5 for y in range(len(lines))], list(lines), fontsize=7)
    panel.tick_params(length=0)
    panel.set_title(name, fontsize=9, loc="left", pad=3)
    for spine in panel.spines.values():
        spine.set_color(MUTED)


def _cell(x: int, y: int, colour: str) -> Rectangle:
    from matplotlib.patches import Rectangle

    return Rectangle((x, y), 1, 1, facecolor=colour, edgecolor="white", lw=0.6)


def _correct_digits(error: float) -> str:
    """Number of correct digits, at most the 16 of a double."""
    return "" if math.isnan(error) else str(int(min(max(-math.log10(max(error, 1e-16)), 0.0), 16.0)))


def _text_colour(colour: str) -> str:
    red, green, blue = (int(colour[k : k + 2], 16) for k in (1, 3, 5))
    return INK if 0.3 * red + 0.6 * green + 0.1 * blue > 130 else "white"


def _margin_text(margin: float) -> str:
    if margin == 0.0:
        return "0"
    digit, exponent = f"{margin:.0e}".replace("-", "−", margin < 0.0).split("e")
    return f"{digit}e{int(exponent)}"
