"""One linkage in true proportions: its limit positions and the paths of its joints."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from explore.charts.simulation import SimulatedDesign, simulate_design
from explore.charts.style import BLUE, GREEN, INK, MUTED, ORANGE, PURPLE, new_figure, write_heading
from explore.model.quantities import FloatArray
from explore.store.open_results import ResultsOrPath, results_of

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_LIMITS = {"overlapped": (BLUE, "-", "o"), "extended": (ORANGE, "--", "s")}


def mechanism_chart(results: ResultsOrPath, *, design: int | None = None) -> Figure:
    """Draw the linkage of one design in true proportions.

    Both limit positions, the paths of the joints and of the middle of the coupler, and the drive stroke where the study
    uses clutches; without limit positions the linkage at crank angle 0.

    Parameters
    ----------
    results
        The results of a sweep, finished or not, or the path of their file.
    design
        Number of the design; the best of the Pareto set unless given.

    Raises
    ------
    MotionError
        If the crank of the design cannot make a full turn.
    RequestError
        If no number is given and no design is feasible.
    ResultsError
        If the design is not in the file, or the window of the study cannot be read.
    """
    return mechanism_figure(simulate_design(results_of(results), design))


def mechanism_figure(simulated: SimulatedDesign) -> Figure:
    """Draw the linkage with a heading and a legend."""
    figure = new_figure(9.0, 6.6)
    draw_linkage(figure.subplots(), simulated)
    write_heading(figure, simulated.title, 80)
    figure.legend(loc="outside lower center", ncols=2, frameon=False, fontsize=10, handlelength=3.5)
    return figure


def joint_paths(motion: pd.DataFrame, parameters: Mapping[str, float]) -> tuple[FloatArray, FloatArray]:
    """Paths of the joint between crank and coupler and of that between coupler and rocker.

    The origin is the pivot of the crank; the pivot of the rocker lies to its right.

    Parameters
    ----------
    motion
        A motion of `explore.simulate`, at t crank angles.
    parameters
        Lengths of the design, mm.

    Returns
    -------
    pair of (t, 2) arrays
        x and y, mm.
    """
    crank, rocker = np.deg2rad(motion.index.to_numpy()), np.deg2rad(motion["rocker_angle"].to_numpy())
    crank_path = parameters["crank"] * np.column_stack([np.cos(crank), np.sin(crank)])
    rocker_path = parameters["rocker"] * np.column_stack([np.cos(rocker), np.sin(rocker)])
    rocker_path[:, 0] += parameters["ground"]
    return crank_path, rocker_path


def draw_linkage(panel: Axes, simulated: SimulatedDesign) -> None:
    """Draw the linkage of `mechanism_chart` into existing axes."""
    motion, parameters, limits = simulated.motion, simulated.parameters, simulated.limits
    ground = parameters["ground"]
    crank_path, rocker_path = joint_paths(motion, parameters)
    panel.plot(*crank_path.T, color=MUTED, lw=1.1, label="path of the joint of crank and coupler")
    panel.plot(*rocker_path.T, color=MUTED, lw=4.5, alpha=0.6, solid_capstyle="butt",
               label="path of the joint of coupler and rocker")  # fmt: skip
    panel.plot(*((crank_path + rocker_path) / 2.0).T, color=PURPLE, lw=1.4, ls="-.",
               label="path of the middle of the coupler")  # fmt: skip
    if simulated.drive is not None:
        _draw_stroke(panel, parameters["crank"], simulated.drive)
    for name, angle in (limits or {"crank angle": 0.0}).items():
        colour, style, marker = _LIMITS.get(name, (INK, "-", "o"))
        joints = [_point_at(motion, path, angle) for path in (crank_path, rocker_path)]
        chain = np.array([[0.0, 0.0], *joints, [ground, 0.0]])
        panel.plot(*chain.T, style, color=colour, lw=2.2, marker=marker, ms=6, mfc="white", mew=1.5, zorder=4,
                   label=f"{name}{' position, crank at' if limits else ''} {angle % 360.0:.1f}°")  # fmt: skip
    size = 0.035 * max(np.ptp(np.vstack([crank_path, rocker_path, [[ground, 0.0]]]), axis=0))
    for x in (0.0, ground):
        _draw_pivot(panel, x, size)
    panel.set_aspect("equal", adjustable="datalim")
    panel.margins(0.06)
    panel.grid(color=MUTED, alpha=0.2, lw=0.5)
    panel.set_xlabel("x [mm]")
    panel.set_ylabel("y [mm]")


def _point_at(motion: pd.DataFrame, path: FloatArray, angle: float) -> FloatArray:
    """Interpolate the point of a path at a crank angle, deg; shape (2,)."""
    angles = motion.index.to_numpy()
    return np.array([np.interp(angle, angles, coordinate, period=360.0) for coordinate in path.T])


def _draw_stroke(panel: Axes, crank: float, drive: tuple[float, float]) -> None:
    """Draw the part of the crank's circle that is the drive stroke, with an arrow in the sense of rotation."""
    angle = np.deg2rad(np.linspace(*drive, 200))
    arc = crank * np.column_stack([np.cos(angle), np.sin(angle)])
    panel.plot(*arc.T, color=GREEN, lw=3.5, solid_capstyle="butt", zorder=2, label="crank on the drive stroke")
    panel.annotate("", arc[110], arc[95], zorder=3,
                   arrowprops={"arrowstyle": "-|>", "color": GREEN, "lw": 2.0, "mutation_scale": 20})  # fmt: skip


def _draw_pivot(panel: Axes, x: float, size: float) -> None:
    """Draw a pivot on the ground: a triangle on a hatched strip."""
    from matplotlib.patches import Polygon, Rectangle

    corners = [(x, 0.0), (x - 0.7 * size, -size), (x + 0.7 * size, -size)]
    panel.add_patch(Polygon(corners, closed=True, fc="white", ec=INK, lw=1.4, zorder=3))
    strip = Rectangle((x - 1.2 * size, -1.55 * size), 2.4 * size, 0.55 * size, fc="none", ec=INK, hatch="/////", lw=0)
    panel.add_patch(strip)
    panel.plot([x - 1.2 * size, x + 1.2 * size], [-size, -size], color=INK, lw=1.4, zorder=3)
