"""A slider in a straight guide, tied by a link to a point of a linkage, that rests while the input turns: a dwell."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from explore.model.drawing import Drawing, Guide, Link, Panel, Path, Pose, Vector
from explore.model.points import drawn_name
from explore.model.quantities import FloatArray, Signal

#: Name of the slider as a point of a drawing.
SLIDER = "slider"
#: Name of the slider's travel as a signal.
TRAVEL = "slider_travel"
#: Columns of results that describe a slider: its rest, mm, its guide, deg, its link, mm, and the dwell, deg.
COLUMNS = ("rest_x", "rest_y", "guide_angle", "slider_link", "dwell_start", "dwell_angle")

TRAVEL_SIGNAL = Signal(TRAVEL, "mm", "travel of the slider along its guide from where it rests", row=-1, needs=0)
TRAVEL_PANEL = Panel("travel of the slider", (TRAVEL,))


@dataclass(frozen=True)
class OutputSlider:
    """A slider in the plane of a linkage.

    Attributes
    ----------
    point
        The point of the drawing that the link is tied to.
    rest
        Where the slider rests, mm.
    guide_angle
        Of the guide through that place, deg.
    link
        Length of the link, mm.
    dwell
        First and last input angle of the dwell, deg.
    side
        1.0 if the slider is ahead of the point along the guide, -1.0 if it is behind.
    """

    point: str
    rest: tuple[float, float]
    guide_angle: float
    link: float
    dwell: tuple[float, float]
    side: float = 1.0

    @classmethod
    def of(cls, row: Mapping[str, object], points: tuple[str, ...]) -> OutputSlider | None:
        """The slider of a row of results; None where its columns describe none."""
        if len(points) != 1 or not all(name in row for name in COLUMNS):
            return None
        x, y, guide_angle, link, start, span = (float(str(row[name])) for name in COLUMNS)
        return cls(drawn_name(points[0]), (x, y), guide_angle, link, (start, start + span))

    def beside(self, place: FloatArray) -> OutputSlider:
        """The slider on the side of a place of its point in the dwell, mm, shape (2,), where it rests."""
        along = (np.subtract(place, self.rest)) @ self._direction
        return replace(self, side=-1.0 if along > 0.0 else 1.0)

    def completed(self, pose: Pose, drawing: Drawing) -> Pose:
        """The pose with the travel; the drawing is that of the linkage alone."""
        apart = pose.sum(drawing.points[self.point]) - self.rest
        along = apart @ self._direction
        across = apart @ np.array([-self._direction[1], self._direction[0]])
        with np.errstate(invalid="ignore"):
            travel = along + self.side * np.sqrt(self.link**2 - across**2)
        return replace(pose, lengths={**pose.lengths, TRAVEL: travel})

    def drawn(self, drawing: Drawing) -> Drawing:
        """The drawing of the linkage with the slider, its guide and its link."""
        x, y = self.rest
        place = (Vector(x), Vector(y, 90.0), Vector(TRAVEL, self.guide_angle))
        return replace(
            drawing,
            points={**drawing.points, SLIDER: place},
            links=(*drawing.links, Link("link of the slider", (self.point, SLIDER))),
            guides=(*drawing.guides, Guide(SLIDER, self.guide_angle)),
            paths=(*drawing.paths, Path(SLIDER, "path of the slider", "output")),
        )

    @property
    def _direction(self) -> FloatArray:
        angle = np.deg2rad(self.guide_angle)
        return np.array([np.cos(angle), np.sin(angle)])
