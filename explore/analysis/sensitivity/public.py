"""Apportion the variance of feasibility and of metrics to the parameters of a study."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from explore.analysis.sensitivity.feasibility import (
    FeasibilityIndices,
    FeasibilityPlan,
    plan_feasibility,
    run_feasibility,
)
from explore.analysis.sensitivity.given_data import LEAST_DESIGNS, Filling, first_order
from explore.base.errors import RequestError, ResultsError
from explore.base.suggest import suggestion
from explore.model.columns import Arrays
from explore.model.progress import ReportProgress
from explore.model.quantities import FloatArray
from explore.results.ranking.rankings import rankable_names
from explore.results.store.open_results import results_of
from explore.results.store.results import Results
from explore.running.workers import find_workers, report_counts
from explore.studies.config.study_file import parse_study

if TYPE_CHECKING:
    import pandas as pd
    from distributed import Client

#: Name of the output that is 1 for feasible designs and 0 for all others.
FEASIBLE = "feasible"
#: Filling of the ranges by sampling methods that do not fill them at random.
_FILLINGS: dict[object, Filling] = {"sobol": "even", "grid": "complete"}
#: Kind of the designs of results that were not drawn from all of the ranges, by what drew them.
_CHOSEN: dict[object, str] = {
    "refinement": "designs drawn around a Pareto set",
    "synthesis": "designs that a search found",
    "tolerances": "designs that were chosen",
}


def sensitivity(
    results: Results | Path | str,
    metrics: Sequence[str] | str | None = None,
    *,
    evaluations: int | None = None,
    seed: int = 0,
    client: Client | None = None,
    workers: int | None = None,
    processes: bool = False,
    report_progress: ReportProgress | None = None,
) -> pd.DataFrame:
    """Apportion the variance of feasibility, and of metrics where designs are feasible, to the parameters.

    Parameters
    ----------
    results
        Finished results, or the path of their file.
    metrics
        Columns of the results, such as ``["cv"]``; None for the objectives of the study.
    evaluations
        Most designs to draw anew for the feasibility, from the ranges and listed values of the study; None for as many
        as the study has, at least 65,536 and at most 1,048,576.
    seed
        Seed of these designs. The indices do not depend on the workers.
    client, workers, processes, report_progress
        As of `sweep`.

    Returns
    -------
    DataFrame
        One row for each output, ``"feasible"`` first, and parameter:

        - ``output``, ``parameter``;
        - ``first_order``, the share of the variance that would vanish on average if the parameter were known, and the
          ends of its 95 % interval, ``first_order_low`` and ``first_order_high``;
        - ``total``, ``total_low``, ``total_high``, of the feasibility: the share that would remain if all other
          parameters were known. NaN for metrics: the parameters of feasible designs depend on each other, and shares
          that add up do not exist;
        - ``designs``, the number that the index is from, and ``undefined``, the number of feasible designs that are
          left out because the metric is undefined;
        - ``bins``, ``coarser``, the index with half the bins, and ``converged``, whether it differs by at most 0.01.
          Feasibility needs no bins.

        ``attrs["notes"]`` says in sentences what is not applicable, and ``attrs["feasible"]`` is the number of
        feasible designs among those drawn.

    Raises
    ------
    RequestError
        If a name is unknown, nothing can be apportioned, or `evaluations` are too few.
    ResultsError
        If the results are not finished.
    """
    plan = plan_sensitivity(results_of(results), metrics, evaluations, seed)
    indices = None
    if plan.feasibility is not None:
        cluster = find_workers(plan.feasibility.study.request, client, workers, processes=processes)
        indices = run_feasibility(plan.feasibility, cluster, report_counts(report_progress))
    return plan.table(indices)


@dataclass(frozen=True)
class SensitivityPlan:
    """What to apportion, and to which parameters.

    No metrics where the designs of the results are not from all of the ranges; no feasibility where there are no
    ranges; notes say in sentences what is not applicable.
    """

    results: Results
    metrics: tuple[str, ...]
    parameters: tuple[str, ...]
    feasibility: FeasibilityPlan | None
    notes: tuple[str, ...]
    seed: int

    def table(self, indices: FeasibilityIndices | None) -> pd.DataFrame:
        """The table of `sensitivity`; the indices of the feasibility are those of the plan."""
        import pandas as pd

        notes = list(self.notes)
        rows = [] if indices is None else _feasibility_rows(self.parameters, indices, notes)
        if self.metrics:
            rows += _metric_rows(self, notes)
        if not rows:
            raise RequestError("; ".join(notes))
        frame = pd.DataFrame(rows)
        frame.attrs["notes"] = notes
        frame.attrs["feasible"] = 0 if indices is None else indices.n_feasible
        return frame


def plan_sensitivity(
    results: Results, metrics: Sequence[str] | str | None, evaluations: int | None, seed: int
) -> SensitivityPlan:
    """Plan `sensitivity`."""
    if not results.is_complete:
        raise ResultsError(
            f"{results.path} is not finished: {results.n_committed:,} of {results.n_designs:,} designs; "
            "run the sweep again to go on"
        )
    names = _metrics(results, metrics)
    sampler, notes = results.attributes.get("sampler"), []
    feasibility = None
    if sampler == "table":
        notes.append(
            "feasibility is not apportioned: the designs of a table have no ranges to draw others from; "
            "sweep the parameters as ranges or lists"
        )
        parameters = tuple(column.name for column in results.columns if column.role == "parameter")
    else:
        study = parse_study(results.config, str(results.path), results.path.parent, results.target)
        feasibility = plan_feasibility(study, evaluations, seed)
        parameters = feasibility.parameters
    kind = "only the Pareto set" if results.keep != "all" else _CHOSEN.get(sampler)
    if kind is not None:
        notes.append(
            f"{', '.join(names)}: not apportioned, because {results.path} has {kind}, not designs from all of the "
            "ranges; use the results of a sweep that keeps all designs"
        )
        names = ()
    return SensitivityPlan(results, names, parameters, feasibility, tuple(notes), seed)


def _metrics(results: Results, metrics: Sequence[str] | str | None) -> tuple[str, ...]:
    """The names of the columns to apportion, each once."""
    if metrics is None:
        return tuple(dict.fromkeys(text.partition(":")[0] for text in results.objectives))
    names, allowed = [metrics] if isinstance(metrics, str) else list(metrics), rankable_names(results)
    for name in names:
        if name not in allowed:
            raise RequestError(f"{results.path} has no column of numbers '{name}'; {suggestion(name, allowed)}")
    return tuple(dict.fromkeys(names))


def _feasibility_rows(parameters: Sequence[str], indices: FeasibilityIndices, notes: list[str]) -> list[dict[str, Any]]:
    """A row for each parameter; none, but a note, where all designs are alike."""
    if not indices.n_feasible:
        advice = "`explore rank` says how near designs are"
        notes.append(
            f"feasibility is not apportioned: none of {indices.n_designs:,} designs drawn is feasible; {advice}"
        )
        return []
    if indices.n_feasible == indices.n_designs:
        notes.append(f"feasibility is not apportioned: all of {indices.n_designs:,} designs drawn are feasible")
        return []
    first, total = indices.first_order, indices.total
    return [
        {
            "output": FEASIBLE,
            "parameter": name,
            "first_order": first.value[k],
            "first_order_low": first.low[k],
            "first_order_high": first.high[k],
            "total": total.value[k],
            "total_low": total.low[k],
            "total_high": total.high[k],
            "designs": indices.n_designs,
            "undefined": 0,
            "bins": 0,
            "coarser": first.value[k],
            "converged": True,
        }
        for k, name in enumerate(parameters)
    ]


def _metric_rows(plan: SensitivityPlan, notes: list[str]) -> list[dict[str, Any]]:
    """A row for each metric and parameter; none, but a note, where a metric cannot be apportioned."""
    columns = _feasible_designs(plan.results, [*plan.parameters, *plan.metrics])
    filling = _FILLINGS.get(plan.results.attributes.get("sampler"), "random")
    parameters = plan.parameters
    if plan.feasibility is None:
        parameters = tuple(name for name in parameters if _varies(columns[name]))
    rows = []
    for metric in plan.metrics:
        n_defined = int(np.isfinite(columns[metric]).sum())
        if not n_defined:
            reason = "it is defined in no feasible design" if len(columns[metric]) else "no design is feasible"
        elif filling != "complete" and n_defined < LEAST_DESIGNS:
            reason = f"it is defined in {n_defined:,} feasible designs, and {LEAST_DESIGNS} are needed; sweep more"
        elif not _varies(columns[metric]):
            reason = "it does not vary among the feasible designs"
        else:
            rows += [_metric_row(columns, metric, name, filling, plan.seed) for name in parameters]
            continue
        notes.append(f"{metric} is not apportioned: {reason}")
    return rows


def _metric_row(columns: Arrays, metric: str, parameter: str, filling: Filling, seed: int) -> dict[str, Any]:
    found = first_order(columns[parameter], columns[metric], filling, seed)
    return {
        "output": metric,
        "parameter": parameter,
        "first_order": found.value,
        "first_order_low": found.low,
        "first_order_high": found.high,
        "total": np.nan,
        "total_low": np.nan,
        "total_high": np.nan,
        "designs": found.n_designs,
        "undefined": len(columns[metric]) - found.n_designs,
        "bins": found.n_bins,
        "coarser": found.coarser,
        "converged": found.has_converged,
    }


def _varies(values: FloatArray) -> bool:
    """Whether the values that are defined differ."""
    defined = values[np.isfinite(values)]
    return len(defined) > 0 and bool(defined.min() < defined.max())


def _feasible_designs(results: Results, names: Sequence[str]) -> Arrays:
    """Columns of the feasible designs by name."""
    wanted = list(dict.fromkeys(names))
    parts: dict[str, list[Any]] = {name: [] for name in wanted}
    for block in results.blocks([*wanted, FEASIBLE]):
        is_feasible = block[FEASIBLE] == 1
        for name in wanted:
            parts[name].append(block[name][is_feasible])
    return {name: np.concatenate(arrays) for name, arrays in parts.items()}
