"""Tolerances of designs of results: how sure they are to do what they promise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from explore.analysis.tolerancing.outcomes import TolerancedRequest
from explore.analysis.tolerancing.robustness import Robustness, TolerancePlan
from explore.analysis.tolerancing.runs import ToleranceRun, is_continued
from explore.base.counts import check_count
from explore.base.errors import RequestError, ResultsError
from explore.base.files import real_path
from explore.base.suggest import format_value
from explore.evaluation.evaluate import compile_kernels
from explore.model.progress import ReportProgress
from explore.results.ranking.objectives import parse_objective
from explore.results.ranking.rankings import rankable_names
from explore.results.store.open_results import results_of
from explore.results.store.results import Results
from explore.running.chosen import chosen_designs, request_of
from explore.running.workers import find_workers
from explore.studies.request.tolerances import make_tolerances

if TYPE_CHECKING:
    from distributed import Client

#: Number of parts that are drawn of each design where the user does not choose it.
DRAWS = 1 << 18


def tolerance(
    results: Results | Path | str,
    tolerances: Mapping[str, object] | None = None,
    designs: Sequence[int] | int | None = None,
    *,
    path: Path | str | None = None,
    draws: int = DRAWS,
    seed: int = 0,
    client: Client | None = None,
    workers: int | None = None,
    processes: bool = False,
    restart: bool = False,
    report_progress: ReportProgress | None = None,
) -> Robustness:
    """Find how far tolerances of the dimensions move the metrics of designs, and how many parts meet the constraints.

    Parameters
    ----------
    results
        Results, or the path of their file.
    tolerances
        By parameter, half the width: a number, a string with a unit, or ``{"plus_minus": 0.1, "distribution":
        "uniform"}``. A normal one, the default, has a standard deviation of a third of it and is not cut off. Those
        named here replace those of the study's ``[tolerances]``; 0 removes one.
    designs
        Numbers of designs; None for the Pareto set of the study.
    path
        A results file for `Robustness.designs`, numbered from 0; ``parent`` has the number in `results`. An unfinished
        one of the same analysis is finished, a finished one left as it is; all is computed in either case, as it has no
        other table.
    draws
        Number of parts to draw of each design.
    seed
        Seed of the draws, from which all follows.
    client, workers, processes
        As of `sweep`.
    restart
        Move an existing file aside.
    report_progress
        Called with the numbers of parts evaluated and, at most, to be evaluated.

    Returns
    -------
    Robustness

    Raises
    ------
    RequestError
        If a name, a tolerance or a number is invalid.
    ResultsError
        If a design is not in the file, or the file at `path` has anything but this analysis.
    ClusterError
        If the cluster is lost or runs other versions of the packages.
    """
    plan = plan_tolerances(results_of(results).declared, tolerances, designs, draws=draws, seed=seed)
    target = check_target(plan, path, restart=restart)
    cluster = find_workers(plan.run.request.request, client, workers, processes=processes)
    if client is None:
        compile_kernels(plan.run.request.exact.request)
    robustness = plan.robustness(plan.run.compute(cluster, report_progress))
    if target is not None:
        plan.write(robustness, target, restart=restart)
    return robustness


def check_target(plan: TolerancePlan, path: Path | str | None, *, restart: bool) -> Path | None:
    """The results file, refused before anything is computed where it has something else than this analysis."""
    if path is None:
        return None
    target = Path(path)
    if real_path(target) == real_path(plan.source.path):
        raise RequestError(f"{target} holds the designs; name another file with `path`")
    if target.exists() and not restart and not is_continued(target, plan.source, plan.attributes):
        raise ResultsError(f"{target} exists; name another file with `path` or move it aside with `restart=True`")
    return target


def plan_tolerances(
    source: Results,
    tolerances: Mapping[str, object] | None,
    designs: Sequence[int] | int | None,
    *,
    draws: int,
    seed: int,
) -> TolerancePlan:
    """Read the tolerances and the designs; see `tolerance`."""
    check_count("draws", draws, 2)
    check_count("seed", seed, 0)
    if not isinstance(tolerances, Mapping | None):
        raise RequestError(f'tolerances: must be a dict such as {{"crank": 0.1}}, got {format_value(tolerances)}')
    request = request_of(source)
    study: Mapping[str, object] = source.sections.get("tolerances", {})
    chosen = make_tolerances(request.mechanism, {**study, **(tolerances or {})})
    frame = chosen_designs(source, designs)
    objectives = tuple(parse_objective(text, source.senses, rankable_names(source)) for text in source.own_objectives)
    names = [column.name for column in source.columns if column.role == "parameter"]
    defaults = {t.parameter: request.mechanism.parameter(t.parameter).default for t in chosen}
    given = [
        {name: float(value) for name, value in defaults.items() if value is not None}
        | {name: float(row[name]) for name in names}
        for row in frame.to_dict(orient="records")
    ]
    toleranced = TolerancedRequest.of(request, objectives, chosen)
    plan = TolerancePlan(source, frame, objectives, ToleranceRun(toleranced, tuple(given), draws, seed))
    for name in sorted({column.name for column in plan.added}.intersection([*names, *toleranced.metrics])):
        raise RequestError(f"{name}: the analysis adds a column of this name; rename it in the study")
    return plan
