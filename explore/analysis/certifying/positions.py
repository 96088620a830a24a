"""Crank angles in ball arithmetic: positions, arcs, and extremes over them from the roots of polynomials."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

from flint import arb, fmpq, fmpq_poly

from explore.analysis.certifying.balls import UndecidedError, UnprovedError


@dataclass(frozen=True)
class Position:
    """A crank angle: `half_turns` times pi, plus twice the arctangent of `tangent`."""

    half_turns: int
    tangent: arb

    @classmethod
    def at_angle(cls, angle: arb) -> Position:
        """The position at an angle in rad."""
        half_turns = round(float(angle.mid() / arb.pi()))
        return cls(half_turns, ((angle - half_turns * arb.pi()) / 2).tan())

    @classmethod
    def at_degrees(cls, angle: Fraction) -> Position:
        """The position at an exact angle in deg."""
        half_turns = round(angle / 180)
        half = angle / 360 - Fraction(half_turns, 2)
        return cls(half_turns, (arb(fmpq(half.numerator, half.denominator)) * arb.pi()).tan())

    @cached_property
    def angle(self) -> arb:
        """The crank angle, rad."""
        return self.half_turns * arb.pi() + 2 * self.tangent.atan()

    @cached_property
    def cosine(self) -> arb:
        """Cosine of the crank angle."""
        square = self.tangent**2
        return self._sign * (1 - square) / (1 + square)

    @cached_property
    def sine(self) -> arb:
        """Sine of the crank angle."""
        return self._sign * 2 * self.tangent / (1 + self.tangent**2)

    @property
    def _sign(self) -> int:
        return -1 if self.half_turns % 2 else 1

    def arctangent(self, factor: arb) -> arb:
        """The arctangent of `factor` times tan(theta/2), continuous in theta."""
        inner = self.tangent / factor if self.half_turns % 2 else self.tangent * factor
        return self.half_turns * arb.pi() / 2 + inner.atan()

    def mirrored(self) -> Position:
        """The position at the opposite angle."""
        return Position(-self.half_turns, -self.tangent)

    def later(self, turns: int) -> Position:
        """The position some full turns later."""
        return Position(self.half_turns + 2 * turns, self.tangent)


@dataclass(frozen=True)
class Arc:
    """A part of the turn, from one position forwards to another."""

    start: Position
    stop: Position

    @cached_property
    def length(self) -> arb:
        """Its length, rad."""
        return self.stop.angle - self.start.angle

    def mirrored(self) -> Arc:
        """The arc that the mirrored motion passes."""
        return Arc(self.stop.mirrored(), self.start.mirrored())

    def holds(self, angle: arb) -> bool:
        """Whether an angle, or one that differs by turns, is inside; UndecidedError is raised at the ends."""
        turn, undecided = 2 * arb.pi(), False
        first = int((float(self.start.angle) - float(angle)) // float(turn))
        for k in range(first, first + 4):
            here = angle + k * turn
            if here > self.start.angle and here < self.stop.angle:
                return True
            undecided |= not (here < self.start.angle or here > self.stop.angle)
        if undecided:
            raise UndecidedError
        return False


def full_turn() -> Arc:
    """The full turn."""
    return Arc(Position(0, arb(0)), Position(2, arb(0)))


def extremes(ends: Iterable[arb], arc: Arc, turning: Iterable[tuple[arb, arb]]) -> tuple[arb, arb]:
    """Smallest and largest value of a signal over an arc, from its values at the ends and where it may turn."""
    first, last = ends
    low, high = first.min(last), first.max(last)
    for angle, value in turning:
        try:
            if arc.holds(angle):
                low, high = low.min(value), high.max(value)
        except UndecidedError:  # perhaps inside
            low, high = low.union(low.min(value)), high.union(high.max(value))
    return low, high


def real_roots(polynomial: fmpq_poly) -> Iterator[arb]:
    """Real roots between -1 and 1, or perhaps just outside."""
    if polynomial.degree() < 0:
        raise UnprovedError("a signal that is constant has no extremes")
    for root, _ in polynomial.numer().complex_roots():
        # a root that is real has an imaginary part of exactly 0
        if root.imag.is_zero() and not (root.real > 1 or root.real < -1):
            yield root.real
        elif not root.imag.is_zero() and root.imag.contains(0):
            raise UndecidedError


def other_coordinate(coordinate: arb) -> arb:
    """The sine, not negative, of an angle with this cosine, or the other way round."""
    square = (1 - coordinate) * (1 + coordinate)
    # a ball from 0 may begin below it by rounding, so that it has no root
    return arb(0).union(square.abs_upper().sqrt()) if square.contains(0) else square.sqrt()
