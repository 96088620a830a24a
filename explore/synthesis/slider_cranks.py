"""A slider-crank at its place in the plane, with a point of its rod: what synthesis finds.

Points of the plane are complex numbers.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from explore.model.quantities import FloatArray
from explore.synthesis.linkages import ComplexArray


@dataclass(frozen=True)
class SliderCrank:
    """A slider-crank and a point of its rod.

    The guide has the offset from the pivot, positive to the left of its direction, which is that from the pivot towards
    the slider, rad. The point counts from the pin of the crank in units of the vector from there to the slider: 0 and 1
    are the pins.
    """

    crank_pivot: complex
    crank: float
    rod: float
    offset: float
    direction: float
    point: complex

    def crank_pins(self, angles: FloatArray) -> ComplexArray:
        """The pin of the crank at angles of the crank in the plane, rad, shape (n,)."""
        return np.asarray(self.crank_pivot + self.crank * np.exp(1j * np.asarray(angles)))

    def sliders(self, angles: FloatArray) -> ComplexArray:
        """The pin of the slider, shape (n,); NaN where the rod does not reach the guide."""
        turned = np.asarray(angles) - self.direction
        across = self.offset - self.crank * np.sin(turned)
        with np.errstate(invalid="ignore"):
            along = self.crank * np.cos(turned) + np.sqrt((self.rod - across) * (self.rod + across))
        return np.asarray(self.crank_pivot + (along + 1j * self.offset) * np.exp(1j * self.direction))

    def points(self, angles: FloatArray) -> ComplexArray:
        """The rod's point at angles of the crank, rad, shape (n,); NaN where the rod does not reach the guide."""
        pins = self.crank_pins(angles)
        return np.asarray(pins + self.point * (self.sliders(angles) - pins))

    def mirrored(self) -> SliderCrank:
        """The mirror image at the real axis."""
        return SliderCrank(
            self.crank_pivot.conjugate(), self.crank, self.rod, -self.offset, -self.direction, self.point.conjugate()
        )
