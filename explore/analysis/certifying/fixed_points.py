"""Lengths of vectors that depend on these lengths, z_i = |a_i + sum_j G_ij z_j|, in balls.

While the sums of |G_ij| over j are at most q < 1, there is one solution, and it is within r/(1 - q) of lengths that one
substitution changes by at most r.

In a box of complex angles a length is the root of F.F with a positive real part. Where the imaginary parts of F and F'
are at most k times as long as their real ones, the roots differ by |(F + F').(F - F')| / |root + root'|, at most by
c |F - F'| with c^2 = (1 + k^2)/(1 - k^2). So with c q < 1 at most one solution has such vectors: that of overlapping
boxes is one analytic function, which at real angles is the real solution.
"""

import math
from collections.abc import Iterable, Sequence
from functools import reduce
from typing import Any

from flint import acb, acb_mat, arb, arb_mat, arb_series, ctx

from explore.analysis.certifying.analytic import NOWHERE, TERMS, coefficients, nowhere, root
from explore.analysis.certifying.balls import UnprovedError

#: Largest number of steps of Newton's method.
_MOST_STEPS = 16

#: Kind of the two parts of a vector.
_Parts = tuple[Any, Any]


def lengths(*parts: Any) -> Sequence[Any]:
    """The lengths, from the parts of each a_i and then of each G_ij, row by row; none where that proves none."""
    n = math.isqrt(len(parts) // 2)
    if any(isinstance(part, arb_series) for part in parts):
        found = _series([_Vectors(n, order, arb_mat) for order in zip(*map(coefficients, parts), strict=True)])
    elif any(isinstance(part, acb) for part in parts):
        found = _in_box(_Vectors(n, parts, acb_mat))
    else:
        found = _at_angles(_Vectors(n, parts, arb_mat))
    return found or [nowhere(*parts)] * n


class _Vectors:
    """All a_i and G_ij, of either part a column and a matrix."""

    def __init__(self, n: int, parts: Sequence[Any], matrix: Any) -> None:
        self._matrix, self._are_finite = matrix, all(part.is_finite() for part in parts)
        self.parts = [(matrix(n, 1, each[:n]), matrix(n, n, each[n:])) for each in (parts[::2], parts[1::2])]

    def totals(self, found: Sequence[Any]) -> list[_Parts]:
        """The vectors with these lengths of all."""
        column = self._matrix([[size] for size in found])
        x, y = ((own + gains * column).entries() for own, gains in self.parts)
        return list(zip(x, y, strict=True))

    def _gains(self) -> list[list[_Parts]]:
        x, y = (gains.tolist() for _, gains in self.parts)
        return [list(zip(*row, strict=True)) for row in zip(x, y, strict=True)]

    def sums(self) -> list[arb]:
        """The sums of all |G_ij| over j; no numbers where a part is none."""
        rows = [sum((_length(abs(x), abs(y)) for x, y in row), arb(0)) for row in self._gains()]
        return rows if self._are_finite else [NOWHERE]

    def system(self, totals: Sequence[_Parts]) -> Any:
        """The derivatives of lengths less those of the substitution."""
        units = [(x / size, y / size) for x, y in totals for size in [(x * x + y * y).sqrt()]]
        rows = zip(units, self._gains(), strict=True)
        return self._matrix(
            [[(i == j) - u * x - v * y for j, (x, y) in enumerate(row)] for i, ((u, v), row) in enumerate(rows)]
        )

    def near(self) -> list[Any]:
        """Lengths near the solution, without radii, by Newton's method."""
        near = arb(2) ** (-ctx.prec // 2)
        found = [_length(*own).mid() for own in zip(*(own.entries() for own, _ in self.parts), strict=True)]
        for _ in range(_MOST_STEPS):
            totals = self.totals(found)
            steps = [_length(*total) - size for total, size in zip(totals, found, strict=True)]
            is_near = all(
                abs(step.mid()) <= step.rad() + abs(size) * near for step, size in zip(steps, found, strict=True)
            )
            try:
                system = self.system([(x.mid(), y.mid()) for x, y in totals]).mid()
                steps = system.solve(self._matrix([[step.mid()] for step in steps])).entries()
            except ZeroDivisionError:  # a length is 0
                pass
            found = [(size + step).mid() for size, step in zip(found, steps, strict=True)]
            if is_near:
                break
        return found


def _at_angles(vectors: _Vectors) -> list[Any] | None:
    """The lengths at a real angle, or at all angles of an interval."""
    sums = vectors.sums()
    if any(total >= 1 for total in sums):
        raise UnprovedError("friction may lock the linkage, which has no forces then")
    largest = _largest(sums)
    if not largest < 1:
        return None
    near = vectors.near()
    change = _largest(_length(*total) - size for total, size in zip(vectors.totals(near), near, strict=True))
    found = [size + arb(0, (change / (1 - largest)).upper()) for size in near]
    return [size.intersection(_length(*total)) for size, total in zip(found, vectors.totals(found), strict=True)]


def _in_box(vectors: _Vectors) -> list[Any] | None:
    """The lengths in a box of complex angles, as one analytic function of these."""
    largest = _largest(vectors.sums())
    if not largest < 1:
        return None
    near = vectors.near()
    squares = [x * x + y * y for x, y in vectors.totals(near)]
    if not all(square.real > 0 and size.real > 0 for square, size in zip(squares, near, strict=True)):
        return None
    # |root - size|, as a root of a box is not narrow
    changes = ((w - size * size) / (w.real.sqrt() + size.real) for w, size in zip(squares, near, strict=True))
    change = _largest(changes)
    radius = (2 * change / (1 - largest)).upper()
    found = [size + acb(arb(0, radius), arb(0, radius)) for size in near]
    ratio = _largest(_length(x.imag, y.imag) / _length(x.real, y.real) for x, y in vectors.totals(found))
    slope = ((1 + ratio * ratio) / (1 - ratio * ratio)).sqrt() if ratio < 1 else NOWHERE
    return found if change <= (1 - largest * slope) * radius else None


def _series(orders: list[_Vectors]) -> list[Any] | None:
    """The lengths as power series: each coefficient from those below, by the derivatives of the substitution."""
    values = _at_angles(orders[0])
    if values is None or not all(value > 0 for value in values):
        return None
    try:
        inverse = orders[0].system(orders[0].totals(values)).inv()
    except ZeroDivisionError:
        return None
    found = [arb_mat([[value] for value in values])]
    for k in range(1, TERMS):
        changes = [coefficients(root(x * x + y * y))[k] for x, y in _totals_of_series(orders, found)]
        found.append(inverse * arb_mat([[change] for change in changes]))
    return [arb_series(list(terms), TERMS) for terms in zip(*(column.entries() for column in found), strict=True)]


def _totals_of_series(orders: list[_Vectors], found: list[arb_mat]) -> Iterable[_Parts]:
    """The vectors with these coefficients of the lengths."""
    parts = [[order.parts[part] for order in orders] for part in (0, 1)]
    columns = [
        [sum((each[k - i][1] * column for i, column in enumerate(found[: k + 1])), each[k][0]) for k in range(TERMS)]
        for each in parts
    ]
    x, y = (zip(*(column.entries() for column in each), strict=True) for each in columns)
    return ((arb_series(list(p), TERMS), arb_series(list(q), TERMS)) for p, q in zip(x, y, strict=True))


def _length(x: Any, y: Any) -> Any:
    square = x * x + y * y
    return (square.nonnegative_part() if isinstance(square, arb) else square).sqrt()


def _largest(numbers: Iterable[arb]) -> arb:
    """The largest size that one of some numbers may have; no number if one is none."""
    return reduce(arb.max, (abs(number).upper() for number in numbers))
