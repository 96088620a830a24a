"""What a worker does with one block, and what it says of itself."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache

import numpy as np

from explore._version import __version__
from explore.design_space import BLOCK_SIZE, DesignSpace
from explore.evaluation import evaluate_columns
from explore.mechanisms.registry import MECHANISMS
from explore.ranking.pareto import front
from explore.ranking.tallies import Tally
from explore.solving import SolvedSpace
from explore.vocabulary import Columns, Objective, Request, Status

#: Facts in which all workers must agree with the client, because the values depend on them.
MUST_AGREE = ("explore", "kernels", "numpy", "numba", "scipy")


@dataclass(frozen=True)
class Block:
    """What came of one block.

    Attributes
    ----------
    columns
        Of all its designs, or of its own Pareto set with the column "design".
    counts
        Number of designs by the label of their status; empty when all designs are kept.
    tally
        Why designs were left out of the Pareto set; empty when all designs are kept.
    """

    number: int
    columns: Columns
    designs: int
    feasible: int
    kinematic_evaluations: int
    facts: Mapping[str, str]
    counts: Mapping[str, int] = field(default_factory=dict)
    tally: Tally = field(default_factory=Tally)


def evaluate_block(request: Request, space: DesignSpace, number: int, objectives: Sequence[Objective] = ()) -> Block:
    """Evaluate one block of a design space and keep all of it, or with objectives its Pareto set."""
    evaluation = evaluate_columns(request, space.block(number).columns)
    columns = evaluation.columns
    status = columns["status"]
    if isinstance(space, SolvedSpace):
        status[space.unreachable(columns)] = Status.UNREACHABLE
    feasible = int(np.count_nonzero(columns["feasible"]))
    counts, tally = {}, Tally()
    if objectives:
        counts = {Status.label_of(code): int(n) for code, n in enumerate(np.bincount(status)) if n}
        tally = Tally(tuple(f"{constraint.metric.name}_margin" for constraint in request.constraints))
        rows = front([columns], objectives, tally)
        columns = {"design": rows + number * BLOCK_SIZE} | {name: values[rows] for name, values in columns.items()}
    return Block(number, columns, len(status), feasible, evaluation.kinematic_evaluations, facts(), counts, tally)


@cache
def facts() -> dict[str, str]:
    """What this process computes with: versions, and the type of its processor."""
    import llvmlite.binding
    import numba
    import scipy

    return {
        "explore": __version__,
        "kernels": ", ".join(f"{m.name} {m.kernel_version}" for m in MECHANISMS.values()),
        "numpy": np.__version__,
        "numba": numba.__version__,
        "scipy": scipy.__version__,
        "python": ".".join(map(str, sys.version_info[:3])),
        "processor": llvmlite.binding.get_host_cpu_name(),
    }
