"""Parts drawn at random: means, standard deviations and extremes of their metrics, and how many meet the constraints.

Parts are drawn in chunks. A chunk follows from the seed and its number alone and is the same for all designs, so no
result depends on the workers or on the other designs, and differences between designs do not come from the draws.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from explore.analysis.tolerancing.outcomes import TolerancedRequest
from explore.model.quantities import FloatArray
from explore.model.status import Status

#: Number of parts that are drawn and evaluated together, that of the designs of a block of a sweep.
CHUNK = 1 << 16
#: Number of parts that one worker computes at a time.
PIECE = 1 << 18


@dataclass(frozen=True)
class Spread:
    """How a metric spreads over the parts that have it; `squares` is the sum of squared distances from the mean."""

    count: int = 0
    mean: float = 0.0
    squares: float = 0.0
    low: float = np.inf
    high: float = -np.inf

    @classmethod
    def of(cls, values: FloatArray) -> Spread:
        """The spread of values without NaN."""
        if np.isnan(values).any():
            values = values[~np.isnan(values)]
        if not len(values):
            return cls()
        mean = float(values.mean())
        with np.errstate(invalid="ignore", over="ignore"):  # of infinite values, and of ratios of 1e200
            distances = values - mean
            # not a product of matrices, whose threads would compete with the other workers
            squares = float(np.einsum("i,i", distances, distances))
        return cls(len(values), mean, squares, float(values.min()), float(values.max()))

    def merged(self, other: Spread) -> Spread:
        """The spread of the parts of both."""
        count = self.count + other.count
        if not count:
            return self
        step = other.mean - self.mean
        mean = self.mean + step * (other.count / count)
        squares = self.squares + other.squares + step * step * (self.count * other.count / count)
        return Spread(count, mean, squares, min(self.low, other.low), max(self.high, other.high))

    @property
    def std(self) -> float:
        """Standard deviation; NaN of fewer than two parts."""
        return float(np.sqrt(self.squares / (self.count - 1))) if self.count > 1 else float("nan")

    def robust(self, sense: str) -> float:
        """The mean and three standard deviations to the worse side; NaN of fewer than two parts."""
        return self.mean + (3.0 if sense == "min" else -3.0) * self.std


@dataclass(frozen=True)
class PartCounts:
    """Numbers of parts of one design, and spreads of moving ones.

    All parts, those that move, those that are feasible, those that move and miss each constraint, and those of each
    status but `OK`, by its label.
    """

    count: int = 0
    assembled: int = 0
    feasible: int = 0
    missed: Mapping[str, int] = field(default_factory=dict)
    statuses: Mapping[str, int] = field(default_factory=dict)
    spreads: Mapping[str, Spread] = field(default_factory=dict)


def chunk_deviations(request: TolerancedRequest, seed: int, number: int, count: int = CHUNK) -> FloatArray:
    """The deviations of the parts of a chunk, (d, count)."""
    sequence = np.random.SeedSequence(seed, spawn_key=(0, number))
    return request.draw(np.random.Generator(np.random.SFC64(sequence)), count)


def count_parts(
    request: TolerancedRequest, nominal: Mapping[str, float], seed: int, start: int, stop: int
) -> PartCounts:
    """Evaluate the parts from number `start`, a multiple of `CHUNK`, to `stop`."""
    return merge_counts(
        _count_chunk(request, nominal, seed, first // CHUNK, min(CHUNK, stop - first))
        for first in range(start, stop, CHUNK)
    )


def _count_chunk(
    request: TolerancedRequest, nominal: Mapping[str, float], seed: int, number: int, count: int
) -> PartCounts:
    found = request.outcomes(nominal, chunk_deviations(request, seed, number, count))
    missed = {name: int(np.count_nonzero(missed)) for name, missed in found.is_missed.items()}
    spreads = {name: Spread.of(values) for name, values in found.metrics.items()}
    assembled, feasible = (int(np.count_nonzero(which)) for which in (found.is_assembled, found.is_feasible))
    codes, counts = np.unique(found.status[found.status != Status.OK], return_counts=True)
    labels = request.request.mechanism.status_labels
    statuses = {labels[int(code)]: int(n) for code, n in zip(codes, counts, strict=True)}
    return PartCounts(count, assembled, feasible, missed, statuses, spreads)


def merge_counts(pieces: Iterable[PartCounts]) -> PartCounts:
    """The parts of all pieces; the last digits of the sums depend on their order."""
    count = assembled = feasible = 0
    missed: Counter[str] = Counter()
    statuses: Counter[str] = Counter()
    spreads: dict[str, Spread] = {}
    for piece in pieces:
        count, assembled, feasible = count + piece.count, assembled + piece.assembled, feasible + piece.feasible
        missed.update(piece.missed)
        statuses.update(piece.statuses)
        spreads = {name: spreads.get(name, Spread()).merged(spread) for name, spread in piece.spreads.items()}
    return PartCounts(count, assembled, feasible, dict(missed), dict(statuses), spreads)
