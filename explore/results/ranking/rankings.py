"""Rank a table, or a results file block by block."""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from explore.base.counts import check_count
from explore.base.errors import RequestError
from explore.base.units.shown import Scale
from explore.model.columns import Arrays
from explore.model.progress import ReportProgress
from explore.model.request import Objective
from explore.results.ranking.limits import Limits, RankingCriteria, make_criteria, parse_limits
from explore.results.ranking.objectives import choose_objectives
from explore.results.ranking.pareto import find_fronts
from explore.results.ranking.quality import add_quality_columns
from explore.results.ranking.tallies import Tally

if TYPE_CHECKING:
    import pandas as pd

    from explore.results.store.results import Results

#: Roles of columns that can be an objective.
RANKABLE_ROLES = ("parameter", "metric", "margin")


@dataclass(frozen=True)
class RankRequest:
    """Options of a ranking; see `explore.rank`."""

    objectives: Sequence[str] | str | None = None
    order_by: str | None = None
    fronts: int = 1
    where: str | None = None
    limits: Limits | None = None
    quality: bool = False

    def __post_init__(self) -> None:
        check_count("fronts", self.fronts, 1)

    @classmethod
    def from_words(
        cls, metrics: Sequence[str], where: str | None, limits: Sequence[str], *, fronts: int, quality: bool
    ) -> RankRequest:
        """As `explore rank` has it: one metric orders the Pareto set, several replace the study's objectives."""
        objectives, order_by = (metrics, None) if len(metrics) > 1 else (None, next(iter(metrics), None))
        return cls(objectives, order_by, fronts, where, parse_limits(list(limits)), quality)


#: Request for the objectives and constraints of the study.
DEFAULT_REQUEST = RankRequest()


@dataclass(frozen=True)
class Ranking:
    """Pareto-optimal designs, best first, with their objectives and the counts of the other designs.

    `exclusions` counts the feasible designs that the condition and the limits exclude, by reason. `is_incomplete` is
    true when the results do not hold every design that can be optimal in these objectives.
    """

    frame: pd.DataFrame
    objectives: tuple[Objective, ...]
    order_by: Objective
    tally: Tally
    exclusions: Counter[str] = field(default_factory=Counter)
    is_incomplete: bool = False


def rank_frame(frame: pd.DataFrame, request: RankRequest) -> pd.DataFrame:
    """The rows of the first fronts of a table, best first, with a column ``front``, from 1.

    Rows whose column ``feasible`` is false or whose objectives are not all finite are left out; a warning says how many
    have an infinite one. Rows that are equal in ``order_by`` keep their order. A `RequestError` says that a column is
    unknown or not numeric.
    """
    attributes = frame.attrs
    names = [str(name) for name in frame.columns]
    objectives, order = choose_objectives(
        request.objectives, request.order_by, attributes.get("senses", {}), names, attributes.get("objectives", ())
    )
    numeric, criteria = criteria_of_table(frame, request.where, request.limits)
    needed = dict.fromkeys([*(objective.metric for objective in objectives), *criteria.column_names])
    for name in needed:
        if name not in numeric:
            raise RequestError(f"column '{name}' does not hold numbers, so it cannot be ranked")
    columns: Arrays = {name: frame[name].to_numpy(dtype=np.float64, na_value=np.nan) for name in needed}
    if "feasible" in frame.columns:
        if not frame["feasible"].isin([True, False]).all():
            raise RequestError("column 'feasible' must be true or false in each row")
        columns["feasible"] = frame["feasible"].to_numpy(dtype=bool)
    infinite = np.isinf([columns[objective.metric] for objective in objectives]).any(axis=0)
    if n_infinite := int(np.count_nonzero(infinite & columns.get("feasible", True))):
        warnings.warn(f"rows left out, because an objective is infinite: {n_infinite:,}", RuntimeWarning, stacklevel=3)
    # Rows are selected by position, because the labels of a table may repeat.
    rows, numbers = find_fronts(criteria.apply([columns]), objectives, request.fronts, numbered_by=None)
    return sort_fronts(frame.iloc[rows], numbers, objectives, order, request)


def criteria_of_table(
    frame: pd.DataFrame, where: str | None, limits: Limits | None
) -> tuple[list[str], RankingCriteria]:
    """The columns of a table that hold numbers, and the criteria of a request on them."""
    import pandas as pd

    numeric = [str(name) for name in frame.columns if pd.api.types.is_numeric_dtype(frame.dtypes[name])]
    scales = {name: Scale(unit, unit) for name, unit in frame.attrs.get("units", {}).items()}
    return numeric, make_criteria(where, limits, numeric, numeric, frame.attrs.get("constraints", {}), scales)


def sort_fronts(
    frame: pd.DataFrame,
    numbers: npt.NDArray[np.int64],
    objectives: Sequence[Objective],
    order: Objective,
    request: RankRequest,
) -> pd.DataFrame:
    """Sort by front, within each best first, and add the columns of a ranking; ties keep their order."""
    ranked = frame.assign(front=numbers).sort_values(order.metric, ascending=order.sense == "min", kind="stable")
    ranked = ranked.sort_values("front", kind="stable")
    return add_quality_columns(ranked, objectives) if request.quality else ranked


def rankable_names(source: Results) -> list[str]:
    """Names of the columns that can be an objective."""
    return [c.name for c in source.columns if c.role in RANKABLE_ROLES and not c.labels]


def rank_source(
    source: Results, request: RankRequest = DEFAULT_REQUEST, report_progress: ReportProgress | None = None
) -> Ranking:
    """Rank the designs of a results file, block by block, and show them in the units of `source`; see `rank_frame`."""
    ranking = rank_declared(source, request, report_progress)
    return replace(ranking, frame=source.show(ranking.frame))


def rank_declared(source: Results, request: RankRequest, report_progress: ReportProgress | None = None) -> Ranking:
    """Rank the designs of a results file by the request in shown units; the table is in declared units.

    The declared values are compared, of which two may become one by a conversion.
    """
    scales, source = source.scales, source.declared
    defaults = source.objectives
    objectives, order = choose_objectives(
        request.objectives, request.order_by, source.senses, rankable_names(source), defaults
    )
    has_front_only = source.keep == "front"
    if request.fronts > 1 and has_front_only:
        raise RequestError('this study kept the first front only; sweep with `keep="all"` to rank more fronts')
    limitable = [c.name for c in source.columns if c.role in ("parameter", "metric") and not c.labels]
    names = [column.name for column in source.columns]
    criteria = make_criteria(request.where, request.limits, names, limitable, source.constraints, scales)
    labels = next((column.labels for column in source.columns if column.name == "status"), {})
    tally = Tally(tuple(column.name for column in source.columns if column.role == "margin"), labels)
    objective_names = (objective.metric for objective in objectives)
    used = (*tally.margins, *objective_names, *criteria.column_names)
    needed = list(dict.fromkeys(["design", "feasible", "status", *used]))
    blocks = report_each(source.blocks(needed), source.n_committed, report_progress)
    rows, numbers = find_fronts(criteria.apply(blocks), objectives, request.fronts, tally)
    has_study_objectives = {f"{o.metric}:{o.sense}" for o in objectives} == set(defaults)
    keeps_best = has_study_objectives and criteria.preserves_front(objectives)
    if has_front_only and keeps_best and not criteria.has_criteria:
        # The results hold the Pareto set in these objectives; the sweep counted the other designs.
        tally = Tally.from_counts(source.tally)
    frame = sort_fronts(source.designs(rows), numbers, objectives, order, request)
    return Ranking(frame, objectives, order, tally, criteria.exclusions, has_front_only and not keeps_best)


def report_each(
    blocks: Iterable[Arrays], total: int, report_progress: ReportProgress | None, done: int = 0
) -> Iterator[Arrays]:
    """Yield the blocks and report the progress after each, from what was done before."""
    for columns in blocks:
        yield columns
        done += len(columns["design"])
        if report_progress is not None:
            report_progress(done, total)
