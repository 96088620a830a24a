"""Slider-cranks whose coupler point follows a closed path: the guide-offset method, and the direct one beside it.

The crank AB, with its pivot at A, and the side BM of the coupler reach from A to the points M of the path, which gives
the lengths of both from the largest and the smallest distance of the path from A, and so the position of the coupler at
every point. The pin C of the slider, a point of the coupler, should then move on a line: the guide. Its offset from A
varies by the guide-offset error.
"""

from dataclasses import dataclass

import numpy as np

from explore.base.errors import RequestError
from explore.model.quantities import FloatArray
from explore.synthesis.linkages import ComplexArray

#: Number of directions of the guide that are scanned, over half a turn.
_N_DIRECTIONS = 180


def closed_spline(points: ComplexArray, per_chord: int) -> ComplexArray:
    """Points of the closed cubic spline through points, by the length of its chords, `per_chord` to each."""
    from scipy.interpolate import CubicSpline

    closed = np.append(points, points[0])
    lengths = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(closed)))])
    shares = np.arange(per_chord) / per_chord
    places = (lengths[:-1, None] + shares * np.diff(lengths)[:, None]).ravel()
    return np.asarray(CubicSpline(lengths, closed, bc_type="periodic")(places))


@dataclass(frozen=True)
class Followers:
    """Crank and side of the coupler that reach from a pivot to all points of a path, and their angles, rad."""

    crank: float
    side: float
    crank_angles: FloatArray
    side_angles: FloatArray


def reach_path(points: ComplexArray, pivot: complex, sense: int) -> Followers:
    """The crank and side that reach the points of a path in order.

    The sense is 1 if the crank turns as the order of the points goes about its pivot, counter-clockwise where they do,
    else -1. The triangle of crank, side and distance folds over where the distance is largest and smallest: there its
    side changes.
    """
    vectors = points - pivot
    distances = np.abs(vectors)
    longest, shortest = float(distances.max()), float(distances.min())
    crank, side = (longest - shortest) / 2.0, (longest + shortest) / 2.0
    turned = np.angle(np.append(vectors[1:], vectors[0]) / vectors)
    if round(float(turned.sum()) / (2.0 * np.pi)):  # the pivot is inside
        crank, side = side, crank
    with np.errstate(invalid="ignore"):
        cosine = (crank**2 + distances**2 - side**2) / (2.0 * crank * distances)
    opening = np.arccos(np.clip(cosine, -1.0, 1.0))
    far, near = int(distances.argmax()), int(distances.argmin())
    order = np.arange(len(points))
    behind = (order - far) % len(points) < (near - far) % len(points)
    signs = np.where(behind, 1.0, -1.0) * sense
    crank_angles = np.angle(vectors) + signs * opening
    side_angles = np.angle(vectors - crank * np.exp(1j * crank_angles))
    return Followers(crank, side, crank_angles, side_angles)


@dataclass(frozen=True)
class Guide:
    """The slider of least guide-offset error: the range of the offsets, of which `offset` is the middle."""

    rod: float
    beta: float
    direction: float
    offset: float
    error: float


def find_guide(followers: Followers, rod_max: float) -> Guide:
    """The guide of least error over its direction.

    For a direction, the offsets are linear in rod cos(beta) and rod sin(beta): the least range of offsets is a linear
    programme. Directions over half a turn are scanned, and the best is improved between its neighbours. The
    size of both products is at most `rod_max`; without it the error tends to 0 with the length.
    """
    from scipy.optimize import minimize_scalar

    step = np.pi / _N_DIRECTIONS
    directions = np.arange(_N_DIRECTIONS) * step
    best = min((_guide(followers, direction, rod_max) for direction in directions), key=lambda guide: guide.error)
    improved = minimize_scalar(
        lambda direction: _guide(followers, direction, rod_max).error,
        bounds=(best.direction - step, best.direction + step),
        method="bounded",
        options={"xatol": 1e-9},
    )
    return min(best, _guide(followers, float(improved.x), rod_max), key=lambda guide: guide.error)


def _guide(followers: Followers, direction: float, rod_max: float) -> Guide:
    """The linear programme in rod cos(beta), rod sin(beta), offset and half the range of offsets."""
    from scipy.optimize import linprog

    crank = -followers.crank * np.sin(followers.crank_angles - direction)
    sine, cosine = np.sin(followers.side_angles - direction), np.cos(followers.side_angles - direction)
    ones = np.ones_like(sine)
    above = np.column_stack([-sine, cosine, -ones, -ones])
    below = np.column_stack([sine, -cosine, ones, -ones])
    found = linprog(
        [0.0, 0.0, 0.0, 1.0],
        A_ub=np.vstack([above, below]),
        b_ub=np.concatenate([-crank, crank]),
        bounds=[(-rod_max, rod_max), (-rod_max, rod_max), (None, None), (0.0, None)],
        method="highs-ds",
    )
    if found.x is None:
        raise RequestError(f"the guide's linear programme failed: {found.message}")
    along, across, offset, half = found.x
    return Guide(float(np.hypot(along, across)), float(np.arctan2(across, along)), direction, float(offset), 2.0 * half)
