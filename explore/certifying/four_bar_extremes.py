"""Extremes of signals of a four-bar over an arc: at its ends, or at roots of a polynomial in the crank's cosine.

Each signal changes where sin(theta) times a polynomial equals another polynomial times a power of w. Squares of both
sides make one polynomial with rational coefficients; all its roots are isolated, those that solve the squares only are
points of the motion too and change nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from flint import arb, fmpq, fmpq_poly

from explore.certifying.balls import UndecidedError, UnprovedError
from explore.certifying.four_bar_motion import Arc, Linkage, Position, State

_U = fmpq_poly([0, 1])
_HALF, _QUARTER = fmpq(1, 2), fmpq(1, 4)


def turning_points_of_angle(linkage: Linkage, link: int) -> fmpq_poly:
    """Polynomial whose roots include the cosines where the velocity of a link is 0."""
    v, w_squared, sine_squared = _parts(linkage)
    return (link * v + linkage.M) ** 2 * sine_squared - w_squared * (2 * linkage.E - v) ** 2


def turning_points_of_velocity(linkage: Linkage, link: int) -> fmpq_poly:
    """Polynomial whose roots include the cosines where the acceleration of a link is 0."""
    _, w_squared, sine_squared = _parts(linkage)
    return _numerator(linkage, link) ** 2 - linkage.E**2 * sine_squared * w_squared**3


def turning_points_of_acceleration(linkage: Linkage, link: int) -> fmpq_poly:
    """Polynomial whose roots include the cosines where the derivative of the acceleration of a link is 0."""
    v, w_squared, sine_squared = _parts(linkage)
    x = _numerator(linkage, link)
    y = (x.derivative() * w_squared - fmpq(3, 2) * x * w_squared.derivative()) * v + 2 * x * w_squared
    z = linkage.E * (_U * v - 2 * sine_squared)
    return sine_squared * y**2 - w_squared**5 * z**2


def _parts(linkage: Linkage) -> tuple[fmpq_poly, fmpq_poly, fmpq_poly]:
    """V, w^2 and sin^2 as polynomials in u."""
    return linkage.D - _U, (linkage.P - _U) * (linkage.Q + _U), 1 - _U * _U


def _numerator(linkage: Linkage, link: int) -> fmpq_poly:
    """X, where the acceleration is X/(w^3 V^2) + E sin(theta)/V^2."""
    v, w_squared, sine_squared = _parts(linkage)
    both = link * v + linkage.M
    steep = _HALF * linkage.M * w_squared - _QUARTER * both * v * w_squared.derivative()
    return _HALF * both * v * _U * w_squared - sine_squared * steep


def extremes(
    linkage: Linkage, arc: Arc, signal: Callable[[Position, State], arb], turning: fmpq_poly
) -> tuple[arb, arb]:
    """Smallest and largest value of a signal over an arc.

    Parameters
    ----------
    signal
        Its value at a position and the state there.
    turning
        Polynomial whose roots include the cosines of all positions where the signal turns.
    """
    values = [signal(end, linkage.at(end)) for end in (arc.start, arc.stop)]
    low, high = values[0].min(values[1]), values[0].max(values[1])
    for cosine in real_roots(turning):
        for position, state in positions_at(linkage, cosine):
            value = signal(position, state)
            try:
                if linkage.is_in(arc, position.angle):
                    low, high = low.min(value), high.max(value)
            except UndecidedError:  # perhaps inside
                low, high = low.union(low.min(value)), high.union(high.max(value))
    return low, high


def real_roots(polynomial: fmpq_poly) -> Iterable[arb]:
    """Real roots between -1 and 1, or perhaps just outside."""
    if polynomial.degree() < 0:
        raise UnprovedError("a signal that is constant has no extremes")
    for root, _ in polynomial.numer().complex_roots():
        # a root that is real has an imaginary part of exactly 0
        if root.imag.is_zero() and not (root.real > 1 or root.real < -1):
            yield root.real
        elif not root.imag.is_zero() and root.imag.contains(0):
            raise UndecidedError


def positions_at(linkage: Linkage, cosine: arb) -> Iterable[tuple[Position, State]]:
    """Both positions with a cosine."""
    square = (1 - cosine) * (1 + cosine)
    if square.contains(0):
        square = arb(0).union(square.abs_upper())
    sine = square.sqrt()
    for signed in (sine, -sine):
        # tan of half the angle from 0, or from pi where the cosine is negative
        tangent = signed / (1 + cosine) if cosine.mid() > 0 else -signed / (1 - cosine)
        yield Position(0 if cosine.mid() > 0 else 1, tangent), linkage.state(cosine, signed)
