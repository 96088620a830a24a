"""A four-bar linkage in ball arithmetic: positions of the crank, velocities, accelerations and angles.

With u = cos(theta), C = 2 r1 r4 and rational numbers D, P, Q, M, E of the lengths (docs/numerics.md),
d^2 = C V, p = C (P - u), q = C (Q + u), V = D - u, w = sqrt((P - u)(Q + u)), and the angular velocities are

    (kappa + M/V)/2 sin(theta)/w + 1/2 - E/V,    kappa = 1 for the rocker, -1 for the coupler.

All is for branch 1; the motion of branch -1 at theta is the mirror of this one at -theta.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from flint import arb

from explore.analysis.certifying.balls import exact, positive
from explore.analysis.certifying.positions import Arc, Position

#: Sign of the equations (kappa) of the coupler.
COUPLER = -1
#: Sign of the equations (kappa) of the rocker.
ROCKER = 1


@dataclass(frozen=True)
class State:
    """Cosine and sine of a crank angle, and w, as balls, real or complex."""

    cosine: Any
    sine: Any
    root: Any


class Linkage:
    """A four-bar of exact lengths whose crank turns, at the precision that is set."""

    def __init__(self, crank: float, coupler: float, rocker: float, ground: float) -> None:
        self.lengths = a, b, c, d = tuple(map(exact, (crank, coupler, rocker, ground)))
        scale = 2 * a * d
        self.D = (a * a + d * d) / scale
        self.P = (a * a + d * d - (b - c) ** 2) / scale
        self.Q = ((b + c) ** 2 - a * a - d * d) / scale
        self.M = (b * b - c * c) / scale
        self.E = (d * d - a * a) / (2 * scale)

    @cached_property
    def overlapped(self) -> Position:
        """The limit position with the coupler over the crank."""
        cosine = self._cosine_at_crank(self.lengths[1] - self.lengths[0])
        return Position(0, -arb((1 + cosine) / (1 - cosine)).sqrt())

    @cached_property
    def extended(self) -> Position:
        """The limit position with the coupler in line with the crank."""
        cosine = self._cosine_at_crank(self.lengths[1] + self.lengths[0])
        return Position(0, arb((1 - cosine) / (1 + cosine)).sqrt())

    def _cosine_at_crank(self, reach: Any) -> Any:
        """Cosine of the angle at the crank's pivot where the joint of coupler and rocker is this far from it."""
        _, _, c, d = self.lengths
        return (reach * reach + d * d - c * c) / (2 * reach * d)

    def state(self, cosine: arb, sine: arb) -> State:
        """The state at a crank angle."""
        return State(cosine, sine, positive((self.P - cosine) * (self.Q + cosine)).sqrt())

    def at(self, position: Position) -> State:
        """The state at a position."""
        return self.state(position.cosine, position.sine)

    def near(self, tangent: Any, half_turns: int, root: Callable[[Any], Any]) -> State:
        """The state at a half-tangent from a multiple of pi, real or complex, by a square root of these numbers."""
        square = tangent * tangent
        one, sign = 1 + square, -1 if half_turns % 2 else 1
        p, q = (self.P - sign) + (self.P + sign) * square, (self.Q + sign) + (self.Q - sign) * square
        return State(sign * (1 - square) / one, sign * 2 * tangent / one, root(p) * root(q) / one)

    def velocity(self, link: int, state: State) -> Any:
        """Angular velocity per crank velocity."""
        v = 1 / (self.D - state.cosine)
        return (link + self.M * v) * state.sine / (2 * state.root) + (1 - 2 * self.E * v) / 2

    def acceleration(self, link: int, state: State) -> Any:
        """Angular acceleration per square of the crank velocity, the derivative of `velocity`."""
        u, sine, w = state.cosine, state.sine, state.root
        v = 1 / (self.D - u)
        rate = (u + sine * sine * (self.P - self.Q - 2 * u) / (2 * w * w)) / w  # of sin/w
        return (link + self.M * v) * rate / 2 + sine * v * v * (self.E - self.M * sine / (2 * w))

    def angle(self, link: int, position: Position) -> arb:
        """Angle of a link, rad, continuous in the crank angle."""
        state, (a, _, _, d) = self.at(position), self.lengths
        along = self.M - link * (self.D - state.cosine)
        own = arb.atan2(state.root, along)  # from the line between crank joint and rocker pivot
        if d > a:
            return own - (a * state.sine / (d - a * state.cosine)).atan()
        return own + arb.pi() + position.angle + (d * state.sine / (a - d * state.cosine)).atan()

    def transmission_angle(self, state: State) -> arb:
        """The transmission angle, rad."""
        return 2 * ((self.P - state.cosine) / (self.Q + state.cosine)).sqrt().atan()

    def stroke(self, *, through_zero: bool) -> Arc:
        """The stroke that passes crank angle 0, from overlapped to extended, or the other one."""
        if through_zero:
            return Arc(self.overlapped, self.extended)
        return Arc(self.extended, self.overlapped.later(1))
