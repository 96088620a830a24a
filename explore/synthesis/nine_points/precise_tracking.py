"""Following one solution of the equations of nine points with as many digits as large solutions need.

A solution of a thousand times the size of the points, or a billion, has the points in its last digits, of which double
precision has too few. Such paths are followed in numbers of `PRECISION` bits. The predictor is the polynomial through
the last solutions on the path, the corrector Newton's method; the first correction measures the predictor's error.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from flint import acb, acb_mat, ctx

from explore.synthesis.linkages import ComplexArray
from explore.synthesis.nine_points.equations import N_POINTS, N_UNKNOWNS
from explore.synthesis.nine_points.regularity import determinant_terms, evaluate

#: Bits of all numbers: 57 digits, of which the largest solutions lose thirty.
PRECISION = 192
#: Solutions that the predictor's polynomial passes at most.
_MOST_KNOTS = 9
#: Largest first correction of a step, relative, and the one that ends its corrections.
_WANTED, _CONVERGED = 1e-8, 1e-26
_N_CORRECTIONS = 4
_FIRST_STEP, _LEAST_STEP, _MOST_STEPS = 1e-4, 1e-20, 6_000
#: At the end: corrections at most, and the relative size of the last one, which singular solutions do not reach.
_N_LAST_CORRECTIONS, _EXACT = 12, 1e-36
#: A Cramer determinant over its terms that is none of a linkage at a dead point.
_DEAD = 1e-20


def follow_precisely(solution: ComplexArray, start: ComplexArray, rates: ComplexArray) -> ComplexArray | None:
    """Follow a solution from parameters `start` to `start + rates`.

    Parameters
    ----------
    solution
        Of the problem with parameters `start`, shape (8,).
    start, rates
        Shape (16,); the parameters are d_1 … d_8 and their hats.

    Returns
    -------
    array or None
        The solution there, rounded, shape (8,); None if the path is lost or leads to no regular solution of a linkage.
    """
    with _precision(PRECISION):
        begin, moves = ([acb(complex(value)) for value in each] for each in (start, rates))
        path = _Path(begin, moves)
        place = path.correct([acb(complex(value)) for value in solution], acb(0), _N_LAST_CORRECTIONS, _EXACT)[0]
        end = path.follow(place) if place is not None else None
        if end is None:
            return None
        end, _ = path.correct(end, acb(1), _N_LAST_CORRECTIONS, _EXACT)
        if end is None or path.is_dead(end):
            return None
        return np.array([complex(value) for value in end])


class _Path:
    """The problem along a straight line of parameters, by the time from 0 to 1."""

    def __init__(self, start: list[Any], rates: list[Any]) -> None:
        self.start, self.rates = start, rates

    def follow(self, place: list[Any]) -> list[Any] | None:
        """The solution at time 1 that a solution at time 0 leads to; None if the way is lost."""
        times, places = [acb(0)], [place]
        time, step = acb(0), _FIRST_STEP
        for _ in range(_MOST_STEPS):
            is_last = float(time.real) + step >= 1.0
            then = acb(1) if is_last else time + acb(step)
            found, error = self.correct(_extrapolate(times, places, then), then, _N_CORRECTIONS, _CONVERGED, _WANTED)
            if found is None:
                step *= 0.3
                if step < _LEAST_STEP:
                    return None
                continue
            if is_last:
                return found
            time = then
            times, places = [*times, then][-_MOST_KNOTS:], [*places, found][-_MOST_KNOTS:]
            step *= min(2.0, max(0.5, 0.8 * (_WANTED / max(error, 1e-60)) ** (1.0 / len(times))))
        return None

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


def _extrapolate(times: list[Any], places: list[list[Any]], then: Any) -> list[Any]:
    """The polynomial through solutions, at a later time, by Lagrange's formula."""
    weights = []
    for i, own in enumerate(times):
        weight = acb(1)
        for k, other in enumerate(times):
            if k != i:
                weight *= (then - other) / (own - other)
        weights.append(weight.mid())
    return [
        sum((weight * place[i] for weight, place in zip(weights, places, strict=True)), acb(0)).mid()
        for i in range(N_UNKNOWNS)
    ]


def _relative_size(changes: list[Any], place: list[Any]) -> float:
    """The largest change over the largest unknown, of the unknowns and of their hats."""
    sizes = []
    for o in (0, 1):
        change, value = (max(float(abs(each).mid()) for each in group[o::2]) for group in (changes, place))
        sizes.append(change / value if value > 0.0 else np.inf)
    return max(sizes)


@contextmanager
def _precision(bits: int) -> Iterator[None]:
    """Numbers of so many bits, and then of as many as before."""
    before = ctx.prec
    ctx.prec = bits
    try:
        yield
    finally:
        ctx.prec = before
