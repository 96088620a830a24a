"""The equations of a group of links: two links whose angles follow together from two ties, bars or slots.

A tie is of a vector V = C + a u + b w in complex numbers, with u and w the directions of the two links, C between
points of the frame and the driver, and a and b in the coordinates of the links. Of a bar V is from end to end, and
V.V = l^2; of a slot V is from a point of its line to its pin, and D x V = 0 with the direction D of the line. Both
angles follow by Newton's method, from places near by that `follow` gives; one step more would change no digit. The
determinant of the equations by the angles is 0 where two assemblies of the group meet.
"""

from collections.abc import Sequence
from typing import NamedTuple

from explore.mechanisms.linkages.graph import FOLLOWS, PARTS, Graph, Number, Series
from explore.mechanisms.linkages.vectors import Local, Vector, cross, dot, minus

#: Steps of Newton's method: the first miss is at most a 50th of the distance at which it converges surely.
_NEWTON_STEPS = 3
#: Pairs of parts of a vector, in the order of the terms of a tie.
_PAIRS = ((0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3))


class Span(NamedTuple):
    """A vector that moves: as `known`, f + g z + a u + b w, and without the angle its parts f, g, a, b.

    Attributes
    ----------
    known
        C = f + g z, mm, z the direction of the driver.
    on_frame, on_driver, on_first, on_second
        f, g, a and b, mm, each in coordinates of its body.
    """

    known: Vector
    on_frame: Local
    on_driver: Local
    on_first: Local
    on_second: Local

    def __sub__(self, other: "Span") -> "Span":
        parts = (minus(own, of_other) for own, of_other in zip(self.parts, other.parts, strict=True))
        return Span(minus(self.known, other.known), *parts)

    @property
    def parts(self) -> tuple[Local, Local, Local, Local]:
        """f, g, a, b."""
        return self[1:]

    def place(self, u: Local, w: Local, order: int = 0) -> tuple[Local, Local, Local]:
        """The vector, or a derivative of its known part in place of that, and its parts with both links."""
        a, b = _turned(self.on_first, u), _turned(self.on_second, w)
        return (self.known[0].terms[order] + (a[0] + b[0]), self.known[1].terms[order] + (a[1] + b[1])), a, b


class Tie(NamedTuple):
    """A bar, or a slot.

    Attributes
    ----------
    span
        V, mm.
    along
        D, of length 1, a part of one body alone; None for a bar.
    length
        Length of the bar, mm, and 1 for a slot: what its value changes by with the length, or the place of the line.
    """

    span: Span
    along: Span | None
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


def pose_group(graph: Graph, cosine: Number, sine: Number, number: int, ties: tuple[Tie, Tie]) -> Pose:
    """Solve the group of a number for the directions of its links."""
    reach = graph.put(FOLLOWS[number], cosine.index, sine.index)
    cu, su, cw, sw, slope, size = (graph.put(part, reach.index) for part in PARTS)
    u, w = _normal((cu, su)), _normal((cw, sw))
    for _ in range(_NEWTON_STEPS):
        u, w = _improve(ties, u, w)
    first, second = _derive(ties, u, w)
    (p, q), (r, s) = (_slopes_along(tie, first, second) for tie in ties)
    determinant = p * s - q * r
    scale = 1.0 / (_scale(ties[0]) * _scale(ties[1]))
    inverse = 1.0 / determinant.terms[0]
    rows = [(p.terms[0], q.terms[0]), (r.terms[0], s.terms[0])]
    reaches = Series(reach, slope, graph.constant(0.0))
    return Pose(first, second, reaches, size, _squared(determinant * scale), _gain(ties, rows, (u, w), inverse))


def rows_of(tie: Tie) -> tuple[Number, ...]:
    """The rows of a tie that `following` takes; see `group_ties`."""
    parts, zero = tie.span.parts, tie.length.graph.constant(0.0)
    total = sum((_norm(part) for part in parts), zero)
    if tie.along is None:
        constant = 0.5 * (sum((dot(part, part) for part in parts), zero) - tie.length * tie.length)
        terms = [_conjugate_product(parts[i], parts[j]) for i, j in _PAIRS]
        rounded, bar_length = total * tie.length, tie.length
    else:
        lines = tie.along.parts
        constant = sum((cross(line, part) for line, part in zip(lines, parts, strict=True)), zero)
        terms = [_cross_term(lines, parts, i, j) for i, j in _PAIRS]
        rounded, bar_length = total, zero
    flat = [x for pair in (*terms, (rounded,), *parts, (bar_length,)) for x in pair]
    return constant, *flat, *map(_norm, terms)


def _conjugate_product(a: Local, b: Local) -> Local:
    """The product of the conjugate of a complex number and another one."""
    return dot(a, b), cross(a, b)


def _cross_term(lines: Sequence[Local], parts: Sequence[Local], i: int, j: int) -> Local:
    """The term of a slot of the pair of a line and a part of its vector, in both orders."""
    # of x + i y the imaginary part is the real part of y - i x; of the pair in the other order it is conjugate
    (x, y), (v, t) = _conjugate_product(lines[i], parts[j]), _conjugate_product(lines[j], parts[i])
    return y + t, v - x


def _value(tie: Tie, u: Local, w: Local) -> Number:
    v, _, _ = tie.span.place(u, w)
    if tie.along is None:
        return 0.5 * (dot(v, v) - tie.length * tie.length)
    return cross(tie.along.place(u, w)[0], v)


def _slopes(tie: Tie, u: Local, w: Local) -> tuple[Number, Number]:
    """The slopes of the value by both angles."""
    v, a, b = tie.span.place(u, w)
    if tie.along is None:
        return cross(a, v), cross(b, v)
    d, on_first, on_second = tie.along.place(u, w)
    return dot(d, a) - dot(on_first, v), dot(d, b) - dot(on_second, v)


def _slopes_along(tie: Tie, first: Vector, second: Vector) -> tuple[Series, Series]:
    """The slopes with their derivatives, for directions with theirs."""
    v, a, b = _moving(tie.span, first, second)
    if tie.along is None:
        return cross(a, v), cross(b, v)
    d, on_first, on_second = _moving(tie.along, first, second)
    return dot(d, a) - dot(on_first, v), dot(d, b) - dot(on_second, v)


def _moving(span: Span, first: Vector, second: Vector) -> tuple[Vector, Vector, Vector]:
    a, b = _turned_by(span.on_first, first), _turned_by(span.on_second, second)
    return (span.known[0] + (a[0] + b[0]), span.known[1] + (a[1] + b[1])), a, b


def _improve(ties: tuple[Tie, Tie], u: Local, w: Local) -> tuple[Local, Local]:
    """Take a step of Newton's method."""
    (p, q), (r, s) = (_slopes(tie, u, w) for tie in ties)
    e, f = (_value(tie, u, w) for tie in ties)
    inverse = 1.0 / (p * s - q * r)
    return _rotated(u, (q * f - s * e) * inverse), _rotated(w, (r * e - p * f) * inverse)


def _derive(ties: tuple[Tie, Tie], u: Local, w: Local) -> tuple[Vector, Vector]:
    """The directions with their derivatives, from those of the ties."""
    (p, q), (r, s) = (_slopes(tie, u, w) for tie in ties)
    inverse = 1.0 / (p * s - q * r)

    def solve(e: Number, f: Number) -> tuple[Number, Number]:
        return (q * f - s * e) * inverse, (r * e - p * f) * inverse

    du, dw = solve(*(_rate(tie, u, w) for tie in ties))
    ddu, ddw = solve(*(_bend(tie, u, w, du, dw) for tie in ties))
    return _direction(u, du, ddu), _direction(w, dw, ddw)


def _rate(tie: Tie, u: Local, w: Local) -> Number:
    """The derivative of the value by the input angle alone."""
    v, rate = tie.span.place(u, w)[0], _derivative(tie.span, 1)
    if tie.along is None:
        return dot(v, rate)
    return cross(tie.along.place(u, w)[0], rate) + cross(_derivative(tie.along, 1), v)


def _bend(tie: Tie, u: Local, w: Local, du: Number, dw: Number) -> Number:
    """The second derivative of the value but for those of the angles, at rates of these."""
    v, rate, inward = _motion(tie.span, u, w, du, dw)
    if tie.along is None:
        return dot(rate, rate) + dot(v, inward)
    d, turning, bending = _motion(tie.along, u, w, du, dw)
    return 2.0 * cross(turning, rate) + cross(d, inward) + cross(bending, v)


def _motion(span: Span, u: Local, w: Local, du: Number, dw: Number) -> tuple[Local, Local, Local]:
    """A vector, its rate, and its second derivative but for those of the angles."""
    v, a, b = span.place(u, w)
    (x, y), (xx, yy) = _derivative(span, 1), _derivative(span, 2)
    rate = x - (a[1] * du + b[1] * dw), y + (a[0] * du + b[0] * dw)
    inward = xx - (a[0] * (du * du) + b[0] * (dw * dw)), yy - (a[1] * (du * du) + b[1] * (dw * dw))
    return v, rate, inward


def _derivative(span: Span, order: int) -> Local:
    """A derivative of the known part."""
    return span.known[0].terms[order], span.known[1].terms[order]


def _direction(u: Local, rate: Number, change: Number) -> Vector:
    """A direction from its cosine and sine, and from the derivatives of its angle."""
    cosine, sine = u
    square = rate * rate
    return (
        Series(cosine, -(sine * rate), -(sine * change + cosine * square)),
        Series(sine, cosine * rate, cosine * change - sine * square),
    )


def _scale(tie: Tie) -> Number:
    """What the slopes of a tie are relative to."""
    if tie.along is None:
        return tie.length * (_norm(tie.span.on_first) * _norm(tie.span.on_second)).sqrt()
    return sum((_norm(part) for part in tie.span.parts), tie.length.graph.constant(0.0))


def _gain(
    ties: tuple[Tie, Tie], rows: list[tuple[Number, Number]], directions: tuple[Local, Local], inverse: Number
) -> Number:  # fmt: skip
    """Square of the largest change of a place, over changes of both lengths, or of the places of lines."""
    (p, q), (r, s) = rows
    one, other = (tie.length * inverse for tie in ties)
    arms = [_arms(tie, *directions) for tie in ties]
    of_first = (arms[0][0] + arms[1][0]) * (_square(s * one) + _square(q * other))
    return of_first + (arms[0][1] + arms[1][1]) * (_square(r * one) + _square(p * other))


def _arms(tie: Tie, u: Local, w: Local) -> tuple[Number, Number]:
    """Squares of what both links move the ends of a tie by, over their angles."""
    first, second = dot(tie.span.on_first, tie.span.on_first), dot(tie.span.on_second, tie.span.on_second)
    if tie.along is None:
        return first, second
    v, _, _ = tie.span.place(u, w)
    square = dot(v, v)
    of_first, of_second = (dot(part, part) for part in tie.along.parts[2:])
    return first + square * of_first, second + square * of_second


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
