"""What a sweep keeps of its blocks, and where: all designs, or the Pareto set only."""

from __future__ import annotations

import json
import platform
from collections import Counter
from collections.abc import Iterable, Mapping
from hashlib import sha256
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np

from explore._version import __version__
from explore.design_space import BLOCK_SIZE
from explore.errors import RequestError, ResultsError
from explore.evaluation import output_columns, speed_power
from explore.ranking.pareto import front
from explore.ranking.tallies import Tally
from explore.store.kept import KeptWriter
from explore.store.layout import Attribute
from explore.store.writer import Writer
from explore.study import Study
from explore.sweeping.blocks import Block
from explore.vocabulary import Column, Columns, Objective, Status

#: Marks and numbers of all blocks of a front are in memory, 150 MB for this many designs, which take weeks.
MOST_STUDIED = 2**40
#: Bytes of the values that HDF5 can place in a file, with room for the rest.
MOST_BYTES = 2**62


def results_columns(study: Study) -> tuple[Column, ...]:
    """The columns of a study's results file."""
    return output_columns(study.request, [axis.name for axis in study.space.axes])


def row_bytes(study: Study) -> int:
    """Bytes of one design in the results file."""
    return sum(np.dtype(column.dtype).itemsize for column in results_columns(study))


class KeepAll:
    """Every design goes into the results file, block by block; a context manager that holds the file's lock.

    Attributes
    ----------
    objectives
        Of the Pareto set that a worker reduces its block to; none, so it sends everything.
    sha256
        Hash of what determines the file.
    """

    objectives: tuple[Objective, ...] = ()

    def __init__(self, study: Study, path: Path, *, restart: bool) -> None:
        _check_count(study, MOST_BYTES // row_bytes(study))
        columns, attributes = results_columns(study), study_attributes(study)
        self.sha256 = study.sha256
        self._writer = Writer(path, columns, study.space.count, BLOCK_SIZE, attributes, restart=restart)

    def __enter__(self) -> Self:
        self._writer.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._writer.__exit__(kind, error, trace)

    @property
    def pending(self) -> Iterable[int]:
        """Numbers of the blocks still to compute."""
        return self._writer.pending

    @property
    def n_pending(self) -> int:
        """How many blocks are still to compute."""
        return self._writer.n_pending

    @property
    def n_damaged(self) -> int:
        """How many blocks were there but damaged; they are pending again."""
        return len(self._writer.damaged)

    @property
    def designs(self) -> int:
        """Number of designs that are done and durable."""
        return self._writer.committed_designs

    def commit(self, block: Block) -> None:
        """Make a block durable."""
        self._writer.commit(block.number, block.columns)

    def finish(self) -> None:
        """Nothing is left to do when the last block is committed."""


class KeepFront:
    """Only the Pareto set of the study's objectives is kept; memory and disk hold a front, not the designs.

    Each worker sends the Pareto set of its block, which goes into a journal. The union of these sets holds the Pareto
    set of the study, whatever the order of the blocks.
    """

    def __init__(self, study: Study, path: Path, *, restart: bool) -> None:
        if not study.objectives:
            raise RequestError("to keep only the front, say what makes a design better: give [rank] metrics")
        _check_count(study, MOST_STUDIED)
        self.objectives, self.path = study.objectives, path
        attributes = _front_attributes(study)
        self.sha256 = str(attributes["request_sha256"])
        self._columns, self._n_designs = results_columns(study), study.space.count
        self._writer = KeptWriter(path, self._columns, self._n_designs, BLOCK_SIZE, attributes, restart=restart)
        self._front: Columns = {column.name: np.empty(0, column.dtype) for column in self._columns}
        self._counts: Counter[str] = Counter()
        self._tally = Tally(tuple(column.name for column in self._columns if column.role == "margin"))
        self._done = np.zeros(study.space.n_blocks, dtype=np.bool_)

    def __enter__(self) -> Self:
        self._writer.__enter__()
        try:
            if self._writer.finished:
                self._done[:] = True
            else:
                for meta, columns in self._writer.records():
                    self._check_record(meta, columns)
                    if not self._done[meta["block"]]:  # or it could not be read once, and was computed again
                        self._include(meta, columns)
        except BaseException:
            self._writer.__exit__(None, None, None)
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._writer.__exit__(kind, error, trace)

    @property
    def pending(self) -> Iterable[int]:
        """Numbers of the blocks still to compute."""
        return map(int, np.flatnonzero(~self._done))

    @property
    def n_pending(self) -> int:
        """How many blocks are still to compute."""
        return int(np.count_nonzero(~self._done))

    @property
    def n_damaged(self) -> int:
        """How many blocks were there but damaged; they are pending again."""
        return self._writer.damaged

    @property
    def designs(self) -> int:
        """Number of designs that are done and durable."""
        missing = BLOCK_SIZE * len(self._done) - self._n_designs if self._done[-1] else 0
        return int(np.count_nonzero(self._done)) * BLOCK_SIZE - missing

    def commit(self, block: Block) -> None:
        """Make the Pareto set of a block durable."""
        meta = {"block": block.number, "counts": block.counts, "tally": block.tally.to_json()}
        self._writer.append(meta, block.columns)
        self._include(meta, block.columns)

    def finish(self) -> None:
        """Write the results file."""
        if self._writer.finished:
            return
        found: dict[str, Attribute] = {
            "studied_designs": self._n_designs,
            "studied_counts": json.dumps(dict(self._counts), sort_keys=True),
            "tally": self._tally.to_json(),
        }
        self._writer.finish(self._front, found)

    def _check_record(self, meta: Mapping[str, Any], columns: Columns) -> None:
        """Make sure that a record of the journal is one that `commit` wrote: a file may come from anywhere."""
        number = meta.get("block")
        kinds = {column.name: np.dtype(column.dtype) for column in self._columns}
        if (
            not isinstance(number, int)
            or not 0 <= number < len(self._done)
            or {name: values.dtype for name, values in columns.items()} != kinds
        ):
            raise ResultsError(f"the journal of {self.path} holds what is no block of this study; use --restart")

    def _include(self, meta: Mapping[str, Any], columns: Columns) -> None:
        both = {name: np.concatenate([values, columns[name]]) for name, values in self._front.items()}
        best = front([both], self.objectives)
        order = np.argsort(both["design"])
        rows = order[np.searchsorted(both["design"], best, sorter=order)]
        self._front = {name: values[rows] for name, values in both.items()}
        self._counts.update(meta["counts"])
        self._tally.include(Tally.from_json(meta["tally"]))
        self._done[meta["block"]] = True


def _check_count(study: Study, most: int) -> None:
    if study.space.count > most:
        raise RequestError(f"{study.space.count:,} designs are more than a sweep can do, {most:,}; sweep less")


def _front_attributes(study: Study) -> dict[str, Attribute]:
    """Of a file that keeps the front: what is kept depends on the objectives too."""
    aims = [f"{objective.metric}:{objective.sense}" for objective in study.objectives]
    determines = json.dumps({**json.loads(study.determines), "objectives": aims}, sort_keys=True, separators=(",", ":"))
    own = {"keep": "front", "determines": determines, "request_sha256": sha256(determines.encode()).hexdigest()}
    return {**study_attributes(study), **own}


def study_attributes(study: Study) -> dict[str, Attribute]:
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
