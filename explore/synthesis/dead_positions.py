"""Crank-rockers with a given swing and time ratio: two families, each with one free number, exact.

With psi the swing, theta = ± pi (K - 1)/(K + 1) the angle between the dead positions of the crank for the time ratio K,
and rho = (coupler - crank) / (coupler + crank) the free number, between 0 and 1, the lengths over the ground are::

    N = |e^{i psi} - rho e^{i theta}|^2,    D = |1 - rho e^{i theta}|^2
    coupler + crank = 2 sin(psi/2) / sqrt(N),    rocker = sqrt(D / N)

because the pivot A of the crank sees the end of the rocker in its two dead positions C1, C2 at distances of ratio rho
and at the angle theta: (C2 - A) = rho e^{i theta} (C1 - A), which is linear in A.

A published procedure takes the crank as free, with an equation for the least transmission angle, and leaves out that
the ground has the same length in both dead positions: its linkages have another swing and time ratio than asked for.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from explore.base.errors import RequestError
from explore.model.quantities import FloatArray

#: Number of points of the scan over each family.
_N_SCAN = 4001
#: Step of derivatives in the complex plane, this small because nothing cancels.
_STEP = 1e-30


@dataclass(frozen=True)
class DeadPositions:
    """Swing of a rocker, 0 … pi, rad, and the ratio of the times of its slow and its fast stroke, at least 1."""

    swing: float
    time_ratio: float

    def __post_init__(self) -> None:
        if not 0.0 < self.swing < np.pi:
            raise RequestError(f"the swing is between 0 and 180 deg, not {np.degrees(self.swing):g} deg")
        if not 1.0 <= self.time_ratio < np.inf:
            raise RequestError(f"the time ratio is 1 or more, not {self.time_ratio:g}")

    @property
    def dead_angle(self) -> float:
        """Angle between the dead positions of the crank, rad; the slow stroke takes this much more than half a turn."""
        return float(np.pi * (self.time_ratio - 1.0) / (self.time_ratio + 1.0))


@dataclass(frozen=True)
class Family:
    """The crank-rockers of one sign of the dead angle, over their free number rho.

    The sign is 1 if the crank turns on from its extended to its overlapped dead position in the sense in which the
    rocker swings, with the dead angle beyond half a turn; else -1.
    """

    task: DeadPositions
    sign: int

    def lengths(self, rho: npt.NDArray[Any]) -> tuple[npt.NDArray[Any], ...]:
        """Crank, coupler and rocker over the ground, each of the shape of `rho`, which may be complex."""
        swing, angle = self.task.swing, self.sign * self.task.dead_angle
        square = (1.0 - rho) * (1.0 - rho)
        n = square + 4.0 * rho * np.sin((swing - angle) / 2.0) ** 2
        d = square + 4.0 * rho * np.sin(angle / 2.0) ** 2
        half = np.sin(swing / 2.0) / np.sqrt(n)
        return half * (1.0 - rho), half * (1.0 + rho), np.sqrt(d / n)

    def transmission_angles(self, rho: npt.NDArray[Any]) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
        """The transmission angles with the crank along the frame, rad: the least, and pi less the largest."""
        crank, coupler, rocker = self.lengths(rho)
        least = _angle_between(coupler, rocker, 1.0 - crank)
        largest = _angle_between(coupler, rocker, 1.0 + crank)
        return least, np.pi - largest

    def worst_transmission_angle(self, rho: FloatArray) -> FloatArray:
        """The least of the transmission angle and its supplement over the turn, rad."""
        return np.asarray(np.minimum(*self.transmission_angles(rho)))

    def is_valid(self, rho: FloatArray) -> npt.NDArray[np.bool_]:
        """Whether the linkages are crank-rockers that have both dead positions on one branch."""
        crank, coupler, rocker = self.lengths(rho)
        lengths = np.sort([crank, coupler, rocker, np.ones_like(rho)], axis=0)
        turns = (lengths[0] == crank) & (lengths[0] + lengths[3] < lengths[1] + lengths[2])
        # Both ends of the rocker on the same side of the frame, with C1 = 1 and C2 = e^{i psi} seen from its pivot.
        end = np.exp(1j * self.task.swing)
        ratio = rho * np.exp(1j * self.sign * self.task.dead_angle)
        pivot = (end - ratio) / (1.0 - ratio)
        return np.asarray(turns & (pivot.imag * (end.conjugate() * pivot).imag > 0.0))


def _angle_between(first: npt.NDArray[Any], second: npt.NDArray[Any], opposite: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """The angle of a triangle between two sides; its half keeps its digits near 0 and pi."""
    difference = first - second
    above = (opposite - difference) * (opposite + difference)
    below = (first + second - opposite) * (first + second + opposite)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(2.0 * np.arctan(np.sqrt(above / below)))


def find_ranges(
    family: Family, allows: Callable[[FloatArray], npt.NDArray[np.bool_]], around: Sequence[float] = ()
) -> list[tuple[float, float]]:
    """The ranges of rho of valid linkages that are allowed, their ends to the last bit.

    Ranges narrower than a step of the scan, 1/4000, may be missed, unless they hold one of the places `around`.
    """

    def is_inside(rho: FloatArray) -> npt.NDArray[np.bool_]:
        return np.asarray(family.is_valid(rho) & allows(rho))

    scan = np.union1d(np.linspace(0.0, 1.0, _N_SCAN)[1:-1], around)
    inside = np.concatenate([[False], is_inside(scan), [False]])
    places = np.concatenate([[0.0], scan, [1.0]])
    changes = np.flatnonzero(inside[1:] != inside[:-1])
    ends = [_bisect(is_inside, places[k + (not inside[k])], places[k + inside[k]]) for k in changes]
    return list(zip(ends[::2], ends[1::2], strict=True))


def _bisect(is_inside: Callable[[FloatArray], npt.NDArray[np.bool_]], inside: float, outside: float) -> float:
    """The last number inside."""
    while True:
        middle = (inside + outside) / 2.0
        if middle in (inside, outside):
            return float(inside)
        if is_inside(np.array([middle]))[0]:
            inside = middle
        else:
            outside = middle


def find_best(family: Family, start: float, stop: float) -> float:
    """The rho of the largest least transmission angle within a range."""
    from scipy.optimize import brentq

    def difference(rho: float) -> float:
        least, supplement = family.transmission_angles(np.array([rho]))
        return float((least - supplement)[0])

    def slope(rho: float, which: int) -> float:
        return float(family.transmission_angles(np.array([rho + _STEP * 1j]))[which].imag[0])

    scan = np.linspace(start, stop, _N_SCAN)
    best = int(np.nanargmax(family.worst_transmission_angle(scan)))
    low, high = float(scan[max(best - 1, 0)]), float(scan[min(best + 1, _N_SCAN - 1)])
    candidates = [low, float(scan[best]), high]
    # The lesser of two smooth functions is largest where they are equal or where one is stationary.
    for function, *arguments in ((difference,), (slope, 0), (slope, 1)):
        if function(low, *arguments) * function(high, *arguments) < 0.0:
            candidates.append(float(brentq(function, low, high, args=tuple(arguments), xtol=1e-15, rtol=1e-15)))
    values = family.worst_transmission_angle(np.array(candidates))
    return candidates[int(np.nanargmax(values))]
