"""Solve for a length: the smallest at which a metric has a prescribed value."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from explore.evaluation.evaluate import evaluate_columns
from explore.model.columns import Arrays
from explore.model.quantities import FloatArray
from explore.model.status import Status
from explore.studies.designs.loop_lengths import solve_loop
from explore.studies.designs.smallest_roots import Difference, Indices, first_root
from explore.studies.designs.spaces import DesignSpace, SolvedLength

#: Number of lengths evaluated between the bounds of a mechanism whose flattened loops are not known.
_N_LENGTHS = 33
#: Number of halvings of the interval in which a design begins to have a motion.
_N_HALVINGS = 50


@dataclass(frozen=True, kw_only=True)
class SolvedSpace(DesignSpace):
    """The designs of another space with one length added: the solution, or NaN where there is none."""

    base: DesignSpace
    solved_length: SolvedLength

    @staticmethod
    def over(base: DesignSpace, solved_length: SolvedLength) -> SolvedSpace:
        """The designs of `base` with the length added in its declared place."""
        order = [parameter.name for parameter in solved_length.request.mechanism.axis_order]
        axes = tuple(sorted((*base.axes, solved_length), key=lambda axis: order.index(axis.name)))
        return SolvedSpace(axes, base.n_designs, base.method, base.seed, base=base, solved_length=solved_length)

    def space_for_block(self, number: int) -> SolvedSpace:
        """A space that can compute this block and is small when pickled, to send to a worker."""
        return replace(self, base=self.base.space_for_block(number))

    def designs(self, start: int, stop: int) -> Arrays:
        """Parameters of the designs start … stop - 1 by name, each of shape (stop - start,)."""
        columns = self.base.designs(start, stop)
        columns[self.solved_length.name] = solve(self.solved_length, columns)
        return {axis.name: columns[axis.name] for axis in self.axes}

    def unreachable(self, columns: Arrays) -> npt.NDArray[np.bool_]:
        """Whether each design has no solution, shape (n,)."""
        return np.isnan(columns[self.solved_length.name])


def solve(solved: SolvedLength, columns: Arrays) -> FloatArray:
    """Solve for the smallest length at which each design has a motion and the prescribed value.

    The columns are the other parameters by name, each of shape (n,); those with a default may be missing. A length (n,)
    is NaN where there is none within the bounds. Chandrupatla's method finds roots to the last bit.
    """
    mechanism = solved.request.mechanism
    parameter = mechanism.parameter(solved.name)
    lowest = max(solved.low, float(np.nextafter(parameter.lower, math.inf)))
    highest = min(solved.high, parameter.upper)
    difference = _difference(solved, columns)
    if mechanism.loop_lengths:
        return solve_loop(solved, columns, lowest, highest, difference)
    n = len(next(iter(columns.values())))
    designs = np.arange(n)
    lengths = np.tile(np.linspace(lowest, highest, _N_LENGTHS)[:, None], (1, n))
    differences = np.array([difference(row, designs) for row in lengths])
    between = _between(difference, lengths, np.isfinite(differences), designs)
    scan = _interleaved(lengths, between)
    differences = _interleaved(differences, np.array([difference(row, designs) for row in between]))
    return first_root(difference, scan, differences, designs, max(abs(solved.value), 1.0))


def _between(difference: Difference, lengths: FloatArray, moves: npt.NDArray[np.bool_], designs: Indices) -> FloatArray:
    """One length between any two of a scan: the last with a motion where only one of both has one, else the middle."""
    between = 0.5 * (lengths[1:] + lengths[:-1])
    rows, columns = np.nonzero(moves[1:] != moves[:-1])
    is_first = moves[rows, columns]
    inner, outer = lengths[rows + ~is_first, columns], lengths[rows + is_first, columns]
    for _ in range(_N_HALVINGS):
        middle = 0.5 * (inner + outer)
        is_inner = np.isfinite(difference(middle, designs[columns]))
        inner, outer = np.where(is_inner, middle, inner), np.where(is_inner, outer, middle)
    between[rows, columns] = inner
    return between


def _interleaved(rows: FloatArray, between: FloatArray) -> FloatArray:
    """The rows in turn, the first and last from `rows`."""
    both = np.empty((len(rows) + len(between), rows.shape[1]))
    both[::2], both[1::2] = rows, between
    return both


def _difference(solved: SolvedLength, columns: Arrays) -> Difference:
    """A function of lengths and indices of designs: metric minus prescribed value, NaN where there is no motion."""
    request = solved.request
    moving = [*request.mechanism.moving_statuses, Status.TOLERANCE_NOT_MET]

    def difference(lengths: FloatArray, designs: Indices) -> FloatArray:
        inputs = {name: values[designs] for name, values in columns.items()} | {solved.name: lengths}
        results = evaluate_columns(request, inputs).columns
        return np.where(np.isin(results["status"], moving), results[solved.metric.name] - solved.value, np.nan)

    return difference
