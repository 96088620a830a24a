"""One mechanism in true proportions: its limit positions, the paths of its points, the curves of its bodies."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import cycle
from typing import TYPE_CHECKING, Any

import numpy as np

from explore.base.units.shown import Scale
from explore.figures.charts.style import BLUE, GREEN, INK, MUTED, ORANGE, PURPLE, new_figure, write_heading
from explore.figures.charts.targets import draw_target
from explore.figures.simulation import SimulatedDesign, drawing_of, simulate_design
from explore.model.drawing import Drawing, Pose, Profile
from explore.model.quantities import FloatArray
from explore.results.store.open_results import ResultsOrPath, results_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Colour, line and mark of each position that is drawn, in the order of the marks.
_POSITIONS = ((BLUE, "-", "o"), (ORANGE, "--", "s"))
#: Lines of the paths of joints, of the output to and fro, and of points of interest.
_PATHS: dict[str, dict[str, Any]] = {
    "joint": {"color": MUTED, "lw": 1.1},
    "output": {"color": MUTED, "lw": 4.5, "alpha": 0.6, "solid_capstyle": "butt"},
    "point": {"color": PURPLE, "lw": 1.4},
}
#: Dashes of the paths of points of interest, by their place: a groove and up to four points.
_POINT_LINES = ("-.", ":", (0, (6, 2)), (0, (2, 1)), (0, (8, 2, 1, 2, 1, 2)))
#: Colours of profiles, by their place.
_PROFILES = (GREEN, BLUE)


def mechanism_chart(results: ResultsOrPath, *, design: int | None = None) -> Figure:
    """Draw the mechanism of one design in true proportions.

    Its limit positions, or those at the ends of a crank that does not turn fully, the paths of its points, and the
    drive stroke where the study uses it; without limit positions the mechanism at input angle 0.

    Parameters and errors are those of `motion_chart`, and `RequestError` if the mechanism declares no drawing.
    """
    return mechanism_figure(simulate_design(results_of(results), design))


def mechanism_figure(simulated: SimulatedDesign) -> Figure:
    """Draw the mechanism with a heading and a legend."""
    figure = new_figure(9.0, 6.6)
    draw_mechanism(figure.subplots(), simulated)
    write_heading(figure, simulated.title, 80)
    figure.legend(loc="outside lower center", ncols=2, frameon=False, fontsize=10, handlelength=3.5)
    return figure


def draw_mechanism(panel: Axes, simulated: SimulatedDesign) -> None:
    """Draw the mechanism of `mechanism_chart` into existing axes."""
    drawing = drawing_of(simulated)
    turn = simulated.pose()
    points = turn.points(drawing)
    lines = cycle(_POINT_LINES)
    joints = [path for path in drawing.paths if path.role == "joint"]
    for path in drawing.paths:
        line: dict[str, Any] = {"ls": next(lines)} if path.role == "point" else {}
        label = path.long_name
        if len(joints) > 1 and path in joints:  # all look alike
            names = ", ".join(each.long_name.removeprefix("path of ") for each in joints)
            label = f"paths of {names}" if path is joints[0] else "_"
        panel.plot(*points[path.point].T, **_PATHS[path.role], **line, label=label)
    if simulated.drive is not None and drawing.stroke_point:
        _draw_stroke(panel, simulated, drawing.stroke_point, simulated.drive, "input on the drive stroke")
    if simulated.slider is not None:
        _draw_stroke(
            panel, simulated, simulated.slider.point, simulated.slider.dwell, f"{simulated.slider.point} in the dwell"
        )
    size = 0.035 * max(np.ptp(np.vstack(list(points.values())), axis=0))
    _draw_positions(panel, simulated, drawing, size)
    for profile, colour in zip(drawing.profiles, _PROFILES, strict=False):
        curve = profile_curve(turn, simulated.pose([simulated.span.first]), profile, drawing)
        panel.plot(*curve.T, color=colour, lw=2.2, label=profile.name)
    draw_ground(panel, drawing, points, size)
    if (followed := simulated.path) is not None:
        draw_target(panel, np.array(followed.points), is_closed=followed.closed)
    set_axes(panel, simulated.units.scale("mm"))


def set_axes(panel: Axes, scale: Scale) -> None:
    """Give the axes true proportions and a pale grid, and label them, which are in mm, at round numbers shown."""
    from matplotlib.ticker import FuncFormatter, MaxNLocator

    panel.set_aspect("equal", adjustable="datalim")
    panel.margins(0.06)
    panel.grid(color=MUTED, alpha=0.2, lw=0.5)
    factor = float(scale.factor)

    class RoundNumbers(MaxNLocator):
        def tick_values(self, vmin: float, vmax: float) -> list[float]:
            return [tick / factor for tick in super().tick_values(vmin * factor, vmax * factor)]

    for name, axis in (("x", panel.xaxis), ("y", panel.yaxis)):
        axis.set_label_text(f"{name} [{scale.shown}]")
        if not scale.is_declared:
            axis.set_major_locator(RoundNumbers(nbins="auto", steps=[1, 2, 2.5, 5, 10]))
            axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value * factor:.6g}"))


def profile_curve(turn: Pose, now: Pose, profile: Profile, drawing: Drawing) -> FloatArray:
    """The curve of a body at one input angle, mm, (t, 2), from its pose there and over a turn."""
    angle = np.deg2rad(profile.sense * now.angle(profile.angle)[0])
    cosine, sine = np.cos(angle), np.sin(angle)
    rotated = turn.sum(profile.vectors) @ np.array([[cosine, sine], [-sine, cosine]])
    return np.asarray(rotated + now.sum(drawing.points[profile.centre]))


def _draw_positions(panel: Axes, simulated: SimulatedDesign, drawing: Drawing, size: float) -> None:
    """Draw the links, and blocks between guides, at the limit positions, or without any at input angle 0."""
    from matplotlib.patches import Rectangle

    limits = simulated.limits
    names = {name: f"{name} position, {simulated.mechanism.input_angle} {simulated.span.shown(angle):.1f}°"
             for name, angle in limits.items()} or {"": f"{simulated.mechanism.input_angle} 0.0°"}  # fmt: skip
    points = simulated.pose(list(limits.values()) or [0.0]).points(drawing)
    for k, (label, (colour, style, mark)) in enumerate(zip(names.values(), _POSITIONS, strict=False)):
        for number, link in enumerate(drawing.links):
            chain = np.array([points[name][k] for name in link.points])
            panel.plot(*chain.T, style, color=colour if limits else INK, lw=2.2, marker=mark, ms=6, mfc="white",
                       mew=1.5, zorder=4, label=label if number == 0 else None)  # fmt: skip
        for guide in drawing.guides:
            x, y = points[guide.point][k] - [1.6 * size, size]
            block = Rectangle((x, y), 3.2 * size, 2.0 * size, angle=guide.angle, rotation_point="center", fc="white",
                              ec=colour if limits else INK, ls=style, lw=1.4, zorder=3.5)  # fmt: skip
            panel.add_patch(block)


def _draw_stroke(panel: Axes, simulated: SimulatedDesign, point: str, span: tuple[float, float], label: str) -> None:
    """Draw a span of input angles on the path of a point, with an arrow in the sense of rotation."""
    arc = simulated.pose(list(np.linspace(*span, 200))).sum(drawing_of(simulated).points[point])
    panel.plot(*arc.T, color=GREEN, lw=3.5, solid_capstyle="butt", zorder=2, label=label)
    panel.annotate("", arc[110], arc[95], zorder=3,
                   arrowprops={"arrowstyle": "-|>", "color": GREEN, "lw": 2.0, "mutation_scale": 20})  # fmt: skip


def draw_ground(panel: Axes, drawing: Drawing, points: Mapping[str, FloatArray], size: float) -> None:
    """Draw guides along the paths of their points, and pivots."""
    for guide in drawing.guides:
        _draw_guide(panel, points[guide.point], guide.angle, size)
    for pivot in drawing.pivots:
        draw_pivot(panel, points[pivot][0], size)


def _draw_guide(panel: Axes, path: FloatArray, degrees: float, size: float) -> None:
    """Draw a guide along the path of its point, a little longer, as a pair of lines."""
    along = np.array([np.cos(np.deg2rad(degrees)), np.sin(np.deg2rad(degrees))])
    across = np.array([-along[1], along[0]])
    places = (path - path[0]) @ along
    for side in (-size, size):
        ends = [path[0] + place * along + side * across for place in (places.min() - 2 * size, places.max() + 2 * size)]
        panel.plot(*np.array(ends).T, color=INK, lw=1.4, zorder=3)


def draw_pivot(panel: Axes, place: FloatArray, size: float) -> None:
    """Draw a pivot on the ground: a triangle on a hatched strip."""
    from matplotlib.patches import Polygon, Rectangle

    x, y = place
    corners = [(x, y), (x - 0.7 * size, y - size), (x + 0.7 * size, y - size)]
    panel.add_patch(Polygon(corners, closed=True, fc="white", ec=INK, lw=1.4, zorder=3))
    strip = Rectangle((x - 1.2 * size, y - 1.55 * size), 2.4 * size, 0.55 * size, fc="none", ec=INK, hatch="/////",
                      lw=0)  # fmt: skip
    panel.add_patch(strip)
    panel.plot([x - 1.2 * size, x + 1.2 * size], [y - size, y - size], color=INK, lw=1.4, zorder=3)
