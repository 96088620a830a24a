"""Where signals of a four-bar may have extremes: at roots of polynomials in the cosine of the crank.

Each signal changes where sin(theta) times a polynomial equals another polynomial times a power of w. Squares of both
sides make one polynomial with rational coefficients; all its roots are isolated, those that solve the squares only are
points of the motion too and change nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from flint import arb, fmpq, fmpq_poly

from explore.analysis.certifying.four_bar_motion import Linkage, State
from explore.analysis.certifying.positions import Position, other_coordinate, real_roots

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


def turning_values(
    linkage: Linkage, signal: Callable[[Position, State], arb], turning: fmpq_poly
) -> Iterator[tuple[arb, arb]]:
    """Crank angles where a signal may turn, and its values there.

    The roots of the polynomial include the cosines of all positions where it turns.
    """
    for cosine in real_roots(turning):
        for position, state in positions_at(linkage, cosine):
            yield position.angle, signal(position, state)


def positions_at(linkage: Linkage, cosine: arb) -> Iterator[tuple[Position, State]]:
    """Both positions with a cosine."""
    sine = other_coordinate(cosine)
    for signed in (sine, -sine):
        # tan of half the angle from 0, or from pi where the cosine is negative
        tangent = signed / (1 + cosine) if cosine.mid() > 0 else -signed / (1 - cosine)
        yield Position(0 if cosine.mid() > 0 else 1, tangent), linkage.state(cosine, signed)
