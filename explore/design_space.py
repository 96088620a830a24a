"""The set of designs of a study: any block is computed from its number, the whole is never held."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from explore.vocabulary import Block, Columns, FloatArray

#: Designs of one block. Fixed, because the bytes of a results file must not depend on the machine.
BLOCK_SIZE = 65_536


@dataclass(frozen=True)
class Listed:
    """An axis that takes the values given; one value makes a fixed parameter."""

    name: str
    values: tuple[float, ...]

    def __len__(self) -> int:
        return len(self.values)

    def at(self, indices: npt.NDArray[np.int64]) -> FloatArray:
        """Values at the indices, shape (n,)."""
        return np.asarray(self.values)[indices]


@dataclass(frozen=True)
class Spaced:
    """An axis of `num` evenly spaced values, both ends included."""

    name: str
    start: float
    stop: float
    num: int

    def __len__(self) -> int:
        return self.num

    def at(self, indices: npt.NDArray[np.int64]) -> FloatArray:
        """Values at the indices, shape (n,); both ends exactly as given."""
        if self.num == 1:
            return np.full(indices.shape, self.start)
        values = self.start + indices * ((self.stop - self.start) / (self.num - 1))
        return np.where(indices == self.num - 1, self.stop, values)


@dataclass(frozen=True)
class Continuous:
    """An axis from which sampling draws between two bounds, evenly in the value or in its logarithm."""

    name: str
    low: float
    high: float
    log: bool = False

    def of(self, unit: FloatArray) -> FloatArray:
        """Values for numbers between 0 and 1, shape (n,)."""
        if self.log:
            values = np.exp(math.log(self.low) + unit * math.log(self.high / self.low))
        else:
            values = self.low + unit * (self.high - self.low)
        return np.clip(values, self.low, self.high)


Axis = Listed | Spaced | Continuous


@dataclass(frozen=True)
class DesignSpace:
    """Designs numbered 0 … count - 1.

    Parameters
    ----------
    axes
        One for every parameter of the study. In a grid the last axis varies fastest.
    method
        "grid" (everything with everything) or "sobol" (scrambled Sobol' sequence of `scipy.stats.qmc`: random linear
        matrix scramble and digital shift).
    count
        Number of designs; for a grid the product of the axes' lengths.
    seed
        Of the scrambling.
    """

    axes: tuple[Axis, ...]
    method: str = "grid"
    count: int = 0
    seed: int = 0

    @staticmethod
    def grid(axes: tuple[Listed | Spaced, ...]) -> DesignSpace:
        """The full grid over the axes."""
        return DesignSpace(
            axes, "grid", math.prod(axis.num if isinstance(axis, Spaced) else len(axis) for axis in axes)
        )

    @property
    def n_blocks(self) -> int:
        """Number of blocks."""
        return -(-self.count // BLOCK_SIZE)

    @property
    def swept(self) -> tuple[str, ...]:
        """Names of the parameters that take more than one value."""
        return tuple(a.name for a in self.axes if isinstance(a, Continuous) or len(a) > 1)

    def block(self, number: int) -> Block:
        """The designs of one block."""
        start = number * BLOCK_SIZE
        return Block(number, start, self.designs(start, min(start + BLOCK_SIZE, self.count)))

    def designs(self, start: int, stop: int) -> Columns:
        """Parameters of the designs start … stop - 1 by name, each of shape (stop - start,)."""
        if self.method == "sobol":
            return self._sobol(start, stop)
        remaining = np.arange(start, stop, dtype=np.int64)
        columns: Columns = {}
        for axis in reversed(self.axes):
            if isinstance(axis, Continuous):
                raise TypeError(f"{axis.name}: a grid has no continuous axes")
            remaining, index = np.divmod(remaining, len(axis)) if len(axis) > 1 else (remaining, remaining * 0)
            columns[axis.name] = axis.at(index)
        return {axis.name: columns[axis.name] for axis in self.axes}

    def _sobol(self, start: int, stop: int) -> Columns:
        from scipy.stats import qmc  # 0.8 s of imports, needed only here

        drawn = [a for a in self.axes if isinstance(a, Continuous) or len(a) > 1]
        unit = np.empty((stop - start, 0))
        if drawn:
            engine = qmc.Sobol(len(drawn), scramble=True, rng=self.seed)
            if start:
                engine.fast_forward(start)
            with warnings.catch_warnings():
                warnings.filterwarnings("ignore", message="The balance properties")
                unit = engine.random(stop - start)
        columns: Columns = {}
        for axis in self.axes:
            if axis not in drawn and not isinstance(axis, Continuous):
                columns[axis.name] = axis.at(np.zeros(stop - start, dtype=np.int64))
                continue
            u = unit[:, drawn.index(axis)]
            if isinstance(axis, Continuous):
                columns[axis.name] = axis.of(u)
            else:
                columns[axis.name] = axis.at(np.minimum((u * len(axis)).astype(np.int64), len(axis) - 1))
        return columns
