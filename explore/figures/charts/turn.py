"""The input angle as the axis of a chart: angles to simulate at, the drive stroke, the marks."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from explore.figures.charts.style import INK, MUTED
from explore.model.quantities import FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: First and last input angle of the turn that charts show, deg.
TURN = (0.0, 360.0)


def turn_angles(anchor: float = 0.0) -> FloatArray:
    """Input angles of one turn, deg, ascending: every half degree, denser near the anchor and its opposite."""
    offsets = 0.5 * 0.75 ** np.arange(100)
    centres = anchor % 180.0 + np.array([-180.0, 0.0, 180.0, 360.0])
    near = [centre + sign * offsets for centre in centres for sign in (-1.0, 1.0)]
    angles = np.unique(np.concatenate([np.arange(0.0, 360.5, 0.5), *near]))
    return angles[(angles >= TURN[0]) & (angles <= TURN[1])]


def spans_in_turn(span: tuple[float, float]) -> list[tuple[float, float]]:
    """Split a span of input angles, deg, into the parts that lie between 0 and 360."""
    parts = [tuple(np.clip([angle + turn for angle in span], *TURN)) for turn in (-360.0, 0.0, 360.0)]
    return [(float(start), float(stop)) for start, stop in parts if stop > start]


def set_turn_axis(panel: Axes, drive: tuple[float, float] | None, marks: Mapping[str, float]) -> None:
    """Make the turn the x axis; shade the drive stroke and draw the marks, all in deg."""
    panel.set_xlim(*TURN)
    panel.set_xticks(range(0, 361, 60))
    panel.grid(color=MUTED, alpha=0.25, lw=0.5)
    for start, stop in spans_in_turn(drive) if drive else ():
        panel.axvspan(start, stop, color=MUTED, alpha=0.17, lw=0, zorder=0)
    for angle in marks.values():
        panel.axvline(angle % 360.0, color=INK, lw=0.9, ls=":")


def label_marks(panels: Iterable[Axes], marks: Mapping[str, float]) -> None:
    """Write the names of the marks above the charts."""
    for panel in panels:
        for name, angle in marks.items():
            right = angle % 360.0 > 180.0
            panel.annotate(f"{name} {angle % 360.0:.1f}°", (angle % 360.0, 1.0), (0, 3), fontsize=9, color=INK,
                           xycoords=("data", "axes fraction"), textcoords="offset points",
                           ha="right" if right else "left")  # fmt: skip
