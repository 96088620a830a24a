"""The loops of a linkage: the equations that close it, from its table, and their derivatives.

Each closed chain of bodies is a sum of vectors of the complex plane that vanishes, and each of its terms is::

    c exp(i a)   or   c t exp(i a)

c is a number of the design, a the angle of a body (0 of the frame), and t the place of a pin in a slot or of a link
along its slide. The input gives one angle or one length; all others are unknown, two for each chain. Derivatives by the
input angle follow term by term; rates and second derivatives solve linear equations with Newton's matrix. Nothing here
knows how the linkage is solved in closed form.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from explore.comparison.methods.chains import Chain
from explore.comparison.methods.elimination import Linear, solve
from explore.comparison.methods.kernels import ClosedMotion
from explore.mechanisms.linkages.coordinate import Coordinate, Place
from explore.mechanisms.linkages.expressions import evaluate_coordinate
from explore.mechanisms.linkages.table import LinkageTable
from explore.mechanisms.loops import Columns, Given
from explore.model.quantities import FloatArray


def cis(angle: Any) -> Any:
    """The unit vector at an angle, of arrays."""
    return np.cos(angle) + 1j * np.sin(angle)


class Linearised:
    """The loops about given unknowns: the gap of each chain, and its terms by angle and by length."""

    def __init__(self, loop: Loop, numbers: Sequence[Sequence[Any]], turned: Sequence[Any], lengths: Sequence[Any]):
        self._loop = loop
        self.gap: list[Any] = []
        self._turned: list[list[Any]] = []
        self._along: list[list[Any]] = []
        for chain, coefficients in zip(loop.chains, numbers, strict=True):
            gap, by_angle, by_length = 0.0, [0.0] * len(turned), [0.0] * len(lengths)
            for term, number in zip(chain, coefficients, strict=True):
                vector = number if term.angle is None else number * turned[term.angle]
                if term.length is not None:
                    by_length[term.length] = by_length[term.length] + vector
                    vector = vector * lengths[term.length]
                if term.angle is not None:
                    by_angle[term.angle] = by_angle[term.angle] + vector
                gap = gap + vector
            self.gap.append(gap)
            self._turned.append(by_angle)
            self._along.append(by_length)

    @property
    def columns(self) -> Linear:
        """Derivatives of the gap of each chain by each unknown."""
        angles, lengths = self._loop.n_angles, self._loop.n_lengths
        return [
            *([1j * chain[k] for chain in self._turned] for k in range(angles)),
            *([chain[k] for chain in self._along] for k in range(lengths)),
        ]

    def rate_terms(self, given: Given | None) -> list[Any]:
        """Right-hand sides of the linear equations for the rates of the unknowns."""
        if given is None:
            return [-1j * chain[-1] for chain in self._turned]
        return [
            -(1j * turned[-1] if self._loop.turns else 0.0) - along[-1] * given[1]
            for turned, along in zip(self._turned, self._along, strict=True)
        ]

    def acceleration_terms(self, rates: Any, given: Given | None) -> list[Any]:
        """Right-hand sides of the linear equations for the second derivatives of the unknowns."""
        loop = self._loop
        turning = [*rates[: loop.n_angles], *([1.0] if loop.turns else [])]
        sliding = [*rates[loop.n_angles :], *([given[1]] if given else [])]
        result = []
        for turned, along in zip(self._turned, self._along, strict=True):
            total = sum(rate * rate * vector for rate, vector in zip(turning, turned, strict=True))
            for vector, rate, angle in zip(along, sliding, loop.carriers, strict=True):
                if angle is not None:
                    total = total - 2j * turning[angle] * rate * vector
            result.append(total - along[-1] * given[2] if given else total)
        return result


@dataclass(frozen=True, eq=False)
class Loop:
    """The loops of a mechanism.

    Attributes
    ----------
    name
        Name of the mechanism.
    table
        Its linkage.
    parameters
        The parameters that its motion depends on.
    closed
        Its closed form.
    chains, angles, lengths, carriers
        As `explore.comparison.methods.chains.Chains` says.
    law
        The length that is given beside the angle of the driver, with its derivatives; None for none.
    side
        ``side(columns, angle, functions)``: 1 or -1, the sign of the matrix's determinant up to a factor of the
        design; None where it is the same at all angles.
    """

    name: str
    table: LinkageTable
    parameters: tuple[str, ...]
    chains: tuple[Chain, ...]
    angles: tuple[str, ...]
    lengths: tuple[str, ...]
    carriers: tuple[int | None, ...]
    closed: ClosedMotion
    law: Callable[[Columns, Any, Any], Given] | None = None
    side: Callable[[Columns, Any, Any], Any] | None = None

    @cached_property
    def n_angles(self) -> int:
        """Number of unknown angles."""
        return len(self.angles)

    @cached_property
    def n_lengths(self) -> int:
        """Number of unknown lengths."""
        return len(self.lengths)

    @property
    def count(self) -> int:
        """Number of unknowns: the angles, then the lengths."""
        return self.n_angles + self.n_lengths

    @cached_property
    def turns(self) -> bool:
        """Whether the driver is a link, whose angle is the input angle."""
        return self.table.driven_slot is None

    @property
    def is_triangle(self) -> bool:
        """Whether there is one chain: a known vector, and two vectors that have an unknown angle or length each."""
        known = (None, self.n_angles)
        return self.count == 2 and self.n_angles > 0 and all(carrier in known for carrier in self.carriers)

    def columns(self, parameters: Any) -> Columns:
        """Parameters by name, from those on the first axis."""
        return dict(zip(self.parameters, parameters, strict=True))

    def numbers(self, columns: Columns, evaluate: Any = evaluate_coordinate) -> list[list[Any]]:
        """The number of each term of designs; `evaluate` takes a coordinate and the columns."""
        with np.errstate(all="ignore"):  # values that are not finite become an outcome
            return [[_number(term, columns, evaluate) for term in chain] for chain in self.chains]

    def given(self, columns: Columns, angle: Any, functions: Any, evaluate: Any = evaluate_coordinate) -> Given | None:
        """The given length and its derivatives; `functions` has the cosine and sine of the numbers."""
        if self.law is not None:
            return self.law(columns, angle, functions)
        if self.table.travel is None:
            return None
        start, end = (evaluate(coordinate, columns) for coordinate in self.table.travel)
        half, cosine, sine = (end - start) / 2, functions.cos(angle), functions.sin(angle)
        return start + half * (1 - cosine), half * sine, half * cosine

    def linearise(
        self,
        numbers: Sequence[Sequence[Any]],
        angle: Any,
        unknowns: Any,
        given: Given | None,
        turn: Any = cis,
    ) -> Linearised:
        """The loops about given unknowns; `turn` gives the unit vector at an angle."""
        turned = [turn(unknown) for unknown in unknowns[: self.n_angles]]
        lengths = [*unknowns[self.n_angles :], *([given[0]] if given else [])]
        return Linearised(self, numbers, [*turned, turn(angle)] if self.turns else turned, lengths)

    def about(self, columns: Columns, angle: Any, unknowns: Any) -> Linearised:
        """The loops of many designs about given unknowns; all arrays broadcast."""
        return self.linearise(self.numbers(columns), angle, unknowns, self.given(columns, angle, np))

    def fill_signals(self, signals: FloatArray, columns: Columns, angle: FloatArray, unknowns: FloatArray) -> None:
        """Fill ``signals[m level, n, t]`` with the m unknowns, and as far as it has rows with their derivatives."""
        m, given = self.count, self.given(columns, angle, np)
        signals[:m] = unknowns
        with np.errstate(all="ignore"):  # at a singular position the quotients are not finite
            about = self.linearise(self.numbers(columns), angle, unknowns, given)
            if len(signals) > m:
                signals[m : 2 * m] = solve(about.columns, about.rate_terms(given))[0]
            if len(signals) > 2 * m:
                terms = about.acceleration_terms(signals[m : 2 * m], given)
                signals[2 * m :] = solve(about.columns, terms)[0]

    def size(self, columns: Columns) -> Any:
        """The longest vector of constant length between two joints."""
        chains = zip(self.chains, self.numbers(columns), strict=True)
        lengths = [abs(c) for chain, numbers in chains for term, c in zip(chain, numbers, strict=True) if not term.line]
        return np.max(np.broadcast_arrays(*lengths, *columns.values())[: len(lengths)], axis=0)

    def scales(self, columns: Columns) -> list[Any]:
        """What errors of the unknowns are relative to: 1 rad or the longest vector."""
        size = self.size(columns)
        return [np.ones_like(size)] * self.n_angles + [size] * self.n_lengths


def _number(term: Any, columns: Columns, evaluate: Callable[[Coordinate, Mapping[str, Any]], Any]) -> Any:
    """The number of a term: a sum of places, or a unit vector along a line."""

    def vector(place: Place) -> Any:
        return evaluate(place[0], columns) + 1j * evaluate(place[1], columns)

    total = sum(sign * vector(place) for sign, place in term.places)
    return term.sign * total / abs(total) if term.line else total


def whole_motion(loop: Loop) -> tuple[float, float]:
    """First crank angle and length of the whole motion, rad; a turn from 90 deg."""
    start, end = np.deg2rad(loop.table.limits or (90.0, 450.0))
    return float(start), float(end - start)
