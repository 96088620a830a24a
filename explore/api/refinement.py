"""Improve the front of results."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from explore.api.workers import find_workers, report_counts
from explore.model.progress import ReportProgress
from explore.store.open_results import open_results, results_of
from explore.store.results import Results
from explore.sweeping.refinement_plan import EVALUATIONS, plan_refinement
from explore.sweeping.refinements import run_refinement

if TYPE_CHECKING:
    from distributed import Client


def refine(
    results: Results | Path | str,
    path: Path | str,
    *,
    objectives: Sequence[str] | None = None,
    evaluations: int = EVALUATIONS,
    seed: int = 0,
    client: Client | None = None,
    workers: int | None = None,
    processes: bool = False,
    restart: bool = False,
    report_progress: ReportProgress | None = None,
) -> Results:
    """Improve the Pareto front of results by generations of designs around it, within the ranges of their study.

    Parameters
    ----------
    results
        Finished results, or the path of their file.
    path
        The new results file; an unfinished one of the same refinement is continued. It begins with the front that is
        refined; its column ``parent`` is the number of the design that a design was drawn from.
    objectives
        Two or more, such as ``["cv", "swing_angle:max"]``; None for those of the study.
    evaluations
        Number of designs of the new file.
    seed
        Seed of the random steps. The designs follow from it, the results and the number of designs alone.
    client, workers, processes, restart, report_progress
        As of `sweep`.

    Returns
    -------
    Results
        The results in the new file.

    Raises
    ------
    RequestError
        If the results have no feasible design, or fewer than two objectives or no range to refine.
    ResultsError
        As of `sweep`, and if the results are not finished.
    ClusterError
        If the cluster is lost, runs other versions of the packages, or a generation failed.
    """
    source = results_of(results)
    plan = plan_refinement(source, objectives=objectives, evaluations=evaluations, seed=seed)
    cluster = find_workers(plan.study.request, client, workers, processes=processes)
    run_refinement(plan, source.path, path, cluster, restart=restart, progress=report_counts(report_progress))
    return open_results(path)
