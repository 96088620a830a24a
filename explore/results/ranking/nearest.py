"""The infeasible designs that are nearest to feasible, of a table or block by block of a results file."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from explore.base.counts import check_count
from explore.base.errors import RequestError
from explore.base.units.shown import in_units
from explore.model.columns import Arrays
from explore.model.progress import ReportProgress
from explore.model.quantities import FloatArray
from explore.results.ranking.exclusions import Exclusions
from explore.results.ranking.limits import Limits, RankingCriteria, make_criteria
from explore.results.ranking.rankings import criteria_of_table, report_each
from explore.results.ranking.violations import find_margins, find_scales, is_measured, total_violations

if TYPE_CHECKING:
    import pandas as pd

    from explore.results.store.results import Results

_SUFFIX = "_margin"
#: Column with the total violation.
VIOLATION = "violation"
#: Share of the designs below which few are feasible.
_LITTLE = 1e-3


def is_little(n_feasible: int, n_designs: int) -> bool:
    """Whether so few designs are feasible that the nearest others are of interest."""
    return n_feasible < _LITTLE * n_designs


@dataclass(frozen=True)
class Nearness:
    """The infeasible designs nearest to feasible, and counts of all designs by the constraints that they miss.

    The frame has the designs, the nearest first, with all columns of the results and ``violation``, the sum of the
    violations. A margin is NaN where its metric was not sampled; then the violation is at least the one given. `scales`
    has for each constrained metric the violation that counts as 1, in its unit.
    """

    frame: pd.DataFrame
    scales: Mapping[str, float]
    exclusions: Exclusions


def find_nearest(
    source: Results,
    count: int,
    *,
    where: str | None = None,
    limits: Limits | None = None,
    report_progress: ReportProgress | None = None,
) -> Nearness:
    """Find the infeasible designs of least total violation in results that keep every design.

    `where` and `limits` are those of `explore.rank`. Memory holds a few blocks. The results are read twice: progress is
    the number of designs read, and to read in both passes. A `RequestError` says that the results keep the front only
    or have no constraint.
    """
    if source.keep == "front":
        raise RequestError('this study kept the Pareto set only; sweep with `keep="all"` to find the nearest designs')
    shown, source = source, source.declared
    names = [column.name for column in source.columns]
    limitable = [c.name for c in source.columns if c.role in ("parameter", "metric") and not c.labels]
    criteria = make_criteria(where, limits, names, limitable, source.constraints, shown.scales)
    metrics = [column.name.removesuffix(_SUFFIX) for column in source.columns if column.role == "margin"]
    needed = list(dict.fromkeys(["design", "status", *(m + _SUFFIX for m in metrics), *criteria.column_names]))

    def read_blocks(is_second: bool) -> Iterator[Arrays]:
        done = source.n_committed * is_second
        return report_each(source.blocks(needed), 2 * source.n_committed, report_progress, done)

    search = _NearestSearch(metrics, criteria, count)
    search.run(read_blocks, source.n_committed)
    order = np.argsort(search.rows)
    frame = source.designs(search.rows[order]).iloc[np.argsort(order)]
    return _show(search.finish(frame), shown)


def _show(nearness: Nearness, source: Results) -> Nearness:
    """The same in the units in which the results are shown."""
    scales = source.scales
    if source is source.declared:
        return nearness
    by_metric = {metric: scales.get(f"{metric}{_SUFFIX}") or scales[metric] for metric in nearness.scales}
    # The margin of a limit on a metric without a constraint is no column of the results.
    margins = {metric + _SUFFIX: scale for metric, scale in by_metric.items()}
    return Nearness(
        in_units(nearness.frame, {**margins, **scales}),
        {metric: by_metric[metric].show(value) for metric, value in nearness.scales.items()},
        nearness.exclusions.in_units(by_metric),
    )


def find_nearest_rows(
    frame: pd.DataFrame, count: int, *, where: str | None = None, limits: Limits | None = None
) -> Nearness:
    """Find the infeasible rows of least total violation in a table, such as one of `explore.evaluate`."""
    numeric, criteria = criteria_of_table(frame, where, limits)
    metrics = [name.removesuffix(_SUFFIX) for name in numeric if name.endswith(_SUFFIX)]
    needed = dict.fromkeys([*(metric + _SUFFIX for metric in metrics), *criteria.column_names])
    columns: Arrays = {name: frame[name].to_numpy(dtype=np.float64, na_value=np.nan) for name in needed}
    if "status" in frame:
        columns["status"] = frame["status"].to_numpy()
    search = _NearestSearch(metrics, criteria, count, numbered_by=None)
    search.run(lambda _: [columns], len(frame))
    return search.finish(frame.iloc[search.rows])


class _NearestSearch:
    """The nearest designs of those read so far: their numbers, totals and margins, each nearest first."""

    def __init__(
        self, metrics: Sequence[str], criteria: RankingCriteria, count: int, numbered_by: str | None = "design"
    ) -> None:
        if not metrics and not criteria.limits:
            raise RequestError("these results have no constraint, so no design misses any")
        check_count("nearest", count, 1)
        self._metrics, self._criteria, self._count, self._numbered_by = metrics, criteria, count, numbered_by
        self._scales: dict[str, float] = {}
        self._exclusions = Exclusions()
        self.rows: npt.NDArray[np.int64] = np.empty(0, dtype=np.int64)
        self._totals: FloatArray = np.empty(0)
        self._margins: dict[str, FloatArray] = {}

    def run(self, read_blocks: Callable[[bool], Iterable[Arrays]], n_designs: int) -> None:
        """Find the scales in a first pass over all blocks, and the designs in a second one."""
        self._scales = find_scales((self._measured_margins(columns) for columns in read_blocks(False)), n_designs)
        for columns in read_blocks(True):
            self._add(columns)

    def finish(self, frame: pd.DataFrame) -> Nearness:
        """The outcome; `frame` has the designs of `rows` in their order."""
        margins = {metric + _SUFFIX: values for metric, values in self._margins.items()}
        return Nearness(frame.assign(**margins, **{VIOLATION: self._totals}), self._scales, self._exclusions)

    def _select(self, columns: Arrays) -> tuple[dict[str, FloatArray], npt.NDArray[np.int64], npt.NDArray[np.bool_]]:
        """Margins, numbers, and whether the distance is known, of the designs that meet the condition."""
        margins = find_margins(columns, self._metrics, self._criteria.limits)
        measured = is_measured(columns.get("status"), margins)
        rows = np.asarray(columns[self._numbered_by]) if self._numbered_by else np.arange(len(measured))
        if self._criteria.condition is not None:
            selected = self._criteria.condition.test(columns)
            margins = {metric: margin[selected] for metric, margin in margins.items()}
            measured, rows = measured[selected], rows[selected]
        return margins, rows, measured

    def _measured_margins(self, columns: Arrays) -> dict[str, FloatArray]:
        margins, _, measured = self._select(columns)
        return {metric: margin[measured] for metric, margin in margins.items()}

    def _add(self, columns: Arrays) -> None:
        margins, rows, measured = self._select(columns)
        self._exclusions.count(margins, measured)
        totals = total_violations(margins, self._scales)
        candidates = np.flatnonzero(measured & (totals > 0.0) & np.isfinite(totals))
        if len(candidates) > self._count:
            most = np.partition(totals[candidates], self._count - 1)[self._count - 1]
            candidates = candidates[totals[candidates] <= most]
        totals = np.concatenate([self._totals, totals[candidates]])
        rows = np.concatenate([self.rows, rows[candidates]])
        kept = np.lexsort((rows, totals))[: self._count]  # of equal designs the first
        self.rows, self._totals = rows[kept], totals[kept]
        for metric, margin in margins.items():
            known = self._margins.get(metric, np.empty(0))
            self._margins[metric] = np.concatenate([known, margin[candidates]])[kept]
