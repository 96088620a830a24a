"""The Burmester curves of four poses: where the pivots of a link that carries a body through them can lie."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from explore.base.errors import RequestError
from explore.figures.charts.cognates import four_bar_of, scaled
from explore.figures.charts.linkages import set_plane
from explore.figures.charts.style import BLUE, GREEN, INK, MUTED, ORANGE, new_figure, write_heading
from explore.figures.charts.targets import target_of
from explore.figures.simulation import simulate_design
from explore.results.queries import choose_design
from explore.results.store.open_results import ResultsOrPath, results_of
from explore.synthesis.linkages import ComplexArray
from explore.synthesis.poses import Dyad, Poses, burmester_curves

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_N_POSES = 4
#: Number of turns of the link at which the curves are first computed.
_N_TURNS = 720
#: Number of times that parts of a curve are halved.
_N_HALVINGS = 24
#: Width of the view over its height.
_RATIO = 1.4
#: Height of the box of poses and links over that of the view.
_LINK_BOX = 0.5
#: Height of the box of poses without links over that of the view.
_POSE_BOX = 0.35
#: Largest gap in a curve over the height of the view.
_GAP = 0.01
#: Smallest size of a pose over the height of the view, where poses lie close together.
_LEAST_POSE = 0.055
#: Largest size of a pose over the height of the view.
_POSE = 0.1


@dataclass(frozen=True)
class _View:
    """The part of the plane that is drawn, about poses and links: the curves go to infinity."""

    centre: complex
    height: float

    @classmethod
    def around(cls, places: ComplexArray, share: float) -> _View:
        width, height = float(np.ptp(places.real)), float(np.ptp(places.imag))
        centre = complex(places.real.min() + width / 2.0, places.imag.min() + height / 2.0)
        return cls(centre, (max(width / _RATIO, height) or 1.0) / share)

    def is_near(self, pivots: ComplexArray) -> npt.NDArray[np.bool_]:
        """Whether pivots lie in the view or beside it."""
        return np.asarray(np.abs(pivots - self.centre) < 2.0 * self.height)


def burmester_chart(results: ResultsOrPath, *, design: int | None = None) -> Figure:
    """Draw the Burmester curves of the four poses that the coupler of one design takes at the points of a target.

    They are the poses of the task where the study has been made from four: see ``explore init --task motion``.

    Parameters and errors are those of `motion_chart`, and `RequestError` if the study has no target of four points.
    """
    results = results_of(results)
    number = choose_design(results, design)
    simulated = simulate_design(results, number)
    target, scale = target_of(simulated), simulated.units.scale("mm")
    if len(target.points) != _N_POSES:
        raise RequestError(f"Burmester curves are those of four poses, and the target has {len(target.points)} points")
    linkage = scaled(four_bar_of(simulated), float(scale.factor))
    angles = np.deg2rad(target.angles) + np.angle(linkage.rocker_pivot - linkage.crank_pivot)
    pins, others = linkage.crank_pins(angles), linkage.rocker_pins(angles)
    # Of a task with poses how far the body is turned from the coupler; else the coupler is the body.
    turned = np.deg2rad(float(results.declared.design(number).get("body_angle", 0.0)))
    poses = Poses(linkage.points(angles), np.angle(others - pins) + turned)
    links = Dyad(linkage.crank_pivot, complex(pins[0])), Dyad(linkage.rocker_pivot, complex(others[0]))
    return burmester_figure(poses, dyads=links, unit=scale.shown, title=simulated.title)


def burmester_figure(poses: Poses, *, dyads: Sequence[Dyad] = (), unit: str = "mm", title: str = "") -> Figure:
    """Draw the circle-point and the centre-point curve of four poses, and dyads that carry the body through them.

    A link between a point of the one curve and its partner on the other carries the body through all poses. Raises
    `RequestError` if the poses are not four.
    """
    if len(poses.points) != _N_POSES:
        raise RequestError(f"four poses have Burmester curves, not {len(poses.points)}")
    figure = new_figure(9.0, 7.2)
    panel = figure.subplots()
    pivots = [pivot for dyad in dyads for pivot in (dyad.fixed, dyad.moving)]
    view = _View.around(np.array([*poses.points, *pivots]), _LINK_BOX if dyads else _POSE_BOX)
    fixed, moving = _trace_curves(poses, view)
    panel.plot(fixed.real, fixed.imag, color=ORANGE, lw=1.8, label="centre points: fixed pivots")
    panel.plot(moving.real, moving.imag, color=BLUE, lw=1.8, ls="--", label="circle points: moving pivots, in pose 1")
    _draw_poses(panel, poses, view.height)
    for number, dyad in enumerate(dyads):
        link = np.array([dyad.fixed, dyad.moving])
        panel.plot(link.real, link.imag, marker="o", color=GREEN, lw=2.2, ms=7, mfc="white", mew=1.6, zorder=5,
                   label="chosen links, in pose 1" if number == 0 else None)  # fmt: skip
    set_plane(panel, unit)
    panel.set_aspect("equal", adjustable="box")
    half_width, half_height = _RATIO * view.height / 2.0, view.height / 2.0
    panel.set_xlim(view.centre.real - half_width, view.centre.real + half_width)
    panel.set_ylim(view.centre.imag - half_height, view.centre.imag + half_height)
    if title:
        write_heading(figure, title, 90)
    figure.legend(loc="outside lower center", ncols=2, frameon=False, fontsize=10, handlelength=3.0)
    return figure


def _trace_curves(poses: Poses, view: _View) -> list[ComplexArray]:
    """Points of both curves in order, NaN where they break.

    Parts between turns are halved until the points in the view lie close together, and those at whose one end there
    are no pivots, because there the two roots meet.
    """
    turns = np.linspace(-np.pi, np.pi, _N_TURNS + 1)
    pivots = np.array(burmester_curves(poses, turns))
    for _ in range(_N_HALVINGS):
        wide = _is_wide(pivots, view)
        if not wide.any():
            break
        places = np.flatnonzero(wide) + 1
        between = (turns[places - 1] + turns[places]) / 2.0
        pivots = np.insert(pivots, places, np.array(burmester_curves(poses, between)), axis=2)
        turns = np.insert(turns, places, between)
    return [_join(roots, view) for roots in pivots]


def _is_wide(pivots: ComplexArray, view: _View) -> npt.NDArray[np.bool_]:
    """Whether the part between neighbouring turns is to be halved for either root of either curve, (n - 1,)."""
    near, defined = view.is_near(pivots), ~np.isnan(pivots)
    is_gap = np.abs(np.diff(pivots)) > _GAP * view.height
    is_end = defined[..., 1:] != defined[..., :-1]
    return np.asarray(((is_gap | is_end) & (near[..., 1:] | near[..., :-1])).any(axis=(0, 1)))


def _join(roots: ComplexArray, view: _View) -> ComplexArray:
    """Both roots of a curve, one after the other, with a break where neighbours stay apart: beyond infinity."""
    pieces = []
    for root in roots:
        apart = np.flatnonzero(np.abs(np.diff(root)) > 10.0 * _GAP * view.height) + 1
        pieces += [np.insert(root, apart, np.nan), np.array([np.nan + 0j])]
    return np.concatenate(pieces)


def _draw_poses(panel: Axes, poses: Poses, height: float) -> None:
    """Draw each pose as a frame at its point: a long and a short side, and its number."""
    first, second = np.triu_indices(len(poses.points), 1)
    nearest = float(np.abs(poses.points[first] - poses.points[second]).min())
    size = float(np.clip(0.8 * nearest, _LEAST_POSE * height, _POSE * height))
    for number, (point, angle) in enumerate(zip(poses.points, poses.angles, strict=True), start=1):
        long, short = size * np.exp(1j * angle), 0.5j * size * np.exp(1j * angle)
        corners = np.array([point, point + long, point + long + short, point + short])
        panel.fill(corners.real, corners.imag, fc=MUTED, ec=INK, alpha=0.25, lw=0, zorder=2)
        sides = np.array([point + short, point, point + long])
        panel.plot(sides.real, sides.imag, color=INK, lw=1.6, zorder=3)
        middle = point + (long + short) / 2.0
        panel.text(middle.real, middle.imag, str(number), ha="center", va="center", fontsize=10, color=INK, zorder=6)
    panel.plot(poses.points.real, poses.points.imag, "o", color=INK, ms=4, zorder=4, label="poses of the body")
