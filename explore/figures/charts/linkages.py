"""Four-bar linkages in their plane.

Points of the plane are complex, as in `explore.synthesis.linkages`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from explore.figures.charts.mechanism import draw_pivot
from explore.figures.charts.style import INK, MUTED
from explore.model.quantities import FloatArray
from explore.synthesis.linkages import FourBar

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Number of crank angles at which a path is drawn.
_N_ANGLES = 721


def crank_angles(linkage: FourBar, first: float = 0.0) -> FloatArray:
    """Angles of the crank in the plane at which a linkage can be drawn, rad, ascending: a turn, or one arc.

    `first` is where a turn begins, or an angle of the arc of a crank that does not turn fully, which may have two.
    """
    crank, coupler, rocker, ground = linkage.lengths
    frame = float(np.angle(linkage.rocker_pivot - linkage.crank_pivot))
    # The diagonal from the pin of the crank to the pivot of the rocker closes a triangle with coupler and rocker.
    diagonals = np.array([abs(coupler - rocker), coupler + rocker])
    nearest, farthest = (crank**2 + ground**2 - diagonals**2) / (2.0 * crank * ground)
    if nearest >= 1.0 and farthest <= -1.0:
        return first + np.linspace(0.0, 2.0 * np.pi, _N_ANGLES)
    low, high = np.arccos(np.clip([nearest, farthest], -1.0, 1.0))
    # Square-root ends: denser there.
    share = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, _N_ANGLES))
    if nearest >= 1.0:
        return np.asarray(frame - high + 2.0 * high * share)
    if farthest <= -1.0:
        return np.asarray(frame + low + 2.0 * (np.pi - low) * share)
    side = 1.0 if np.sin(first - frame) >= 0.0 else -1.0
    return np.sort(frame + side * (low + (high - low) * share))


def draw_linkage(
    panel: Axes, linkage: FourBar, angle: float, *, colour: str = INK, label: str = "", size: float | None = None
) -> None:
    """Draw a linkage at an angle of its crank in the plane, rad, its coupler as a triangle.

    `size` is that of a pivot in the units of the axes, a share of the linkage's unless given.
    """
    pin, other = complex(linkage.crank_pins(np.array([angle]))[0]), complex(linkage.rocker_pins(np.array([angle]))[0])
    point = pin + linkage.point * (other - pin)
    size = size or 0.035 * max(linkage.lengths)
    body = np.array([pin, point, other, pin])
    line: dict[str, Any] = {"color": colour, "lw": 2.2, "zorder": 4, "solid_joinstyle": "round"}
    panel.fill(body.real, body.imag, color=colour, alpha=0.13, lw=0, zorder=3)
    joints: dict[str, Any] = {"marker": "o", "ms": 6, "mfc": "white", "mew": 1.5}
    for number, link in enumerate(([linkage.crank_pivot, pin], body, [other, linkage.rocker_pivot])):
        places = np.array(link)
        panel.plot(places.real, places.imag, **line, **joints, label=label if number == 0 else None)
    for pivot in (linkage.crank_pivot, linkage.rocker_pivot):
        draw_pivot(panel, np.array([pivot.real, pivot.imag]), size)


def set_plane(panel: Axes, unit: str = "mm") -> None:
    """Give the axes true proportions, a unit and a pale grid."""
    panel.set_aspect("equal", adjustable="datalim")
    panel.margins(0.06)
    panel.grid(color=MUTED, alpha=0.2, lw=0.5)
    panel.set_xlabel(f"x [{unit}]" if unit else "x")
    panel.set_ylabel(f"y [{unit}]" if unit else "y")
