"""Integrals over crank angles of signals of a four-bar, by rigorous integration.

`acb.integral` bounds the error of Gauss-Legendre rules by the size of the integrand on ellipses around the pieces, and
halves the pieces. The variable is the half-tangent from the nearest multiple of pi, in which all is algebraic.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from math import ceil

from flint import acb, arb, ctx

from explore.certifying.four_bar_motion import Arc, Linkage, State

#: Takes a state and whether it must be analytic there, and returns the signal.
Integrand = Callable[[State, bool], acb]
_NOWHERE = acb("nan")


def integrate(linkage: Linkage, arc: Arc, integrand: Integrand) -> arb:
    """The integral of a signal over an arc."""
    total, tolerance = arb(0), arb(2) ** -(ctx.prec * 5 // 8)
    for half_turns, start, stop in _pieces(arc):

        def function(tangent: acb, analytic: bool, half_turns: int = half_turns) -> acb:
            state = linkage.near(tangent, half_turns, lambda square: square.sqrt(analytic=analytic))
            return integrand(state, analytic) * 2 / (1 + tangent * tangent)

        total += acb.integral(function, acb(start), acb(stop), rel_tol=tolerance, abs_tol=tolerance).real
    return total


def _pieces(arc: Arc) -> list[tuple[int, arb, arb]]:
    """Multiples of pi, and the half-tangents from them of the two ends, of the parts of an arc."""
    quarter = arb.pi() / 2
    first = ceil(float(arc.start.angle / arb.pi()) - 0.5)
    last = ceil(float(arc.stop.angle / arb.pi()) - 0.5)
    cuts = [(2 * k + 1) * quarter for k in range(first, last)]
    edges = [arc.start.angle, *cuts, arc.stop.angle]
    return [
        (first + k, ((a - (first + k) * arb.pi()) / 2).tan(), ((b - (first + k) * arb.pi()) / 2).tan())
        for k, (a, b) in enumerate(pairwise(edges))
    ]


def transmission_angle(linkage: Linkage) -> Integrand:
    """The transmission angle: its cosine is (Q + u - (P - u)) over their sum, its sine 2 w over it."""

    def signal(state: State, analytic: bool) -> acb:
        along = (linkage.Q - linkage.P + 2 * state.cosine) / (2 * state.root)
        return arb.pi() / 2 - _arctangent(along, analytic)

    return signal


def angle(linkage: Linkage, link: int) -> Integrand:
    """The angle of a link of a four-bar whose ground is longer than its crank."""
    crank, _, _, ground = linkage.lengths

    def signal(state: State, analytic: bool) -> acb:
        along = (linkage.M - link * (linkage.D - state.cosine)) / state.root
        across = crank * state.sine / (ground - crank * state.cosine)
        return arb.pi() / 2 - _arctangent(along, analytic) - _arctangent(across, analytic)

    return signal


def _arctangent(number: acb, analytic: bool) -> acb:
    """The arctangent, or no finite number on its branch cuts, where 1 + number^2 is real and negative."""
    if analytic and not (1 + number * number).sqrt(analytic=True).is_finite():
        return _NOWHERE
    return number.atan()
