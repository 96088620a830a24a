"""Slider dwells: a link from a coupler point whose path has a nearly circular arc, as long as the arc's radius, to a
slider.

While the coupler point moves along the arc, the other end of the link rests at the arc's centre, through which the
guide passes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from explore.errors import RequestError
from explore.model.quantities import FloatArray
from explore.synthesis.linkages import ComplexArray, FourBar

#: Crank angles over the dwell and over the turn.
_N_DWELL, _N_TURN = 37, 180
#: Steps of Gauss and Newton's method from the algebraic fit of a circle.
_N_STEPS = 5
#: Cost from which on a limit is missed: more than any error over a stroke.
_MISSED = 1.0


@dataclass(frozen=True)
class Circles:
    """Circles fitted to arcs, least squares of the distances.

    Attributes
    ----------
    centres
        Shape (n,), complex.
    radii
        Shape (n,).
    deviations
        Largest distance of a point of each arc from its circle, shape (n,).
    """

    centres: ComplexArray
    radii: FloatArray
    deviations: FloatArray


def fit_circles(points: ComplexArray) -> Circles:
    """Fit a circle to each row of points, shape (n, k); NaN for points on a line."""
    middle = points.mean(axis=1, keepdims=True)
    near = points - middle
    square = np.abs(near) ** 2
    # |z|^2 = 2 Re(z c') + const: normal equations about the mean, of two unknowns.
    xx, yy, xy = (near.real**2).sum(axis=1), (near.imag**2).sum(axis=1), (near.real * near.imag).sum(axis=1)
    right = ((square - square.mean(axis=1, keepdims=True))[..., None] * np.stack([near.real, near.imag], axis=-1)).sum(
        1
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        determinant = 2.0 * (xx * yy - xy * xy)
        centres = (yy * right[:, 0] - xy * right[:, 1] + 1j * (xx * right[:, 1] - xy * right[:, 0])) / determinant
        for _ in range(_N_STEPS):
            centres = centres + _gauss_newton_step(near, centres)
        distances = np.abs(near - centres[:, None])
        radii = distances.mean(axis=1)
        deviations = np.abs(distances - radii[:, None]).max(axis=1)
    return Circles(centres + middle[:, 0], radii, deviations)


def _gauss_newton_step(points: ComplexArray, centres: ComplexArray) -> ComplexArray:
    """The step of the centres that lessens the squares of distances less their mean."""
    vectors = points - centres[:, None]
    distances = np.abs(vectors)
    directions = vectors / distances
    directions = directions - directions.mean(axis=1, keepdims=True)
    errors = distances - distances.mean(axis=1, keepdims=True)
    u, v = directions.real, directions.imag
    uu, vv, uv = (u * u).sum(axis=1), (v * v).sum(axis=1), (u * v).sum(axis=1)
    a, b = (u * errors).sum(axis=1), (v * errors).sum(axis=1)
    return np.asarray((vv * a - uv * b + 1j * (uu * b - uv * a)) / (uu * vv - uv * uv))


def narrowest_ring(points: ComplexArray) -> tuple[complex, float]:
    """Centre and middle radius of the narrowest ring around points near a circle, shape (k,).

    A link of that radius has the least travel at its other end. From the least-squares circle, linear programmes in the
    shift of the centre, the radius and half the width.
    """
    from scipy.optimize import linprog

    circle = fit_circles(points[None])
    centre, radius = complex(circle.centres[0]), float(circle.radii[0])
    for _ in range(_N_STEPS):
        vectors = points - centre
        distances = np.abs(vectors)
        column, one = (vectors / distances)[:, None], np.ones((len(points), 1))
        # |distance - direction . shift - radius| <= half
        outside = np.hstack([-column.real, -column.imag, -one, -one])
        inside = np.hstack([column.real, column.imag, one, -one])
        found = linprog(
            [0.0, 0.0, 0.0, 1.0],
            A_ub=np.vstack([outside, inside]),
            b_ub=np.concatenate([-distances, distances]),
            bounds=[(None, None)] * 3 + [(0.0, None)],
        )
        if found.x is None:
            break
        centre, radius = centre + complex(found.x[0], found.x[1]), float(found.x[2])
    return centre, radius


@dataclass(frozen=True)
class Dwell:
    """A dwell mechanism and what it does.

    Attributes
    ----------
    linkage
        The four-bar.
    start, span
        First angle of the crank in the dwell and what it turns there, rad.
    link
        Length of the link to the slider.
    centre
        Where the slider rests.
    direction
        Of the guide through the centre, rad.
    stroke
        Travel of the slider over the turn.
    error
        Travel of the slider in the dwell.
    pressure_angle_max
        Largest angle between link and guide, rad.
    """

    linkage: FourBar
    start: float
    span: float
    link: float
    centre: complex
    direction: float
    stroke: float
    error: float
    pressure_angle_max: float


def slider_positions(
    points: ComplexArray, links: FloatArray, centres: ComplexArray, directions: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Positions of sliders along their guides from the centre, and the sine of their pressure angle, shape (n, k).

    The slider is on the side of its coupler point on which it rests; NaN where the link does not reach the guide.
    """
    local = (points - centres[:, None]) * np.exp(-1j * directions)[:, None]
    with np.errstate(invalid="ignore"):
        along = np.sqrt(links[:, None] ** 2 - local.imag**2)
    side = np.where(local[:, :1].real > 0.0, -1.0, 1.0)
    return local.real + side * along, local.imag / links[:, None]


def measure(linkage: FourBar, start: float, span: float, direction: float, count: int = 20 * _N_DWELL) -> Dwell:
    """Fit the link to the arc and measure the slider's motion, `count` crank angles in the dwell and in the turn.

    Raises
    ------
    RequestError
        If the linkage or the slider cannot be assembled over the whole turn.
    """
    dwell = linkage.points(start + np.linspace(0.0, span, count))[None]
    turn = linkage.points(start + np.linspace(0.0, 2.0 * np.pi, 10 * count))[None]
    centre, link = narrowest_ring(dwell[0])
    arguments = np.array([link]), np.array([centre]), np.array([direction])
    rest, _ = slider_positions(dwell, *arguments)
    travel, sines = slider_positions(turn, *arguments)
    if np.isnan(travel).any() or np.isnan(rest).any():
        raise RequestError("the slider's link does not reach the guide over the whole turn")
    return Dwell(
        linkage, start, span, link, centre, direction,
        float(np.ptp(travel)), float(np.ptp(rest)), float(np.arcsin(np.abs(sines).max())),
    )  # fmt: skip


@dataclass(frozen=True)
class DwellTask:
    """A dwell of a slider.

    Attributes
    ----------
    span
        Angle that the crank turns while the slider rests, rad.
    stroke
        Least travel of the slider over the length of the crank.
    transmission_angle_min, pressure_angle_max
        Limits over the turn, rad.
    link_ratio_max
        Largest length of a link, and of the coupler point's distance from the crank's pin, over that of the crank.
    """

    span: float
    stroke: float = 1.0
    transmission_angle_min: float = float(np.radians(30.0))
    pressure_angle_max: float = float(np.radians(50.0))
    link_ratio_max: float = 6.0


def find_dwell(task: DwellTask, seed: int = 0, generations: int = 300) -> Dwell:
    """The dwell of least error over the stroke that a search by differential evolution finds; the crank is 1.

    Raises
    ------
    RequestError
        If no linkage within the limits was found.
    """
    from scipy.optimize import Bounds, differential_evolution

    def costs(x: Any, /) -> Any:
        return _costs(task, x)

    # Coupler, rocker, ground, the coupler point along and across the coupler, start and direction.
    longest = task.link_ratio_max
    bounds = Bounds([1.0, 1.0, 1.0, -1.5, -2.0, 0.0, 0.0], [longest] * 3 + [2.5, 2.0, 2.0 * np.pi, np.pi])
    found = differential_evolution(
        costs, bounds, vectorized=True, updating="deferred", seed=seed, popsize=20,
        maxiter=generations, tol=1e-10, polish=False,
    )  # fmt: skip
    if found.fun >= _MISSED:
        raise RequestError("no dwell within these limits was found; ease the stroke, the angles or the lengths")
    coupler, rocker, ground, along, across, start, direction = found.x.tolist()
    linkage = FourBar(0j, complex(ground), 1.0, coupler, rocker, complex(along, across))
    return measure(linkage, start, task.span, direction)


def _costs(task: DwellTask, x: FloatArray) -> npt.NDArray[np.float64]:
    """Error over stroke, or how far limits are missed, of a population, shape (7, n)."""
    coupler, rocker, ground, along, across, start, direction = (row[:, None] for row in x)
    point = along + 1j * across
    angles = start + np.linspace(0.0, 2.0 * np.pi, _N_TURN, endpoint=False)
    dwell_angles = start + np.linspace(0.0, task.span, _N_DWELL)
    shortest, longest = np.abs(ground - 1.0), ground + 1.0
    with np.errstate(invalid="ignore", divide="ignore"):
        cosines = [(coupler**2 + rocker**2 - side**2) / (2.0 * coupler * rocker) for side in (shortest, longest)]
        worst = np.abs(np.array(cosines)).max(axis=0)[:, 0]
        missed = np.clip(worst - np.cos(task.transmission_angle_min), 0.0, None)
        missed = missed + np.clip(np.abs(point * coupler)[:, 0] / task.link_ratio_max - 1.0, 0.0, None)
        turn, dwell = (_points(coupler, rocker, ground, point, a) for a in (angles, dwell_angles))
        circle = fit_circles(dwell)
        rest, _ = slider_positions(dwell, circle.radii, circle.centres, direction[:, 0])
        travel, sines = slider_positions(turn, circle.radii, circle.centres, direction[:, 0])
        stroke = np.ptp(travel, axis=1)
        missed = missed + np.clip(np.abs(sines).max(axis=1) - np.sin(task.pressure_angle_max), 0.0, None)
        missed = (
            missed + np.clip(task.stroke - stroke, 0.0, None) + np.clip(circle.radii / task.link_ratio_max - 1, 0, None)
        )
        costs = np.ptp(rest, axis=1) / stroke
    costs = np.where(missed > 0.0, _MISSED + missed, costs)
    return np.asarray(np.nan_to_num(costs, nan=100.0 * _MISSED, posinf=100.0 * _MISSED))


def _points(
    coupler: FloatArray, rocker: FloatArray, ground: FloatArray, point: ComplexArray, angles: FloatArray
) -> ComplexArray:
    """Coupler points of a population with cranks of 1, shape (n, k)."""
    pins = np.exp(1j * angles)
    diagonal = ground - pins
    square = np.abs(diagonal) ** 2
    along = (square + coupler**2 - rocker**2) / (2.0 * square)
    across = np.sqrt(coupler**2 / square - along**2)
    return np.asarray(pins + point * diagonal * (along + 1j * across))
