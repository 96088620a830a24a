"""The equations of a group of four links: two links whose angles follow together from the lengths of two bars.

From end to end bar i is V = C + a u + b w in complex numbers, with u and w the directions of the two links, C between
points of the frame and the driver, and a and b in the coordinates of the links. Both angles follow from V.V = l^2 by
Newton's method, from places near by that `follow` gives; one step more would change no digit. With the determinant D
of the equations by the angles, D = 0 where two assemblies of the group meet.
"""

from typing import NamedTuple

from explore.mechanisms.linkages.graph import FOLLOWS, PARTS, Graph, Number, Series
from explore.mechanisms.linkages.vectors import Local, Vector, cross, dot

#: Steps of Newton's method: the first miss is at most a 50th of the distance at which it converges surely.
_NEWTON_STEPS = 3


class Chain(NamedTuple):
    """A bar as a chain: its vector is C + a u + b w, and its length is l.

    Attributes
    ----------
    known
        C, mm.
    first, second
        a and b, mm.
    length
        l, mm.
    """

    known: Vector
    first: Local
    second: Local
    length: Number


class Pose(NamedTuple):
    """The directions of the two links and what is known of them.

    Attributes
    ----------
    first, second
        The directions.
    reach, reach_size
        Positive where the group assembles, with its slope by the input angle; and the size of its rounding errors.
    square
        The square of the determinant of the equations, over the squares of their terms.
    gain
        Square of what errors of lengths are amplified by.
    """

    first: Vector
    second: Vector
    reach: Series
    reach_size: Number
    square: Series
    gain: Number


def pose_group(graph: Graph, cosine: Number, sine: Number, number: int, chains: tuple[Chain, Chain]) -> Pose:
    """Solve the group of a number for the directions of its links."""
    reach = graph.put(FOLLOWS[number], cosine.index, sine.index)
    cu, su, cw, sw, slope, size = (graph.put(part, reach.index) for part in PARTS)
    u, w = _normal((cu, su)), _normal((cw, sw))
    for _ in range(_NEWTON_STEPS):
        u, w = _improve(chains, u, w)
    first, second = _derive(chains, u, w)
    rows = [_slopes(chain, first, second) for chain in chains]
    (p, q), (r, s) = rows
    determinant = p * s - q * r
    sizes = [_norm(chain.first) * _norm(chain.second) for chain in chains]
    scale = 1.0 / (chains[0].length * chains[1].length * (sizes[0] * sizes[1]).sqrt())
    inverse = 1.0 / determinant.terms[0]
    reaches = Series(reach, slope, graph.constant(0.0))
    return Pose(first, second, reaches, size, _squared(determinant * scale), _gain(chains, rows, inverse))


def _improve(chains: tuple[Chain, Chain], u: Local, w: Local) -> tuple[Local, Local]:
    """Take a step of Newton's method."""
    rows = []
    for chain in chains:
        (cx, cy), a, b = chain.known, _turned(chain.first, u), _turned(chain.second, w)
        v = (cx.terms[0] + (a[0] + b[0]), cy.terms[0] + (a[1] + b[1]))
        miss = 0.5 * (dot(v, v) - chain.length * chain.length)
        rows.append((cross(a, v), cross(b, v), miss))
    (p, q, e), (r, s, f) = rows
    inverse = 1.0 / (p * s - q * r)
    return _rotated(u, (q * f - s * e) * inverse), _rotated(w, (r * e - p * f) * inverse)


def _derive(chains: tuple[Chain, Chain], u: Local, w: Local) -> tuple[Vector, Vector]:
    """The directions with their derivatives, from those of V.V = l^2."""
    places = []
    for chain in chains:
        a, b = _turned(chain.first, u), _turned(chain.second, w)
        known = [(chain.known[0].terms[k], chain.known[1].terms[k]) for k in range(3)]
        v = (known[0][0] + (a[0] + b[0]), known[0][1] + (a[1] + b[1]))
        places.append((a, b, v, known))
    (p, q), (r, s) = ((cross(a, v), cross(b, v)) for a, b, v, _ in places)
    inverse = 1.0 / (p * s - q * r)

    def solve(e: Number, f: Number) -> tuple[Number, Number]:
        return (q * f - s * e) * inverse, (r * e - p * f) * inverse

    du, dw = solve(*(dot(v, known[1]) for _, _, v, known in places))
    misses = []
    for a, b, v, known in places:
        rate = (known[1][0] - (a[1] * du + b[1] * dw), known[1][1] + (a[0] * du + b[0] * dw))
        inward = tuple(known[2][k] - (a[k] * (du * du) + b[k] * (dw * dw)) for k in range(2))
        misses.append(dot(rate, rate) + v[0] * inward[0] + v[1] * inward[1])
    ddu, ddw = solve(*misses)
    return _direction(u, du, ddu), _direction(w, dw, ddw)


def _direction(u: Local, rate: Number, change: Number) -> Vector:
    """A direction from its cosine and sine, and from the derivatives of its angle."""
    cosine, sine = u
    square = rate * rate
    return (
        Series(cosine, -(sine * rate), -(sine * change + cosine * square)),
        Series(sine, cosine * rate, cosine * change - sine * square),
    )


def _slopes(chain: Chain, first: Vector, second: Vector) -> tuple[Series, Series]:
    """Half the slopes of V.V by the two angles."""
    a, b = _turned_by(chain.first, first), _turned_by(chain.second, second)
    v = (chain.known[0] + (a[0] + b[0]), chain.known[1] + (a[1] + b[1]))
    return cross(a, v), cross(b, v)


def _gain(chains: tuple[Chain, Chain], rows: list[tuple[Series, Series]], inverse: Number) -> Number:
    """Square of the largest change of a place, over changes of both lengths."""
    (p, q), (r, s) = (tuple(each.terms[0] for each in row) for row in rows)
    one, other = (chain.length * inverse for chain in chains)
    arms = [dot(chain.first, chain.first) for chain in chains], [dot(chain.second, chain.second) for chain in chains]
    of_first = (arms[0][0] + arms[0][1]) * (_square(s * one) + _square(q * other))
    return of_first + (arms[1][0] + arms[1][1]) * (_square(r * one) + _square(p * other))


def _rotated(u: Local, angle: Number) -> Local:
    """A direction turned by a small angle, but for its cube."""
    half = 0.5 * angle
    square = half * half
    inverse = 1.0 / (1.0 + square)
    return _turned(u, ((1.0 - square) * inverse, angle * inverse))


def _turned(a: Local, u: Local) -> Local:
    """A vector turned by a direction."""
    return a[0] * u[0] - a[1] * u[1], a[0] * u[1] + a[1] * u[0]


def _turned_by(a: Local, direction: Vector) -> Vector:
    cosine, sine = direction
    return cosine * a[0] - sine * a[1], sine * a[0] + cosine * a[1]


def _normal(u: Local) -> Local:
    inverse = 1.0 / dot(u, u).sqrt()
    return u[0] * inverse, u[1] * inverse


def _norm(a: Local) -> Number:
    return dot(a, a).sqrt()


def _square(number: Number) -> Number:
    return number * number


def _squared(series: Series) -> Series:
    return series * series
