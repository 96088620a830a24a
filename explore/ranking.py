"""Pareto sets: which designs no other design beats in every objective."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
import numpy.typing as npt

from explore.errors import RequestError, ResultsError
from explore.suggest import suggestion
from explore.vocabulary import Column, Columns, FloatArray, Objective, Sense, Status

if TYPE_CHECKING:
    import pandas as pd

_OK = int(Status.OK)
#: Roles of columns that can be an aim; codes and bookkeeping cannot.
_RANKABLE = ("parameter", "metric", "margin")
#: Endings of names whose small values are better wherever they come from.
_SMALL_IS_GOOD = ("cv", "variance", "_std", "_rms", "_peak_to_peak")


def nondominated(values: FloatArray) -> npt.NDArray[np.bool_]:
    """Which rows no other row dominates, all columns minimised; equal rows are all kept.

    Parameters
    ----------
    values
        Finite numbers, shape (n, m).

    Returns
    -------
    (n,) array
    """
    import moocore

    # moocore crashes the process on -inf, mis-masks +inf and is silent on NaN.
    if not np.isfinite(values).all():
        raise RequestError("objectives must be finite; leave out the other designs first")
    if len(values) == 0:
        return np.zeros(0, dtype=np.bool_)
    return np.asarray(moocore.is_nondominated(np.ascontiguousarray(values), keep_weakly=True), dtype=np.bool_)


def parse_objective(text: str, senses: Mapping[str, Sense | None], columns: Sequence[str]) -> Objective:
    """An objective from "cv" or "swing_angle:max".

    Parameters
    ----------
    senses
        The own sense of each metric, None where it has none.
    columns
        The columns there are.
    """
    name, _, sense = text.partition(":")
    if name not in columns:
        raise RequestError(f"no column '{name}' in these results; {suggestion(name, columns)}")
    if sense == "" and ":" not in text:
        own = senses.get(name) or ("min" if name.endswith(_SMALL_IS_GOOD) else None)
        if own is None:
            raise RequestError(f"'{name}' has no better side of its own: write {name}:min or {name}:max")
        return Objective(name, own)
    if sense not in ("min", "max"):
        raise RequestError(f"'{text}': the sense is min or max, as in {name}:max")
    return Objective(name, "min" if sense == "min" else "max")


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


def front(
    blocks: Iterable[Columns], objectives: Sequence[Objective], tally: Tally | None = None
) -> npt.NDArray[np.int64]:
    """Row numbers of the first front of designs that come in blocks; memory holds one block and one front.

    Parameters
    ----------
    blocks
        Columns of consecutive designs, each with the objectives and, where they exist, ``feasible`` and "design".
    objectives
        At least one.

    Returns
    -------
    (k,) array
        Ascending row numbers, counted over all blocks or taken from "design".
    """
    signs = np.array([1.0 if objective.sense == "min" else -1.0 for objective in objectives])
    kept_values, kept_rows, offset = np.empty((0, len(signs))), np.empty(0, dtype=np.int64), 0
    for columns in blocks:
        values = np.column_stack([np.asarray(columns[o.metric], dtype=np.float64) for o in objectives]) * signs
        n = len(values)
        rows = np.asarray(columns["design"]) if "design" in columns else np.arange(offset, offset + n)
        eligible = np.asarray(columns["feasible"]).astype(bool) if "feasible" in columns else np.ones(n, dtype=bool)
        finite = np.isfinite(values).all(axis=1)
        if tally is not None:
            tally.add(columns, eligible, finite)
        chosen = eligible & finite
        values, rows, offset = values[chosen], rows[chosen], offset + n
        # The front of a union is within the union of the fronts; the local one first, since it is small.
        local = nondominated(values)
        values, rows = values[local], rows[local]
        if len(kept_rows):
            values, rows = np.vstack([kept_values, values]), np.concatenate([kept_rows, rows])
            mask = nondominated(values)
            values, rows = values[mask], rows[mask]
        kept_values, kept_rows = values, rows
    return np.sort(kept_rows)


def rank_frame(
    frame: pd.DataFrame, objectives: Sequence[Objective], order_by: Objective | None = None, fronts: int = 1
) -> pd.DataFrame:
    """The Pareto-optimal rows of a table, best first.

    Parameters
    ----------
    frame
        Any table with the objectives as columns; rows whose column ``feasible`` is false are left out.
    objectives
        Aims; rows where one is not finite are left out.
    order_by
        Column that orders each front; the first objective unless given. Ties keep their order.
    fronts
        How many fronts; the second is the first of what is left, and so on.

    Returns
    -------
    DataFrame
        The rows with a column ``front``, from 1.
    """
    import pandas as pd

    for objective in objectives:
        if not pd.api.types.is_numeric_dtype(frame[objective.metric]):
            raise RequestError(f"column '{objective.metric}' does not hold numbers, so it cannot be ranked")
    eligible = frame[frame["feasible"].astype(bool)] if "feasible" in frame.columns else frame
    order = order_by or objectives[0]
    names = [objective.metric for objective in objectives]
    parts, left = [], eligible
    for number in range(1, fronts + 1):
        if left.empty:
            break
        rows = front([{name: left[name].to_numpy() for name in names}], objectives)
        best = left.iloc[rows].sort_values(order.metric, ascending=order.sense == "min", kind="stable")
        parts.append(best.assign(front=number))
        # By position: labels of a user's table may repeat.
        remaining = np.ones(len(left), dtype=np.bool_)
        remaining[rows] = False
        left = left.iloc[remaining]
    return pd.concat(parts) if parts else eligible.iloc[:0].assign(front=0)


class Source(Protocol):
    """What a ranking needs of results: blocks of columns, and single rows."""

    @property
    def attributes(self) -> Mapping[str, Any]:
        """Facts of the study; ``objectives`` and ``senses`` are JSON texts."""

    @property
    def columns(self) -> tuple[Column, ...]:
        """The columns in their order."""

    def blocks(self, columns: Sequence[str] | None = None) -> Iterable[Columns]:
        """Columns of consecutive designs."""

    def rows(self, numbers: npt.NDArray[np.int64]) -> pd.DataFrame:
        """Whole rows by design number."""


@dataclass(frozen=True)
class Ranking:
    """Pareto-optimal designs, best first, with the aims that chose them and the count of the others.

    `incomplete` says that designs were left out of the results that may be better in these aims.
    """

    frame: pd.DataFrame
    objectives: tuple[Objective, ...]
    order_by: Objective
    tally: Tally
    incomplete: bool = False


def choose_objectives(
    metrics: Sequence[str] | str | None,
    order_by: str | None,
    senses: Mapping[str, Sense | None],
    columns: Sequence[str],
    usual: Sequence[str] = (),
) -> tuple[tuple[Objective, ...], Objective]:
    """The aims of a ranking and what orders it: what was asked for, else the study's own."""
    texts = [metrics] if isinstance(metrics, str) else list(usual if metrics is None else metrics)
    if not texts:
        raise RequestError("nothing to rank by: give metrics, such as cv and swing_angle:max")
    objectives = tuple(dict.fromkeys(parse_objective(text, senses, columns) for text in texts))
    order = objectives[0] if order_by is None else parse_objective(order_by, senses, columns)
    return objectives, order


def rank_source(
    source: Source, metrics: Sequence[str] | str | None = None, order_by: str | None = None, fronts: int = 1
) -> Ranking:
    """Rank the designs of a results file, block by block; see `rank_frame`."""
    usual = json.loads(str(source.attributes.get("objectives", "[]")))
    rankable = [c.name for c in source.columns if c.role in _RANKABLE and not c.labels]
    objectives, order = choose_objectives(metrics, order_by, senses_of(source.attributes), rankable, usual)
    tally = Tally(tuple(column.name for column in source.columns if column.role == "margin"))
    wanted = list(dict.fromkeys(["design", "feasible", "status", *tally.margins, *(o.metric for o in objectives)]))
    best = source.rows(front(source.blocks(wanted), objectives, tally))
    if fronts > 1 and source.attributes.get("keep") == "front":
        raise RequestError("only the first front was kept of this study; sweep with --keep all to see the others")
    if fronts > 1:
        chosen = source.rows(
            np.concatenate([block["design"][block["feasible"] != 0] for block in source.blocks(wanted)])
        )
        return Ranking(rank_frame(chosen, objectives, order, fronts), objectives, order, tally)
    reduced = source.attributes.get("keep") == "front"
    incomplete = reduced and {f"{o.metric}:{o.sense}" for o in objectives} != set(usual)
    if reduced and not incomplete:
        # Only the Pareto set in these objectives was kept; the others were counted when they were computed.
        tally = Tally.from_json(str(source.attributes.get("tally")))
    best = best.sort_values(order.metric, ascending=order.sense == "min", kind="stable").assign(front=1)
    return Ranking(best, objectives, order, tally, incomplete)


def senses_of(attributes: Mapping[str, object]) -> dict[str, Sense | None]:
    """The own sense of each metric, from a results file's attributes."""
    return dict(json.loads(str(attributes.get("senses", "{}"))))
