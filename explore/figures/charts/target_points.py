"""The points of a target in its plane."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from explore.figures.charts.style import RED
from explore.model.quantities import FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Number of points from which on their marks shrink.
_MANY = 30


def draw_target(panel: Axes, points: FloatArray, *, is_closed: bool) -> None:
    """Draw the points of a target, shape (n, 2), joined by a line; of an open one the first is marked."""
    joined = np.vstack([points, points[:1]]) if is_closed else points
    style: dict[str, Any] = {"color": RED, "zorder": 5}
    size = 5.0 if len(points) <= _MANY else 3.0
    panel.plot(*joined.T, lw=0.9, ls="--", alpha=0.7, **style)
    panel.plot(*points.T, ls="", marker="o", ms=size, mew=0, label=f"target, {len(points):,} points", **style)
    if not is_closed:
        panel.plot(
            *points[:1].T, ls="", marker="o", ms=size + 4.0, mfc="none", mew=1.3, label="its first point", **style
        )
