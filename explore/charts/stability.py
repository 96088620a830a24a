"""Maps of where methods break: distance to the change point against setting."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from explore.charts.style import BLUE, BROWN, GREEN, INK, MUTED, ORANGE, PURPLE, RED, SKY

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.patches import Rectangle

#: Colour and letter of each verdict: what is said is pale, what is silently wrong is strong.
VERDICTS = {
    "right": (GREEN, ""),
    "inaccurate": (ORANGE, ""),
    "rightly refused": ("#d9dee3", "·"),
    "gave up and said so": (SKY, "g"),
    "raised": (BLUE, "e"),
    "silent NaN": (PURPLE, "N"),
    "ok where none is": (BROWN, "!"),
    "wrong branch": (RED, "B"),
}
#: Methods in one panel: those without a setting are a line each.
_TOGETHER = "methods of one setting"
#: Height of a panel's heading and of each of its lines, inches.
_HEADING, _LINE = 0.3, 0.17


def stability_chart(rows: pd.DataFrame, goal: float) -> Figure:
    """One panel a method: margin to the right, a line for each setting; a cell says the verdict and the digits.

    Parameters
    ----------
    rows
        Of `explore.comparison.stability.map_stability`.
    goal
        The error up to which a motion counted as right.
    """
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

    panels = _panels(rows)
    heights = [_HEADING + _LINE * len(lines) for lines in panels.values()]
    left, right = _two_columns(list(panels), heights)
    height = max(sum(h for _, h in left), sum(h for _, h in right)) + 1.3
    figure = Figure(figsize=(11.0, height), layout="constrained")
    columns = figure.subfigures(1, 2, squeeze=False)[0]
    for column, names in zip(columns, (left, right), strict=True):
        charts = column.subplots(len(names), 1, squeeze=False, height_ratios=[h for _, h in names]).ravel()
        for chart, (name, _) in zip(charts, names, strict=True):
            _panel(chart, name, panels[name])
        margins = rows["margin"].drop_duplicates()
        charts[-1].set_xticks([x + 0.5 for x in range(len(margins))], map(_power, margins), fontsize=7, rotation=90)
        charts[-1].set_xlabel("Grashof margin over the longest link; right of the bar no turn exists", fontsize=8)
    present = [verdict for verdict in VERDICTS if (rows["verdict"] == verdict).any()]
    patches = [Patch(color=VERDICTS[v][0], label=f"{v} {VERDICTS[v][1]}".strip()) for v in present]
    title = f"Where methods break. Right: errors up to {goal:g}. The number in a cell counts the correct digits."
    figure.legend(handles=patches, loc="outside upper center", ncols=len(present), frameon=False, fontsize=8.5,
                  title=title, title_fontsize=9.5)  # fmt: skip
    return figure


def _panels(rows: pd.DataFrame) -> dict[str, dict[str, pd.DataFrame]]:
    """Lines by panel; methods of one line share a panel. Headings and labels do not repeat one another."""
    panels: dict[str, dict[str, pd.DataFrame]] = {}
    for name, of_method in rows.groupby("method", sort=False):
        several = len(set(of_method["angles"])) > 1
        lines = {
            (str(setting), f"{angles} angles" if several else ""): line
            for (setting, angles), line in of_method.groupby(["setting", "angles"], sort=False)
        }
        if len(lines) == 1:
            panels.setdefault(_TOGETHER, {})[next(iter(lines))[0]] = next(iter(lines.values()))
            continue
        parts = [(*_field(setting), angles) for setting, angles in lines]
        heading = ", ".join(filter(None, [f"{name}: {parts[0][0]}".rstrip(": "), "angles a turn" * several]))
        labels = [", ".join(filter(None, part[1:])) for part in parts]
        panels[heading] = dict(zip(labels, lines.values(), strict=True))
    return panels


def _field(setting: str) -> tuple[str, str]:
    """The name and the value in a label such as ``rk45(rtol=1e-06)``; empty where there is none."""
    name, _, value = setting.partition("(")[2].rstrip(")").partition("=")
    return name, value


def _two_columns(names: list[str], heights: list[float]) -> tuple[list[tuple[str, float]], list[tuple[str, float]]]:
    """Panels in reading order, in two columns of about the same height."""
    total, used, split = sum(heights), 0.0, 0
    while split < len(names) - 1 and used + heights[split] / 2.0 < total / 2.0:
        used, split = used + heights[split], split + 1
    pairs = list(zip(names, heights, strict=True))
    split = max(split, 1)
    return pairs[:split], pairs[split:] or pairs[-1:]


def _panel(chart: Axes, name: str, lines: dict[str, pd.DataFrame]) -> None:
    margins = next(iter(lines.values()))["margin"].tolist()
    for y, line in enumerate(lines.values()):
        for x, (verdict, error) in enumerate(zip(line["verdict"], line["error"], strict=True)):
            colour, letter = VERDICTS[verdict]
            chart.add_patch(_cell(x, y, colour))
            text = letter or _digits(error)
            chart.text(x + 0.5, y + 0.5, text, ha="center", va="center", fontsize=7, color=_ink_on(colour))
    chart.set_xlim(0, len(margins))
    chart.set_ylim(len(lines), 0)
    blocked = sum(margin > 0.0 for margin in margins)
    chart.axvline(blocked, color=INK, lw=2)
    chart.set_xticks([])
    chart.set_yticks([y + 0.5 for y in range(len(lines))], list(lines), fontsize=7)
    chart.tick_params(length=0)
    chart.set_title(name, fontsize=9, loc="left", pad=3)
    for spine in chart.spines.values():
        spine.set_color(MUTED)


def _cell(x: int, y: int, colour: str) -> Rectangle:
    from matplotlib.patches import Rectangle

    return Rectangle((x, y), 1, 1, facecolor=colour, edgecolor="white", lw=0.6)


def _digits(error: float) -> str:
    """Correct digits, at most those of a double."""
    return "" if math.isnan(error) else str(int(min(max(-math.log10(max(error, 1e-16)), 0.0), 16.0)))


def _ink_on(colour: str) -> str:
    red, green, blue = (int(colour[k : k + 2], 16) for k in (1, 3, 5))
    return INK if 0.3 * red + 0.6 * green + 0.1 * blue > 130 else "white"


def _power(margin: float) -> str:
    if margin == 0.0:
        return "0"
    digit, exponent = f"{margin:.0e}".replace("-", "−", margin < 0.0).split("e")
    return f"{digit}e{int(exponent)}"
