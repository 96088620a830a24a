"""Design spaces. A block of designs is computed from its number; the whole space is never in memory."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np
import numpy.typing as npt

from explore.model.columns import Arrays, Block
from explore.model.quantities import AnyMetric, FloatArray
from explore.model.request import Request
from explore.studies.designs.samplers import SAMPLERS

#: Number of designs of a block; constant, because the bytes of a results file must not depend on the machine.
BLOCK_SIZE = 65_536

Indices = npt.NDArray[np.int64]

#: Number of digits of a decimal that a value of a grid is meant to be.
_DECIMAL_DIGITS = 12
#: Largest power of ten that a double holds exactly.
_EXACT_POWER = 22
#: Factor that splits a double in halves.
_SPLIT = 2.0**27 + 1.0
#: Bound on the rounding errors of a start and a multiple of a step, relative to the larger end: four roundings.
_ROUNDING = 4.0 * np.finfo(float).eps


def _as_decimals(values: FloatArray, size: float, step: float, unit: Fraction) -> FloatArray:
    """Values of at most a size; those that only rounding keeps from a decimal of a unit as that, as users write it."""
    power = _DECIMAL_DIGITS - 1 - math.floor(math.log10(size / unit))
    if not 0 <= power <= _EXACT_POWER:
        return values
    numbers = np.rint(values * 10.0**power / float(unit))
    decimals = numbers / 10.0**power if unit == 1 else _products(numbers, unit / 10**power)
    # a range of a few roundings keeps its values apart
    is_near = np.abs(decimals - values) <= min(_ROUNDING * size, 1e-3 * abs(step))
    return np.where(is_near, decimals, values)


def _products(numbers: FloatArray, factor: Fraction) -> FloatArray:
    """Whole numbers times a factor, rounded once: Dekker's product, and that with the rest of the factor."""
    high = float(factor)
    (a, b), (c, d) = _halves(numbers), _halves(np.float64(high))
    products = numbers * high
    rest = (a * c - products) + a * d + b * c + b * d
    return np.asarray(products + (rest + numbers * float(factor - Fraction(high))))


def _halves(values: FloatArray | np.float64) -> tuple[FloatArray | np.float64, FloatArray | np.float64]:
    """Two parts whose sum the values are, with so few digits that their products are exact."""
    high = _SPLIT * values - (_SPLIT * values - values)
    return high, values - high


@dataclass(frozen=True)
class ListedAxis:
    """An axis of listed values; a fixed parameter has one."""

    name: str
    values: tuple[float, ...]

    def __len__(self) -> int:
        return len(self.values)

    @property
    def varies(self) -> bool:
        """Whether the parameter takes more than one value."""
        return len(self) > 1

    @property
    def has_nonzero(self) -> bool:
        """Whether any value is not 0."""
        return any(self.values)

    def values_at(self, indices: Indices) -> FloatArray:
        """Values at the indices, shape (n,)."""
        return np.asarray(self.values)[indices]

    def values_at_fractions(self, fractions: FloatArray) -> FloatArray:
        """Values at fractions in [0, 1), shape (n,); every value has an equal share of the interval."""
        return self.values_at(_positions(fractions, len(self)))


@dataclass(frozen=True)
class SpacedAxis:
    """An axis of `num` evenly spaced values, both ends included; `unit` is what the decimals of a user count in."""

    name: str
    start: float
    stop: float
    num: int
    unit: Fraction = Fraction(1)

    def __len__(self) -> int:
        return self.num

    @property
    def varies(self) -> bool:
        """Whether the parameter takes more than one value."""
        return self.num > 1

    @property
    def has_nonzero(self) -> bool:
        """Whether any value is not 0."""
        return bool(self.start or self.stop)

    def values_at(self, indices: Indices) -> FloatArray:
        """Values at the indices, shape (n,); both ends exact."""
        if self.num == 1:
            return np.full(indices.shape, self.start)
        step = (self.stop - self.start) / (self.num - 1)
        sums: FloatArray = np.asarray(self.start + indices * step, dtype=np.float64)
        values = _as_decimals(sums, max(abs(self.start), abs(self.stop)), step, self.unit)
        values = np.where(indices == 0, self.start, values)
        return np.where(indices == self.num - 1, self.stop, values)

    def values_at_fractions(self, fractions: FloatArray) -> FloatArray:
        """Values at fractions in [0, 1), shape (n,); every value has an equal share of the interval."""
        return self.values_at(_positions(fractions, self.num))


@dataclass(frozen=True)
class ContinuousAxis:
    """A range to draw values from, uniformly in the value or in its logarithm."""

    name: str
    low: float
    high: float
    log: bool = False
    varies = True
    has_nonzero = True

    def values_at_fractions(self, fractions: FloatArray) -> FloatArray:
        """Values at fractions in [0, 1), shape (n,)."""
        if self.log:
            values = np.exp(math.log(self.low) + fractions * math.log(self.high / self.low))
        else:
            values = self.low + fractions * (self.high - self.low)
        return np.clip(values, self.low, self.high)


@dataclass(frozen=True, eq=False)
class TableAxis:
    """An axis with one value for each design, shape (n,)."""

    name: str
    values: FloatArray

    @property
    def varies(self) -> bool:
        """Whether the parameter takes more than one value."""
        return bool((self.values != self.values[0]).any())

    @property
    def has_nonzero(self) -> bool:
        """Whether any value is not 0."""
        return bool(self.values.any())


@dataclass(frozen=True)
class SolvedLength:
    """A length that follows from the other parameters and the prescribed value of a metric, the same in all designs.

    The request asks for that metric alone. The bounds `low` and `high` are inclusive. A solved length is not swept, and
    0 in few designs: `varies`, `has_nonzero`.
    """

    name: str
    request: Request
    value: float
    low: float = 0.0
    high: float = math.inf
    varies = False
    has_nonzero = True

    @property
    def metric(self) -> AnyMetric:
        """The metric that has the prescribed value."""
        return self.request.metrics[0]


#: Axis that a study file can define.
Axis = ListedAxis | SpacedAxis | ContinuousAxis


def _positions(fractions: FloatArray, length: int) -> Indices:
    return np.minimum((fractions * length).astype(np.int64), length - 1)


@dataclass(frozen=True)
class DesignSpace(ABC):
    """Designs numbered 0 … n_designs - 1, with one axis for each parameter of the study.

    `method` is the name of the sampling method in a study file; `seed` is 0 where there are no random numbers.
    """

    axes: tuple[Axis | TableAxis | SolvedLength, ...]
    n_designs: int
    method: str
    seed: int = 0

    @property
    def n_blocks(self) -> int:
        """Number of blocks."""
        return -(-self.n_designs // BLOCK_SIZE)

    @property
    def swept_parameters(self) -> tuple[str, ...]:
        """Names of the parameters that take more than one value."""
        return tuple(axis.name for axis in self.axes if axis.varies)

    def block(self, number: int) -> Block:
        """The designs of one block."""
        start = number * BLOCK_SIZE
        return Block(number, start, self.designs(start, min(start + BLOCK_SIZE, self.n_designs)))

    def space_for_block(self, number: int) -> DesignSpace:  # noqa: ARG002  (`Table` uses it)
        """A space that can compute this block and is small when pickled, to send to a worker."""
        return self

    @abstractmethod
    def designs(self, start: int, stop: int) -> Arrays:
        """Parameters of the designs start … stop - 1 by name, each of shape (stop - start,)."""


@dataclass(frozen=True)
class Grid(DesignSpace):
    """All combinations of the values of the axes; the last axis varies fastest."""

    axes: tuple[ListedAxis | SpacedAxis, ...]
    method: str = "grid"

    @staticmethod
    def over(axes: tuple[ListedAxis | SpacedAxis, ...]) -> Grid:
        """The full grid over the axes."""
        return Grid(axes, math.prod(len(axis) for axis in axes))

    def designs(self, start: int, stop: int) -> Arrays:
        """Parameters of the designs start … stop - 1 by name, each of shape (stop - start,)."""
        columns: Arrays = {}
        period = 1  # designs in a row with the same value of the axis
        for axis in reversed(self.axes):
            columns[axis.name] = _values_in_rows(axis, period, start, stop)
            period *= len(axis)
        return {axis.name: columns[axis.name] for axis in self.axes}


def _values_in_rows(axis: ListedAxis | SpacedAxis, period: int, start: int, stop: int) -> FloatArray:
    """Values of an axis that changes after each `period` designs, shape (stop - start,)."""
    first, last = start // period, max(start, stop - 1) // period
    values = axis.values_at(np.arange(first, last + 1) % len(axis))
    if first == last:  # the period may be more than an integer of NumPy
        return np.full(stop - start, values[0])
    if period == 1:
        return values
    edges = np.arange((first + 1) * period, stop, period)
    return np.repeat(values, np.diff(edges, prepend=start, append=stop))


@dataclass(frozen=True)
class Sample(DesignSpace):
    """Designs drawn from the axes that vary, at points of the unit cube."""

    axes: tuple[Axis, ...]

    def designs(self, start: int, stop: int) -> Arrays:
        """Parameters of the designs start … stop - 1 by name, each of shape (stop - start,)."""
        dimensions = len(self.swept_parameters)
        fractions = np.zeros((stop - start, 0))
        if dimensions:
            fractions = SAMPLERS[self.method](dimensions, start, stop, self.n_designs, self.seed)
        return values_at_fractions(self.axes, fractions)


def values_at_fractions(axes: Sequence[Axis], fractions: FloatArray) -> Arrays:
    """Values of the axes by name, each of shape (n,), at fractions in [0, 1) of those that vary, shape (n, d)."""
    coordinates = iter(fractions.T)
    zeros = np.zeros(len(fractions))
    return {axis.name: axis.values_at_fractions(next(coordinates) if axis.varies else zeros) for axis in axes}


@dataclass(frozen=True)
class Table(DesignSpace):
    """Designs with one row of values each.

    `first` is the number of the design in the first row, for a part of a table.
    """

    axes: tuple[ListedAxis | TableAxis, ...]
    method: str = "table"
    first: int = 0

    def designs(self, start: int, stop: int) -> Arrays:
        """Parameters of the designs start … stop - 1 by name, each of shape (stop - start,)."""
        rows = slice(start - self.first, stop - self.first)
        zeros = np.zeros(stop - start, dtype=np.int64)
        return {
            axis.name: axis.values[rows].copy() if isinstance(axis, TableAxis) else axis.values_at(zeros)
            for axis in self.axes
        }

    def space_for_block(self, number: int) -> Table:
        """The rows of one block, so that the whole table is not sent with each block."""
        start = number * BLOCK_SIZE
        rows = slice(start - self.first, start - self.first + BLOCK_SIZE)
        axes = tuple(
            replace(axis, values=axis.values[rows]) if isinstance(axis, TableAxis) else axis for axis in self.axes
        )
        return replace(self, axes=axes, first=start)
