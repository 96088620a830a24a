"""Numbers known to lie in discs: arithmetic of complex arrays whose results enclose every rounding error.

A disc is a centre and a radius. A sum of two doubles is off by at most half of `EPSILON` of its magnitude, a product of
two complex ones by at most sqrt(5) halves (R. Brent, C. Percival, P. Zimmermann, Error bounds on complex floating-point
multiplication, Math. Comp. 76 (2007) 1469-1481); radii are enlarged by more than their own rounding.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from explore.model.quantities import FloatArray
from explore.synthesis.linkages import ComplexArray

EPSILON = float(np.finfo(np.float64).eps)
#: Factor that enlarges a sum of a few nonnegative numbers beyond its rounding.
_UP = 1.0 + 32.0 * EPSILON
#: Bound of all that underflow can lose.
_TINY = 1e-290


@dataclass(frozen=True)
class Discs:
    """Discs of the complex plane, elementwise: arrays of one shape, or of shapes that broadcast."""

    centre: ComplexArray
    radius: FloatArray

    def __add__(self, other: Discs) -> Discs:
        """Enclose the sum."""
        centre = self.centre + other.centre
        return Discs(centre, (self.radius + other.radius + EPSILON * np.abs(centre)) * _UP + _TINY)

    def __sub__(self, other: Discs) -> Discs:
        """Enclose the difference."""
        centre = self.centre - other.centre
        return Discs(centre, (self.radius + other.radius + EPSILON * np.abs(centre)) * _UP + _TINY)

    def __mul__(self, other: Discs) -> Discs:
        """Enclose the product."""
        centre = self.centre * other.centre
        mine, its = np.abs(self.centre), np.abs(other.centre)
        spread = mine * other.radius + self.radius * (its + other.radius)
        return Discs(centre, (spread + 2.0 * EPSILON * np.abs(centre)) * _UP + _TINY)

    def reciprocal(self) -> Discs:
        """Enclose the reciprocals; infinite radii where a disc holds zero."""
        size = np.abs(self.centre)
        least = size * (1.0 - 2.0 * EPSILON) - self.radius * _UP
        centre = 1.0 / self.centre
        spread = self.radius / (size * least) + 8.0 * EPSILON * np.abs(centre)
        return Discs(centre, np.where(least > 0.0, spread * _UP + _TINY, np.inf))

    def __getitem__(self, key: Any) -> Discs:
        """Some of the discs."""
        return Discs(self.centre[key], self.radius[key])

    def excludes_zero(self) -> npt.NDArray[np.bool_]:
        """Whether each disc leaves out zero."""
        return np.asarray(np.abs(self.centre) > self.radius * _UP + _TINY)


def exact(values: ComplexArray) -> Discs:
    """Discs of radius zero."""
    return Discs(np.asarray(values, dtype=np.complex128), np.zeros(np.shape(values)))


def stack(discs: list[Discs], axis: int) -> Discs:
    """Discs of one shape along a new axis."""
    return Discs(np.stack([d.centre for d in discs], axis), np.stack([d.radius for d in discs], axis))


def product(matrices: ComplexArray, discs: Discs) -> Discs:
    """Matrices, known exactly, times matrices of discs: (n, k, l) by (n, l, m).

    A sum of l products is off by at most (l + 3) `EPSILON` of the sum of their magnitudes, in any order.
    """
    sizes = np.abs(matrices)
    n_terms = matrices.shape[-1] + 3
    spread = sizes @ (discs.radius + n_terms * EPSILON * np.abs(discs.centre))
    return Discs(matrices @ discs.centre, spread * (1.0 + 2.0 * n_terms * EPSILON) + _TINY)
