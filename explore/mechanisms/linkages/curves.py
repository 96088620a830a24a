"""Curves that loads change by: over a place of a linkage or the crank angle, straight or cubic between points.

Between two points, x and y of the first, h and d how far the second one is from it, and s and t the slopes at both, a
curve adds to y, with u = x' - x kept between 0 and h::

    u (s + u ((3 m - 2 s - t)/h + u (s + t - 2 m)/h^2)),    m = d/h

It is the first y and the sum of what all intervals add, so that it keeps the values of its ends beyond them.
"""

from collections.abc import Sequence
from fractions import Fraction
from itertools import pairwise

from explore.base.units.quantities import unit_factor
from explore.mechanisms.linkages.coordinate import Coordinate
from explore.mechanisms.linkages.equations import Equations
from explore.mechanisms.linkages.expressions import read_expression
from explore.mechanisms.linkages.graph import (
    COSINE,
    GREATEST_PLACE,
    INPUT_ANGLE,
    LEAST_PLACE,
    SENSES,
    SINE,
    Graph,
    Number,
)
from explore.mechanisms.linkages.load_table import CRANK_ANGLE, FROM_LEAST, TO_GREATEST, Curve
from explore.mechanisms.linkages.table import LinkageTable

#: Half a turn, deg.
_HALF_TURN = 180.0
#: Crank angles between which all windows of certificates are, deg: strokes begin below 366 deg.
_WINDOWS = (-360, 726)


def place_unit(table: LinkageTable, curve: Curve) -> str:
    """The unit of the places of a curve, "mm" or "deg"."""
    of_output = curve.over in (FROM_LEAST, TO_GREATEST) and table.output_turns
    return "deg" if of_output or curve.over == CRANK_ANGLE else "mm"


def place_of_curve(equations: Equations, curve: Curve) -> Number:
    """The place that a curve is over, mm or rad."""
    graph, table = equations.graph, equations.table
    if not isinstance(curve.over, str):
        point, direction = curve.over
        place = equations.points[point]
        x, y = (read_expression(graph, part) for part in direction)
        return (place[0].terms[0] * x + place[1].terms[0] * y) / (x * x + y * y).sqrt()
    if curve.over == CRANK_ANGLE:
        return _crank_angle(equations, _middle(table, curve))
    if curve.over == FROM_LEAST:
        return equations.output_place() - graph.input(LEAST_PLACE)
    if curve.over == TO_GREATEST:
        return graph.input(GREATEST_PLACE) - equations.output_place()
    return equations.position_of(curve.over).terms[0]


def _middle(table: LinkageTable, curve: Curve) -> float:
    """The crank angle, deg, within half a turn of which all are that a curve is over."""
    return sum(table.limits) / 2.0 if table.limits else curve.points[0][0] + _HALF_TURN


def _crank_angle(equations: Equations, middle: float) -> Number:
    """The crank angle within half a turn of another one, deg, in rad."""
    graph = equations.graph
    if graph.is_exact:
        return _exact_crank_angle(graph, Fraction(middle) - Fraction(_HALF_TURN))
    cosine, sine = (
        read_expression(graph, Coordinate((), (("number", middle), (function, 0.0)))) for function in ("cos", "sin")
    )
    x, y = graph.input(COSINE), graph.input(SINE)
    angle = (y * cosine - x * sine).call("arctangent", x * cosine + y * sine)
    return angle + graph.constant(Fraction(middle) * unit_factor("deg", "rad"))


def _exact_crank_angle(graph: Graph, first: Fraction) -> Number:
    """The crank angle within the turn from a first one on, deg, in rad, with its jumps in all windows."""
    angle, unit, half = graph.input(INPUT_ANGLE), unit_factor("deg", "rad"), Fraction(_HALF_TURN)
    begin = first % _WINDOWS[0]
    jumps = [place for place in (begin + 2 * half * k for k in range(4)) if place < _WINDOWS[1]]
    senses = sum(((angle - graph.constant(jump * unit)).call(SENSES[0]) for jump in jumps), graph.constant(0.0))
    moved = first - begin + half * (2 - len(jumps))  # between the first two jumps, the senses' share cancels the rest
    return angle + graph.constant(moved * unit) - graph.constant(half * unit) * senses


def levels_of_curve(table: LinkageTable, curve: Curve) -> tuple[float, ...]:
    """The places, mm or rad, at which a curve has corners; of crank angles also the one beside which they jump."""
    middle = (_middle(table, curve),) if curve.over == CRANK_ANGLE else ()
    unit = _unit(table, curve)
    return tuple(float(Fraction(x) * unit) for x in (*middle, *(x for x, _ in curve.points)))


def _unit(table: LinkageTable, curve: Curve) -> Fraction:
    return unit_factor("deg", "rad") if place_unit(table, curve) == "deg" else Fraction(1)


def value_of_curve(equations: Equations, curve: Curve, place: Number) -> Number:
    """The value of a curve at a place."""
    graph, unit = equations.graph, _unit(equations.table, curve)
    xs, ys = [Fraction(x) * unit for x, _ in curve.points], [Fraction(y) for _, y in curve.points]
    steps, rises = ([b - a for a, b in pairwise(each)] for each in (xs, ys))
    chords = [rise / step for rise, step in zip(rises, steps, strict=True)]
    slopes = _slopes(steps, chords) if curve.is_cubic else []
    value, zero = graph.constant(ys[0]), graph.constant(0.0)
    for k, (x, step, m) in enumerate(zip(xs, steps, chords, strict=False)):
        way = (place - graph.constant(x)).call("maximum", zero).call("minimum", graph.constant(step))
        if curve.is_cubic:
            s, t = slopes[k], slopes[k + 1]
            bend = graph.constant((3 * m - 2 * s - t) / step) + way * graph.constant((s + t - 2 * m) / step**2)
            value = value + way * (graph.constant(s) + way * bend)
        else:
            value = value + way * graph.constant(m)
    # No value is below the least one; where it is 0, neither by rounding.
    return value if graph.is_exact else value.call("maximum", graph.constant(min(ys)))


def _slopes(steps: Sequence[Fraction], chords: Sequence[Fraction]) -> list[Fraction]:
    """The slopes at all points with which cubics between them rise and fall as the points do (Fritsch and Butland)."""
    if len(chords) == 1:
        return [chords[0], chords[0]]
    inner = [Fraction(0)] * (len(chords) - 1)
    for k, ((h, g), (m, n)) in enumerate(zip(pairwise(steps), pairwise(chords), strict=True)):
        if m * n > 0:
            inner[k] = 3 * (h + g) / ((h + 2 * g) / m + (2 * h + g) / n)
    return [_end_slope(steps, chords), *inner, _end_slope(steps[::-1], chords[::-1])]


def _end_slope(steps: Sequence[Fraction], chords: Sequence[Fraction]) -> Fraction:
    """The slope at the first point, of the parabola through three points, kept from leaving their range."""
    (h, g), (m, n) = steps[:2], chords[:2]
    slope = ((2 * h + g) * m - h * n) / (h + g)
    if slope * m <= 0:
        return Fraction(0)
    return 3 * m if m * n <= 0 and abs(slope) > 3 * abs(m) else slope
