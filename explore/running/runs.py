"""Run a study: compute the pending blocks on threads or a cluster, collect them, log, and return a summary."""

from __future__ import annotations

import os
import platform
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from explore.base.errors import ClusterError
from explore.running.blocks import BlockResult, environment_of, evaluate_block
from explore.running.clusters import check_environment
from explore.running.collectors import AllDesignsCollector, FrontCollector
from explore.running.log import Listener, Log
from explore.running.slices import evaluate_on_threads
from explore.running.tasks import run_tasks
from explore.running.threads import LocalThreads, threads_of_block
from explore.studies.config.study import Study
from explore.studies.designs.spaces import BLOCK_SIZE

if TYPE_CHECKING:
    from distributed import Client

Keep = Literal["all", "front"]


@dataclass(frozen=True)
class Progress:
    """Progress of a sweep, in designs.

    `n_done` are committed: `n_resumed` by earlier runs, `n_computed` by this one, with `n_feasible` feasible ones.
    """

    n_done: int
    n_designs: int
    n_resumed: int
    n_computed: int
    n_feasible: int


@dataclass
class Summary:
    """Outcome of a run, in designs as in `Progress`; `failures` maps each failed block to its reason."""

    path: Path
    n_designs: int
    n_resumed: int = 0
    n_computed: int = 0
    n_feasible: int = 0
    kinematic_evaluations: int = 0
    seconds: float = 0.0
    failures: dict[int, str] = field(default_factory=dict)

    def count(self, block: BlockResult) -> None:
        """Count the designs of a block that this run computed."""
        self.n_computed += block.n_designs
        self.n_feasible += block.n_feasible
        self.kinematic_evaluations += block.kinematic_evaluations

    @property
    def progress(self) -> Progress:
        """Progress so far."""
        n_done = self.n_resumed + self.n_computed
        return Progress(n_done, self.n_designs, self.n_resumed, self.n_computed, self.n_feasible)


def run_study(
    study: Study,
    path: Path | str,
    cluster: AbstractContextManager[Client | LocalThreads],
    *,
    keep: Keep = "all",
    max_failures: int | None = None,
    restart: bool = False,
    progress: Callable[[Progress], None] | None = None,
    listener: Listener | None = None,
) -> Summary:
    """Run a study into a results file and return a summary; see `explore.sweep` for the other arguments.

    `cluster` yields threads or a cluster's client, and is entered only if blocks are pending; `listener` is called with
    every event that is logged.
    """
    start = time.monotonic()
    path = Path(path)
    log = Log(path, listener)  # raises if the log's name is taken, before any file is created
    with (FrontCollector if keep == "front" else AllDesignsCollector)(study, path, restart=restart) as collector:
        summary = Summary(path, study.space.n_designs, n_resumed=collector.n_committed)
        if collector.n_pending:
            run = _Run(study, collector, summary, log, max_failures, progress)
            facts = {"pending_blocks": collector.n_pending, "damaged_blocks": collector.n_damaged}
            mechanism = study.request.mechanism.name
            with logged(log, summary, mechanism, study=collector.sha256, **facts), cluster as workers:
                run.compute(workers)
        if not summary.failures:
            collector.finish()
    summary.seconds = time.monotonic() - start
    return summary


class _Run:
    """One run: passes results to the collector, counts and logs them."""

    def __init__(
        self,
        study: Study,
        collector: AllDesignsCollector | FrontCollector,
        summary: Summary,
        log: Log,
        max_failures: int | None,
        progress: Callable[[Progress], None] | None,
    ) -> None:
        self._study, self._collector, self._summary, self._log = study, collector, summary, log
        self._max_failures, self._progress = max_failures, progress
        self._environments = Environments(study.request.mechanism.name, log)

    def compute(self, workers: Client | LocalThreads) -> None:
        """Compute the pending blocks."""
        study, objectives = self._study, self._collector.objectives
        evaluate = partial(evaluate_on_threads, threads=threads_of_block(workers, self._collector.n_pending))

        def arguments(number: int) -> tuple[Any, ...]:
            if isinstance(workers, LocalThreads):
                return study.request, study.space, number, objectives, evaluate
            return study.request, study.space.space_for_block(number), number, objectives

        run_tasks(workers, evaluate_block, arguments, self._collector.pending, self._accept, self._reject, self._log)
        # The commits in the file decide which blocks are done, not the number of results received.
        missing = set(self._collector.pending) - set(self._summary.failures)
        if missing:
            raise ClusterError(f"blocks {sorted(missing)[:5]} never came back from the workers; run the sweep again")

    def _accept(self, number: int, block: BlockResult) -> None:
        self._environments.check(block.environment, f"that computed block {number}")
        self._collector.add(block)
        summary = self._summary
        summary.count(block)
        if self._progress is not None:
            self._progress(summary.progress)

    def _reject(self, number: int, problem: str) -> None:
        self._summary.failures[number] = problem
        self._log("failure", block=number, problem=problem, **self._describe(number))
        failures = len(self._summary.failures)
        if self._max_failures is not None and failures > self._max_failures:
            raise ClusterError(
                f"stopped after {failures} failed block{'s' * (failures > 1)}; "
                "the others are safe; run the sweep again to go on"
            )

    def _describe(self, number: int) -> dict[str, Any]:
        """First and last design number of a block, and the range of each swept parameter."""
        space = self._study.space
        ranges = {}
        with suppress(Exception):  # the failure may come from making the designs
            columns = space.block(number).columns
            ranges = {
                name: [float(np.min(columns[name])), float(np.max(columns[name]))] for name in space.swept_parameters
            }
        first = number * BLOCK_SIZE
        return {"designs": [first, min(first + BLOCK_SIZE, space.n_designs) - 1], "parameters": ranges}


class Environments:
    """Checks the environments of the workers that computed blocks."""

    def __init__(self, mechanism: str, log: Log) -> None:
        self._mechanism, self._log = mechanism, log
        self._processors: set[str] = set()

    def check(self, environment: Mapping[str, str], worker: str) -> None:
        """Refuse other versions, and log when processors differ: these agree within the tolerance, not to the bit."""
        check_environment(environment, worker, self._mechanism)
        if environment["processor"] not in self._processors:
            self._processors.add(environment["processor"])
            if len(self._processors) > 1:
                self._log("processors", types=sorted(self._processors))


@contextmanager
def logged(log: Log, summary: Summary, mechanism: str, **facts: Any) -> Iterator[None]:
    """Log the start of a run, with more facts about it, and its stop with the outcome."""
    log(
        "start",
        host=platform.node(),
        process=os.getpid(),
        designs=summary.n_designs,
        resumed=summary.n_resumed,
        **facts,
        **environment_of(mechanism),
    )
    start = time.monotonic()
    outcome = "failed"
    try:
        yield
        outcome = "incomplete" if summary.failures else "finished"
    except KeyboardInterrupt:
        outcome = "interrupted"
        raise
    except Exception as problem:
        outcome = f"failed: {problem}"
        raise
    finally:
        seconds = round(time.monotonic() - start, 3)
        log("stop", outcome=outcome, computed=summary.n_computed, failed=len(summary.failures), seconds=seconds)
