"""A linkage on its target: its path against the target, how far they lie apart, and the transmission angle."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from explore.figures.charts.bounds import draw_bounds
from explore.figures.charts.mechanism import draw_ground, set_axes
from explore.figures.charts.style import BLUE, GREEN, INK, MUTED, ORANGE, PURPLE, RED, new_figure, write_heading
from explore.figures.charts.targets import DrawnTarget, draw_target, target_of
from explore.figures.charts.turn import set_turn_axis
from explore.figures.simulation import SimulatedDesign, drawing_of, simulate_design
from explore.model.drawing import Drawing
from explore.results.store.open_results import ResultsOrPath, results_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_LINKS = (GREEN, ORANGE, BLUE, PURPLE)
#: Signal of the quality of the motion, drawn where the mechanism has it.
_TRANSMISSION = "transmission_angle"
#: Top of the axis of distances over the largest at a given point, for open targets, whose ends the path leaves.
_BEYOND = 3.0


def path_chart(results: ResultsOrPath, *, design: int | None = None) -> Figure:
    """Draw the linkage of one design with its path against the target of the study.

    Beside it, over the input angle: the distance of the path from the target, with the distances of the given points
    from the path, and the transmission angle.

    Parameters and errors are those of `motion_chart`, and `RequestError` if the study has no target.
    """
    simulated = simulate_design(results_of(results), design)
    return path_figure(simulated, target_of(simulated))


def path_figure(simulated: SimulatedDesign, target: DrawnTarget) -> Figure:
    """Draw the three panels with a heading and a legend."""
    figure = new_figure(12.5, 6.6)
    left, right = figure.subfigures(1, 2, squeeze=False, width_ratios=[1.15, 1.0])[0]
    has_transmission = _TRANSMISSION in simulated.motion
    plane = left.subplots()
    panels = right.subplots(1 + has_transmission, 1, sharex=True, squeeze=False)[:, 0]
    draw_on_target(plane, simulated, target)
    draw_path_error(panels[0], simulated, target)
    if has_transmission:
        _draw_transmission(panels[1], simulated)
    panels[-1].set_xlabel(f"{simulated.mechanism.input_angle} [deg]")
    left.legend(loc="outside lower left", ncols=3, frameon=False, fontsize=10, handlelength=2.5)
    write_heading(figure, simulated.title, 110)
    return figure


def draw_on_target(panel: Axes, simulated: SimulatedDesign, target: DrawnTarget) -> None:
    """Draw the links at the first point of the target, the path of the point, and the target."""
    drawing = drawing_of(simulated)
    points = simulated.pose().points(drawing)
    size = 0.03 * max(np.ptp(np.vstack([*points.values(), target.corners]), axis=0))
    path = points[target.point]
    panel.plot(*path.T, color=PURPLE, lw=1.8, zorder=3, label=f"path of {target.name}")
    _draw_links(panel, simulated, drawing, float(target.angles[0]))
    draw_ground(panel, drawing, points, size)
    draw_target(panel, target.points, is_closed=target.is_closed)
    set_axes(panel, simulated.units.scale("mm"))


def _draw_links(panel: Axes, simulated: SimulatedDesign, drawing: Drawing, angle: float) -> None:
    """Draw the links at an input angle, deg; a link with points besides its ends as a body."""
    places = simulated.pose([angle % 360.0]).points(drawing)
    line: dict[str, Any] = {"lw": 2.4, "marker": "o", "ms": 6, "mfc": "white", "mew": 1.5, "zorder": 4}
    for number, link in enumerate(drawing.links):
        chain = np.array([places[name][0] for name in link.points])
        is_body = len(chain) > 2
        colour = ORANGE if is_body else _LINKS[number % len(_LINKS)]
        if is_body:
            panel.fill(*chain.T, color=colour, alpha=0.13, lw=0, zorder=2)
        panel.plot(*chain.T, color=colour, label=None if is_body else link.name, **line)


def draw_path_error(panel: Axes, simulated: SimulatedDesign, target: DrawnTarget) -> None:
    """Draw the distance of the path from the target over the turn, and the given points at their input angles."""
    scale = simulated.units.scale("mm")
    factor = float(scale.factor)
    angle, distances = simulated.motion.index.to_numpy(), target.distances_along(simulated) * factor
    at_points = target.distances_at_points(simulated) * factor
    panel.plot(angle, distances, color=PURPLE, lw=1.8, label=f"path of {target.name} to the lines between the points")
    panel.plot(target.angles % 360.0, at_points, ls="", marker="o", ms=5 if len(at_points) <= 30 else 3, mew=0,
               color=RED, label="given points to the path", zorder=4)  # fmt: skip
    rms = float(np.sqrt(np.average(at_points**2, weights=target.weights)))
    panel.axhline(rms, color=RED, lw=1.0, ls="--", label=f"rms of the given points, {rms:.4g} {scale.shown}")
    top = float(at_points.max()) * _BEYOND
    highest = max(1.5 * float(np.nanmax(distances)), 1.1 * float(at_points.max()))  # of points at given crank angles
    panel.set_ylim(0.0, highest if target.is_closed or not top else min(top, highest))
    set_turn_axis(panel, None, {})
    panel.set_ylabel(f"distance [{scale.shown}]")
    panel.legend(loc="best", frameon=True, framealpha=0.85, edgecolor="none", fontsize=9)


def _draw_transmission(panel: Axes, simulated: SimulatedDesign) -> None:
    """Draw the transmission angle with the study's bounds and its farthest from 90 deg."""
    angle, values = simulated.motion.index.to_numpy(), simulated.motion[_TRANSMISSION].to_numpy()
    panel.plot(angle, values, color=GREEN, lw=1.8)
    worst = int(np.argmax(np.abs(values - 90.0)))
    panel.plot(angle[worst], values[worst], "o", color=INK, ms=5)
    side: dict[str, Any] = (
        {"ha": "left"} if angle[worst] < 30.0 else {"ha": "right"} if angle[worst] > 330.0 else {"ha": "center"}
    )
    above = values[worst] > 90.0
    panel.annotate(f"{values[worst]:.1f}°", (angle[worst], values[worst]), (0, 7 if above else -7), **side,
                   textcoords="offset points", va="bottom" if above else "top", fontsize=9, color=INK)  # fmt: skip
    panel.axhline(90.0, color=MUTED, lw=0.8, ls=":")
    low, high = float(values.min()), float(values.max())
    panel.set_ylim(max(0.0, min(low - 20.0, 30.0)), min(180.0, max(high + 20.0, 150.0)))
    draw_bounds(panel, angle, {_TRANSMISSION: values}, simulated.bounds, 1.0)
    set_turn_axis(panel, None, {})
    panel.set_ylabel("transmission angle [deg]")
