"""Sobol' indices of the feasibility of a study: its designs drawn in parts, evaluated on threads or a cluster."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from explore.analysis.refining.plan import space_of
from explore.analysis.sensitivity.paired_points import Estimate, PairedPoints
from explore.base.errors import ClusterError, RequestError
from explore.model.quantities import FloatArray
from explore.running.blocks import evaluate_block
from explore.running.clusters import check_environment
from explore.running.runs import Progress
from explore.running.tasks import run_tasks
from explore.running.threads import LocalThreads
from explore.studies.config.study import Study
from explore.studies.designs.solved_lengths import SolvedSpace
from explore.studies.designs.spaces import Axis, DesignSpace, values_at_fractions

if TYPE_CHECKING:
    from distributed import Client

#: Least number of designs that are drawn where the user does not choose it: more than a study of slow designs has.
_FEWEST = 2**16
#: Largest number of designs that are drawn where the user does not choose it.
_MOST = 2**20


@dataclass(frozen=True)
class FeasibilityPlan:
    """The designs whose feasibility is apportioned to the parameters that vary."""

    study: Study
    parameters: tuple[str, ...]
    points: PairedPoints

    def space(self, number: int) -> DesignSpace:
        """The designs of a part, drawn from the ranges and the listed values of the study."""
        columns = values_at_fractions(_axes(self.study.space), self.points.part(number))
        return space_of(self.study, columns)


@dataclass(frozen=True)
class FeasibilityIndices:
    """The indices of each parameter, and how many designs they were computed from."""

    first_order: Estimate
    total: Estimate
    n_designs: int
    n_feasible: int


def plan_feasibility(study: Study, evaluations: int | None, seed: int) -> FeasibilityPlan:
    """Plan the indices of a study; `RequestError` where its parameters are not drawn independently."""
    axes = _axes(study.space)
    varying = tuple(axis.name for axis in axes if axis.varies)
    if not varying:
        raise RequestError("no parameter of the study varies, so there is nothing to apportion; give one a range")
    if evaluations is None:
        evaluations = min(max(study.space.n_designs, _FEWEST), _MOST)
    return FeasibilityPlan(study, varying, PairedPoints.within(evaluations, len(varying), seed))


def run_feasibility(
    plan: FeasibilityPlan,
    cluster: AbstractContextManager[Client | LocalThreads],
    progress: Callable[[Progress], None] | None = None,
) -> FeasibilityIndices:
    """Evaluate the designs of a plan and compute the indices; they do not depend on the workers."""
    points, run = plan.points, _Run(plan, progress)
    with cluster as workers:
        numbers = range(points.n_parts)
        run_tasks(workers, _evaluate_part, lambda number: (plan, number), numbers, run.accept, _reject)
    if run.n_done != points.n_evaluations:
        raise ClusterError("some parts never came back from the workers; run the command again")
    return FeasibilityIndices(*points.indices(run.moments), run.n_done, run.n_feasible)


class _Run:
    """Adds up the sums of the parts that were computed."""

    def __init__(self, plan: FeasibilityPlan, progress: Callable[[Progress], None] | None) -> None:
        self._plan, self._progress = plan, progress
        self.moments = np.zeros((plan.points.replicates, plan.points.dimensions, 3, 3))
        self.n_done = self.n_feasible = 0

    def accept(self, number: int, part: _Part) -> None:
        check_environment(part.environment, f"that computed part {number}", self._plan.study.request.mechanism.name)
        points = self._plan.points
        self.moments[points.replicate(number)] += part.moments
        self.n_done += part.n_designs
        self.n_feasible += part.n_feasible
        if self._progress is not None:
            self._progress(Progress(self.n_done, points.n_evaluations, 0, self.n_done, self.n_feasible))


@dataclass(frozen=True)
class _Part:
    """The sums of a part, its numbers of designs, and the environment of the worker."""

    moments: FloatArray
    n_designs: int
    n_feasible: int
    environment: Mapping[str, str]


def _evaluate_part(plan: FeasibilityPlan, number: int) -> _Part:
    """Evaluate the designs of a part: feasible 1, all others 0, whatever became of them."""
    block = evaluate_block(plan.study.request, plan.space(number), 0)
    moments = plan.points.moments(block.arrays["feasible"])
    return _Part(moments, block.n_designs, block.n_feasible, block.environment)


def _axes(space: DesignSpace) -> list[Axis]:
    """The axes of the parameters that are given, not solved for."""
    base = space.base if isinstance(space, SolvedSpace) else space
    axes = [axis for axis in base.axes if isinstance(axis, Axis)]
    if len(axes) < len(base.axes):
        raise RequestError(
            "the designs of a table have no ranges to draw from, so that the feasibility is not apportioned; "
            "sweep the parameters as ranges or lists"
        )
    return axes


def _reject(part: int, problem: str) -> None:
    raise ClusterError(f"part {part} failed: {problem}")
