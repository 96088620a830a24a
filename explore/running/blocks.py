"""The task of a worker: evaluate one block of designs; and the software it computes with."""

import sys
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache

import numpy as np

from explore._version import __version__
from explore.evaluation.evaluate import Evaluation, evaluate_columns
from explore.mechanisms.linkages.table import LinkageTable
from explore.mechanisms.registry import MECHANISMS, mechanism_by_name
from explore.model.columns import Arrays
from explore.model.request import Objective, Request
from explore.model.status import Status
from explore.results.ranking.pareto import find_front
from explore.results.ranking.tallies import Tally
from explore.studies.designs.solved_lengths import SolvedSpace
from explore.studies.designs.spaces import BLOCK_SIZE, DesignSpace

#: Entries of `environment_of` that must be equal on all workers and the client, because values depend on them.
VERSIONS_THAT_MUST_AGREE = ("explore", "kernel", "numpy", "numba", "scipy")


@dataclass(frozen=True)
class BlockResult:
    """The result of one block, with numbers of its designs and of the feasible ones, and the worker's environment.

    `arrays` are the columns of all its designs; or, with objectives, of its own Pareto set, with the column "design".
    `counts` are the numbers of designs by status label and `tally` says why designs are not in the Pareto set, both
    empty when all designs are kept.
    """

    number: int
    arrays: Arrays
    n_designs: int
    n_feasible: int
    kinematic_evaluations: int
    environment: Mapping[str, str]
    counts: Mapping[str, int] = field(default_factory=dict)
    tally: Tally = field(default_factory=Tally)


def evaluate_block(
    request: Request,
    space: DesignSpace,
    number: int,
    objectives: Sequence[Objective] = (),
    evaluate: Callable[[Request, Arrays], Evaluation] = evaluate_columns,
) -> BlockResult:
    """Evaluate one block of a design space; with objectives, reduce it to its Pareto set.

    Called on threads, and submitted to clusters, by `explore.running.runs._Run.compute`.
    """
    evaluation = evaluate(request, space.block(number).columns)
    arrays = evaluation.columns
    status = arrays["status"]
    if isinstance(space, SolvedSpace):
        status[space.unreachable(arrays)] = Status.UNREACHABLE
    n_feasible = int(np.count_nonzero(arrays["feasible"]))
    counts, tally = {}, Tally()
    if objectives:
        labels = request.mechanism.status_labels
        counts = {labels.get(code, f"status {code}"): int(n) for code, n in enumerate(np.bincount(status)) if n}
        tally = Tally(tuple(f"{constraint.metric.name}_margin" for constraint in request.constraints), labels)
        rows = find_front([arrays], objectives, tally)
        arrays = {"design": rows + number * BLOCK_SIZE} | {name: values[rows] for name, values in arrays.items()}
    environment = environment_of(request.mechanism.name)
    return BlockResult(
        number, arrays, len(status), n_feasible, evaluation.kinematic_evaluations, environment, counts, tally
    )


def environment_there(mechanism: str, table: Hashable) -> dict[str, str]:
    """`environment_of` on a worker, which does not know the name of the mechanism of a table yet."""
    if isinstance(table, LinkageTable):
        MECHANISMS.of_table(table)
    return environment_of(mechanism)


@cache
def environment_of(mechanism: str) -> dict[str, str]:
    """Versions of the mechanism of this name and of all else that computes here, and the type of the processor."""
    import llvmlite.binding
    import numba
    import scipy

    return {
        "explore": __version__,
        "kernel": mechanism_by_name(mechanism).kernel,
        "numpy": np.__version__,
        "numba": numba.__version__,
        "scipy": scipy.__version__,
        "python": ".".join(map(str, sys.version_info[:3])),
        "processor": llvmlite.binding.get_host_cpu_name(),
    }
