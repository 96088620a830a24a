"""Slider dwells: a link from a coupler point whose path has a nearly circular arc, as long as the arc's radius, to a
slider.

While the coupler point moves along the arc, the other end of the link rests at the arc's centre, through which the
guide passes.
"""

from dataclasses import dataclass

import numpy as np

from explore.base.errors import RequestError
from explore.model.quantities import FloatArray
from explore.synthesis.linkages import ComplexArray, FourBar

#: Number of crank angles over the dwell, and over the turn, at which motions are measured: travels keep seven digits.
_N_ANGLES = 1 << 16
#: Number of Gauss and Newton's steps from the algebraic fit of a circle.
_N_STEPS = 5


def fit_circles(points: ComplexArray) -> ComplexArray:
    """Centres, (n,), of circles fitted to rows of points, (n, k), by least squares; NaN for points on a line."""
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
    return np.asarray(centres + middle[:, 0])


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


@dataclass(frozen=True)
class Dwell:
    """A dwell mechanism and what it does.

    The dwell begins at the crank angle `start` and lasts for the angle `span`. The slider rests at `centre`, at the end
    of the link, on a guide in `direction`; `stroke` and `error` are its travels over the turn and in the dwell. All
    angles are in rad.
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


def measure_slider(
    linkage: FourBar, start: float, span: float, direction: float, link: float, centre: complex
) -> Dwell:
    """Measure a slider on the guide through a centre, near which it rests.

    Raises `RequestError` if the linkage or the slider cannot be assembled over the whole turn.
    """
    dwell = linkage.points(start + np.linspace(0.0, span, _N_ANGLES))[None]
    turn = linkage.points(start + np.linspace(0.0, 2.0 * np.pi, _N_ANGLES))[None]
    arguments = np.array([link]), np.array([centre]), np.array([direction])
    rest, _ = slider_positions(dwell, *arguments)
    travel, sines = slider_positions(turn, *arguments)
    if np.isnan(travel).any() or np.isnan(rest).any():
        raise RequestError("the slider's link does not reach the guide over the whole turn")
    return Dwell(
        linkage, start, span, link, centre, direction,
        float(np.ptp(travel)), float(np.ptp(rest)), float(np.arcsin(np.abs(sines).max())),
    )  # fmt: skip
