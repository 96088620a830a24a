"""Ranking a table, or a results file block by block."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
import numpy.typing as npt

from explore.errors import RequestError
from explore.ranking.limits import Bounds, Limits
from explore.ranking.objectives import choose_objectives, senses_of
from explore.ranking.pareto import fronts as find_fronts
from explore.ranking.quality import with_quality
from explore.ranking.selection import make_selection
from explore.ranking.tallies import Tally
from explore.vocabulary import Column, Columns, Objective

if TYPE_CHECKING:
    import pandas as pd

#: Called after each block with how many designs were read and how many there are to be read.
Step = Callable[[int, int], None]
#: Roles of columns that can be an aim; codes and bookkeeping cannot.
_RANKABLE = ("parameter", "metric", "margin")


@dataclass(frozen=True)
class RankRequest:
    """What is asked of a ranking; see `explore.rank`."""

    metrics: Sequence[str] | str | None = None
    order_by: str | None = None
    fronts: int = 1
    where: str | None = None
    limits: Limits | None = None
    quality: bool = False

    def __post_init__(self) -> None:
        if self.fronts < 1:
            raise RequestError(f"fronts = {self.fronts}: ask for at least one")


#: The objectives of the study itself, and its own constraints.
AS_SWEPT = RankRequest()


class Source(Protocol):
    """What a ranking needs of results: blocks of columns, and single rows."""

    @property
    def attributes(self) -> Mapping[str, Any]:
        """Facts of the study; ``objectives`` and ``senses`` are JSON texts."""

    @property
    def columns(self) -> tuple[Column, ...]:
        """The columns in their order."""

    @property
    def constraints(self) -> Bounds:
        """The bounds that the designs were swept with."""

    @property
    def n_committed(self) -> int:
        """How many designs the blocks hold."""

    def blocks(self, columns: Sequence[str] | None = None) -> Iterable[Columns]:
        """Columns of consecutive designs."""

    def rows(self, numbers: npt.NDArray[np.int64]) -> pd.DataFrame:
        """Whole rows by design number."""


@dataclass(frozen=True)
class Ranking:
    """Pareto-optimal designs, best first, with the aims that chose them and the count of the others.

    `left_out` counts the feasible designs that did not meet the request. `incomplete` says that designs were left out
    of the results that may be better in these aims.
    """

    frame: pd.DataFrame
    objectives: tuple[Objective, ...]
    order_by: Objective
    tally: Tally
    left_out: Counter[str] = field(default_factory=Counter)
    incomplete: bool = False


def rank_frame(frame: pd.DataFrame, request: RankRequest) -> pd.DataFrame:
    """The Pareto-optimal rows of a table, best first, with a column ``front``, from 1.

    Rows whose column ``feasible`` is false are left out, and rows where an aim is not finite. Rows that are equal in
    the column that orders them keep their order.
    """
    import pandas as pd

    attributes = frame.attrs
    names = [str(name) for name in frame.columns]
    objectives, order = choose_objectives(
        request.metrics, request.order_by, attributes.get("senses", {}), names, attributes.get("objectives", ())
    )
    numeric = [str(name) for name in frame.columns if pd.api.types.is_numeric_dtype(frame.dtypes[name])]
    selection = make_selection(request.where, request.limits, numeric, numeric, attributes.get("constraints", {}))
    wanted = dict.fromkeys([*(objective.metric for objective in objectives), *selection.names])
    for name in wanted:
        if name not in numeric:
            raise RequestError(f"column '{name}' does not hold numbers, so it cannot be ranked")
    columns: Columns = {name: frame[name].to_numpy(dtype=np.float64, na_value=np.nan) for name in wanted}
    if "feasible" in frame.columns:
        columns["feasible"] = frame["feasible"].to_numpy()
    # By position: labels of a user's table may repeat.
    rows, numbers = find_fronts(selection.apply([columns]), objectives, request.fronts)
    return arranged(frame.iloc[rows], numbers, objectives, order, request)


def arranged(
    frame: pd.DataFrame,
    numbers: npt.NDArray[np.int64],
    objectives: Sequence[Objective],
    order: Objective,
    request: RankRequest,
) -> pd.DataFrame:
    """Front after front, each best first, with the columns that a ranking adds; ties keep their order."""
    best = frame.assign(front=numbers).sort_values(order.metric, ascending=order.sense == "min", kind="stable")
    best = best.sort_values("front", kind="stable")
    return with_quality(best, objectives) if request.quality else best


def rank_source(source: Source, request: RankRequest = AS_SWEPT, step: Step | None = None) -> Ranking:
    """Rank the designs of a results file, block by block, with a step after each; see `rank_frame`."""
    usual = json.loads(str(source.attributes.get("objectives", "[]")))
    rankable = [c.name for c in source.columns if c.role in _RANKABLE and not c.labels]
    objectives, order = choose_objectives(
        request.metrics, request.order_by, senses_of(source.attributes), rankable, usual
    )
    reduced = source.attributes.get("keep") == "front"
    if request.fronts > 1 and reduced:
        raise RequestError("only the first front was kept of this study; sweep with --keep all to see the others")
    limited = [c.name for c in source.columns if c.role in ("parameter", "metric") and not c.labels]
    names = [column.name for column in source.columns]
    selection = make_selection(request.where, request.limits, names, limited, source.constraints)
    tally = Tally(tuple(column.name for column in source.columns if column.role == "margin"))
    aims = (objective.metric for objective in objectives)
    wanted = list(dict.fromkeys(["design", "feasible", "status", *tally.margins, *aims, *selection.names]))
    blocks = _followed(source.blocks(wanted), source.n_committed, step)
    rows, numbers = find_fronts(selection.apply(blocks), objectives, request.fronts, tally)
    complete = {f"{o.metric}:{o.sense}" for o in objectives} == set(usual) and selection.keeps_front(objectives)
    if reduced and complete and not selection.selects:
        # Only the Pareto set in these objectives was kept; the others were counted when they were computed.
        tally = Tally.from_json(str(source.attributes.get("tally")))
    frame = arranged(source.rows(rows), numbers, objectives, order, request)
    return Ranking(frame, objectives, order, tally, selection.left_out, reduced and not complete)


def _followed(blocks: Iterable[Columns], total: int, step: Step | None) -> Iterator[Columns]:
    """The blocks, with a step after what was done with each."""
    done = 0
    for columns in blocks:
        yield columns
        done += len(columns["design"])
        if step is not None:
            step(done, total)
