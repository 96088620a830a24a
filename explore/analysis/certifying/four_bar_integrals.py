"""Integrals of the angular velocities of a four-bar, their squares and its signals.

The squares have elementary antiderivatives: rational functions of u = cos(theta), which partial fractions turn into
arctangents of multiples of tan(theta/2), plus sin(theta) times a function of u, which y = sqrt((Q + u)/(P - u)) turns
into arctangents of multiples of y. Near kites, change points and tiny cranks the terms cancel; more bits make up for
that. Other signals are integrands of rigorous integration.
"""

from collections.abc import Callable

from flint import acb, arb, fmpq

from explore.analysis.certifying.balls import positive
from explore.analysis.certifying.four_bar_motion import Linkage, State
from explore.analysis.certifying.integration import arctangent, integrate_over
from explore.analysis.certifying.positions import Arc, Position

_HALF, _QUARTER = fmpq(1, 2), fmpq(1, 4)
#: Function that takes a state, and whether it must be analytic there, and returns the signal.
Integrand = Callable[[State, bool], acb]


class SquareOfVelocity:
    """The square of the angular velocity of a link, integrated over crank angles."""

    def __init__(self, linkage: Linkage, link: int) -> None:
        self.linkage, self.link = linkage, link
        d, p, q, m, e = linkage.D, linkage.P, linkage.Q, linkage.M, linkage.E
        at_p = link + (m / (d - p) if m != 0 else 0)
        self._p = _QUARTER * at_p * at_p * (1 - p * p) / (q + p)
        self._q = _QUARTER * (link + m / (d + q)) ** 2 * (1 - q * q) / (q + p)
        first = second = fmpq(0)
        if m != 0:
            ratio = (1 - d * d) / ((p - d) * (q + d))
            slope = ratio * (1 / (p - d) - 1 / (q + d)) - 2 * d / ((p - d) * (q + d))
            first = _QUARTER * (2 * link * m * ratio - m * m * slope)
            second = _QUARTER * m * m * ratio
        self._v, self._v_squared = first - e, second + e * e
        self._odd = -link * _HALF, link * e - m * _HALF, m * e  # of 1/w, 1/(V w), 1/(V^2 w), by -du

    def over(self, arc: Arc) -> arb:
        """The integral over an arc."""
        return self._antiderivative(arc.stop) - self._antiderivative(arc.start)

    def _antiderivative(self, at: Position) -> arb:
        linkage = self.linkage
        by_p, by_d = _over_difference(linkage.P, at), _over_difference(linkage.D, at)
        by_q = 2 * at.arctangent(arb((linkage.Q - 1) / (linkage.Q + 1)).sqrt()) / arb(linkage.Q**2 - 1).sqrt()
        by_d_squared = (at.sine / (linkage.D - at.cosine) + linkage.D * by_d) / (linkage.D**2 - 1)
        even = _HALF * at.angle + self._p * by_p + self._q * by_q + self._v * by_d + self._v_squared * by_d_squared
        return even + self._odd_part(at.cosine)

    def _odd_part(self, u: arb) -> arb:
        linkage = self.linkage
        one, two, three = self._odd
        ratio = positive((linkage.Q + u) / (linkage.P - u))
        y = ratio.sqrt()
        if linkage.M == 0:
            # then also D = P, and the integral of du/(V w) is 2 y/(P + Q)
            return one * 2 * y.atan() + two * 2 * y / (linkage.P + linkage.Q)
        plus, minus = linkage.D + linkage.Q, linkage.D - linkage.P
        inner = (y * arb(minus / plus).sqrt()).atan() / abs(linkage.M)
        last = y / (plus + minus * ratio) * (1 / plus - 1 / minus) + inner * (1 / plus + 1 / minus)
        return one * 2 * y.atan() + two * 2 * inner + three * last


def _over_difference(a: fmpq, at: Position) -> arb:
    """The integral of 1/(a - cos(theta))."""
    return 2 * at.arctangent(arb((a + 1) / (a - 1)).sqrt()) / arb(a * a - 1).sqrt()


def integrate(linkage: Linkage, arc: Arc, signal: Integrand) -> arb:
    """The integral of a signal over an arc."""

    def function(tangent: acb, half_turns: int, analytic: bool) -> acb:
        return signal(linkage.near(tangent, half_turns, lambda square: square.sqrt(analytic=analytic)), analytic)

    return integrate_over(arc, function)


def transmission_angle(linkage: Linkage) -> Integrand:
    """The transmission angle: its cosine is (Q + u - (P - u)) over their sum, its sine 2 w over it."""

    def signal(state: State, analytic: bool) -> acb:
        along = (linkage.Q - linkage.P + 2 * state.cosine) / (2 * state.root)
        return arb.pi() / 2 - arctangent(along, analytic)

    return signal


def angle(linkage: Linkage, link: int) -> Integrand:
    """The angle of a link of a four-bar whose ground is longer than its crank."""
    crank, _, _, ground = linkage.lengths

    def signal(state: State, analytic: bool) -> acb:
        along = (linkage.M - link * (linkage.D - state.cosine)) / state.root
        across = crank * state.sine / (ground - crank * state.cosine)
        return arb.pi() / 2 - arctangent(along, analytic) - arctangent(across, analytic)

    return signal
