"""The plan of a refinement: the front to start from, how many designs to draw around it, and what determines them."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from explore.analysis.refining.coordinates import Coordinates
from explore.analysis.refining.generations import MOST_NEAREST, NO_PARENT, PARENT, Generations
from explore.base.counts import check_count
from explore.base.errors import RequestError, ResultsError
from explore.model.columns import Arrays, Attribute, Column
from explore.model.request import Objective
from explore.results.ranking.nearest import find_nearest
from explore.results.ranking.pareto import objectives_to_minimise
from explore.results.ranking.quality import REFERENCE_OFFSET
from explore.results.ranking.rankings import Ranking, RankRequest, rank_source
from explore.results.store.results import Results
from explore.running.collectors import digest_of, identity_attributes, results_columns, study_attributes
from explore.studies.config.study import Study
from explore.studies.config.study_file import parse_study
from explore.studies.designs.solved_lengths import SolvedSpace
from explore.studies.designs.spaces import Axis, DesignSpace, Table, TableAxis

if TYPE_CHECKING:
    import pandas as pd

#: Number of designs of a refinement without a choice of the user.
EVALUATIONS = 262_144
#: Smallest number of designs of a generation.
_SMALLEST = 256
#: Largest number of designs of a generation.
_LARGEST = 8192
#: Number of generations, where that makes generations of neither too few nor too many designs.
_GENERATIONS = 16
#: Version of how generations are drawn, raised by every change, so that no file is continued in two ways.
_VERSION = 1


@dataclass(frozen=True)
class RefinementPlan:
    """What determines the results of a refinement.

    `start` has all columns of the front to refine, in the order of the design numbers, which count among `n_designs`;
    `scales`, where no design of it is feasible, the violation of each constraint that counts as 1.
    """

    study: Study
    objectives: tuple[Objective, ...]
    start: Arrays
    n_designs: int
    seed: int
    scales: tuple[float, ...] = ()

    @property
    def has_front(self) -> bool:
        """Whether the start is a front; else it is the designs of least violation."""
        return not self.scales

    @property
    def size(self) -> int:
        """Number of designs of each generation, which is a block of the file: a power of two."""
        size = 1 << max(self.n_designs // _GENERATIONS, 1).bit_length() - 1
        return min(max(size, _SMALLEST), _LARGEST)

    def generations(self) -> Generations:
        """The generations, the first one next."""
        return Generations(
            coordinates_of(self.study),
            self.objectives,
            self.margins,
            self.start,
            self.scales,
            n_designs=self.n_designs,
            size=self.size,
            seed=self.seed,
        )

    @property
    def margins(self) -> list[str]:
        """Names of the columns with the margins of the constraints."""
        return [f"{constraint.metric.name}_margin" for constraint in self.study.request.constraints]

    @property
    def columns(self) -> tuple[Column, ...]:
        """The columns of the results file: those of a sweep, and the parent."""
        text = f"design that it was drawn from, {NO_PARENT} for those of the front that was refined"
        return (*results_columns(self.study), Column(PARENT, "", text, "bookkeeping", "<i8"))

    @property
    def attributes(self) -> dict[str, Attribute]:
        """Attributes of the results file; none of them differs between two runs."""
        objectives = [f"{objective.metric}:{objective.sense}" for objective in self.objectives]
        content = json.loads(self.study.identity) | {
            "objectives": objectives,
            "block_size": self.size,
            "sampling": {
                "method": "refinement",
                "version": _VERSION,
                "seed": self.seed,
                "start": len(self.start["design"]),
                "sha256": digest_of(self.start),
            },
        }
        return (
            study_attributes(self.study)
            | identity_attributes(content)
            | {
                "sampler": "refinement",
                "seed": self.seed,
                "objectives": json.dumps(objectives),
            }
        )


def plan_refinement(
    results: Results,
    *,
    objectives: Sequence[str] | None = None,
    evaluations: int = EVALUATIONS,
    seed: int = 0,
) -> RefinementPlan:
    """Plan the refinement of the front of results; see `explore.refine`."""
    if not results.is_complete:
        raise ResultsError(
            f"{results.path} is not finished: {results.n_committed:,} of {results.n_designs:,} designs; "
            "run the sweep or refinement again to go on, then refine"
        )
    check_count("seed", seed, 0)
    check_count("evaluations", evaluations, 0)
    study = study_of(results)
    ranking = rank_source(results, RankRequest(objectives))
    require_computed(study, ranking.objectives, results)
    if len(ranking.objectives) < 2:
        name = ranking.objectives[0].metric
        raise RequestError(
            f"{name} alone has one best design, not a front; name two or more `objectives`, "
            "or improve that design by `explore polish`"
        )
    scales: tuple[float, ...] = ()
    frame = ranking.frame
    if frame.empty:
        constrained = [constraint.metric.name for constraint in study.request.constraints]
        frame, scales = _nearest_designs(results, ranking, constrained)
    n_start = len(frame)
    if evaluations <= n_start:
        raise RequestError(
            f"evaluations = {evaluations:,}: the refinement begins with {n_start:,} "
            f"design{'s' * (n_start > 1)}; evaluate more than these"
        )
    start = _start_columns(results, study, frame.sort_index().reset_index())
    return RefinementPlan(study, ranking.objectives, start, evaluations, seed, scales)


def _start_columns(results: Results, study: Study, frame: pd.DataFrame) -> Arrays:
    """The columns of the designs that a refinement starts from, with finite coordinates."""
    names = [column.name for column in results_columns(study)]
    start = {name: np.ascontiguousarray(frame[name].to_numpy()) for name in names if name in frame}
    for name in coordinates_of(study).names:
        if name in start and not np.isfinite(start[name]).all():
            raise ResultsError(
                f"{results.path} has a design whose {name} is not finite; "
                f"it is damaged: run `explore verify {results.path}`"
            )
    return start


def study_of(results: Results) -> Study:
    """The study of results, whose designs a search can move within its ranges."""
    if results.attributes.get("sampler") == "table":
        raise RequestError(
            f"{results.path} has the designs of a table, which has no ranges to move in; sweep ranges or lists"
        )
    study = parse_study(results.config, str(results.path), results.path.parent, results.target)
    if not coordinates_of(study).ranges:
        raise RequestError(
            f"{results.path} has only listed values, with nothing between them; "
            "give a parameter of the study a range and sweep it"
        )
    return study


def require_computed(study: Study, objectives: Sequence[Objective], results: Results) -> None:
    """Refuse objectives that the study does not compute, because new designs would not have them."""
    columns = {column.name for column in results_columns(study)}
    missing = [objective.metric for objective in objectives if objective.metric not in columns]
    if missing:
        is_synthesis = results.attributes.get("sampler") == "synthesis"
        source = "the solver of the task" if is_synthesis else f"the command that wrote {results.path}"
        own = " and ".join(f"{objective.metric}:{objective.sense}" for objective in study.objectives)
        raise RequestError(
            f"only {source} computes {' and '.join(missing)}, not the study, which new designs follow; "
            f"name other `objectives`, such as {own or 'cv:min'}"
        )


def coordinates_of(study: Study) -> Coordinates:
    """The coordinates of the parameters that are given, not solved for."""
    base = study.space.base if isinstance(study.space, SolvedSpace) else study.space
    axes = [axis for axis in base.axes if isinstance(axis, Axis)]
    return Coordinates.over(axes, [p.name for p in study.request.mechanism.parameters if p.choices])


def space_of(study: Study, parameters: Arrays) -> DesignSpace:
    """The designs with these parameters, and the solved length of the study if it has one."""
    axes = tuple(TableAxis(name, values) for name, values in parameters.items())
    table = Table(axes, len(axes[0].values))
    space = study.space
    return SolvedSpace.over(table, space.solved_length) if isinstance(space, SolvedSpace) else table


def count_distinct(columns: Mapping[str, object], objectives: Sequence[Objective]) -> int:
    """Number of designs with different objectives."""
    return len(np.unique([np.asarray(columns[objective.metric]) for objective in objectives], axis=1).T)


def growth(plan: RefinementPlan, ranking: Ranking) -> float | None:
    """By which share the hypervolume of the front grew, up to the ranking of the refined results.

    The reference point is a tenth of each objective's range on the front at the start beyond its worst value there.
    None in more than three objectives, where it takes long, and where no design of the start is feasible.
    """
    import moocore

    if len(plan.objectives) > 3 or not plan.has_front:
        return None
    frame = {objective.metric: ranking.frame[objective.metric].to_numpy() for objective in plan.objectives}
    before, after = (objectives_to_minimise(columns, plan.objectives) for columns in (plan.start, frame))
    worst, best = before.max(axis=0), before.min(axis=0)
    reference = worst + REFERENCE_OFFSET * (worst - best)
    start, end = (float(moocore.hypervolume(np.ascontiguousarray(values), ref=reference)) for values in (before, after))
    return end / start - 1.0 if start > 0.0 else None


def _nearest_designs(
    results: Results, ranking: Ranking, constrained: Sequence[str]
) -> tuple[pd.DataFrame, tuple[float, ...]]:
    """The designs of least violation where none is feasible, and the violations of these metrics that count as 1."""
    if ranking.tally.n_not_finite:
        raise RequestError(
            f"the objectives of the feasible designs of {results.path} are undefined; name other `objectives`"
        )
    if results.keep == "front" or not results.constraints:
        raise RequestError(f"no design of {results.path} is feasible, so there is none to refine; sweep other ranges")
    nearness = find_nearest(results, MOST_NEAREST)
    if nearness.frame.empty:
        raise RequestError(
            f"no design of {results.path} is feasible or so computed that its distance is known; sweep other ranges"
        )
    return nearness.frame, tuple(nearness.scales[metric] for metric in constrained)
