"""Ranking a table, or a results file block by block."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
import numpy.typing as npt

from explore.errors import RequestError
from explore.ranking.objectives import choose_objectives, senses_of
from explore.ranking.pareto import fronts as find_fronts
from explore.ranking.tallies import Tally
from explore.vocabulary import Column, Columns, Objective

if TYPE_CHECKING:
    import pandas as pd

#: Roles of columns that can be an aim; codes and bookkeeping cannot.
_RANKABLE = ("parameter", "metric", "margin")


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
    names = [objective.metric for objective in objectives]
    names += ["feasible"] if "feasible" in frame.columns else []
    # By position: labels of a user's table may repeat.
    rows, numbers = find_fronts([{name: frame[name].to_numpy() for name in names}], objectives, fronts)
    return _ordered(frame.iloc[rows], numbers, order_by or objectives[0])


def _ordered(frame: pd.DataFrame, numbers: npt.NDArray[np.int64], order: Objective) -> pd.DataFrame:
    """Front after front, each best first; ties keep their order."""
    best = frame.assign(front=numbers).sort_values(order.metric, ascending=order.sense == "min", kind="stable")
    return best.sort_values("front", kind="stable")


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


def rank_source(
    source: Source, metrics: Sequence[str] | str | None = None, order_by: str | None = None, fronts: int = 1
) -> Ranking:
    """Rank the designs of a results file, block by block; see `rank_frame`."""
    usual = json.loads(str(source.attributes.get("objectives", "[]")))
    rankable = [c.name for c in source.columns if c.role in _RANKABLE and not c.labels]
    objectives, order = choose_objectives(metrics, order_by, senses_of(source.attributes), rankable, usual)
    reduced = source.attributes.get("keep") == "front"
    if fronts > 1 and reduced:
        raise RequestError("only the first front was kept of this study; sweep with --keep all to see the others")
    tally = Tally(tuple(column.name for column in source.columns if column.role == "margin"))
    wanted = list(dict.fromkeys(["design", "feasible", "status", *tally.margins, *(o.metric for o in objectives)]))
    rows, numbers = find_fronts(source.blocks(wanted), objectives, fronts, tally)
    incomplete = reduced and {f"{o.metric}:{o.sense}" for o in objectives} != set(usual)
    if reduced and not incomplete:
        # Only the Pareto set in these objectives was kept; the others were counted when they were computed.
        tally = Tally.from_json(str(source.attributes.get("tally")))
    return Ranking(_ordered(source.rows(rows), numbers, order), objectives, order, tally, incomplete)
