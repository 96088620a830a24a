"""The distance of a point of the frame, or of a line of it, and a point of the driver, without terms that cancel.

With g and c the distances of the two points from the driver's pivot and phi the angle between them, the square of the
distance is (g - c)^2 + 2 g c (1 - cos phi). From the driver's point to the frame's, along the frame's direction and to
the left of it, they are g - c + c (1 - cos phi) and -c sin phi apart.

With e the height of the driver's pivot over the line and phi the angle from the line to the driver's point, this is at
the height e + c sin phi, which a length r exceeds by (r - e - c) + c (1 - sin phi).
"""

from dataclasses import dataclass

from explore.mechanisms.linkages.graph import COSINE, SINE, VERSINES, Graph, Number, Series
from explore.mechanisms.linkages.vectors import Local, Vector


class Input:
    """The input angle: its cosine and sine, and 1 less the cosine of its differences from quarters of a turn."""

    def __init__(self, graph: Graph) -> None:
        cosine, sine = graph.input(COSINE), graph.input(SINE)
        self.cosine, self.sine = Series(cosine, -sine, -cosine), Series(sine, cosine, -sine)
        rates = ((sine, cosine), (-cosine, sine), (-sine, -cosine), (cosine, -sine))
        self._versines = [Series(graph.input(name), *rate) for name, rate in zip(VERSINES, rates, strict=True)]

    def versine(self, quarters: int) -> Series:
        """1 less the cosine of the input angle less some quarters of a turn."""
        return self._versines[quarters % 4]

    def sine_from(self, quarters: int) -> Series:
        """The sine of the input angle less some quarters of a turn."""
        return (self.sine, -self.cosine, -self.sine, self.cosine)[quarters % 4]


@dataclass(frozen=True)
class DriverDistance:
    """The vector between a point of the frame and one of the driver.

    Attributes
    ----------
    square, vector
        The square of its length, and from the driver's point to the frame's.
    ground, crank, product
        Distances of the two points from the driver's pivot, and twice their product.
    versine, coversine
        1 - cos and 1 + cos of the angle between the two.
    """

    square: Series
    vector: Vector
    ground: Number
    crank: Number
    product: Number
    versine: Series
    coversine: Series


def find_distance(angle: Input, still: Local, moving: Local) -> DriverDistance | None:
    """The distance of two points, from the pivot at input angle 0; None unless each is along an axis."""
    along, other = _along_axis(still), _along_axis(moving)
    if along is None or other is None:
        return None
    (ground, quarters), (crank, turned) = along, other
    versine = angle.versine(quarters - turned)
    ahead, left = versine * crank + (ground - crank), angle.sine_from(quarters - turned) * -crank
    vector = ((ahead, left), (-left, ahead), (-ahead, -left), (left, -ahead))[quarters]
    product = 2.0 * (ground * crank)
    square = versine * product + (ground - crank) * (ground - crank)
    return DriverDistance(square, vector, ground, crank, product, versine, angle.versine(quarters - turned + 2))


def find_margins(
    angle: Input, radius: Number, start: Local, direction: Local, pivot: Local, moving: Local
) -> tuple[Series, Series, Number, Number] | None:
    """The sums r - h and r + h of a radius r and the height h of a line of the frame over a point of the driver.

    The line is from `start` in a direction, the point `moving` from the driver's pivot. Then follow what terms cancel
    by, which is 0 unless a parameter is negative, and the sense of h, -1 where the parameter of the direction is. None
    unless the line and the point are along an axis.
    """
    along, other = _along_axis(direction), _along_axis(moving)
    if along is None or other is None:
        return None
    (span, quarters), (crank, turned) = along, other
    # the pivot over the line is the difference of two coordinates
    axis, ahead, total = 1 - quarters % 2, quarters - turned, radius.graph.exact_sum
    upper, lower = (start, pivot) if quarters in (1, 2) else (pivot, start)
    below = angle.versine(ahead - 1) * crank + total(radius, upper[axis], -lower[axis], -crank)
    above = angle.versine(ahead + 1) * crank + total(radius, lower[axis], -upper[axis], -crank)
    sense = radius.graph.constant(1.0) if span.value is not None else span / abs(span)
    return below, above, abs(crank) - crank, sense


def _along_axis(vector: Local) -> tuple[Number, int] | None:
    """The length of a vector along an axis, and its direction in quarters of a turn; None for others.

    A parameter counts as positive; where it is not, terms cancel that need not.
    """
    for axis in (0, 1):
        along, across = vector[axis], vector[1 - axis]
        if across.value == 0.0:
            is_negative = along.node[0] == "neg" or (along.value is not None and along.value < 0.0)
            return (-along, axis + 2) if is_negative else (along, axis)
    return None
