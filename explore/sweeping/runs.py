"""A run of a study, from what is pending to a summary of what was done."""

from __future__ import annotations

import os
import platform
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from explore.design_space import BLOCK_SIZE
from explore.errors import ClusterError
from explore.study import Study
from explore.sweeping.blocks import Block, evaluate_block, facts
from explore.sweeping.clusters import check_facts
from explore.sweeping.keeping import KeepAll, KeepFront
from explore.sweeping.log import Listener, Log
from explore.sweeping.window import Window

if TYPE_CHECKING:
    from distributed import Client, Future

Keep = Literal["all", "front"]


@dataclass(frozen=True)
class Progress:
    """How far a sweep is: counts of designs, of which `resumed` were there at the start."""

    done: int
    total: int
    resumed: int
    feasible: int
    computed: int


@dataclass
class Summary:
    """What a sweep did. `failed` has the reason for each block that was left out."""

    path: Path
    designs: int
    resumed: int = 0
    computed: int = 0
    feasible: int = 0
    kinematic_evaluations: int = 0
    seconds: float = 0.0
    failed: dict[int, str] = field(default_factory=dict)

    @property
    def progress(self) -> Progress:
        """How far it is."""
        done = self.resumed + self.computed
        return Progress(done, self.designs, self.resumed, self.feasible, self.computed)


def run_study(
    study: Study,
    path: Path | str,
    cluster: AbstractContextManager[Client],
    *,
    keep: Keep = "all",
    max_failures: int | None = None,
    restart: bool = False,
    progress: Callable[[Progress], None] | None = None,
    listener: Listener | None = None,
) -> Summary:
    """Run a study into a results file and say what was done; `explore.sweep` describes the arguments.

    Parameters
    ----------
    cluster
        Gives the client; entered only when there is something to compute.
    listener
        Told of every event that goes to the log.
    """
    begun = time.monotonic()
    path = Path(path)
    with (KeepFront if keep == "front" else KeepAll)(study, path, restart=restart) as keeping:
        summary = Summary(path, study.space.count, resumed=keeping.designs)
        if keeping.n_pending:
            run = _Run(study, keeping, summary, Log(path, listener), max_failures, progress)
            with run.logged(), cluster as client:
                run.compute(client)
        if not summary.failed:
            keeping.finish()
    summary.seconds = time.monotonic() - begun
    return summary


class _Run:
    """The blocks of one run: from the window to what is kept, counted and logged."""

    def __init__(
        self,
        study: Study,
        keeping: KeepAll | KeepFront,
        summary: Summary,
        log: Log,
        max_failures: int | None,
        progress: Callable[[Progress], None] | None,
    ) -> None:
        self._study, self._keeping, self._summary, self._log = study, keeping, summary, log
        self._max_failures, self._progress = max_failures, progress
        self._processors: set[str] = set()

    def compute(self, client: Client) -> None:
        """Compute all that is pending."""

        def submit(number: int) -> Future:
            study, objectives = self._study, self._keeping.objectives
            space = study.space.for_block(number)
            future: Future = client.submit(
                evaluate_block, study.request, space, number, objectives, pure=False, retries=0
            )
            return future

        Window(client, submit, self._accept, self._reject, self._log).run(self._keeping.pending)
        # What was committed decides what is done, not the count of what came back.
        lost = set(self._keeping.pending) - set(self._summary.failed)
        if lost:
            raise ClusterError(f"blocks {sorted(lost)[:5]} never came back from the workers; run the sweep again")

    def _accept(self, number: int, block: Block) -> None:
        check_facts(block.facts, f"that computed block {number}")
        self._note_processor(block.facts["processor"])
        self._keeping.commit(block)
        summary = self._summary
        summary.computed += block.designs
        summary.feasible += block.feasible
        summary.kinematic_evaluations += block.kinematic_evaluations
        if self._progress is not None:
            self._progress(summary.progress)

    def _note_processor(self, processor: str) -> None:
        """Workers on several types of processors agree to the tolerance, not to the last bit: the log says so."""
        if processor not in self._processors:
            self._processors.add(processor)
            if len(self._processors) > 1:
                self._log("processors", types=sorted(self._processors))

    def _reject(self, number: int, problem: str) -> None:
        self._summary.failed[number] = problem
        self._log("failure", block=number, problem=problem, **self._described(number))
        failures = len(self._summary.failed)
        if self._max_failures is not None and failures > self._max_failures:
            raise ClusterError(
                f"stopped after {failures} failed block{'s' * (failures > 1)}; "
                "the others are safe, and the same command goes on"
            )

    def _described(self, number: int) -> dict[str, Any]:
        """Which designs a block holds: their numbers, and the range of each swept parameter."""
        space = self._study.space
        ranges = {}
        with suppress(Exception):  # it may be the designs themselves that fail
            columns = space.block(number).columns
            ranges = {name: [float(np.min(columns[name])), float(np.max(columns[name]))] for name in space.swept}
        first = number * BLOCK_SIZE
        return {"designs": [first, min(first + BLOCK_SIZE, space.count) - 1], "parameters": ranges}

    @contextmanager
    def logged(self) -> Iterator[None]:
        """Log the start and, however it ends, the stop."""
        summary = self._summary
        self._log(
            "start",
            host=platform.node(),
            process=os.getpid(),
            study=self._keeping.sha256,
            designs=summary.designs,
            resumed=summary.resumed,
            pending_blocks=self._keeping.n_pending,
            damaged_blocks=self._keeping.n_damaged,
            **facts(),
        )
        begun = time.monotonic()
        outcome = "failed"
        try:
            yield
            outcome = "incomplete" if summary.failed else "finished"
        except KeyboardInterrupt:
            outcome = "interrupted"
            raise
        except Exception as problem:
            outcome = f"failed: {problem}"
            raise
        finally:
            seconds = round(time.monotonic() - begun, 3)
            self._log("stop", outcome=outcome, computed=summary.computed, failed=len(summary.failed), seconds=seconds)
