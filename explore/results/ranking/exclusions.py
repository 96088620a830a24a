"""Which constraints exclude designs, alone and together, and how many designs a wider bound would let in."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from explore.base.units.shown import Scale
from explore.model.quantities import FloatArray

#: Largest number of designs for which `Exclusions.relaxation` is known.
MOST_LET_IN = 100


@dataclass
class Exclusions:
    """Counts of the designs that miss constraints, as far as is known.

    `combinations` has numbers of designs by the constraints that they miss, as metrics, none for those that miss none.
    `n_unmeasured` designs have no known distance from feasible: no motion, a constrained metric that is undefined, or
    an error bound that is missed.
    `n_partly_known` of those in `combinations` were screened before all constraints could be checked: they may miss
    more.
    """

    combinations: Counter[tuple[str, ...]] = field(default_factory=Counter)
    n_unmeasured: int = 0
    n_partly_known: int = 0
    _least: dict[str, FloatArray] = field(default_factory=dict)

    def missed(self, metric: str) -> int:
        """Number of designs that miss the constraint on a metric."""
        return sum(count for metrics, count in self.combinations.items() if metric in metrics)

    def alone(self, metric: str) -> int:
        """Number of designs that miss the constraint on a metric and no other."""
        return self.combinations[(metric,)]

    def together(self) -> list[tuple[tuple[str, ...], int]]:
        """The constraints that designs miss at once, and the number of designs that miss just these, most first."""
        several = [(metrics, count) for metrics, count in self.combinations.items() if len(metrics) > 1]
        return sorted(several, key=lambda entry: (-entry[1], entry[0]))

    def relaxation(self, metric: str, count: int) -> float | None:
        """By how much, in its unit, a constraint must be relaxed to let in `count` designs that miss it alone.

        None if fewer miss it alone, or for more than `MOST_LET_IN` designs.
        """
        least = self._least.get(metric, np.empty(0))
        return float(least[count - 1]) if count <= len(least) else None

    def in_units(self, scales: Mapping[str, Scale]) -> Exclusions:
        """The same with the violations in shown units; `scales` has those of each metric."""
        return replace(self, _least={metric: scales[metric].show_all(least) for metric, least in self._least.items()})

    def count(self, margins: Mapping[str, FloatArray], measured: npt.NDArray[np.bool_]) -> None:
        """Count the designs of one block by the margins of constrained metrics, (n,), where they are measured, (n,)."""
        metrics = list(margins)
        values = np.array([margin[measured] for margin in margins.values()])
        self.n_unmeasured += int(np.count_nonzero(~measured))
        self.n_partly_known += int(np.count_nonzero(np.isnan(values).any(axis=0)))
        missed = values < 0.0
        # One text of bits for each design, because numbers have too few bits for more than 64 constraints.
        bits = np.ascontiguousarray(np.packbits(missed, axis=0).T)
        codes, counts = np.unique(bits.view(f"S{bits.shape[1]}").ravel(), return_counts=True)
        for code, count in zip(codes, counts.tolist(), strict=True):
            filled = code.ljust(bits.shape[1], b"\0")  # NumPy strips zeros at the end of a text
            flags = np.unpackbits(np.frombuffer(filled, np.uint8), count=len(metrics))
            self.combinations[tuple(metric for metric, flag in zip(metrics, flags, strict=True) if flag)] += count
        is_alone = missed.sum(axis=0) == 1
        for metric, margin, misses in zip(metrics, values, missed, strict=True):
            violations = np.concatenate([self._least.get(metric, np.empty(0)), -margin[is_alone & misses]])
            self._least[metric] = np.sort(violations)[:MOST_LET_IN]
