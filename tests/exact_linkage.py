"""A crank-rocker with 60 digits by a third method: Freudenstein's equation, differentiated implicitly.

Checks the stored references and the closed-form metrics, and shares no formula with the package or the campaign.
"""

from itertools import pairwise

import mpmath
from mpmath import mpf

DIGITS = 60
SIGNALS = ("coupler_velocity", "rocker_velocity", "coupler_acceleration", "rocker_acceleration")


def slope_of(function, lengths, length, digits):
    """Slope of a function of a linkage by one of its lengths: a central difference whose step has so many digits.

    With the 60 digits of all numbers its error is the square of the step times the third relative derivatives.
    """
    mpmath.mp.dps = DIGITS
    step = mpf(10) ** -digits
    above, below = (
        function(ExactLinkage(*(mpf(lengths[name]) + (sign * step if name == length else 0) for name in lengths)))
        for sign in (1, -1)
    )
    return (above - below) / (2 * step)


class ExactLinkage:
    """A crank-rocker whose lengths are the exact values of doubles; all angles in rad, as mpmath numbers."""

    def __init__(self, crank, coupler, rocker, ground, branch=1):
        mpmath.mp.dps = DIGITS
        self.r1, self.r2, self.r3, self.r4 = map(mpf, (crank, coupler, rocker, ground))
        self.branch = branch
        r1, r2, r3, r4 = self.r1, self.r2, self.r3, self.r4
        # law of cosines for the triangle of the two pivots and the coupler joint, coupler and crank in line
        extended = mpmath.acos(((r2 + r1) ** 2 + r4**2 - r3**2) / (2 * (r2 + r1) * r4))
        overlapped = mpmath.acos(((r2 - r1) ** 2 + r4**2 - r3**2) / (2 * (r2 - r1) * r4)) - mpmath.pi
        self.extended, self.overlapped = branch * extended, branch * overlapped
        psi_extended = mpmath.acos((r4**2 + r3**2 - (r2 + r1) ** 2) / (2 * r4 * r3))
        psi_overlapped = mpmath.acos((r4**2 + r3**2 - (r2 - r1) ** 2) / (2 * r4 * r3))
        self.swing = psi_extended - psi_overlapped
        self.mid_angle = branch * (mpmath.pi - (psi_extended + psi_overlapped) / 2)
        through_zero = extended - overlapped
        self.time_ratio = max(
            through_zero / (2 * mpmath.pi - through_zero), (2 * mpmath.pi - through_zero) / through_zero
        )
        self.transmission_angle_min = mpmath.acos((r2**2 + r3**2 - (r4 - r1) ** 2) / (2 * r2 * r3))
        self.transmission_angle_max = mpmath.acos((r2**2 + r3**2 - (r4 + r1) ** 2) / (2 * r2 * r3))
        self.grashof_margin = r2 + r3 + r4 - 2 * max(r2, r3, r4) - r1

    def angles(self, theta):
        """Coupler and rocker angle, from the half-angle quadratic of the rocker and the loop's closure."""
        r1, r2, r3, r4 = self.r1, self.r2, self.r3, self.r4
        a, b = 2 * r3 * (r4 - r1 * mpmath.cos(theta)), -2 * r1 * r3 * mpmath.sin(theta)
        c = r4**2 + r1**2 + r3**2 - r2**2 - 2 * r1 * r4 * mpmath.cos(theta)
        # a cos(phi) + b sin(phi) + c = 0
        rocker = mpmath.atan2(b, a) + self.branch * mpmath.acos(-c / mpmath.hypot(a, b))
        coupler = mpmath.atan2(
            r3 * mpmath.sin(rocker) - r1 * mpmath.sin(theta), r4 + r3 * mpmath.cos(rocker) - r1 * mpmath.cos(theta)
        )
        return coupler, rocker

    def motion(self, theta):
        """The four SIGNALS for unit crank velocity, by implicit differentiation of the length conditions."""
        r1, r2, r3, r4 = self.r1, self.r2, self.r3, self.r4
        coupler, rocker = self.angles(theta)
        sine, cosine = mpmath.sin, mpmath.cos
        # F(theta, phi) = r4 r3 cos(phi) - r1 r4 cos(theta) - r1 r3 cos(theta - phi) + const = 0
        f_t = r1 * r4 * sine(theta) + r1 * r3 * sine(theta - rocker)
        f_p = -r4 * r3 * sine(rocker) - r1 * r3 * sine(theta - rocker)
        w3 = -f_t / f_p
        far, near = r1 * r3 * cosine(theta - rocker), r1 * r4 * cosine(theta)
        a3 = -(near + far - 2 * far * w3 + (far - r4 * r3 * cosine(rocker)) * w3**2) / f_p
        # G(theta, gamma) = r2 r4 cos(gamma) + r1 r4 cos(theta) - r1 r2 cos(theta - gamma) + const = 0
        g_t = -r1 * r4 * sine(theta) + r1 * r2 * sine(theta - coupler)
        g_g = -r2 * r4 * sine(coupler) - r1 * r2 * sine(theta - coupler)
        w2 = -g_t / g_g
        far = r1 * r2 * cosine(theta - coupler)
        a2 = -(-near + far - 2 * far * w2 + (far - r2 * r4 * cosine(coupler)) * w2**2) / g_g
        return w2, w3, a2, a3

    def signals(self, theta):
        """The four SIGNALS, then coupler angle, rocker angle and transmission angle."""
        r1, r2, r3, r4 = self.r1, self.r2, self.r3, self.r4
        d_squared = r1**2 + r4**2 - 2 * r1 * r4 * mpmath.cos(theta)
        transmission_angle = mpmath.acos((r2**2 + r3**2 - d_squared) / (2 * r2 * r3))
        return (*self.motion(theta), *self.angles(theta), transmission_angle)

    def stroke(self, through_zero):
        """First and last crank angle of the stroke that passes crank angle 0, or of the one that passes pi."""
        low, high = sorted((self.overlapped, self.extended))
        return (low, high) if through_zero else (high, low + 2 * mpmath.pi)

    def moments(self, first, last, signals=None):
        """Mean and variance of the SIGNALS, or of a function of signals, between two crank angles.

        Gauss-Legendre rules on panels graded towards multiples of pi.
        """
        signals = signals or self.motion
        nodes = mpmath.calculus.quadrature.GaussLegendre(mpmath.mp).get_nodes(-1, 1, 4, mpmath.mp.prec)
        total = [mpf(0)] * len(signals(first))
        squares = list(total)
        edges = self._edges(first, last)
        for low, high in pairwise(edges):
            half, centre = (high - low) / 2, (high + low) / 2
            for x, w in nodes:
                for s, value in enumerate(signals(centre + half * x)):
                    total[s] += half * w * value
                    squares[s] += half * w * value**2
        means = [t / (last - first) for t in total]
        return [(m, q / (last - first) - m**2) for m, q in zip(means, squares, strict=True)]

    def extremes(self, first, last):
        """Minimum and maximum of each of the `signals`: at the ends, and where a central difference of it is 0."""
        step = mpf(10) ** -15

        def slopes(theta):
            after, before = self.signals(theta + step), self.signals(theta - step)
            return [a - b for a, b in zip(after, before, strict=True)]

        # midpoints, because at multiples of pi a slope may be exactly 0
        inside = (
            low + (high - low) * k / 16 for low, high in pairwise(self._edges(first, last)) for k in range(1, 16, 2)
        )
        points = [first, *inside, last]
        candidates = [self.signals(first), self.signals(last)]
        for (low, high), (before, after) in zip(pairwise(points), pairwise(map(slopes, points)), strict=True):
            for s, ends in enumerate(zip(before, after, strict=True)):
                if ends[0] * ends[1] < 0:
                    root = mpmath.findroot(lambda t, s=s: slopes(t)[s], (low, high), solver="anderson", verify=False)
                    candidates.append(self.signals(root))
        return [(min(values), max(values)) for values in zip(*candidates, strict=True)]

    def _edges(self, first, last):
        """The two ends and the panel edges between them; panels shrink by a factor of four towards multiples of pi."""
        edges = {first, last}
        for k in range(-1, 4):
            y = mpmath.pi / 2
            while y > mpf(10) ** -9:
                edges |= {k * mpmath.pi + y, k * mpmath.pi - y}
                y /= 4
            edges.add(k * mpmath.pi)
        return sorted(e for e in edges if first <= e <= last)

    @staticmethod
    def radians(degrees):
        """A crank angle given in degrees."""
        return mpf(float(degrees)) * mpmath.pi / 180
