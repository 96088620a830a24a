"""Roberts' cognates of a four-bar: three linkages, one path."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from explore.base.errors import RequestError
from explore.figures.charts.linkages import crank_angles, draw_linkage, set_plane
from explore.figures.charts.style import BLUE, GREEN, INK, MUTED, ORANGE, new_figure, write_heading
from explore.figures.charts.targets import draw_target
from explore.figures.simulation import SimulatedDesign, simulate_design
from explore.model.points import drawn_name
from explore.model.quantities import FloatArray
from explore.results.store.open_results import ResultsOrPath, results_of
from explore.synthesis.cognates import cognate_angles, find_cognates, third_pivot
from explore.synthesis.linkages import ComplexArray, FourBar

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_COLOURS = (BLUE, ORANGE, GREEN)
_NAMES = ("linkage", "cognate 1", "cognate 2")
#: Number of crank angles of a dash of the path; the dashes of the three linkages follow each other.
_DASH = 12
#: Number of crank angles among which the clearest position is chosen.
_N_TRIED = 48
#: Input angle at which a linkage is measured, any at which it is no straight line, deg.
_ANGLE = 60.0


def cognates_chart(results: ResultsOrPath, *, design: int | None = None) -> Figure:
    """Draw the four-bar of one design and its two cognates in one position, and the path that all three draw.

    Every third dash of the path is computed from the same linkage. A study with several points is drawn with that
    of its target, or the first.

    Parameters and errors are those of `motion_chart`, and `RequestError` if the mechanism is no four-bar with a point
    of its coupler, or that is a pin.
    """
    simulated = simulate_design(results_of(results), design)
    scale = simulated.units.scale("mm")
    factor, target = float(scale.factor), simulated.path
    return cognates_figure(
        scaled(four_bar_of(simulated), factor),
        target=None if target is None else factor * np.array(target.points),
        is_closed=target is None or target.closed,
        unit=scale.shown,
        title=simulated.title,
    )


def four_bar_of(simulated: SimulatedDesign) -> FourBar:
    """The linkage of a design, mm, with the point of its target, or its first; `RequestError` if there is none."""
    name, drawing = simulated.mechanism.name, simulated.drawing
    links = [link.points for link in drawing.links if len(link.points) == 2] if drawing else []
    joints = [first for first, _ in links] + [last for _, last in links[-1:]]
    if drawing is None or len(links) != 3 or (joints[0], joints[3]) != drawing.pivots:
        raise RequestError(f"cognates are those of a four-bar, which a {name} is not")
    if not simulated.mechanism.points:
        raise RequestError(
            "cognates draw the path of a point of the coupler, and the study has none: name one in [points]"
        )
    points = simulated.pose([_ANGLE]).points(drawing)
    chain = [complex(*points[joint][0]) for joint in joints]
    target = simulated.path
    place = complex(*points[drawn_name(target.point if target else simulated.mechanism.points[0])][0])
    crank_pivot, crank_pin, rocker_pin, rocker_pivot = chain
    is_left = ((rocker_pivot - crank_pin).conjugate() * (rocker_pin - crank_pin)).imag > 0.0
    crank, coupler, rocker = (abs(second - first) for first, second in pairwise(chain))
    point = (place - crank_pin) / (rocker_pin - crank_pin)
    return FourBar(crank_pivot, rocker_pivot, crank, coupler, rocker, point, 1 if is_left else -1)


def scaled(linkage: FourBar, factor: float) -> FourBar:
    """The linkage with all lengths times a factor."""
    lengths = ("crank_pivot", "rocker_pivot", "crank", "coupler", "rocker")
    return replace(linkage, **{name: factor * getattr(linkage, name) for name in lengths})


def cognates_figure(
    linkage: FourBar, *, angle: float | None = None, target: FloatArray | None = None, is_closed: bool = True,
    unit: str = "mm", title: str = "",
) -> Figure:  # fmt: skip
    """Draw a linkage and its two cognates in one position, and the path that all three draw.

    Every third dash of the path is computed from the same linkage. The angle is that of its crank in the plane, rad, by
    default where the joints lie farthest apart. Raises `RequestError` if the coupler point is a pin, or the linkage
    cannot be assembled at the angle.
    """
    figure = new_figure(9.0, 7.2)
    panel = figure.subplots()
    angles = crank_angles(linkage, 0.0 if angle is None else angle)
    angle = _clearest_angle(linkage, angles) if angle is None else angle
    triple = (linkage, *find_cognates(linkage, angle))
    paths = (linkage.points(angles), *_cognate_points(linkage, angles))
    _draw_common_path(panel, paths)
    size = 0.03 * _extent(np.append(paths[0], [*_pivots(linkage)]))
    own_angles = (np.array([angle]), *cognate_angles(linkage, np.array([angle])))
    for each, at, name, colour in zip(triple, own_angles, _NAMES, _COLOURS, strict=True):
        draw_linkage(panel, each, float(at[0]), colour=colour, label=_describe(name, each, unit), size=size)
    ground = _pivots(linkage)[[0, 1, 2, 0]]
    panel.plot(ground.real, ground.imag, color=MUTED, lw=1.0, ls="--", zorder=1, label="ground of all three")
    point = complex(linkage.points(np.array([angle]))[0])
    panel.plot(point.real, point.imag, "o", color=INK, ms=7, zorder=6, label="the coupler point of all three")
    if target is not None:
        draw_target(panel, target, is_closed=is_closed)
    set_plane(panel, unit)
    if title:
        write_heading(figure, title, 90)
    figure.legend(loc="outside lower left", frameon=False, fontsize=10, handlelength=2.5)
    return figure


def _describe(name: str, linkage: FourBar, unit: str) -> str:
    """The lengths of a linkage, and whether its crank turns."""
    lengths = ", ".join(
        f"{link} {length:.5g}"
        for link, length in zip(("crank", "coupler", "rocker", "ground"), linkage.lengths, strict=True)
    )
    lengths += f" {unit}" if unit else ""
    return f"{name}: {lengths}; its crank {'turns fully' if linkage.is_crank_turning else 'does not turn fully'}"


def _pivots(linkage: FourBar) -> ComplexArray:
    return np.array([linkage.crank_pivot, linkage.rocker_pivot, third_pivot(linkage)])


def _extent(points: ComplexArray) -> float:
    """The larger side of the box of points."""
    return float(max(np.nanmax(points.real) - np.nanmin(points.real), np.nanmax(points.imag) - np.nanmin(points.imag)))


def _draw_common_path(panel: Axes, paths: Sequence[ComplexArray]) -> None:
    """Draw the path in dashes of three colours, each computed from its own linkage."""
    dash = np.arange(len(paths[0])) // _DASH % len(paths)
    for number, (path, colour) in enumerate(zip(paths, _COLOURS, strict=True)):
        own = dash == number
        own[1:] |= own[:-1].copy()  # a dash ends where the next begins
        shown = np.where(own, path, np.nan)
        panel.plot(shown.real, shown.imag, color=colour, lw=2.2, solid_capstyle="butt", zorder=2)


def _cognate_points(linkage: FourBar, angles: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    """Coupler points of both cognates, each simulated at its own crank angles."""
    own_angles = np.array(cognate_angles(linkage, angles))
    points = np.full(own_angles.shape, np.nan + 0j)
    for k, angle in enumerate(angles):
        if not np.isnan(own_angles[0, k]):
            for row, cognate in enumerate(find_cognates(linkage, float(angle))):
                points[row, k] = cognate.points(own_angles[row, k : k + 1])[0]
    return points[0], points[1]


def _clearest_angle(linkage: FourBar, angles: FloatArray) -> float:
    """The crank angle at which the nearest two of all joints, pivots and the point are farthest apart."""
    tried = angles[1 : -1 : len(angles) // _N_TRIED]
    kappa = linkage.point
    cranks, others = linkage.crank_pins(tried) - linkage.crank_pivot, linkage.rocker_pins(tried)
    couplers, rockers = others - linkage.crank_pivot - cranks, others - linkage.rocker_pivot
    points = linkage.points(tried)
    first, second = linkage.crank_pivot + kappa * couplers, points - kappa * rockers
    fixed = [np.full(len(tried), each) for each in _pivots(linkage)]
    joints = np.array([
        *fixed, points, linkage.crank_pivot + cranks, others, first, first + kappa * cranks, second,
        linkage.rocker_pivot + (points - others),
    ])  # fmt: skip
    pairs = np.triu_indices(len(joints), 1)
    nearest = np.abs(joints[pairs[0]] - joints[pairs[1]]).min(axis=0)
    return float(tried[np.nanargmax(nearest)])
