"""The input angle as the axis of a chart: angles to simulate at, the drive stroke, the marks."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from explore.figures.charts.style import INK, MUTED
from explore.model.quantities import FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Angle from which on a crank angle is that of a whole turn, far above rounding errors, deg.
_WHOLE = 360.0 - 1e-9


@dataclass(frozen=True)
class Span:
    """The input angles of a motion that figures show, deg: by default the turn from 0."""

    first: float = 0.0
    last: float = 360.0

    @property
    def is_turn(self) -> bool:
        """Whether it is a full turn."""
        return self.last - self.first >= 360.0

    @property
    def ends(self) -> tuple[float, float]:
        """First and last input angle, deg."""
        return self.first, self.last

    def shown(self, angle: float) -> float:
        """An input angle, deg, of a turn less whole turns; what rounding leaves below a whole one is 0."""
        if not self.is_turn:
            return angle
        rest = angle % 360.0
        return rest if rest < _WHOLE else 0.0

    def evenly(self, count: int) -> FloatArray:
        """Evenly spaced input angles, deg, from the first to the last."""
        return np.linspace(self.first, self.last, count)

    def once(self, count: int) -> FloatArray:
        """Input angles, deg, evenly in time, of a motion that begins again: a turn, or to and fro as a sine."""
        if self.is_turn:
            return np.linspace(self.first, self.last, count, endpoint=False)
        share = 0.5 - 0.5 * np.cos(np.linspace(0.0, 2.0 * np.pi, count, endpoint=False))
        return self.first + (self.last - self.first) * share

    def densely(self, anchor: float) -> FloatArray:
        """Input angles, deg, ascending: every half degree, denser near the anchor and its opposite."""
        offsets = 0.5 * 0.75 ** np.arange(100)
        centres = anchor % 180.0 + np.arange(-720.0, 721.0, 180.0)
        near = [centre + sign * offsets for centre in centres for sign in (-1.0, 1.0)]
        angles = np.unique(np.concatenate([np.arange(self.first, self.last, 0.5), [self.last], *near]))
        return angles[(angles >= self.first) & (angles <= self.last)]

    def parts(self, span: tuple[float, float]) -> list[tuple[float, float]]:
        """The parts of other input angles, first and last of each, deg, that lie within these."""
        parts = [tuple(np.clip([angle + turn for angle in span], *self.ends)) for turn in (-360.0, 0.0, 360.0)]
        return [(float(start), float(stop)) for start, stop in parts if stop > start]


#: The turn that charts show.
TURN = Span()


def set_turn_axis(
    panel: Axes, drive: tuple[float, float] | None, marks: Mapping[str, float], span: Span = TURN
) -> None:
    """Make the input angle the x axis; shade the drive stroke and draw the marks, all in deg."""
    panel.set_xlim(*span.ends)
    if span.is_turn:
        panel.set_xticks(range(0, 361, 60))
    panel.grid(color=MUTED, alpha=0.25, lw=0.5)
    for start, stop in span.parts(drive) if drive else ():
        panel.axvspan(start, stop, color=MUTED, alpha=0.17, lw=0, zorder=0)
    for angle in marks.values():
        panel.axvline(span.shown(angle), color=INK, lw=0.9, ls=":")


def label_marks(panels: Iterable[Axes], marks: Mapping[str, float], span: Span = TURN) -> None:
    """Write the names of the marks above the charts."""
    middle = 0.5 * (span.first + span.last)
    for panel in panels:
        for name, angle in marks.items():
            right = span.shown(angle) > middle
            panel.annotate(f"{name} {span.shown(angle):.1f}°", (span.shown(angle), 1.0), (0, 3), fontsize=9, color=INK,
                           xycoords=("data", "axes fraction"), textcoords="offset points",
                           ha="right" if right else "left")  # fmt: skip
