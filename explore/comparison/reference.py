"""Reference motion and statistics in multiple precision (mpmath), by other formulas than those of the closed form.

The coupler joint C is the intersection of two circles, located by Heron's formula. The conditions (C - B)^2 = r2^2 and
(C - D)^2 = r3^2, differentiated once, twice and three times, each give two linear equations for the next derivative of
C; angular rates are cross products with these.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np

from explore.comparison.methods.contract import Outcome
from explore.comparison.methods.geometry import geometric_outcome
from explore.model.quantities import FloatArray

#: Signals of `exact_statistics`.
REFERENCE_SIGNALS = ("rocker_angle", "rocker_velocity", "rocker_acceleration")
#: Statistics of `exact_statistics`.
REFERENCE_STATISTICS = ("mean", "variance", "cv", "min", "max")
#: Windows of `exact_statistics`: the slower stroke and the full turn.
REFERENCE_WINDOWS = ("drive", "cycle")

#: Number of digits, of which 30 cancel close to a change point.
_DIGITS = 80
#: Relative difference up to which two strokes are equally long in doubles: the one through pi is then the drive stroke.
_TIE = 1e-15
#: Magnitude below which a value is the rounding of an exact 0, such as the velocity at a limit position.
_ZERO = 1e-60


@cache
def multiple_precision() -> Any:
    """A private mpmath context, so that the caller's precision does not change."""
    import mpmath  # imported here because it takes a tenth of a second and only a comparison needs it

    context = mpmath.MPContext()
    context.dps = _DIGITS
    return context


@cache
def _gauss() -> list[tuple[Any, Any]]:
    """The 24 nodes, ascending, and weights of a Gauss-Legendre rule on (-1, 1).

    The singularities of a panel lie outside the Bernstein ellipse of parameter 3 (see `_Linkage.edges`), so the error
    is about 3^-48 = 1e-23.
    """
    from mpmath.calculus.quadrature import GaussLegendre

    return sorted(GaussLegendre(multiple_precision()).get_nodes(-1, 1, 4, multiple_precision().prec))


def exact_motion(lengths: FloatArray, branch: FloatArray, crank_angle: FloatArray) -> FloatArray:
    """Compute the six signals of `comparison.methods.contract.Motion`, (6, n, t), rounded once.

    Lengths, (n, 4), are taken as exact; crank angles, (n, t), in rad. NaN for a linkage whose crank cannot turn.
    """
    signals = np.full((6, *crank_angle.shape), np.nan)
    for i in np.flatnonzero(geometric_outcome(lengths) == Outcome.OK):
        linkage = _Linkage.of(lengths[i], branch[i])
        for j, theta in enumerate(crank_angle[i]):
            signals[:, i, j] = [float(x) for x in linkage.motion(multiple_precision().mpf(float(theta)))]
    return signals


def exact_statistics(lengths: FloatArray, branch: FloatArray, window: str = "drive") -> FloatArray:
    """`REFERENCE_STATISTICS` of `REFERENCE_SIGNALS` at a crank speed of 1 rad/s, (3, 5, n), rounded once.

    Lengths, (n, 4), are taken as exact; variances are those of a population. NaN for a linkage that is not a
    crank-rocker, and for a cv other than that of the velocity over a stroke: the other means are 0 or depend on the
    datum of the angle.
    """
    statistics = np.full((len(REFERENCE_SIGNALS), len(REFERENCE_STATISTICS), len(lengths)), np.nan)
    rocks = (geometric_outcome(lengths) == Outcome.OK) & (lengths[:, 0] < lengths[:, 3])
    for i in np.flatnonzero(rocks):
        statistics[:, :, i] = _statistics(_Linkage.of(lengths[i], branch[i]), window)
    return statistics


@dataclass(frozen=True)
class _Linkage:
    """A linkage in mpmath numbers."""

    r1: Any
    r2: Any
    r3: Any
    r4: Any
    branch: int

    @classmethod
    def of(cls, lengths: FloatArray, branch: float) -> _Linkage:
        r1, r2, r3, r4 = (multiple_precision().mpf(float(length)) for length in lengths)
        return cls(r1, r2, r3, r4, int(branch))

    def rates(self, theta: Any) -> tuple[Any, ...]:
        """Vectors u = BC, v = DC as four numbers, then rates and second rates of coupler and rocker, rocker's third."""
        mp, r1, r2, r3, r4 = multiple_precision(), self.r1, self.r2, self.r3, self.r4
        cosine, sine = mp.cos_sin(theta)
        bx, by = r1 * cosine, r1 * sine
        dx, dy = r4 - bx, -by
        square = dx * dx + dy * dy
        distance = mp.sqrt(square)
        twice_area = 2 * self.branch * _area(distance, r2, r3)
        along, across = (square + r2 * r2 - r3 * r3) / (2 * square), twice_area / square
        ux, uy = along * dx - across * dy, along * dy + across * dx
        vx, vy = ux - dx, uy - dy

        def solve(p: Any, q: Any) -> tuple[Any, Any]:
            """The vector whose dot products with u and v are p and q."""
            return (p * vy - q * uy) / twice_area, (q * ux - p * vx) / twice_area

        # B' = (-by, bx), B'' = -B, B''' = -B'
        cx1, cy1 = solve(uy * bx - ux * by, 0)
        ux1, uy1 = cx1 + by, cy1 - bx
        cx2, cy2 = solve(-ux * bx - uy * by - ux1 * ux1 - uy1 * uy1, -cx1 * cx1 - cy1 * cy1)
        ux2, uy2 = cx2 + bx, cy2 + by
        cx3, cy3 = solve(ux * by - uy * bx - 3 * (ux1 * ux2 + uy1 * uy2), -3 * (cx1 * cx2 + cy1 * cy2))
        rr2, rr3 = r2 * r2, r3 * r3
        return (
            ux, uy, vx, vy,
            (ux * uy1 - uy * ux1) / rr2, (vx * cy1 - vy * cx1) / rr3,
            (ux * uy2 - uy * ux2) / rr2, (vx * cy2 - vy * cx2) / rr3,
            (cx1 * cy2 - cy1 * cx2 + vx * cy3 - vy * cx3) / rr3,
        )  # fmt: skip

    def motion(self, theta: Any) -> tuple[Any, ...]:
        """The six signals at a crank angle."""
        ux, uy, vx, vy, w2, w3, a2, a3, _ = self.rates(theta)
        return multiple_precision().atan2(uy, ux), multiple_precision().atan2(vy, vx), w2, w3, a2, a3

    def rocker(self, theta: Any) -> tuple[Any, ...]:
        """The rocker's angle and its first three derivatives: each signal is followed by its own derivative."""
        _, _, vx, vy, _, w3, _, a3, jerk = self.rates(theta)
        return multiple_precision().atan2(vy, vx), w3, a3, jerk

    def ends(self, window: str) -> tuple[Any, Any]:
        """First and last crank angle of a window."""
        mp, pi = multiple_precision(), +multiple_precision().pi
        if window == "cycle":
            return -pi, pi
        extended, overlapped = (self._angle_at_crank(reach) for reach in (self.r2 + self.r1, self.r2 - self.r1))
        first, last = overlapped - pi, extended
        if last - first <= pi * (1 + mp.mpf(_TIE)):
            first, last = last, first + 2 * pi
        return (first, last) if self.branch > 0 else (-last, -first)

    def _angle_at_crank(self, reach: Any) -> Any:
        """Angle at the crank's pivot in the triangle with sides reach, ground, rocker."""
        return multiple_precision().atan2(4 * _area(reach, self.r4, self.r3), reach**2 + self.r4**2 - self.r3**2)

    def edges(self, first: Any, last: Any) -> list[Any]:
        """Ends of panels whose length grows by a factor of four with the distance from the multiples of pi.

        The complex singularities have these as real parts: 0 where the distance of B and D is r2 - r3, pi where it is
        r2 + r3.
        """
        mp, r1, r4 = multiple_precision(), self.r1, self.r4
        edges = {first, last}
        for k in range(-2, 4):
            reach = self.r2 - self.r3 if k % 2 == 0 else self.r2 + self.r3
            step = mp.acosh(abs(r4 * r4 + r1 * r1 - reach * reach) / (2 * r1 * r4)) / 2
            while step < mp.pi / 2:
                edges |= {k * mp.pi - step, k * mp.pi + step}
                step *= 4
            edges.add((k + mp.mpf(0.5)) * mp.pi)
        return sorted(edge for edge in edges if first <= edge <= last)


def _area(a: Any, b: Any, c: Any) -> Any:
    """Area of a triangle, by Heron."""
    s = (a + b + c) / 2
    return multiple_precision().sqrt(s * (s - a) * (s - b) * (s - c))


def _statistics(linkage: _Linkage, window: str) -> FloatArray:
    """Statistics of one linkage, shape (3, 5)."""
    mp = multiple_precision()
    first, last = linkage.ends(window)
    angles, weights = [first], [mp.zero]  # the ends matter only for the extremes
    for low, high in pairwise(linkage.edges(first, last)):
        half, centre = (high - low) / 2, (high + low) / 2
        angles += [centre + half * x for x, _ in _gauss()]
        weights += [half * w / (last - first) for _, w in _gauss()]
    angles, weights = [*angles, last], [*weights, mp.zero]
    rows = list(zip(*(linkage.rocker(theta) for theta in angles), strict=True))
    statistics = np.full((len(REFERENCE_SIGNALS), len(REFERENCE_STATISTICS)), np.nan)
    for k, name in enumerate(REFERENCE_SIGNALS):
        mean = mp.fdot(weights, rows[k])
        variance = mp.fdot(weights, [(value - mean) ** 2 for value in rows[k]])
        extrema = _extrema(linkage, k, angles, rows[k + 1])
        if name == "rocker_velocity" and window == "drive":
            statistics[k, 2] = mp.sqrt(variance) / abs(mean)
        elif name != "rocker_angle":
            mean = mp.zero  # exactly, as the integral of a derivative between equal values
        extremes = (min(*rows[k], *extrema), max(*rows[k], *extrema))
        statistics[k, [0, 1, 3, 4]] = [float(x) if abs(x) > _ZERO else 0.0 for x in (mean, variance, *extremes)]
    return statistics


def _extrema(linkage: _Linkage, k: int, angles: list[Any], slopes: tuple[Any, ...]) -> list[Any]:
    """Extrema of signal k: its values where its derivative changes sign between two of the angles."""

    def slope(theta: Any) -> Any:
        return linkage.rocker(theta)[k + 1]

    values = []
    for (low, before), (high, after) in pairwise(zip(angles, slopes, strict=True)):
        if before * after < 0 and min(abs(before), abs(after)) > _ZERO:
            # the error of the value is quadratic in that of the angle
            angle = multiple_precision().findroot(slope, (low, high), solver="anderson", tol=1e-20, verify=False)
            values.append(linkage.rocker(angle)[k])
    return values
