"""One linkage in true proportions: its limit positions and the paths of its joints."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from explore.charts.style import BLUE, GREEN, INK, MUTED, ORANGE, PURPLE, heading, new_figure
from explore.vocabulary import FloatArray

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Letters of one line of the title.
_LETTERS = 80
_LIMITS = {"overlapped": (BLUE, "-", "o"), "extended": (ORANGE, "--", "s")}


def joint_paths(motion: pd.DataFrame, parameters: Mapping[str, float]) -> tuple[FloatArray, FloatArray]:
    """Where the joints between crank and coupler and between coupler and rocker are, each of shape (t, 2), mm.

    The crank's pivot is the origin, the rocker's lies to its right.

    Parameters
    ----------
    motion
        As `explore.simulate` gives it.
    parameters
        Of the design, mm.
    """
    crank, rocker = np.deg2rad(motion.index.to_numpy()), np.deg2rad(motion["rocker_angle"].to_numpy())
    pin = parameters["crank"] * np.column_stack([np.cos(crank), np.sin(crank)])
    joint = parameters["rocker"] * np.column_stack([np.cos(rocker), np.sin(rocker)])
    joint[:, 0] += parameters["ground"]
    return pin, joint


def mechanism_chart(
    motion: pd.DataFrame,
    parameters: Mapping[str, float],
    title: str,
    drive: tuple[float, float] | None = None,
    limits: Mapping[str, float] | None = None,
) -> Figure:
    """The linkage, its limit positions, and the paths of its joints and of the middle of its coupler.

    Parameters
    ----------
    motion
        Of one turn, as `explore.simulate` gives it at `explore.charts.motion.crank_angles`.
    parameters
        Of the design, mm.
    title
        Of the figure.
    drive
        Crank angles of the drive stroke, deg, drawn bold on the crank's circle; None where there are no strokes.
    limits
        Crank angles of the limit positions by name, deg; without, the linkage is drawn at crank angle 0.
    """
    figure = new_figure(9.0, 6.6)
    chart = figure.subplots()
    pin, joint = joint_paths(motion, parameters)
    chart.plot(*pin.T, color=MUTED, lw=1.1, label="path of the joint of crank and coupler")
    chart.plot(*joint.T, color=MUTED, lw=4.5, alpha=0.6, solid_capstyle="butt",
               label="path of the joint of coupler and rocker")  # fmt: skip
    chart.plot(*((pin + joint) / 2.0).T, color=PURPLE, lw=1.4, ls="-.", label="path of the middle of the coupler")
    if drive is not None:
        _stroke(chart, parameters["crank"], drive)
    ground = parameters["ground"]
    for name, angle in (limits or {"crank angle": 0.0}).items():
        colour, style, marker = _LIMITS.get(name, (INK, "-", "o"))
        place = [_at(motion, path, angle) for path in (pin, joint)]
        chain = np.array([[0.0, 0.0], *place, [ground, 0.0]])
        chart.plot(*chain.T, style, color=colour, lw=2.2, marker=marker, ms=6, mfc="white", mew=1.5, zorder=4,
                   label=f"{name}{' position, crank at' if limits else ''} {angle % 360.0:.1f}°")  # fmt: skip
    size = 0.035 * max(np.ptp(np.vstack([pin, joint, [[ground, 0.0]]]), axis=0))
    for x in (0.0, ground):
        _pivot(chart, x, size)
    chart.set_aspect("equal", adjustable="datalim")
    chart.margins(0.06)
    chart.grid(color=MUTED, alpha=0.2, lw=0.5)
    chart.set_xlabel("x [mm]")
    chart.set_ylabel("y [mm]")
    heading(figure, title, _LETTERS)
    figure.legend(loc="outside lower center", ncols=2, frameon=False, fontsize=10, handlelength=3.5)
    return figure


def _at(motion: pd.DataFrame, path: FloatArray, angle: float) -> FloatArray:
    """The point of a path at a crank angle in degrees."""
    known = motion.index.to_numpy()
    return np.array([np.interp(angle, known, values, period=360.0) for values in path.T])


def _stroke(chart: Axes, crank: float, drive: tuple[float, float]) -> None:
    """The part of the crank's circle that drives, with the sense of turning."""
    angle = np.deg2rad(np.linspace(*drive, 200))
    arc = crank * np.column_stack([np.cos(angle), np.sin(angle)])
    chart.plot(*arc.T, color=GREEN, lw=3.5, solid_capstyle="butt", zorder=2, label="crank on the drive stroke")
    chart.annotate("", arc[110], arc[95], zorder=3,
                   arrowprops={"arrowstyle": "-|>", "color": GREEN, "lw": 2.0, "mutation_scale": 20})  # fmt: skip


def _pivot(chart: Axes, x: float, size: float) -> None:
    """A pivot on the ground: a triangle on a hatched strip."""
    from matplotlib.patches import Polygon, Rectangle

    corners = [(x, 0.0), (x - 0.7 * size, -size), (x + 0.7 * size, -size)]
    chart.add_patch(Polygon(corners, closed=True, fc="white", ec=INK, lw=1.4, zorder=3))
    strip = Rectangle((x - 1.2 * size, -1.55 * size), 2.4 * size, 0.55 * size, fc="none", ec=INK, hatch="/////", lw=0)
    chart.add_patch(strip)
    chart.plot([x - 1.2 * size, x + 1.2 * size], [-size, -size], color=INK, lw=1.4, zorder=3)
