"""Where signals of a four-bar may have extremes, also behind clutches: roots of polynomials in the crank's cosine.

Each signal changes where sin(theta) times a polynomial equals another polynomial times a power of w. Squares of both
sides make one polynomial with rational coefficients; all its roots are isolated, those that solve the squares only are
points of the motion too and change nothing.

The output of several four-bars through one-way clutches is the largest of the rocker velocities, or rest. On the drive
stroke the velocity rises to one peak and falls; that there is one only is proved by counting the zeros of the
acceleration. Then the velocity and the same a period later, 2 pi/z, are equal at one angle before the peak, and from
there the output follows one rocker for a period; where a stroke is shorter than a period it rests in between.
"""

from collections.abc import Callable, Iterator

from flint import arb, ctx, fmpq, fmpq_poly

from explore.analysis.certifying.balls import UndecidedError
from explore.analysis.certifying.four_bar_motion import ROCKER, Linkage, State
from explore.analysis.certifying.positions import Arc, Position, other_coordinate, real_roots

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


def peak(linkage: Linkage, stroke: Arc) -> arb:
    """The angle in a stroke where the rocker is fastest, between the angles of the stroke's ends."""
    peaks = []
    for cosine in real_roots(turning_points_of_velocity(linkage, ROCKER)):
        for position, state in positions_at(linkage, cosine):
            if linkage.acceleration(ROCKER, state).contains(0) and stroke.holds(position.angle):
                turns = ((stroke.start.angle - position.angle) / (2 * arb.pi())).ceil()
                peaks.append(position.angle + 2 * arb.pi() * turns)
    if len(peaks) != 1:
        raise UndecidedError
    return peaks[0]


def driven_arc(linkage: Linkage, stroke: Arc, period: arb) -> Arc:
    """The part of the drive stroke in which one rocker drives the output: a period, or all of a shorter stroke."""
    if stroke.length < period:
        return stroke
    if not stroke.length > period:
        raise UndecidedError
    at_peak = peak(linkage, stroke)
    low, high = stroke.start.angle.max(at_peak - period), (stroke.stop.angle - period).min(at_peak)
    for _ in range(ctx.prec):
        middle = ((low + high) / 2).mid()
        gain = abs(_speed(linkage, middle + period)) - abs(_speed(linkage, middle))
        if gain > 0:
            low = middle
        elif gain < 0:
            high = middle
        else:
            break
    crossing = low.union(high)
    return Arc(Position.at_angle(crossing), Position.at_angle(crossing + period))


def _speed(linkage: Linkage, angle: arb) -> arb:
    return linkage.velocity(ROCKER, linkage.at(Position.at_angle(angle)))
