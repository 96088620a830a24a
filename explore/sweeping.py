"""A run of a study: pending blocks to dask, results to the store as they finish. The client is the only writer."""

from __future__ import annotations

import itertools
import json
import os
import platform
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from explore._version import __version__
from explore.design_space import BLOCK_SIZE, DesignSpace
from explore.errors import ResultsError
from explore.evaluation import Evaluation, evaluate_columns, output_columns
from explore.store.writer import Writer
from explore.study import Study
from explore.vocabulary import Column, Request, SampledMetric, Status

if TYPE_CHECKING:
    from distributed import Client

#: Blocks under way at a time beyond one for each worker thread: enough to keep them busy while one is committed.
SPARE_BLOCKS = 2


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


def evaluate_block(request: Request, space: DesignSpace, number: int) -> Evaluation:
    """Evaluate one block of a design space; what a worker runs."""
    block = space.block(number)
    evaluation = evaluate_columns(request, block.columns)
    n = len(evaluation.columns["status"])
    design = np.arange(block.start, block.start + n, dtype=np.int64)
    return Evaluation({"design": design, **evaluation.columns}, evaluation.kinematic_evaluations)


def results_columns(study: Study) -> tuple[Column, ...]:
    """The columns of a study's results file."""
    return output_columns(study.request, [axis.name for axis in study.space.axes])


def row_bytes(study: Study) -> int:
    """Bytes of one design in the results file."""
    return sum(np.dtype(column.dtype).itemsize for column in results_columns(study))


def sweep(
    study: Study,
    path: Path | str,
    *,
    client: Client | None = None,
    workers: int | None = None,
    restart: bool = False,
    progress: Callable[[Progress], None] | None = None,
) -> Summary:
    """Compute every pending block of a study into a results file.

    Parameters
    ----------
    study
        From `explore.load_study`.
    path
        The results file; an unfinished one of the same study is continued.
    client
        Any dask.distributed Client; an in-process cluster of threads unless given.
    workers
        Threads of the in-process cluster; all processors unless given.
    restart
        Move an existing file aside and start over.
    progress
        Called after every commit.

    Raises
    ------
    ResultsError
        If the file cannot be created, belongs to another study, or is being written by another process.
    """
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
        LocalCluster(
            n_workers=1,
            threads_per_worker=workers or _processors(),
            processes=False,
            dashboard_address="127.0.0.1:0",
            scheduler_kwargs={"dashboard": False},
        ) as cluster,
        Client(cluster) as running,
    ):
        yield running


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
    retried: set[int] = set()
    window = max(sum(client.nthreads().values()), 1) + SPARE_BLOCKS
    arriving: Any = as_completed()
    numbers: dict[Any, int] = {}

    def submit(number: int) -> None:
        future = client.submit(evaluate_block, study.request, study.space, number, pure=False, retries=0)
        numbers[future.key] = number
        arriving.add(future)

    for number in itertools.islice(queue, window):
        submit(number)
    for future in arriving:
        number = numbers.pop(future.key)
        try:
            evaluation = future.result()
        except (OSError, KeyboardInterrupt):
            raise
        except Exception as problem:
            if number not in retried:
                retried.add(number)
                submit(number)
                continue
            summary.failed[number] = f"{type(problem).__name__}: {problem}"
        else:
            _commit(writer, number, evaluation, summary)
            if progress is not None:
                done = summary.resumed + summary.computed
                progress(Progress(done, summary.designs, summary.resumed, summary.feasible, summary.computed))
        future.release()
        following = next(queue, None)
        if following is not None:
            submit(following)
    # The commit table decides what is done, not the count of what came back.
    lost = set(writer.pending) - set(summary.failed)
    if lost:
        raise ResultsError(f"blocks {sorted(lost)[:5]} never came back from the workers; run the sweep again to go on")


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

    request = study.request
    senses = {metric.name: metric.sense for metric in request.metrics}
    powers = {
        metric.name: metric.signal.speed_power if metric.statistic != "cv" else 0
        for metric in request.metrics
        if isinstance(metric, SampledMetric)
    }
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
        "h5py_version": h5py.__version__,
        "hdf5_version": h5py.version.hdf5_version,
        "machine": platform.machine(),
    }


def check_room(study: Study, path: Path) -> None:
    """Refuse a sweep whose results cannot fit on the disk, before anything is written."""
    import shutil

    needed = row_bytes(study) * study.space.count
    folder = path.parent
    while not folder.exists():
        folder = folder.parent
    free = shutil.disk_usage(folder).free
    if needed > free:
        raise ResultsError(
            f"{study.space.count:,} designs need {needed / 1e9:,.1f} GB, but only {free / 1e9:,.1f} GB are free in "
            f'{folder}; sweep fewer values or use method = "sobol" with a count'
        )
