"""Coordinates of designs: ranges scaled to 0 … 1, and positions in lists of values."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from explore.model.columns import Arrays
from explore.model.quantities import FloatArray
from explore.studies.designs.spaces import Axis, ContinuousAxis, ListedAxis

Choices = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Coordinates:
    """The axes of a study as designs move in them.

    Parameters that take any value of a range, of a grid between its first and its last; parameters that stay among
    listed values; and the value of each other one.
    """

    ranges: tuple[ContinuousAxis, ...]
    lists: tuple[ListedAxis, ...]
    fixed: Mapping[str, float]

    @staticmethod
    def over(axes: Iterable[Axis], listed: Iterable[str]) -> Coordinates:
        """The coordinates of axes; evenly spaced values of the parameters named in `listed` are kept as a list."""
        ranges, lists, fixed, kept = [], [], {}, set(listed)
        for axis in axes:
            if isinstance(axis, ContinuousAxis):
                ranges.append(axis)
            elif not axis.varies:
                fixed[axis.name] = float(axis.values_at(np.zeros(1, dtype=np.int64))[0])
            elif isinstance(axis, ListedAxis):
                lists.append(axis)
            elif axis.name in kept:
                lists.append(ListedAxis(axis.name, tuple(axis.values_at(np.arange(len(axis))).tolist())))
            else:
                ranges.append(ContinuousAxis(axis.name, axis.start, axis.stop))
        return Coordinates(tuple(ranges), tuple(lists), fixed)

    def positions(self, columns: Arrays) -> FloatArray:
        """Positions in the ranges, each 0 … 1, shape (n, ranges)."""
        positions = np.empty((_count(columns), len(self.ranges)))
        for k, axis in enumerate(self.ranges):
            values = columns[axis.name]
            if axis.log:
                positions[:, k] = np.log(values / axis.low) / math.log(axis.high / axis.low)
            else:
                positions[:, k] = (values - axis.low) / (axis.high - axis.low)
        return positions

    def choices(self, columns: Arrays) -> Choices:
        """Positions in the lists, shape (n, lists)."""
        choices = np.empty((_count(columns), len(self.lists)), dtype=np.int64)
        for k, axis in enumerate(self.lists):
            order = np.argsort(axis.values)
            choices[:, k] = order[np.searchsorted(np.asarray(axis.values)[order], columns[axis.name])]
        return choices

    def columns(self, positions: FloatArray, choices: Choices) -> Arrays:
        """Parameters by name, each of shape (n,)."""
        columns: Arrays = {name: np.full(len(positions), value) for name, value in self.fixed.items()}
        columns |= {axis.name: axis.values_at_fractions(positions[:, k]) for k, axis in enumerate(self.ranges)}
        return columns | {axis.name: axis.values_at(choices[:, k]) for k, axis in enumerate(self.lists)}

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return (*self.fixed, *(axis.name for axis in self.ranges), *(axis.name for axis in self.lists))


def _count(columns: Arrays) -> int:
    return len(next(iter(columns.values())))
