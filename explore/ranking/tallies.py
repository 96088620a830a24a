"""How many designs were ranked, and why the others were not."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from explore.errors import ResultsError
from explore.vocabulary import Columns, Status

_OK = int(Status.OK)


@dataclass
class Tally:
    """How many designs were ranked and why the others were left out; `margins` are the columns of constraints."""

    margins: tuple[str, ...] = ()
    ranked: int = 0
    not_finite: int = 0
    by_status: Counter[str] = field(default_factory=Counter)
    by_constraint: Counter[str] = field(default_factory=Counter)
    undefined: Counter[str] = field(default_factory=Counter)

    def include(self, other: Tally) -> None:
        """Add the counts of other designs."""
        self.ranked += other.ranked
        self.not_finite += other.not_finite
        for mine, theirs in (
            (self.by_status, other.by_status),
            (self.by_constraint, other.by_constraint),
            (self.undefined, other.undefined),
        ):
            mine.update(theirs)

    def to_json(self) -> str:
        """All counts as text, the same for the same counts."""
        return json.dumps(vars(self), sort_keys=True)

    @staticmethod
    def from_json(text: str) -> Tally:
        """The counts that `to_json` wrote."""
        try:
            content = json.loads(text)
            counters = {
                name: Counter({str(label): int(count) for label, count in content[name].items()})
                for name in ("by_status", "by_constraint", "undefined")
            }
            return Tally(tuple(content["margins"]), int(content["ranked"]), int(content["not_finite"]), **counters)
        except (ValueError, KeyError, TypeError, AttributeError, OverflowError) as error:
            raise ResultsError(f"the tally of the designs that were not kept is damaged: {error}") from error

    def add(self, columns: Columns, eligible: npt.NDArray[np.bool_], finite: npt.NDArray[np.bool_]) -> None:
        """Count one block."""
        self.ranked += int(np.count_nonzero(eligible & finite))
        self.not_finite += int(np.count_nonzero(eligible & ~finite))
        if "status" not in columns:
            return
        status = columns["status"]
        for code, count in zip(*np.unique(status, return_counts=True), strict=True):
            if code not in (_OK, Status.SCREENED):
                self.by_status[Status.label_of(int(code))] += int(count)
        judged = (status == _OK) | (status == Status.SCREENED)
        for name in self.margins:
            # A screened design was never asked for the constraints on sampled metrics.
            self.by_constraint[name] += int(np.count_nonzero(judged & (columns[name] < 0.0)))
            self.undefined[name] += int(np.count_nonzero((status == _OK) & np.isnan(columns[name])))
