"""Signals of a four-bar as integrands of rigorous integration."""

from __future__ import annotations

from collections.abc import Callable

from flint import acb, arb

from explore.analysis.certifying.four_bar_motion import Linkage, State
from explore.analysis.certifying.integration import arctangent, integrate_over
from explore.analysis.certifying.positions import Arc

#: Function that takes a state, and whether it must be analytic there, and returns the signal.
Integrand = Callable[[State, bool], acb]


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
