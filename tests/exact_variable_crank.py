"""The variable crank by its defining equations in 40 digits: integrals of the speed, roots of the loop.

It shares nothing with the kernel: the slider's position is the integral of its speed, the branch of the root follows
from the side of the regular angle, and derivatives are those of mpmath.
"""

import mpmath as mp

DIGITS = 40
SMOOTHSTEPS = {
    1: lambda s: 3 * s**2 - 2 * s**3,
    2: lambda s: 10 * s**3 - 15 * s**4 + 6 * s**5,
    3: lambda s: 35 * s**4 - 84 * s**5 + 70 * s**6 - 20 * s**7,
}


class ExactVariableCrank:
    """One design; angles in rad, from 0 to pi or, on the way back, to 2 pi."""

    def __init__(self, rod, slider_speed, speed, reversal_time, blend_order=2.0):
        self.rod, self.wanted, self.speed, time = map(mp.mpf, (rod, slider_speed, speed, reversal_time))
        self.order, self.paths = int(blend_order), {}
        self.width, self.travel = self.speed * time, self.wanted / self.speed
        rod, travel = self.rod, self.travel
        self.regular_crank = mp.sqrt((-(rod**2) + rod * mp.sqrt(rod**2 + 4 * travel**2)) / 2)
        self.regular_angle = mp.atan2(rod, self.regular_crank)
        regular_position = mp.sqrt(rod**2 + self.regular_crank**2)
        # from the regular angle back to 0, the slider's law being one polynomial before and one after half of the width
        self.start = regular_position + travel * self._path(self.regular_angle)

    def share(self, angle):
        """Speed over the wanted speed on the way to the inner dead centre."""
        near = min(angle, mp.pi - angle)
        if near >= self.width / 2:
            return mp.mpf(1)
        return 2 * SMOOTHSTEPS[self.order](near / self.width + mp.mpf(1) / 2) - 1

    def _path(self, angle):
        """Integral of `share` from 0, computed once for an angle and a number of digits."""
        key = angle, mp.mp.prec
        if key not in self.paths:
            breaks = [place for place in (self.width / 2, mp.pi - self.width / 2) if place < angle]
            self.paths[key] = mp.quad(self.share, [0, *breaks, angle])
        return self.paths[key]

    def position(self, angle):
        """Position of the slider, mm."""
        folded = angle if angle <= mp.pi else 2 * mp.pi - angle
        return self.start - self.travel * self._path(folded)

    def crank(self, angle):
        """Length of the crank, mm."""
        folded = angle if angle <= mp.pi else 2 * mp.pi - angle
        x = self.position(folded)
        root = mp.sqrt(self.rod**2 - (x * mp.sin(folded)) ** 2)
        return x * mp.cos(folded) + (root if folded > self.regular_angle else -root)

    def crank_slope(self, angle):
        """Derivative of the crank's length by the angle, mm: the velocity loop, projected on the rod."""
        x, crank = self.position(angle), self.crank(angle)
        rate = self.velocity(angle) / self.speed
        numerator = crank * (rate * mp.cos(angle) - x * mp.sin(angle)) - x * rate
        return numerator / (crank - x * mp.cos(angle))

    def velocity(self, angle):
        """Velocity of the slider, mm/s."""
        back = angle > mp.pi
        return (1 if back else -1) * self.wanted * self.share(2 * mp.pi - angle if back else angle)

    def acceleration(self, angle):
        """Acceleration of the slider, mm/s^2."""
        return self.speed * mp.diff(self.velocity, angle)

    def curvature(self, angle):
        """Curvature of the groove by differences of points on it, 1/mm."""
        point = lambda turn: self.crank(turn) * mp.expj(turn)  # noqa: E731
        first, second = mp.diff(point, angle, 1), mp.diff(point, angle, 2)
        return (mp.conj(first) * second).imag / abs(first) ** 3
