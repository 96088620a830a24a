"""A run of a study: pending blocks to dask, results to the store as they finish. The client is the only writer."""

from __future__ import annotations

import itertools
import json
import logging
import os
import platform
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from explore._version import __version__
from explore.design_space import BLOCK_SIZE, DesignSpace
from explore.errors import RequestError, ResultsError
from explore.evaluation import Evaluation, evaluate_columns, output_columns, speed_power
from explore.store.writer import Writer
from explore.study import Study
from explore.vocabulary import Column, Request, Status

if TYPE_CHECKING:
    from distributed import Client

#: Blocks under way at a time beyond one for each worker thread: enough to keep them busy while one is committed.
SPARE_BLOCKS = 2
#: How often a block is tried before it is left out.
TRIES = 2


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
    """What a sweep did."""

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


def evaluate_block(request: Request, space: DesignSpace, number: int) -> Evaluation:
    """Evaluate one block of a design space; what a worker runs."""
    return evaluate_columns(request, space.block(number).columns)


def results_columns(study: Study) -> tuple[Column, ...]:
    """The columns of a study's results file."""
    return output_columns(study.request, [axis.name for axis in study.space.axes])


def row_bytes(study: Study) -> int:
    """Bytes of one design in the results file."""
    return sum(np.dtype(column.dtype).itemsize for column in results_columns(study))


def run_study(
    study: Study,
    path: Path | str,
    *,
    client: Client | None = None,
    workers: int | None = None,
    restart: bool = False,
    progress: Callable[[Progress], None] | None = None,
) -> Summary:
    """Run a study into a results file and say what was done; `explore.sweep` describes the arguments."""
    begun = time.monotonic()
    path = Path(path)
    writer = Writer(path, results_columns(study), study.space.count, BLOCK_SIZE, _attributes(study), restart=restart)
    with writer:
        summary = Summary(path, study.space.count, resumed=writer.committed_designs)
        if writer.pending:
            with _cluster(client, workers) as running:
                _run(study, writer, running, summary, progress)
    summary.seconds = time.monotonic() - begun
    return summary


@contextmanager
def _cluster(client: Client | None, workers: int | None) -> Iterator[Client]:
    """The client given, or an in-process cluster of threads: the kernels release the GIL."""
    if client is not None:
        if client.asynchronous:
            raise RequestError("the client is asynchronous; give a synchronous dask.distributed Client")
        yield client
        return
    import dask
    from distributed import Client, LocalCluster

    # The window of blocks bounds the memory, so the worker must not pause on a small machine; and nothing is served
    # over HTTP, where the default port would collide with the next sweep's.
    limits = ("target", "spill", "pause", "terminate")
    settings: dict[str, Any] = {f"distributed.worker.memory.{limit}": False for limit in limits}
    settings |= {"distributed.scheduler.http.routes": [], "distributed.worker.http.routes": []}
    with (
        dask.config.set(settings),
        _quiet("distributed"),
        LocalCluster(
            n_workers=1,
            threads_per_worker=workers or _processors(),
            processes=False,
            dashboard_address="127.0.0.1:0",
            scheduler_kwargs={"dashboard": False},
        ) as cluster,
        Client(cluster, set_as_default=False) as running,
    ):
        yield running


@contextmanager
def _quiet(name: str) -> Iterator[None]:
    """Keep a logger to itself: what a user must know of failed or cancelled blocks is said by the sweep."""
    logger = logging.getLogger(name)
    level = logger.level
    logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        logger.setLevel(level)


def _processors() -> int:
    """How many processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _run(
    study: Study, writer: Writer, client: Client, summary: Summary, progress: Callable[[Progress], None] | None
) -> None:
    """Keep a bounded window of blocks under way and commit each as it comes."""
    from distributed import as_completed

    queue = iter(writer.pending)
    tries: Counter[int] = Counter()
    window = max(sum(client.nthreads().values()), 1) + SPARE_BLOCKS
    arriving: Any = as_completed(loop=client.loop)
    numbers: dict[Any, int] = {}

    def submit(number: int) -> None:
        tries[number] += 1
        try:
            future = client.submit(evaluate_block, study.request, study.space, number, pure=False, retries=0)
        except Exception as problem:
            raise _lost(problem) from problem
        numbers[future.key] = number
        arriving.add(future)

    for number in itertools.islice(queue, window):
        submit(number)
    for future in arriving:
        number, outcome = numbers.pop(future.key), _outcome(future)
        future.release()
        if isinstance(outcome, str) and tries[number] < TRIES:
            submit(number)
            continue
        if isinstance(outcome, str):
            summary.failed[number] = outcome
        else:
            _commit(writer, number, outcome, summary)
            if progress is not None:
                progress(summary.progress)
        for following in itertools.islice(queue, 1):
            submit(following)
    # The commit table decides what is done, not the count of what came back.
    lost = set(writer.pending) - set(summary.failed)
    if lost:
        raise ResultsError(f"blocks {sorted(lost)[:5]} never came back from the workers; run the sweep again to go on")


def _lost(problem: Exception) -> ResultsError:
    return ResultsError(f"the cluster was lost ({problem}); run the sweep again to go on")


def _outcome(future: Any) -> Evaluation | str:
    """What a block gave: its columns, or why it failed. Whatever it raises must not stop the others."""
    try:
        evaluation: Evaluation = future.result()
    except Exception as problem:
        if future.status != "error":  # the block did not fail, the cluster did
            raise _lost(problem) from problem
        return f"{type(problem).__name__}: {problem}"
    return evaluation


def _commit(writer: Writer, number: int, evaluation: Evaluation, summary: Summary) -> None:
    """Make a block durable and count it."""
    columns = evaluation.columns
    writer.commit(number, columns)
    summary.computed += len(columns["status"])
    summary.feasible += int(np.count_nonzero(columns["feasible"]))
    summary.kinematic_evaluations += evaluation.kinematic_evaluations


def _attributes(study: Study) -> dict[str, str | int | float]:
    """What the results file says about itself; nothing that differs between two runs of the same study."""
    import h5py
    import numba
    import scipy

    request = study.request
    senses = {metric.name: metric.sense for metric in request.metrics}
    powers = {metric.name: speed_power(metric) for metric in request.metrics}
    powers |= {f"{constraint.metric.name}_margin": speed_power(constraint.metric) for constraint in request.constraints}
    return {
        "config": study.text,
        "request_sha256": study.sha256,
        "determines": study.determines,
        "mechanism": request.mechanism.name,
        "kernel": f"{request.mechanism.name} {request.mechanism.kernel_version}",
        "sampler": study.space.method,
        "seed": study.space.seed,
        "objectives": json.dumps([f"{o.metric}:{o.sense}" for o in study.objectives]),
        "senses": json.dumps(senses),
        "speed_powers": json.dumps(powers),
        "speed": request.mechanism.speed.name,
        "status_sentences": json.dumps({status.label: status.sentence for status in Status}),
        "explore_version": __version__,
        "numpy_version": np.__version__,
        "scipy_version": scipy.__version__,
        "numba_version": numba.__version__,
        "h5py_version": h5py.__version__,
        "hdf5_version": h5py.version.hdf5_version,
        "machine": platform.machine(),
    }
