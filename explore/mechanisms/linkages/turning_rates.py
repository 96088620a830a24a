"""Rates of links that turn, by the input angle, from those of the vector between two points that they hang at.

A vector d of the square D turns by phi' = (d x d')/D and grows by D'/D. Where its ends are pinned to two links of fixed
lengths, these meet at k d + f J d from its start, J a quarter of a turn to the left. With the determinant δ = f D, of
δ^2 = p q/4 and p' = -q' = D'::

    h = D'/(2 δ),   k' = (1/2 - k) D'/D,   δ' = h (q - p)/4

tell how fast the angles of the triangle change: the links turn by phi' + (k - 1) h and phi' + k h. A link from the
start of d with the end of it in a slot, at the distance e across, turns by phi' + e g/D, with g = D'/(2 root) the rate
of the root of D - e^2. Each term is as exact as D', a product where one end is on the driver and one on the frame.
"""

from explore.mechanisms.linkages.graph import Number, Series
from explore.mechanisms.linkages.vectors import Local, Vector, cross

#: First and second derivative of the angle of a link by the input angle.
Turning = tuple[Number, Number]


def turn_sides(
    d: Vector, square: Series, k: Number, difference: Number, determinant: Number
) -> tuple[Turning, Turning]:
    """How the links at the start and at the end of d turn; `difference` is q - p."""
    (own, own_change), growth = _turn(d, square)
    half, inverse = 0.5 * square.terms[1], 1.0 / determinant
    h = half * inverse
    h_change = (0.5 * square.terms[2] - 0.25 * (h * h) * difference) * inverse
    both = own_change + (0.5 - k) * growth * h
    return (own + (k - 1.0) * h, both + (k - 1.0) * h_change), (own + k * h, both + k * h_change)


def turn_in_slot(d: Vector, square: Series, root: Number, across: Number) -> Turning:
    """How a link turns that is pinned at the start of d, and has the end of it in a slot `across` from there."""
    (own, own_change), growth = _turn(d, square)
    share, inverse = across / square.terms[0], 1.0 / root
    g = 0.5 * square.terms[1] * inverse
    g_change = (0.5 * square.terms[2] - g * g) * inverse
    return own + share * g, own_change + share * (g_change - g * growth)


def _turn(d: Vector, square: Series) -> tuple[Turning, Number]:
    """How a vector turns, and its growth."""
    place, rate, second = zip(*(part.terms for part in d), strict=True)
    inverse = 1.0 / square.terms[0]
    own, growth = cross(place, rate) * inverse, square.terms[1] * inverse
    return (own, cross(place, second) * inverse - own * growth), growth


def turned(vector: Local, turning: Turning) -> Vector:
    """A vector of a link that turns, with its derivatives."""
    (x, y), (rate, change) = vector, turning
    square = rate * rate
    return Series(x, -(rate * y), -(change * y) - square * x), Series(y, rate * x, change * x - square * y)
