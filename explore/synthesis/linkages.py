"""A four-bar linkage at its place in the plane, with a point of its coupler: what synthesis finds.

Points of the plane are complex numbers.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from explore.model.quantities import FloatArray

ComplexArray = npt.NDArray[np.complex128]
_Found = TypeVar("_Found")


@dataclass(frozen=True)
class FourBar:
    """A four-bar linkage and a point of its coupler.

    The point counts from the pin of the crank in units of the vector from there to the pin of the rocker: 0 and 1 are
    the pins. The branch is 1 if the pin of the rocker lies left of the line from the pin of the crank to the pivot of
    the rocker, else -1.
    """

    crank_pivot: complex
    rocker_pivot: complex
    crank: float
    coupler: float
    rocker: float
    point: complex
    branch: int = 1

    @property
    def ground(self) -> float:
        """Distance of the pivots."""
        return abs(self.rocker_pivot - self.crank_pivot)

    @property
    def lengths(self) -> tuple[float, float, float, float]:
        """Crank, coupler, rocker and ground."""
        return self.crank, self.coupler, self.rocker, self.ground

    @property
    def is_crank_turning(self) -> bool:
        """Whether the crank turns fully: crank and ground, or ground and crank, hold the shortest link by Grashof."""
        ordered = sorted(self.lengths)
        shortest_turns = min(self.crank, self.ground) == ordered[0]
        return shortest_turns and ordered[0] + ordered[3] < ordered[1] + ordered[2]

    def crank_pins(self, angles: FloatArray) -> ComplexArray:
        """The pin of the crank at angles of the crank in the plane, rad, shape (n,)."""
        return np.asarray(self.crank_pivot + self.crank * np.exp(1j * np.asarray(angles)))

    def rocker_pins(self, angles: FloatArray) -> ComplexArray:
        """The pin of the rocker, shape (n,); NaN where the linkage cannot be assembled.

        It is where the circles around the pin of the crank and around the pivot of the rocker meet.
        """
        pins = self.crank_pins(angles)
        diagonal = self.rocker_pivot - pins
        length = np.abs(diagonal)
        with np.errstate(invalid="ignore", divide="ignore"):
            # Heron's formula as a product of differences keeps its digits near the change point.
            short, long = length - abs(self.coupler - self.rocker), self.coupler + self.rocker - length
            heights = np.sqrt(
                short * (length + abs(self.coupler - self.rocker)) * long * (self.coupler + self.rocker + length)
            )
            along = (length**2 + (self.coupler - self.rocker) * (self.coupler + self.rocker)) / (2.0 * length)
            found = pins + diagonal / length * (along + 0.5j * self.branch * heights / length)
        return np.asarray(found, dtype=np.complex128)

    def points(self, angles: FloatArray) -> ComplexArray:
        """The coupler point at angles of the crank, rad, shape (n,); NaN where the linkage cannot be assembled."""
        pins = self.crank_pins(angles)
        return np.asarray(pins + self.point * (self.rocker_pins(angles) - pins))

    def transmission_angles(self, angles: FloatArray) -> FloatArray:
        """The angle between coupler and rocker, 0 … pi, shape (n,); NaN where the linkage cannot be assembled."""
        pins = self.rocker_pins(angles)
        return np.asarray(np.abs(np.angle((self.crank_pins(angles) - pins) / (self.rocker_pivot - pins))))


def driven_by_rocker(linkage: FourBar) -> FourBar:
    """The same linkage with its crank called rocker and its rocker crank."""
    return FourBar(
        linkage.rocker_pivot,
        linkage.crank_pivot,
        linkage.rocker,
        linkage.coupler,
        linkage.crank,
        1.0 - linkage.point,
        -linkage.branch,
    )


def distinct(found: Iterable[_Found], are_same: Callable[[_Found, _Found], bool]) -> list[_Found]:
    """Those that are not the same as one before them."""
    kept: list[_Found] = []
    for each in found:
        if not any(are_same(each, other) for other in kept):
            kept.append(each)
    return kept


def is_alike(one: FourBar, other: FourBar, tolerance: float) -> bool:
    """Whether two are one linkage, driven by either link: no pivot, length or place of the point differs by a share of
    the longest link. Their branches do not count.
    """

    def numbers(linkage: FourBar) -> list[complex]:
        return [linkage.crank_pivot, linkage.rocker_pivot, *linkage.lengths, linkage.point * linkage.coupler]

    size = max(*one.lengths, *other.lengths)
    pairs = ((numbers(one), numbers(each)) for each in (other, driven_by_rocker(other)))
    return any(np.abs(np.subtract(*pair)).max() < tolerance * size for pair in pairs)
