"""Following one solution of the equations of nine points with as many digits as large solutions need.

A solution of a thousand times the size of the points, or a billion, has the points in its last digits, of which double
precision has too few. Such paths are followed in numbers of `PRECISION` bits. The predictor is the polynomial through
the last solutions on the path, the corrector Newton's method; the first correction measures the predictor's error. Near
its end a solution is a sum of powers of what is left of the path, so the polynomial is one of the logarithm of that.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from flint import acb, acb_mat, ctx

from explore.synthesis.linkages import ComplexArray
from explore.synthesis.nine_points.equations import N_POINTS, N_UNKNOWNS
from explore.synthesis.nine_points.regularity import determinant_terms, evaluate

#: Precision of all numbers, 96 digits, of which the largest solutions lose more than thirty, bits.
PRECISION = 320
#: Largest number of solutions that the predictor's polynomial passes.
_MOST_KNOTS = 12
#: Largest first correction of a step, relative.
_WANTED = 1e-8
#: Correction that ends the corrections of a step, relative.
_CONVERGED = 1e-26
#: Largest number of corrections of a step.
_N_CORRECTIONS = 4
#: First step along a path, of the logarithm.
_FIRST_STEP = 1e-4
#: Least step along a path, of the logarithm.
_LEAST_STEP = 1e-10
#: Largest number of steps along a path.
_MOST_STEPS = 3_000
#: Logarithm at the end of a path, where 2^-40 of it is left, a few hundred roundings of the points.
_LAST = 40.0 * math.log(2.0)
#: Logarithm where growth is measured from.
_LATE = 30.0 * math.log(2.0)
#: Least growth of a solution that goes to infinity; one of the power 1 / 8 grows by 2.4.
_GROWTH = 1.5
#: Largest relative change of a solution over the rest of the path for its limit to be known.
_KNOWN = 1e-2
#: Largest number of corrections at the end.
_N_LAST_CORRECTIONS = 12
#: Relative size of the last correction at the end, which singular solutions do not reach.
_EXACT = 1e-45
#: Largest Cramer determinant over its terms of a linkage at a dead point.
_DEAD = 1e-20


@dataclass(frozen=True)
class PreciseEnd:
    """Where a path leads.

    The regular solution, rounded, (8,), or None, and whether it goes to infinity as far as the digits of the points
    tell.
    """

    solution: ComplexArray | None = None
    is_infinite: bool = False


def follow_precisely(solution: ComplexArray, start: ComplexArray, rates: ComplexArray) -> PreciseEnd:
    """Follow a solution, (8,), from parameters `start` to `start + rates`, (16,): d_1 … d_8 and their hats."""
    with ctx.workprec(PRECISION):
        begin, moves = ([acb(complex(value)) for value in each] for each in (start, rates))
        path = _Path(begin, moves)
        place = path.correct([acb(complex(value)) for value in solution], acb(0), _N_LAST_CORRECTIONS, _EXACT)[0]
        if place is None:
            return PreciseEnd()
        place, growth = path.follow(place)
        if place is None:
            return PreciseEnd()
        end, _ = path.correct(place, acb(1), _N_LAST_CORRECTIONS, _EXACT, _KNOWN)
        if end is None:
            return PreciseEnd(is_infinite=growth > _GROWTH)
        return PreciseEnd() if path.is_dead(end) else PreciseEnd(np.array([complex(value) for value in end]))


class _Path:
    """The problem along a straight line of parameters, by the time from 0 to 1."""

    def __init__(self, start: list[Any], rates: list[Any]) -> None:
        self.start, self.rates = start, rates

    def follow(self, place: list[Any]) -> tuple[list[Any] | None, float]:
        """The solution near time 1 that one at time 0 leads to, None if the way is lost; how it grew at last."""
        logarithms, places = [acb(0)], [place]
        now, step, size_before = 0.0, _FIRST_STEP, 0.0
        for _ in range(_MOST_STEPS):
            then = min(now + step, _LAST)
            moment = acb(then)
            found, error = self.correct(
                _extrapolate(logarithms, places, moment), 1 - (-moment).exp(), _N_CORRECTIONS, _CONVERGED, _WANTED
            )
            if found is None:
                step *= 0.3
                if step < _LEAST_STEP:
                    break
                continue
            if not size_before and then >= _LATE:
                size_before = _size(found)
            if then == _LAST:
                return found, _size(found) / size_before
            now = then
            logarithms, places = [*logarithms, moment][-_MOST_KNOTS:], [*places, found][-_MOST_KNOTS:]
            step *= min(2.0, max(0.5, 0.8 * (_WANTED / max(error, 1e-60)) ** (1.0 / len(logarithms))))
        return None, 0.0

    def correct(
        self, place: list[Any], time: Any, most: int, converged: float, wanted: float = 1.0
    ) -> tuple[list[Any] | None, float]:
        """Newton's method from a place near a solution; the solution or None, and the first correction, relative."""
        parameters = [(value + time * rate).mid() for value, rate in zip(self.start, self.rates, strict=True)]
        first, before = 0.0, wanted
        for k in range(most):
            terms = [evaluate(place, parameters[j], parameters[N_POINTS + j]) for j in range(N_POINTS)]
            slopes = acb_mat(N_POINTS, N_UNKNOWNS, [each.mid() for _, row, _ in terms for each in row])
            values = acb_mat(N_POINTS, 1, [value.mid() for value, _, _ in terms])
            try:
                steps = slopes.solve(values, algorithm="approx")
            except ZeroDivisionError:
                return None, np.inf
            changes = [steps[i, 0].mid() for i in range(N_UNKNOWNS)]
            place = [(value - change).mid() for value, change in zip(place, changes, strict=True)]
            size = _relative_size(changes, place)
            if k == 0:
                first = size
            if size < converged:
                return place, first
            if not size <= before:
                break
            before = size
        return None, first

    def is_dead(self, place: list[Any]) -> bool:
        """Whether a Cramer determinant at time 1 vanishes."""
        parameters = [value + rate for value, rate in zip(self.start, self.rates, strict=True)]
        for j in range(N_POINTS):
            d, dh = parameters[j], parameters[N_POINTS + j]
            determinant = evaluate(place, d, dh)[2]
            if not float(abs(determinant).mid()) > _DEAD * float(determinant_terms(place, d, dh).mid()):
                return True
        return False


def _extrapolate(logarithms: list[Any], places: list[list[Any]], then: Any) -> list[Any]:
    """The polynomial through solutions, later, by Lagrange's formula."""
    weights = []
    for i, own in enumerate(logarithms):
        weight = acb(1)
        for k, other in enumerate(logarithms):
            if k != i:
                weight *= (then - other) / (own - other)
        weights.append(weight.mid())
    return [
        sum((weight * place[i] for weight, place in zip(weights, places, strict=True)), acb(0)).mid()
        for i in range(N_UNKNOWNS)
    ]


def _size(place: list[Any]) -> float:
    """The magnitude of the largest unknown."""
    return max(float(abs(value).mid()) for value in place)


def _relative_size(changes: list[Any], place: list[Any]) -> float:
    """The largest change over the largest unknown, of the unknowns and of their hats."""
    sizes = []
    for o in (0, 1):
        change, value = _size(changes[o::2]), _size(place[o::2])
        sizes.append(change / value if value > 0.0 else np.inf)
    return max(sizes)
