"""The set of designs of a study: any block is computed from its number, the whole is never held."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from explore.unit_cube import SAMPLERS
from explore.vocabulary import Block, Columns, FloatArray, Metric

#: Designs of one block. Fixed, because the bytes of a results file must not depend on the machine.
BLOCK_SIZE = 65_536

Indices = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Listed:
    """An axis that takes the values given; one value makes a fixed parameter."""

    name: str
    values: tuple[float, ...]

    def __len__(self) -> int:
        return len(self.values)

    @property
    def varies(self) -> bool:
        """Whether it takes more than one value."""
        return len(self) > 1

    @property
    def gives(self) -> bool:
        """Whether it takes a value that is not 0."""
        return any(self.values)

    def at(self, indices: Indices) -> FloatArray:
        """Values at the indices, shape (n,)."""
        return np.asarray(self.values)[indices]

    def of(self, unit: FloatArray) -> FloatArray:
        """Values for numbers between 0 and 1, shape (n,): each as often as the others."""
        return self.at(_positions(unit, len(self)))


@dataclass(frozen=True)
class Spaced:
    """An axis of `num` evenly spaced values, both ends included."""

    name: str
    start: float
    stop: float
    num: int

    def __len__(self) -> int:
        return self.num

    @property
    def varies(self) -> bool:
        """Whether it takes more than one value."""
        return self.num > 1

    @property
    def gives(self) -> bool:
        """Whether it takes a value that is not 0."""
        return bool(self.start or self.stop)

    def at(self, indices: Indices) -> FloatArray:
        """Values at the indices, shape (n,); both ends exactly as given."""
        if self.num == 1:
            return np.full(indices.shape, self.start)
        values = self.start + indices * ((self.stop - self.start) / (self.num - 1))
        return np.where(indices == self.num - 1, self.stop, values)

    def of(self, unit: FloatArray) -> FloatArray:
        """Values for numbers between 0 and 1, shape (n,): each as often as the others."""
        return self.at(_positions(unit, self.num))


@dataclass(frozen=True)
class Continuous:
    """An axis from which sampling draws between two bounds, evenly in the value or in its logarithm."""

    name: str
    low: float
    high: float
    log: bool = False
    varies = True
    gives = True

    def of(self, unit: FloatArray) -> FloatArray:
        """Values for numbers between 0 and 1, shape (n,)."""
        if self.log:
            values = np.exp(math.log(self.low) + unit * math.log(self.high / self.low))
        else:
            values = self.low + unit * (self.high - self.low)
        return np.clip(values, self.low, self.high)


@dataclass(frozen=True, eq=False)
class Tabled:
    """An axis that has a value of its own for every design, shape (n,)."""

    name: str
    values: FloatArray

    @property
    def varies(self) -> bool:
        """Whether it takes more than one value."""
        return bool((self.values != self.values[0]).any())

    @property
    def gives(self) -> bool:
        """Whether it has a value that is not 0."""
        return bool(self.values.any())


@dataclass(frozen=True)
class Solved:
    """An axis whose values follow from the other parameters.

    Attributes
    ----------
    name
        Of the length.
    metric, value
        What the designs have in common, in the metric's unit.
    low, high
        Bounds of the length, both allowed.
    varies, gives
        It is not swept: it follows. A length is never 0.
    """

    name: str
    metric: Metric
    value: float
    low: float = 0.0
    high: float = math.inf
    varies = False
    gives = True


#: What a study file says of a parameter.
Axis = Listed | Spaced | Continuous


def _positions(unit: FloatArray, length: int) -> Indices:
    return np.minimum((unit * length).astype(np.int64), length - 1)


@dataclass(frozen=True)
class DesignSpace(ABC):
    """Designs numbered 0 … count - 1.

    Parameters
    ----------
    axes
        One for every parameter of the study.
    count
        Number of designs.
    method
        Where they come from, as a study file calls it.
    seed
        Of the random numbers; 0 where there are none.
    """

    axes: tuple[Axis | Tabled | Solved, ...]
    count: int
    method: str
    seed: int = 0

    @property
    def n_blocks(self) -> int:
        """Number of blocks."""
        return -(-self.count // BLOCK_SIZE)

    @property
    def swept(self) -> tuple[str, ...]:
        """Names of the parameters that take more than one value."""
        return tuple(axis.name for axis in self.axes if axis.varies)

    def block(self, number: int) -> Block:
        """The designs of one block."""
        start = number * BLOCK_SIZE
        return Block(number, start, self.designs(start, min(start + BLOCK_SIZE, self.count)))

    def for_block(self, number: int) -> DesignSpace:  # noqa: ARG002  (a table needs it)
        """What a worker needs to make this block: a space, small when pickled, that answers ``block(number)``."""
        return self

    @abstractmethod
    def designs(self, start: int, stop: int) -> Columns:
        """Parameters of the designs start … stop - 1 by name, each of shape (stop - start,)."""


@dataclass(frozen=True)
class Grid(DesignSpace):
    """Every value of each axis with every value of the others; the last axis varies fastest."""

    axes: tuple[Listed | Spaced, ...]
    method: str = "grid"

    @staticmethod
    def over(axes: tuple[Listed | Spaced, ...]) -> Grid:
        """The full grid over the axes."""
        return Grid(axes, math.prod(len(axis) for axis in axes))

    def designs(self, start: int, stop: int) -> Columns:
        """Parameters of the designs start … stop - 1 by name, each of shape (stop - start,)."""
        remaining = np.arange(start, stop, dtype=np.int64)
        columns: Columns = {}
        for axis in reversed(self.axes):
            remaining, index = np.divmod(remaining, len(axis)) if axis.varies else (remaining, remaining * 0)
            columns[axis.name] = axis.at(index)
        return {axis.name: columns[axis.name] for axis in self.axes}


@dataclass(frozen=True)
class Drawn(DesignSpace):
    """Designs drawn from the axes that vary, at the points of the unit cube that `method` gives."""

    axes: tuple[Axis, ...]

    def designs(self, start: int, stop: int) -> Columns:
        """Parameters of the designs start … stop - 1 by name, each of shape (stop - start,)."""
        dimensions = len(self.swept)
        unit = np.zeros((stop - start, 0))
        if dimensions:
            unit = SAMPLERS[self.method](dimensions, start, stop, self.count, self.seed)
        numbers = iter(unit.T)
        fixed = np.zeros(stop - start)
        return {axis.name: axis.of(next(numbers) if axis.varies else fixed) for axis in self.axes}


@dataclass(frozen=True)
class Table(DesignSpace):
    """Designs listed one by one.

    `first` is the number of the design that the columns begin with: a part of a table knows its place in the whole.
    """

    axes: tuple[Listed | Tabled, ...]
    method: str = "table"
    first: int = 0

    def designs(self, start: int, stop: int) -> Columns:
        """Parameters of the designs start … stop - 1 by name, each of shape (stop - start,)."""
        rows = slice(start - self.first, stop - self.first)
        fixed = np.zeros(stop - start, dtype=np.int64)
        return {
            axis.name: axis.values[rows].copy() if isinstance(axis, Tabled) else axis.at(fixed) for axis in self.axes
        }

    def for_block(self, number: int) -> Table:
        """The rows of one block alone, so that a worker does not get the whole table with each."""
        start = number * BLOCK_SIZE
        rows = slice(start - self.first, start - self.first + BLOCK_SIZE)
        axes = tuple(
            replace(axis, values=axis.values[rows]) if isinstance(axis, Tabled) else axis for axis in self.axes
        )
        return replace(self, axes=axes, first=start)
