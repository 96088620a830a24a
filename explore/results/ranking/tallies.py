"""Counts of the designs that were ranked, and of the others by reason."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from explore.base.errors import ResultsError
from explore.model.columns import Arrays
from explore.model.status import Status

_OK = int(Status.OK)
#: Attributes of a tally by the keys of their counts in a results file.
_KEYS = {
    "margins": "margins",
    "ranked": "n_ranked",
    "not_finite": "n_not_finite",
    "by_status": "by_status",
    "by_constraint": "by_constraint",
    "undefined": "by_undefined_constraint",
}

_DAMAGED = "the tally of the designs that were not kept is damaged: {}"


@dataclass
class Tally:
    """Counts of the designs that were ranked, and of the others by reason.

    `margins` are the columns of the constraints, `status_labels` the words for the codes of statuses. `n_ranked` and
    `n_not_finite` count the feasible designs whose objectives are all finite and those with one that is not,
    `by_status` the others by status, `by_constraint` the designs that miss each constraint and
    `by_undefined_constraint` those whose margin of it is NaN.
    """

    margins: tuple[str, ...] = ()
    status_labels: Mapping[int, str] = field(default_factory=dict)
    n_ranked: int = 0
    n_not_finite: int = 0
    by_status: Counter[str] = field(default_factory=Counter)
    by_constraint: Counter[str] = field(default_factory=Counter)
    by_undefined_constraint: Counter[str] = field(default_factory=Counter)

    @property
    def n_feasible(self) -> int:
        """Number of the feasible designs that were counted, ranked or not."""
        return self.n_ranked + self.n_not_finite

    def merge(self, other: Tally) -> None:
        """Add the counts of another tally."""
        self.n_ranked += other.n_ranked
        self.n_not_finite += other.n_not_finite
        for own_counts, other_counts in (
            (self.by_status, other.by_status),
            (self.by_constraint, other.by_constraint),
            (self.by_undefined_constraint, other.by_undefined_constraint),
        ):
            own_counts.update(other_counts)

    def to_json(self) -> str:
        """All counts as JSON; equal counts give equal text."""
        return json.dumps({key: getattr(self, name) for key, name in _KEYS.items()}, sort_keys=True)

    @staticmethod
    def from_json(text: str) -> Tally:
        """The tally that `to_json` wrote."""
        try:
            content = json.loads(text)
        except ValueError as error:
            raise ResultsError(_DAMAGED.format(error)) from error
        return Tally.from_counts(content)

    @staticmethod
    def from_counts(content: Mapping[str, Any]) -> Tally:
        """The tally with the counts that `to_json` wrote."""
        try:
            counts = [
                Counter({str(label): int(count) for label, count in content[key].items()})
                for key in ("by_status", "by_constraint", "undefined")
            ]
            return Tally(tuple(content["margins"]), {}, int(content["ranked"]), int(content["not_finite"]), *counts)
        except (ValueError, KeyError, TypeError, AttributeError, OverflowError) as error:
            raise ResultsError(_DAMAGED.format(error)) from error

    def count(self, columns: Arrays, feasible: npt.NDArray[np.bool_], finite: npt.NDArray[np.bool_]) -> None:
        """Count the designs of one block, with masks (n,) of feasible ones and of those whose objectives are all
        finite.

        The columns have ``status`` and the margins, unless the block has no status.
        """
        self.n_ranked += int(np.count_nonzero(feasible & finite))
        self.n_not_finite += int(np.count_nonzero(feasible & ~finite))
        if "status" not in columns:
            return
        status = columns["status"]
        has_margins = (status == _OK) | (status == Status.SCREENED)
        for code, count in zip(*np.unique(status[~has_margins], return_counts=True), strict=True):
            self.by_status[self.status_labels.get(int(code), f"status {code}")] += int(count)
        for name in self.margins:
            # Screening stops before the sampled metrics, so their margins are NaN there and count neither way.
            self.by_constraint[name] += int(np.count_nonzero(has_margins & (columns[name] < 0.0)))
            self.by_undefined_constraint[name] += int(np.count_nonzero((status == _OK) & np.isnan(columns[name])))
