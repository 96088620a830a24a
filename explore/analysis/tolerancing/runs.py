"""Run the analysis of designs with tolerances on threads or a cluster, and write it as a results file.

A task is a piece of the parts of one design, or what follows from all parts of one. No result depends on the workers.
"""

from __future__ import annotations

import json
import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from explore.analysis.refining.generations import PARENT
from explore.analysis.tolerancing.analysis import Analysis, analyse, most_analysed
from explore.analysis.tolerancing.outcomes import TolerancedRequest, watching
from explore.analysis.tolerancing.spreads import PIECE, PartCounts, count_parts, merge_counts
from explore.base.errors import ClusterError, ResultsError
from explore.model.columns import Attribute, Column
from explore.model.progress import ReportProgress
from explore.model.quantities import Sense
from explore.results.store.open_results import open_results
from explore.results.store.results import Results
from explore.running.blocks import environment_of
from explore.running.clusters import check_environment
from explore.running.collectors import digest_of, identity_attributes, write_at_once
from explore.running.tasks import run_tasks
from explore.running.threads import LocalThreads

if TYPE_CHECKING:
    import pandas as pd
    from distributed import Client

#: Attributes that results with tolerances take over from the results they belong to.
_KEPT = (
    "config", "mechanism", "kernel", "seed", "speed", "speed_powers", "status_sentences", "label_sentences",
    "explore_version", "numpy_version", "scipy_version", "numba_version", "h5py_version", "hdf5_version", "machine",
)  # fmt: skip
#: Version of how parts are drawn and analysed, raised by every change.
_VERSION = 2
#: Attribute of the file that says how its designs were chosen.
_SAMPLER = "tolerances"

_Task = Callable[[], Any]


@dataclass(frozen=True)
class ToleranceRun:
    """What determines the analysis: what is computed, the parameters of each design, and the draws."""

    request: TolerancedRequest
    designs: tuple[Mapping[str, float], ...]
    draws: int
    seed: int

    def compute(
        self,
        cluster: AbstractContextManager[Client | LocalThreads],
        progress: ReportProgress | None = None,
    ) -> list[Analysis]:
        """Analyse all designs.

        `progress` is called with the numbers of parts evaluated and, at most, to be evaluated.
        """
        starts = range(0, self.draws, PIECE)
        n_pieces, n_designs = len(starts), len(self.designs)
        pieces, rests = range(n_pieces * n_designs), range(n_pieces * n_designs, (n_pieces + 1) * n_designs)
        sizes = [min(PIECE, self.draws - start) for start in starts] * n_designs
        watch = _Watch(progress, [*sizes, *[most_analysed(self.request, None)] * n_designs])

        def piece(number: int) -> _Task:
            design, start = self.designs[number // n_pieces], starts[number % n_pieces]
            stop = min(start + PIECE, self.draws)
            return partial(count_parts, self.request, design, self.seed, start, stop)

        with cluster as workers:
            tasks = _Tasks(workers, self.request.request.mechanism.name, watch)
            counts: list[PartCounts] = tasks.run(piece, pieces)
            parts = [merge_counts(counts[k : k + n_pieces]) for k in range(0, len(counts), n_pieces)]
            watch.sizes[rests.start :] = [most_analysed(self.request, each) for each in parts]

            def rest(number: int) -> _Task:
                k = number - rests.start  # the number of a task is its own in the whole run
                return partial(analyse, self.request, self.designs[k], parts[k], self.seed)

            found: list[Analysis] = tasks.run(rest, rests)
        return found


class _Watch:
    """Counts the parts that are evaluated, and ends the tasks of threads once it is stopped.

    A task that is finished counts as its size, the parts it has at most.
    """

    def __init__(self, progress: ReportProgress | None, sizes: list[int]) -> None:
        self.sizes, self._progress, self._counted = sizes, progress, [0] * len(sizes)
        self._lock, self._telling, self._stopped = threading.Lock(), threading.Lock(), threading.Event()

    def count(self, number: int, count: int) -> None:
        """Count parts of a task; called in its thread."""
        if self._stopped.is_set():
            raise KeyboardInterrupt
        with self._lock:
            self._counted[number] += count

    def finish(self, number: int) -> None:
        """Note that a task is finished."""
        with self._lock:
            self._counted[number] = self.sizes[number]
        self.tell()

    def tell(self) -> None:
        """Report the progress; called each second by a thread of its own, too."""
        if self._progress is not None:
            with self._telling:
                self._progress(sum(map(min, self._counted, self.sizes)), sum(self.sizes))

    def stop(self) -> None:
        """End the tasks at their next slices."""
        self._stopped.set()


class _Tasks:
    """Runs tasks by number on threads, which a watch follows, or on a cluster."""

    def __init__(self, workers: Client | LocalThreads, mechanism: str, watch: _Watch) -> None:
        self._workers, self._mechanism, self._watch = workers, mechanism, watch

    def run(self, task: Callable[[int], _Task], numbers: range) -> list[Any]:
        """The results of the tasks in the order of their numbers."""
        results: dict[int, Any] = {}

        def accept(number: int, result: tuple[Mapping[str, str], Any]) -> None:
            environment, results[number] = result
            check_environment(environment, f"of task {number}", self._mechanism)
            self._watch.finish(number)

        function: Callable[..., Any] = _call
        if isinstance(self._workers, LocalThreads):
            function = partial(_call_watched, self._watch)
        run_tasks(
            self._workers, function, lambda number: (number, self._mechanism, task(number)), numbers, accept, _reject,
            wait=self._watch.tell, stop=self._watch.stop,
        )  # fmt: skip
        missing = len(numbers) - len(results)
        if missing:
            raise ClusterError(f"{missing} tasks never came back from the workers; run the command again")
        return [results[number] for number in numbers]


def _call(_number: int, mechanism: str, task: _Task) -> tuple[Mapping[str, str], Any]:
    """Run a task on a worker."""
    return environment_of(mechanism), task()


def _call_watched(watch: _Watch, number: int, mechanism: str, task: _Task) -> tuple[Mapping[str, str], Any]:
    with watching(partial(watch.count, number)):
        return _call(number, mechanism, task)


def _reject(number: int, problem: str) -> None:
    raise ClusterError(f"task {number} failed: {problem}; nothing was written")


def write_toleranced(
    path: Path,
    source: Results,
    frame: pd.DataFrame,
    added: Sequence[Column],
    attributes: Mapping[str, object],
    *,
    restart: bool,
) -> bool:
    """Write designs with their tolerances as a results file, whose designs are numbered from 0; see `write_at_once`.

    The column ``parent`` has their numbers in the source. The attributes are "senses", "objectives", and "tolerances":
    what determines the columns that were added.
    """
    parent = Column(PARENT, "", f"design of {source.path.name} that it is", "bookkeeping", "<i8")
    replaced = {column.name for column in (parent, *added)}
    columns = (*(c for c in source.columns if c.name not in replaced), *added, parent)
    arrays = {c.name: np.ascontiguousarray(frame[c.name], dtype=c.dtype) for c in columns[1:-1]}
    arrays[PARENT] = frame.index.to_numpy().astype("<i8")
    stored = _attributes(source, arrays, attributes)
    return write_at_once(path, columns, arrays, stored, restart=restart)


def is_continued(path: Path, source: Results, attributes: Mapping[str, object]) -> bool:
    """Whether a file is of this analysis, such as an unfinished one; its values are known only at the end."""
    try:
        old = open_results(path)
    except ResultsError:  # of another program, or damaged
        return False
    if old.attributes.get("sampler") != _SAMPLER:
        return False
    stored = json.loads(str(old.attributes["determines"]))
    content = _content(source, attributes, stored["tolerances"]["sha256"])
    return old.attributes.get("kernel") == source.attributes.get("kernel") and stored == json.loads(json.dumps(content))


def _content(source: Results, attributes: Mapping[str, object], digest: str) -> dict[str, Any]:
    """What determines the new results; `digest` is the SHA-256 of their values."""
    determines: dict[str, Any] = json.loads(str(source.attributes["determines"]))
    return determines | {
        "objectives": attributes["objectives"],
        "tolerances": {"version": _VERSION, "sha256": digest, "of": attributes["tolerances"]},
    }


def _attributes(source: Results, arrays: Mapping[str, Any], attributes: Mapping[str, Any]) -> dict[str, Attribute]:
    """Attributes of the new results file."""
    old, content = source.attributes, _content(source, attributes, digest_of(arrays))
    senses: Mapping[str, Sense | None] = attributes["senses"]
    return (
        {name: old[name] for name in _KEPT if name in old}
        | identity_attributes(content)
        | {
            "sampler": _SAMPLER,
            "objectives": json.dumps(attributes["objectives"]),
            "senses": json.dumps(source.senses | dict(senses)),
        }
    )
