"""A slider-crank with 60 digits, from the sine of the rod's angle: sin(beta) = (offset - crank sin(theta))/rod.

Position and rates are the textbook's, differentiated step by step; there are digits enough for their cancellation.
Shares no formula with the package.
"""

from functools import cache
from itertools import pairwise

import mpmath
from mpmath import mpf

DIGITS = 60
SIGNALS = (
    "slider_position", "slider_velocity", "slider_acceleration", "rod_angle", "rod_velocity", "rod_acceleration",
)  # fmt: skip


class ExactSliderCrank:
    """A slider-crank whose lengths are the exact values of doubles; all angles in rad, as mpmath numbers."""

    def __init__(self, crank, rod, offset=0.0):
        mpmath.mp.dps = DIGITS
        self.r, self.rod, self.e = map(mpf, (crank, rod, offset))
        self._motions = {}
        r, rod, e = self.r, self.rod, self.e
        # crank and rod in line, stretched and folded: the slider is at the distance rod + r or rod - r from the pivot
        self.outer, self.inner = mpmath.asin(e / (rod + r)), mpmath.pi + mpmath.asin(e / (rod - r))
        self.stroke = mpmath.sqrt((rod + r) ** 2 - e**2) - mpmath.sqrt((rod - r) ** 2 - e**2)
        first = self.inner - self.outer
        self.time_ratio = max(first / (2 * mpmath.pi - first), (2 * mpmath.pi - first) / first)
        self.pressure_angle_max = mpmath.asin((r + abs(e)) / rod)
        self.transmission_angle_min = mpmath.acos((r + abs(e)) / rod)
        self.turning_margin = rod - r - abs(e)

    def motion(self, theta):
        """The six SIGNALS for unit crank velocity, then the rates of the two accelerations."""
        r, rod = self.r, self.rod
        c, s = mpmath.cos_sin(theta)
        across, along = self.e - r * s, mpmath.sqrt(rod**2 - (self.e - r * s) ** 2)  # times the rod
        w = -r * c / along
        dw = (r * s + across * w**2) / along
        ddw = (r * c + along * w**3 + 3 * across * w * dw) / along
        v = -r * s - across * w
        a = -r * c - along * w**2 - across * dw
        jerk = r * s + across * w**3 - 3 * along * w * dw - across * ddw
        return r * c + along, v, a, mpmath.atan2(across, along), w, dw, jerk, ddw

    def edges(self, first, last):
        """Angles between two angles, whose distances double away from +-90 degrees, the dead centres among them."""
        quarter = mpmath.pi / 2
        inside = {self.outer, self.inner, *(k * mpmath.pi for k in range(-1, 5)), *(k * quarter for k in range(-3, 9))}
        for anchor, margin in ((1, self.rod + self.e - self.r), (-1, self.rod - self.e - self.r)):
            step = mpmath.sqrt(margin / (self.rod + self.r)) / 2
            while step < quarter:
                inside |= {anchor * quarter + 2 * k * mpmath.pi + sign * step for k in (0, 1) for sign in (-1, 1)}
                step *= 2
        return sorted({first, last, *(angle for angle in inside if first < angle < last)})

    def statistics(self, first, last):
        """Mean, variance, minimum and maximum of the SIGNALS between two angles, by composite Gauss-Legendre rules."""
        edges = self.edges(first, last)
        samples = [self._panel(start, stop) for start, stop in pairwise(edges)]
        result = []
        for s in range(len(SIGNALS)):
            mean = sum(w * m[s] for panel in samples for _, w, m in panel) / (last - first)
            variance = sum(w * (m[s] - mean) ** 2 for panel in samples for _, w, m in panel) / (last - first)
            points = [(theta, m) for panel in samples for theta, _, m in panel]
            result.append((mean, variance, *self._extremes(s, [first, *(t for t, _ in points), last])))
        return result

    def _panel(self, start, stop):
        """Nodes, weights and motions of one panel."""
        half, centre = (stop - start) / 2, (stop + start) / 2
        return [
            (centre + half * x, half * w, self._known(centre + half * x)) for x, w in gauss_legendre(mpmath.mp.prec)
        ]

    def _extremes(self, s, angles):
        """Smallest and largest value of a signal, its stationary angles found as roots of its rate."""
        rate = (1, 2, 6, 4, 5, 7)[s]
        values = [self._known(angle) for angle in angles]
        found = [values[0][s], values[-1][s]]
        for k in range(len(angles) - 1):
            if values[k][rate] * values[k + 1][rate] <= 0:
                ends = angles[k], angles[k + 1]
                root = mpmath.findroot(lambda t: self._known(t)[rate], ends, solver="illinois", verify=False)
                found.append(self.motion(root)[s])
        return min(found), max(found)

    def _known(self, angle):
        """The motion, computed once for each angle."""
        if angle not in self._motions:
            self._motions[angle] = self.motion(angle)
        return self._motions[angle]


@cache
def gauss_legendre(bits):
    """24 nodes and weights of the Gauss-Legendre rule on [-1, 1], of a precision."""
    return mpmath.calculus.quadrature.GaussLegendre(mpmath.mp).calc_nodes(4, bits)
