"""A gear pair by a second road, in mpmath: the five conditions of the law by Newton, integrals by quadrature.

It shares no formula with the kernel but the laws themselves.
"""

import math
from functools import cached_property

import mpmath as mp

DIGITS = 25


class GearPair:
    """A pair with the sine law, or a log-smoothstep law of an order from 1; angles in rad.

    `start` is where the solution of the five conditions is looked for: about k C0, C1, C1 (b - C2) and k C3.
    """

    def __init__(self, growth, sector, order=0, start=()):
        self.log_growth, self.sector, self.order = mp.log(mp.mpf(growth)), mp.mpf(sector), order
        self.width = 2 * mp.pi - self.sector
        self.constant, *self.sine = self._solve_sine(start) if order == 0 else [self._constant_of_smoothstep()]

    def _solve_sine(self, start):
        """k, C0, C1, C2, C3: k times the amplitude and mean make the conditions at the joints free of k."""
        log_growth, sector, width = self.log_growth, self.sector, self.width
        last = mp.exp(-log_growth * sector)

        def conditions(amplitude, frequency, phase, mean):
            end = frequency * width + phase
            return [
                amplitude * mp.sin(phase) + mean - last / log_growth,
                amplitude * mp.sin(end) + mean - 1 / log_growth,
                amplitude * frequency * mp.cos(phase) + last,
                amplitude * frequency * mp.cos(end) + 1,
            ]

        amplitude, frequency, phase, mean = mp.findroot(conditions, start, tol=mp.mpf(10) ** (10 - 2 * DIGITS))

        def inverse(s):
            return 1 / (amplitude * mp.sin(frequency * s + phase) + mean)

        total = mp.expm1(log_growth * sector) + mp.quad(inverse, mp.linspace(0, width, 9))
        k = 2 * mp.pi / total
        return k, amplitude / k, frequency, phase, mean / k

    def _smoothstep(self, sigma):
        # the integral of the slope, (sigma (1 - sigma))^order times what makes the whole 1
        def integral(x):
            parts = range(self.order + 1)
            return sum((-1) ** j * math.comb(self.order, j) * x ** (self.order + 1 + j) / (self.order + 1 + j)
                       for j in parts)  # fmt: skip

        return integral(sigma) / integral(mp.mpf(1))

    def _logarithm(self, s):
        """ln(i/i(0)) at an angle s after the joint."""
        return self.log_growth * (2 * mp.pi * self._smoothstep(s / self.width) - self.sector - s)

    def _constant_of_smoothstep(self):
        integral = mp.quad(lambda s: mp.exp(-self._logarithm(s)), mp.linspace(0, self.width, 9))
        return 2 * mp.pi / (mp.expm1(self.log_growth * self.sector) + self.log_growth * integral)

    @cached_property
    def start(self):
        """The ratio at 0."""
        return 1 / (self.constant * self.log_growth)

    def ratio(self, angle, is_return=None):
        """The ratio at an angle; at a joint, that of the sector."""
        if not (angle > self.sector if is_return is None else is_return):
            return self.start * mp.exp(-self.log_growth * angle)
        if self.order:
            return self.start * mp.exp(self._logarithm(angle - self.sector))
        amplitude, frequency, phase, mean = self.sine
        return amplitude * mp.sin(frequency * (angle - self.sector) + phase) + mean

    def derivatives(self, angle, is_return):
        """The ratio and its first and second derivatives."""
        return [mp.diff(lambda x: self.ratio(x, is_return), angle, n) for n in range(3)]

    def driven_angle(self, angle):
        """The integral of 1/i from 0."""
        working, returning = min(angle, self.sector), max(angle, self.sector)
        parts = [mp.linspace(0, working, 5), mp.linspace(self.sector, returning, 9)]
        return sum(mp.quad(lambda x: 1 / self.ratio(x), part) for part in parts)
