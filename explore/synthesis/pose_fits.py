"""Four-bars that carry a body through more than five poses, nearly: least squares of the achieved pose errors.

Dyads come first, each alone: the links whose length changes least over the poses, from those that are exact for five of
them. Pairs of the best are then improved together, with the crank's angles at the poses: the errors are those of the
simulated linkage, not those of equations.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from explore.errors import RequestError
from explore.model.quantities import FloatArray
from explore.synthesis.functions import wrapped
from explore.synthesis.linkages import ComplexArray, FourBar
from explore.synthesis.poses import Dyad, Poses, find_dyads

#: Sets of five poses whose dyads are starts, dyads that are paired, and pairs that are improved.
_N_SETS, _N_DYADS, _N_PAIRS = 20, 6, 12
#: Evaluations of the improvement of a dyad, and steps of that of a pair.
_MOST_STEPS, _N_STEPS = 200, 60
#: Pivots and lengths that differ by less, relatively, are the same; dyads so far away, over the poses' size, are none.
_SAME, _FAR = 1e-3, 100.0


@dataclass(frozen=True)
class FittedPoses:
    """A four-bar for poses, and how well it meets them.

    Attributes
    ----------
    linkage
        The four-bar; its coupler point is the point of the poses.
    body_angle
        Angle of the body from the coupler, rad.
    angles
        Of the crank in the plane at the poses, rad, shape (n,).
    position_errors, angle_errors
        Distances of the point from its places, and angles of the body from those of the poses, rad, each (n,).
    """

    linkage: FourBar
    body_angle: float
    angles: FloatArray
    position_errors: FloatArray
    angle_errors: FloatArray


def measure_poses(linkage: FourBar, body_angle: float, poses: Poses, angles: FloatArray) -> FittedPoses:
    """The errors of a linkage at crank angles, by simulation."""
    pins, ends = linkage.crank_pins(angles), linkage.rocker_pins(angles)
    places = pins + linkage.point * (ends - pins)
    turned = wrapped(np.angle(ends - pins) + body_angle - poses.angles)
    return FittedPoses(linkage, body_angle, angles, np.abs(places - poses.points), np.abs(turned))


def fit_poses(poses: Poses, lever: float | None = None, seed: int = 0) -> list[FittedPoses]:
    """Four-bars of least errors, each a local optimum, best first.

    Parameters
    ----------
    poses
        Five or more.
    lever
        Length at whose end the body's angle counts as a distance; None for half the size of the poses' points.
    seed
        Of the choice of sets of five poses.

    Raises
    ------
    RequestError
        If there are fewer than five poses, or no dyads are found.
    """
    if len(poses.points) < 5:
        raise RequestError(f"least squares need five poses or more, not {len(poses.points)}")
    middle = complex(poses.points.mean())
    size = float(np.abs(poses.points - middle).max()) or 1.0
    small = Poses((poses.points - middle) / size, poses.angles)
    dyads = _best_dyads(small, np.random.default_rng(seed))
    if len(dyads) < 2:
        raise RequestError("no two links were found that keep their lengths over the poses, even nearly; move a pose")
    # Either link may be the crank: a motion on one branch of the one may be on two of the other.
    pairs = [(one, other) for one in dyads for other in dyads if one is not other]
    pairs.sort(key=lambda pair: sum(float(np.square(_stretches(_numbers(dyad), small)).mean()) for dyad in pair))
    found: list[FittedPoses] = []
    for one, other in pairs[:_N_PAIRS]:
        for branch in (1, -1):
            fitted = _improved(small, one, other, branch, 1.0 if lever is None else 2.0 * lever / size)
            if fitted is not None and not any(_is_same(fitted, each) for each in found):
                found.append(fitted)
    found.sort(key=lambda each: float(np.square(each.position_errors).sum() + np.square(each.angle_errors).sum()))
    return [_scaled(each, poses, middle, size) for each in found]


def _numbers(dyad: Dyad) -> FloatArray:
    return np.array([dyad.fixed.real, dyad.fixed.imag, dyad.moving.real, dyad.moving.imag, dyad.length])


def _stretches(numbers: FloatArray, poses: Poses) -> FloatArray:
    """By how much a link would have to change its length at the poses, shape (n,)."""
    rotations, shifts = poses.displacements()
    moving = complex(numbers[2], numbers[3])
    places = np.append(moving, rotations * moving + shifts)
    return np.asarray(np.abs(places - complex(numbers[0], numbers[1])) - numbers[4])


def _best_dyads(poses: Poses, rng: np.random.Generator) -> list[Dyad]:
    """The dyads whose length changes least over all poses, from those of sets of five."""
    from scipy.optimize import least_squares

    n = len(poses.points)
    sets = [np.unique(np.linspace(0, n - 1, 5).astype(np.int64))]
    sets += [np.sort(rng.choice(n, 5, replace=False)) for _ in range(_N_SETS if n > 5 else 0)]
    starts: list[Dyad] = []
    for chosen in sets:
        try:
            starts += find_dyads(Poses(poses.points[chosen], poses.angles[chosen]))
        except RequestError:
            continue
    starts.sort(key=lambda dyad: float(np.square(_stretches(_numbers(dyad), poses)).sum()))
    distinct: list[Dyad] = []
    for start in starts:
        if not any(_are_same(start, each) for each in distinct):
            distinct.append(start)
    found: list[tuple[float, Dyad]] = []
    for start in distinct[: 3 * _N_DYADS]:
        solved = least_squares(_stretches, _numbers(start), args=(poses,), method="lm", max_nfev=_MOST_STEPS)
        x = solved.x
        dyad = Dyad(complex(x[0], x[1]), complex(x[2], x[3]))
        if max(abs(dyad.fixed), abs(dyad.moving)) > _FAR or dyad.length < _SAME:
            continue
        if not any(_are_same(dyad, each) for _, each in found):
            found.append((float(solved.cost), dyad))
    found.sort(key=lambda each: each[0])
    return [dyad for _, dyad in found[:_N_DYADS]]


def _are_same(one: Dyad, other: Dyad) -> bool:
    apart = abs(one.moving - other.moving) + abs(one.fixed - other.fixed)
    return apart <= _SAME * (1.0 + abs(other.moving) + abs(other.fixed))


def _improved(poses: Poses, one: Dyad, other: Dyad, branch: int, lever: float) -> FittedPoses | None:
    """The local optimum of a pair of dyads on a branch; None where it cannot be assembled at a pose."""
    from scipy.optimize import least_squares

    rotations, shifts = poses.displacements()
    pins = np.append(one.moving, rotations * one.moving + shifts)
    ends = np.append(other.moving, rotations * other.moving + shifts)
    sides = ((other.fixed - pins).conj() * (ends - pins)).imag
    if (np.sign(sides) == branch).sum() * 2 < len(pins):
        return None  # most poses are on the other branch
    body = np.exp(-1j * poses.angles[0])
    arms = [(dyad.moving - poses.points[0]) * body for dyad in (one, other)]  # of the body, its point at 0
    start = np.array([
        one.fixed.real, one.fixed.imag, other.fixed.real, other.fixed.imag, arms[0].real, arms[0].imag, arms[1].real,
        arms[1].imag, one.length, other.length,
    ])  # fmt: skip

    def residuals(x: FloatArray) -> FloatArray:
        linkage, body_angle = _linkage(x, branch)
        pins, ends = _pins(linkage, x[10:])
        vectors = ends - pins
        gaps = pins + linkage.point * vectors - poses.points
        turned = lever * wrapped(np.angle(vectors) + body_angle - poses.angles)
        return np.concatenate([gaps.real, gaps.imag, turned])

    angles = np.unwrap(np.angle(pins - one.fixed))
    solved = least_squares(residuals, np.append(start, angles), method="lm", max_nfev=_N_STEPS * (len(angles) + 10))
    linkage, body_angle = _linkage(solved.x, branch)
    fitted = measure_poses(linkage, body_angle, poses, solved.x[10:])
    return fitted if np.isfinite(fitted.position_errors).all() else None


def _pins(linkage: FourBar, angles: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    """Pins of the crank and of the rocker, as near as it comes to being assembled where it cannot be."""
    pins = linkage.crank_pins(angles)
    diagonal = linkage.rocker_pivot - pins
    square = np.abs(diagonal) ** 2
    along = 0.5 * (square + (linkage.coupler - linkage.rocker) * (linkage.coupler + linkage.rocker)) / square
    across = np.sqrt(np.maximum(linkage.coupler**2 / square - along**2, 0.0))
    return pins, np.asarray(pins + diagonal * (along + 1j * linkage.branch * across))


def _linkage(x: FloatArray, branch: int) -> tuple[FourBar, float]:
    """The linkage of pivots, places of the pins on the body, and lengths; and the body's angle from its coupler."""
    pin, end = complex(x[4], x[5]), complex(x[6], x[7])
    vector = end - pin
    linkage = FourBar(
        complex(x[0], x[1]), complex(x[2], x[3]), abs(float(x[8])), abs(vector), abs(float(x[9])), -pin / vector, branch
    )
    return linkage, -float(np.angle(vector))


def _scaled(fitted: FittedPoses, poses: Poses, middle: complex, size: float) -> FittedPoses:
    """The linkage in the plane of the task."""
    own = fitted.linkage
    linkage = FourBar(
        own.crank_pivot * size + middle, own.rocker_pivot * size + middle, own.crank * size, own.coupler * size,
        own.rocker * size, own.point, own.branch,
    )  # fmt: skip
    return measure_poses(linkage, fitted.body_angle, poses, fitted.angles)


def _is_same(first: FittedPoses, second: FittedPoses) -> bool:
    one, other = first.linkage, second.linkage
    apart = abs(one.crank_pivot - other.crank_pivot) + abs(one.rocker_pivot - other.rocker_pivot)
    apart += abs(one.crank - other.crank) + abs(one.rocker - other.rocker)
    return apart <= _SAME * (1.0 + one.crank + one.rocker)
