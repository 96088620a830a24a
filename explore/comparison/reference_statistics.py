"""Statistics of an output over its windows in multiple precision, by the exact motion at the nodes of Gauss rules."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np

from explore.comparison.reference import ExactDesign, multiple_precision
from explore.comparison.strokes import Designs
from explore.model.quantities import FloatArray

#: Statistics of `exact_statistics`.
STATISTICS = ("mean", "variance", "cv", "min", "max")
#: Number of panels that a window begins with.
_FIRST_PANELS = 8
#: Change of the integrals of a panel, over the whole, up to which it is not halved; halves are exact to its square.
_TOLERANCE = 1e-13
#: Largest number of halvings of a panel.
_MOST_HALVINGS = 60
#: Part of its root mean square below which a mean is 0.
_ZERO = 1e-18
#: Steps of the difference that gives the derivative of an acceleration, rad: half of the digits remain.
_DIFFERENCE = 1e-25
#: Magnitude below which a value is the rounding of an exact 0, such as the velocity at a limit position.
_NOTHING = 1e-40


def exact_statistics(designs: Designs, window: str = "drive") -> FloatArray:
    """`STATISTICS` of position, velocity and acceleration of the output at a speed of 1 rad/s, (3, 5, n), rounded once.

    Variances are those of a population. NaN for a design without strokes, and for a cv other than that of the velocity
    over a stroke: the other means are 0 or depend on the datum.
    """
    statistics = np.full((3, len(STATISTICS), len(designs)), np.nan)
    ends = designs.ends(window)
    for i in np.flatnonzero(designs.has_strokes):
        design = ExactDesign(designs.loop, designs.parameters[i])
        statistics[:, :, i] = _Output(design, designs.row).statistics(float(ends[i, 0]), float(ends[i, 1]), window)
    return statistics


@cache
def _gauss() -> tuple[list[Any], list[Any]]:
    """The 24 nodes, ascending, and weights of a Gauss-Legendre rule on (-1, 1)."""
    from mpmath.calculus.quadrature import GaussLegendre

    rule = sorted(GaussLegendre(multiple_precision()).get_nodes(-1, 1, 4, multiple_precision().prec))
    return [node for node, _ in rule], [weight for _, weight in rule]


@dataclass(frozen=True)
class _Output:
    """The output of a design: its position, velocity and acceleration."""

    design: ExactDesign
    row: int

    def values(self, angles: Sequence[Any]) -> list[list[Any]]:
        """The three signals at crank angles."""
        return [motion[self.row :: self.design.loop.count] for motion in self.design.motions(angles)]

    def statistics(self, first: float, last: float, window: str) -> FloatArray:
        """Statistics between rounded ends, shape (3, 5)."""
        mp = multiple_precision()
        if window == "drive":
            low, high = (self._limit(mp.mpf(float(end))) for end in (first, last))
        else:
            low, high = mp.pi / 2, 5 * mp.pi / 2
        angles, weights, values = self._integrate(low, high)
        if window == "cycle":  # an extreme may lie beside both ends
            angles, weights, values = [*angles, angles[1] + 2 * mp.pi], [*weights, mp.zero], [*values, values[1]]
        statistics = np.full((3, len(STATISTICS)), np.nan)
        for k in range(3):
            row = [each[k] for each in values]
            if k == 0 and self._is_angle:
                row = _unwrapped(row)
            mean = mp.fdot(weights, row)
            variance = mp.fdot(weights, [(value - mean) ** 2 for value in row])
            if abs(mean) < _ZERO * mp.sqrt(variance):
                mean = mp.zero  # exactly, as the integral of a derivative between equal values
            if k == 1 and window == "drive":
                statistics[k, 2] = mp.sqrt(variance) / abs(mean)
            extremes = [*row, *self._extremes(k, row, angles, values)]
            exact = (mean, variance, min(extremes), max(extremes))
            statistics[k, [0, 1, 3, 4]] = [float(x) if abs(x) > _NOTHING else 0.0 for x in exact]
        return statistics

    def _limit(self, angle: Any) -> Any:
        """The crank angle near a rounded one at which the velocity is 0."""
        for _ in range(4):
            _, velocity, acceleration = self.values([angle])[0]
            angle -= velocity / acceleration
        return angle

    def _integrate(self, low: Any, high: Any) -> tuple[list[Any], list[Any], list[list[Any]]]:
        """Crank angles, weights of sum 1, and values; both ends have no weight, and matter for the extremes."""
        mp = multiple_precision()
        step = (high - low) / _FIRST_PANELS
        waiting = [(low + k * step, step, self._panel(low + k * step, step), 0) for k in range(_FIRST_PANELS)]
        scales = [sum(parts) for parts in zip(*(whole[3] for _, _, whole, _ in waiting), strict=True)]
        taken: list[Any] = []
        while waiting:
            start, length, whole, depth = waiting.pop()
            halves = [self._panel(start + k * length / 2, length / 2) for k in range(2)]
            sums = zip(halves[0][3], halves[1][3], whole[3], scales, strict=True)
            differs = any(abs(a + b - c) > _TOLERANCE * scale for a, b, c, scale in sums)  # not where they are NaN
            if differs and depth < _MOST_HALVINGS:
                waiting += [(start + k * length / 2, length / 2, halves[k], depth + 1) for k in range(2)]
            else:
                taken += halves
        taken.sort(key=lambda panel: panel[0][0])
        ends = self.values([low, high])
        angles = [low, *(angle for panel in taken for angle in panel[0]), high]
        weights = [mp.zero, *(weight / (high - low) for panel in taken for weight in panel[1]), mp.zero]
        return angles, weights, [ends[0], *(value for panel in taken for value in panel[2]), ends[1]]

    def _panel(self, start: Any, length: Any) -> tuple[list[Any], list[Any], list[list[Any]], list[Any]]:
        """Nodes, weights, values, and the integrals of the squares of velocity and acceleration."""
        mp, (nodes, rule) = multiple_precision(), _gauss()
        angles = [start + length / 2 * (1 + node) for node in nodes]
        weights, values = [length / 2 * weight for weight in rule], self.values(angles)
        sums = [mp.fdot(weights, [value[k] ** 2 for value in values]) for k in (1, 2)]
        return angles, weights, values, sums

    def _extremes(self, k: int, row: list[Any], angles: list[Any], values: list[list[Any]]) -> list[Any]:
        """Extremes of signal k: its values where its derivative changes sign between two of the angles."""
        mp = multiple_precision()

        def slope(angle: Any) -> Any:
            if k < 2:
                return self.values([angle])[0][k + 1]
            below, above = self.values([angle - _DIFFERENCE, angle + _DIFFERENCE])
            return (above[k] - below[k]) / (2 * mp.mpf(_DIFFERENCE))

        slopes, width = ([value[k + 1] for value in values], 1) if k < 2 else (_steps(row), 2)
        found = []
        for j in range(len(slopes) - 1):
            if slopes[j] * slopes[j + 1] < 0 and min(abs(slopes[j]), abs(slopes[j + 1])) > _NOTHING:
                # the error of the value is quadratic in that of the angle
                bracket = angles[j], angles[j + width]
                angle = mp.findroot(slope, bracket, solver="ridder", tol=1e-20, maxsteps=99, verify=False)
                value = self.values([angle])[0][k]
                found.append(_unwrapped([row[j], value])[1] if k == 0 and self._is_angle else value)
        return found

    @property
    def _is_angle(self) -> bool:
        return self.row < self.design.loop.n_angles


def _steps(row: list[Any]) -> list[Any]:
    """Differences from each value to the next: they change sign about an extreme."""
    return [after - before for before, after in pairwise(row)]


def _unwrapped(angles: list[Any]) -> list[Any]:
    """Angles without jumps of a turn."""
    turn, result = 2 * multiple_precision().pi, angles[:1]
    for angle in angles[1:]:
        result.append(angle + multiple_precision().nint((result[-1] - angle) / turn) * turn)
    return result
