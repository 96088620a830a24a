"""Improve the front of results, or some designs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from explore.analysis.refining.plan import (
    EVALUATIONS,
    coordinates_of,
    plan_refinement,
    require_computed,
    space_of,
    study_of,
)
from explore.analysis.refining.polishing import polish as polish_position
from explore.analysis.refining.runs import run_refinement
from explore.base.errors import RequestError
from explore.evaluation.constraints import margin
from explore.evaluation.evaluate import evaluate_columns
from explore.model.columns import Arrays
from explore.model.progress import ReportProgress
from explore.model.quantities import FloatArray
from explore.model.request import Objective, Request
from explore.results.ranking.objectives import choose_objectives
from explore.results.ranking.pareto import objectives_to_minimise
from explore.results.ranking.rankings import RankRequest, rank_source, rankable_names
from explore.results.ranking.reasons import nothing_ranked
from explore.results.store.open_results import open_results, results_of
from explore.results.store.results import Results
from explore.running.chosen import chosen_designs
from explore.running.workers import find_workers, report_counts

if TYPE_CHECKING:
    import pandas as pd
    from distributed import Client

    from explore.studies.config.study import Study


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

    Where no design is feasible, it starts from those of least total violation and looks for feasible ones first.

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
        If the results have fewer than two objectives or no range to refine, or no design that is feasible or whose
        distance from feasible is known.
    ResultsError
        As of `sweep`, and if the results are not finished.
    ClusterError
        If the cluster is lost, runs other versions of the packages, or a generation failed.
    """
    source = results_of(results).declared
    plan = plan_refinement(source, objectives=objectives, evaluations=evaluations, seed=seed)
    cluster = find_workers(plan.study.request, client, workers, processes=processes)
    run_refinement(plan, source.path, path, cluster, restart=restart, progress=report_counts(report_progress))
    return open_results(path)


def polish(
    results: Results | Path | str,
    designs: Sequence[int] | int | None = None,
    *,
    objective: str | None = None,
) -> pd.DataFrame:
    """Improve designs in one objective as far as the constraints and the ranges of their study allow.

    Parameters
    ----------
    results
        Results, or the path of their file.
    designs
        Numbers of feasible designs; None for the best one in the objective.
    objective
        The metric to improve, such as ``"cv"`` or ``"swing_angle:max"``; None for the first objective of the study.
        Other objectives may become worse.

    Returns
    -------
    DataFrame
        One row for each design, under its number, with the columns of the results; ``attrs["units"]`` has their units.

    Raises
    ------
    RequestError
        If a design is not feasible, the objective is unknown, or the study has no range.

    Notes
    -----
    The searches are local: SciPy's sequential quadratic programming, then a bundle method, with derivatives by central
    differences of exact evaluations. Listed values stay as they are.
    """
    import pandas as pd

    source = results_of(results).declared
    study = study_of(source)
    one, _ = choose_objectives(objective, None, source.senses, rankable_names(source), source.objectives[:1])
    require_computed(study, one, source)
    if designs is None:
        ranking = rank_source(source, RankRequest([f"{one[0].metric}:{one[0].sense}"]))
        if ranking.frame.empty:
            raise RequestError(f"{nothing_ranked(ranking, source.path)}, so there is none to polish")
        designs = [int(ranking.frame.index[0])]
    frame = chosen_designs(source, designs)
    for number in frame.index[frame["feasible"] == 0]:
        raise RequestError(f"design {number} is not feasible; choose one that is")
    rows = [_polished(study, frame.iloc[[row]], one[0]) for row in range(len(frame))]
    polished = pd.concat(rows).set_index(frame.index)
    polished.attrs["units"] = {name: unit for name, unit in source.units.items() if name in polished}
    return polished


def _polished(study: Study, row: pd.DataFrame, objective: Objective) -> pd.DataFrame:
    """One design, polished."""
    import pandas as pd

    coordinates, request = coordinates_of(study), study.request
    columns = {str(name): row[name].to_numpy() for name in row}
    choices = coordinates.choices(columns)
    needed = {objective.metric, *(constraint.metric.name for constraint in request.constraints)}

    def evaluate(request: Request, positions: FloatArray) -> Arrays:
        parameters = coordinates.columns(positions, np.repeat(choices, len(positions), axis=0))
        return evaluate_columns(request, space_of(study, parameters).designs(0, len(positions))).columns

    def values_at(free: Request, positions: FloatArray) -> tuple[FloatArray, FloatArray]:
        found = evaluate(free, positions)
        margins = [margin(constraint, found[constraint.metric.name]) for constraint in request.constraints]
        found |= {f"{each.metric.name}_margin": own for each, own in zip(request.constraints, margins, strict=True)}
        # Not even the best value of a design that misses the tolerance counts: such a design is not feasible.
        values = np.where(found["feasible"], objectives_to_minimise(found, [objective])[:, 0], np.nan)
        return values, np.array(margins).reshape(len(margins), len(positions)).T

    # The other metrics count only where they miss the tolerance, which few designs do.
    few = tuple(metric for metric in request.all_metrics if metric.name in needed)
    for metrics in dict.fromkeys((few or request.all_metrics, request.all_metrics)):
        # Without constraints, because a design that breaks one is not sampled.
        free = replace(request, metrics=metrics, constraints=())
        position = polish_position(partial(values_at, free), coordinates.positions(columns)[0])
        polished = evaluate(request, position[None])
        if polished["feasible"][0]:
            return pd.DataFrame(polished)
    return row[list(polished)]
