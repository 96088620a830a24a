"""A four-bar without rounding: class, status and limit positions from lengths that are fractions."""

import math
from collections.abc import Mapping
from typing import Any

from explore.mechanisms import four_bar, rocking
from explore.mechanisms.four_bar_table import LENGTHS
from explore.model.exact import ExactDesign
from explore.model.status import Status

_STATUSES = {
    four_bar.CRANK_ROCKER: Status.OK,
    four_bar.DOUBLE_CRANK: rocking.NO_STROKE,
    four_bar.CHANGE_POINT: rocking.CHANGE_POINT,
    four_bar.CANNOT_ASSEMBLE: rocking.CANNOT_ASSEMBLE,
}


def classify(lengths: tuple[Any, ...]) -> tuple[int, Any]:
    """Class and Grashof margin; a margin of up to 4 units in the last place is a change point."""
    short, first, second, long = sorted(lengths)
    margin = first + second - short - long
    if short == long:
        return four_bar.CHANGE_POINT, margin
    if long >= short + first + second:
        return four_bar.CANNOT_ASSEMBLE, margin
    if abs(margin) <= 4 * type(margin)(*math.ulp(float(long)).as_integer_ratio()):
        return four_bar.CHANGE_POINT, margin
    if margin < 0:
        return four_bar.NON_GRASHOF, margin
    by_shortest = (four_bar.CRANK_ROCKER, four_bar.DOUBLE_ROCKER, four_bar.ROCKER_CRANK, four_bar.DOUBLE_CRANK)
    return by_shortest[lengths.index(short)], margin


def exact_four_bar(parameters: Mapping[str, Any]) -> ExactDesign:
    """A four-bar of these parameters."""
    crank, coupler, rocker, ground = lengths = tuple(parameters[name] for name in LENGTHS)
    linkage_class, margin = classify(lengths)
    status = _STATUSES.get(linkage_class, rocking.CRANK_BLOCKED)
    metrics = {"linkage_class": linkage_class, "grashof_margin": margin, "size": coupler + rocker}
    if status != Status.OK:
        return ExactDesign(int(status), metrics)
    side, marks = parameters.get("branch", 1), {}
    # The coupler lies over the crank, or in line with it: the angle of the triangle at the crank's pivot.
    for name, reach, sign in (("overlapped", coupler - crank, -1), ("extended", coupler + crank, 1)):
        cosine = sign * (reach * reach + ground * ground - rocker * rocker) / (2 * reach * ground)
        marks[name] = cosine * abs(cosine), sign * side * (1 - cosine * cosine)
    square = SquareOfVelocity(*lengths)
    # The motion of the other branch is the mirrored one.
    return ExactDesign(
        int(status), metrics, marks, {"rocker_velocity": lambda angle, c, s: side * square(side * angle, c, side * s)}
    )


class SquareOfVelocity:
    """An antiderivative of the square of the rocker's velocity per crank velocity, for the branch 1.

    With u = cos(theta) and the numbers of docs/numerics.md the velocity is (1 + M/V)/2 sin(theta)/w + 1/2 - E/V. Its
    square is a rational function of u, whose partial fractions have arctangents of multiples of tan(theta/2), and
    sin(theta) times a function of u, which y = sqrt((Q + u)/(P - u)) turns into arctangents of multiples of y.
    """

    def __init__(self, crank: Any, coupler: Any, rocker: Any, ground: Any) -> None:
        scale = 2 * crank * ground
        both = crank * crank + ground * ground
        self._d = d = both / scale
        self._p = p = (both - (coupler - rocker) ** 2) / scale
        self._q = q = ((coupler + rocker) ** 2 - both) / scale
        self._m = m = (coupler * coupler - rocker * rocker) / scale
        e = (ground * ground - crank * crank) / (2 * scale)
        over_p = (1 + (m / (d - p) if m != 0 else 0)) ** 2 * (1 - p * p) / (4 * (q + p))
        over_q = (1 + m / (d + q)) ** 2 * (1 - q * q) / (4 * (q + p))
        first = second = 0
        if m != 0:
            ratio = (1 - d * d) / ((p - d) * (q + d))
            slope = ratio * (1 / (p - d) - 1 / (q + d)) - 2 * d / ((p - d) * (q + d))
            first, second = (2 * m * ratio - m * m * slope) / 4, m * m * ratio / 4
        self._even = over_p, over_q, first - e, second + e * e
        self._odd = e - m / 2, m * e

    def __call__(self, angle: Any, cosine: Any, sine: Any) -> Any:
        """The antiderivative at an angle, rad, as a ball, from its cosine and sine."""
        ball, d = type(cosine), self._d

        def over_difference(a: Any, sign: int) -> Any:
            """The integral of 1/(a - sign cos(theta)), continuous in theta."""
            f = ball((a + sign) / (a - sign)).sqrt()
            turned = ((f - 1) * sine / ((1 + f) + (1 - f) * cosine)).atan()
            return (angle + 2 * turned) / ball(a * a - 1).sqrt()

        over_p, over_q, over_v, over_square = self._even
        by_d = over_difference(d, 1)
        by_square = (sine / (d - cosine) + d * by_d) / (d * d - 1)
        even = over_p * over_difference(self._p, 1) + over_q * over_difference(self._q, -1)
        return angle / 2 + even + over_v * by_d + over_square * by_square + self._of_sine(cosine)

    def _of_sine(self, cosine: Any) -> Any:
        """The part that sin(theta) times a function of its cosine gives: of -1/2 1/w, 1/(V w) and 1/(V^2 w)."""
        ball, ratio, (by_v, by_square) = type(cosine), (self._q + cosine) / (self._p - cosine), self._odd
        y = ratio.sqrt()
        if self._m == 0:  # then also D = P
            return by_v * 2 * y / (self._p + self._q) - y.atan()
        plus, minus = self._d + self._q, self._d - self._p
        inner = (y * ball(minus / plus).sqrt()).atan() / abs(self._m)
        last = y / (plus + minus * ratio) * (1 / plus - 1 / minus) + inner * (1 / plus + 1 / minus)
        return by_v * 2 * inner + by_square * last - y.atan()
