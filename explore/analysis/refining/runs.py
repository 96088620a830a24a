"""Run a refinement: draw generation after generation, evaluate each on threads or a cluster, and commit it whole.

A generation is a block of the file and follows from those before it and the seed, so that a run that was killed goes
on from the file alone: it reads the generations that are there and draws the others again.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from explore.analysis.refining.generations import PARENT, Draw, Generations
from explore.analysis.refining.plan import RefinementPlan, space_of
from explore.base.errors import ClusterError, RequestError
from explore.base.files import real_path
from explore.model.columns import Arrays, join_columns
from explore.results.store.all_designs_writer import AllDesignsWriter
from explore.results.store.open_results import open_results
from explore.running.blocks import BlockResult, evaluate_block
from explore.running.log import Listener, Log
from explore.running.runs import Environments, Progress, Summary, logged
from explore.running.tasks import run_tasks
from explore.running.threads import LocalThreads

if TYPE_CHECKING:
    from distributed import Client

    from explore.studies.designs.spaces import DesignSpace

#: Number of designs that one worker computes at a time; no result depends on it.
PART_SIZE = 2048


def run_refinement(
    plan: RefinementPlan,
    source: Path,
    path: Path | str,
    cluster: AbstractContextManager[Client | LocalThreads],
    *,
    restart: bool = False,
    progress: Callable[[Progress], None] | None = None,
    listener: Listener | None = None,
) -> Summary:
    """Run a refinement into a results file and return a summary; see `explore.refine` for the other arguments.

    `source` is the file of the results that are refined; `cluster`, entered only if generations are pending, yields
    threads or a cluster's client; `listener` is told every event that is logged.
    """
    start = time.monotonic()
    path = Path(path)
    if real_path(path) == real_path(source):
        raise RequestError(f"{path} holds the results to refine; name another file with `path`")
    log = Log(path, listener)  # raises if the log's name is taken, before any file is created
    attributes = plan.attributes
    with AllDesignsWriter(path, plan.columns, plan.n_designs, plan.size, attributes, restart=restart) as writer:
        summary = Summary(path, plan.n_designs, n_resumed=writer.n_committed)
        if writer.n_pending:
            facts = {"pending_blocks": writer.n_pending, "damaged_blocks": len(writer.damaged)}
            mechanism = plan.study.request.mechanism.name
            run = _Run(plan, writer, summary, log, progress)
            with logged(log, summary, mechanism, study=attributes["request_sha256"], **facts), cluster as workers:
                run.compute(workers)
    summary.seconds = time.monotonic() - start
    return summary


class _Run:
    """One run: draws, evaluates and commits the pending generations."""

    def __init__(
        self,
        plan: RefinementPlan,
        writer: AllDesignsWriter,
        summary: Summary,
        log: Log,
        progress: Callable[[Progress], None] | None,
    ) -> None:
        self._plan, self._writer, self._summary, self._log, self._progress = plan, writer, summary, log, progress
        self._environments = Environments(plan.study.request.mechanism.name, log)
        self._parts: dict[int, DesignSpace] = {}
        self._results: dict[int, Arrays] = {}

    def compute(self, workers: Client | LocalThreads) -> None:
        """Compute the pending generations in order, and read the others."""
        generations, pending = self._plan.generations(), set(self._writer.pending)
        committed = self._committed(generations)
        while generations.number < generations.count:
            number = generations.number
            if number not in pending:
                generations.include(next(committed))
                continue
            draw = generations.draw()
            columns = self._evaluate(draw, number, workers)
            self._writer.commit(number, columns)
            generations.include(columns)
            if self._progress is not None:
                self._progress(self._summary.progress)

    def _committed(self, generations: Generations) -> Iterator[Arrays]:
        """The columns of each committed generation that the next ones are drawn from."""
        yield from open_results(self._writer.path).blocks(generations.needed_columns)

    def _evaluate(self, draw: Draw, number: int, workers: Client | LocalThreads) -> Arrays:
        """Evaluate the parts of a generation and join their columns."""
        n = len(draw.parents)
        first = number * -(-self._plan.size // PART_SIZE)  # the number of a part is its own in the whole run
        numbers = range(first, first - (-n // PART_SIZE))
        for part, begin in zip(numbers, range(0, n, PART_SIZE), strict=True):
            rows = slice(begin, begin + PART_SIZE)
            columns = {name: values[rows] for name, values in draw.columns.items()}
            self._parts[part] = space_of(self._plan.study, columns)
        note = self._note_on_threads if isinstance(workers, LocalThreads) else self._log
        run_tasks(workers, evaluate_block, self._arguments, numbers, self._accept, _reject, note)
        missing = [part for part in numbers if part not in self._results]
        if missing:
            raise ClusterError(f"{len(missing)} parts of generation {number} never came back; run the refinement again")
        results = [self._results.pop(part) for part in numbers]
        self._parts.clear()
        return join_columns(results) | {PARENT: draw.parents}

    def _arguments(self, part: int) -> tuple[Any, ...]:
        return self._plan.study.request, self._parts[part], 0

    def _note_on_threads(self, event: str, **facts: object) -> None:
        """Log an event, but not that threads started: they do for each generation."""
        if event != "workers":
            self._log(event, **facts)

    def _accept(self, part: int, block: BlockResult) -> None:
        self._environments.check(block.environment, f"that computed part {part}")
        self._summary.count(block)
        self._results[part] = block.arrays


def _reject(part: int, problem: str) -> None:
    raise ClusterError(
        f"part {part} failed: {problem}; finished generations are safe; run the refinement again to go on"
    )
