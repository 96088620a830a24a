"""Ball arithmetic: exact numbers from doubles, enclosures, and what to do when they are too wide.

A ball is a number with a radius that holds all rounding (python-flint's `arb`). Parameters are exact rationals.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

from flint import arb, ctx, fmpq

#: Precisions that are tried in turn, bits.
PRECISIONS = (128, 256, 512, 1024)
#: Largest radius of a narrow enclosure over its scale: a 2048th of the rounding of a double.
_NARROW = 2.0**-64

_Value = TypeVar("_Value")


class UnprovedError(Exception):
    """There is no rigorous road to a number, or no precision decides it; the text says why."""


class UndecidedError(Exception):
    """The balls are too wide; more precision may help."""


@dataclass(frozen=True)
class Enclosure:
    """A ball that holds a number, and the size that an error of the number is relative to, as in the column `error`."""

    ball: arb
    scale: arb

    @classmethod
    def of(cls, ball: arb) -> Enclosure:
        """A number whose error is relative to itself."""
        return cls(ball, abs(ball))

    @property
    def is_narrow(self) -> bool:
        """Whether the radius is far below the rounding of a double."""
        return self.scale.is_finite() and bool(self.ball.rad() <= self.scale.abs_upper() * _NARROW)

    def times(self, factor: arb) -> Enclosure:
        """The number in another unit, or of the opposite sign."""
        return Enclosure(self.ball * factor, self.scale * abs(factor))


def with_more_bits(find: Callable[[int], _Value | None], reason: str) -> _Value:
    """The first value that is found with rising precision.

    `find` takes a precision in bits; it returns None, or raises `UndecidedError`, if that is too low. If all are,
    `UnprovedError` is raised with the reason.
    """
    before = ctx.prec
    try:
        for bits in PRECISIONS:
            ctx.prec = bits
            try:
                value = find(bits)
            except UndecidedError:
                continue
            if value is not None:
                return value
    finally:
        ctx.prec = before
    raise UnprovedError(f"{reason} is not decided with {PRECISIONS[-1]} bits")


def exact(number: float | fmpq) -> fmpq:
    """A double as a rational; a rational is itself."""
    return number if isinstance(number, fmpq) else fmpq(*number.as_integer_ratio())


def sure_sign(ball: arb) -> int:
    """1, 0 or -1; raises UndecidedError if the ball holds numbers of several signs."""
    if ball > 0:
        return 1
    if ball < 0:
        return -1
    if ball.is_zero():
        return 0
    raise UndecidedError


def positive(ball: arb) -> arb:
    """The ball, if all its numbers are positive; else UndecidedError is raised."""
    if not ball > 0:
        raise UndecidedError
    return ball


def bounds(ball: arb) -> tuple[float, float]:
    """Doubles below and above all numbers of a ball; both equal a ball that is a double."""
    low, high = float(ball.lower()), float(ball.upper())
    if ball.is_exact() and low == high and arb(low) == ball:
        return low, high
    return math.nextafter(low, -math.inf), math.nextafter(high, math.inf)
