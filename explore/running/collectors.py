"""Collectors put the blocks of a sweep into the store: all designs, or the Pareto set only."""

import json
import platform
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from hashlib import sha256
from pathlib import Path
from typing import Any, Self

import numpy as np

from explore._version import __version__
from explore.base.errors import RequestError, ResultsError
from explore.evaluation.evaluate import output_columns
from explore.evaluation.kinematics import speed_power
from explore.model.columns import Arrays, Attribute, Column
from explore.model.request import Objective
from explore.results.ranking.pareto import find_front
from explore.results.ranking.tallies import Tally
from explore.results.store.all_designs_writer import AllDesignsWriter
from explore.results.store.front_writer import FrontWriter
from explore.running.blocks import BlockResult
from explore.studies.config.study import Study
from explore.studies.designs.spaces import BLOCK_SIZE

#: Largest number of designs when only the front is kept: marks and numbers of its blocks take 150 MB of memory.
MOST_STUDIED = 2**40
#: Largest size of all values, bytes: HDF5 addresses 2^63, and a file holds more than its values.
MOST_BYTES = 2**62


def results_columns(study: Study) -> tuple[Column, ...]:
    """The columns of a study's results file."""
    return output_columns(study.request, [axis.name for axis in study.space.axes])


def row_bytes(study: Study) -> int:
    """Bytes of one design in the results file."""
    return sum(np.dtype(column.dtype).itemsize for column in results_columns(study))


class AllDesignsCollector(AllDesignsWriter):
    """Writes every design into the results file, block by block; a context manager that holds the file's lock.

    There are no objectives, so a worker returns its block whole; `sha256` is a hash of what determines the file.
    """

    objectives: tuple[Objective, ...] = ()

    def __init__(self, study: Study, path: Path, *, restart: bool) -> None:
        _check_count(study, MOST_BYTES // row_bytes(study))
        columns, attributes = results_columns(study), study_attributes(study)
        super().__init__(path, columns, study.space.n_designs, BLOCK_SIZE, attributes, restart=restart)
        self.sha256 = study.sha256

    @property
    def n_damaged(self) -> int:
        """Number of blocks that are damaged, and therefore pending again."""
        return len(self.damaged)

    def add(self, block: BlockResult) -> None:
        """Make a block durable."""
        self.commit(block.number, block.arrays)

    def finish(self) -> None:
        """Do nothing: the file is complete when the last block is committed."""


class FrontCollector:
    """Keeps only the Pareto set of the study's objectives, so memory and disk hold a front, not all designs.

    Each worker returns the Pareto set of its block, which is appended to a journal. The union of these sets contains
    the Pareto set of the study, in whatever order the blocks arrive.
    """

    def __init__(self, study: Study, path: Path, *, restart: bool) -> None:
        if not study.objectives:
            raise RequestError("to keep only the front, give objectives ([rank] metrics of a study file)")
        _check_count(study, MOST_STUDIED)
        self.objectives, self.path = study.objectives, path
        content = {**json.loads(study.identity), "objectives": [f"{o.metric}:{o.sense}" for o in study.objectives]}
        attributes = {**study_attributes(study), "keep": "front", **identity_attributes(content)}
        self.sha256 = str(attributes["request_sha256"])
        self._columns, self._n_designs = results_columns(study), study.space.n_designs
        self._writer = FrontWriter(path, self._columns, self._n_designs, BLOCK_SIZE, attributes, restart=restart)
        self._front: Arrays = {column.name: np.empty(0, column.dtype) for column in self._columns}
        self._counts: Counter[str] = Counter()
        self._tally = Tally(tuple(column.name for column in self._columns if column.role == "margin"))
        self._done = np.zeros(study.space.n_blocks, dtype=np.bool_)

    def __enter__(self) -> Self:
        self._writer.__enter__()
        try:
            if self._writer.is_finished:
                self._done[:] = True
            else:
                for meta, arrays in self._writer.records():
                    self._check_record(meta, arrays)
                    if not self._done[meta["block"]]:  # a record that was unreadable once may occur twice
                        self._include(meta, arrays)
        except BaseException:
            self._writer.__exit__(None, None, None)
            raise
        return self

    def __exit__(self, *error: Any) -> None:
        self._writer.__exit__(*error)

    @property
    def pending(self) -> Iterable[int]:
        """Numbers of the pending blocks."""
        return map(int, np.flatnonzero(~self._done))

    @property
    def n_pending(self) -> int:
        """Number of pending blocks."""
        return int(np.count_nonzero(~self._done))

    @property
    def n_damaged(self) -> int:
        """Number of blocks that are damaged, and therefore pending again."""
        return self._writer.n_damaged

    @property
    def n_committed(self) -> int:
        """Number of designs in committed blocks."""
        missing = BLOCK_SIZE * len(self._done) - self._n_designs if self._done[-1] else 0
        return int(np.count_nonzero(self._done)) * BLOCK_SIZE - missing

    def add(self, block: BlockResult) -> None:
        """Make the Pareto set of a block durable."""
        meta = {"block": block.number, "counts": block.counts, "tally": block.tally.to_json()}
        self._writer.append(meta, block.arrays)
        self._include(meta, block.arrays)

    def finish(self) -> None:
        """Write the results file."""
        if self._writer.is_finished:
            return
        outcome: dict[str, Attribute] = {
            "studied_designs": self._n_designs,
            "studied_counts": json.dumps(dict(self._counts), sort_keys=True),
            "tally": self._tally.to_json(),
        }
        self._writer.finish(self._front, outcome)

    def _check_record(self, meta: Mapping[str, Any], arrays: Arrays) -> None:
        """Raise unless a record has the form that `add` writes; the journal may come from anywhere."""
        number = meta.get("block")
        kinds = {column.name: np.dtype(column.dtype) for column in self._columns}
        if (
            not isinstance(number, int)
            or not 0 <= number < len(self._done)
            or {name: values.dtype for name, values in arrays.items()} != kinds
        ):
            raise ResultsError(
                f"the journal of {self.path} has a record that is not a block of this study; use `restart=True`"
            )

    def _include(self, meta: Mapping[str, Any], arrays: Arrays) -> None:
        both = {name: np.concatenate([values, arrays[name]]) for name, values in self._front.items()}
        best = find_front([both], self.objectives)
        order = np.argsort(both["design"])
        rows = order[np.searchsorted(both["design"], best, sorter=order)]
        self._front = {name: values[rows] for name, values in both.items()}
        self._counts.update(meta["counts"])
        self._tally.merge(Tally.from_json(meta["tally"]))
        self._done[meta["block"]] = True


def _check_count(study: Study, most: int) -> None:
    if study.space.n_designs > most:
        raise RequestError(f"{study.space.n_designs:,} designs are more than a sweep can do, {most:,}; sweep less")


def digest_of(arrays: Mapping[str, Any]) -> str:
    """SHA-256 of the values of columns, in the order of their names."""
    values = sha256()
    for name in sorted(arrays):
        values.update(arrays[name].tobytes())
    return values.hexdigest()


def identity_attributes(content: Mapping[str, Any]) -> dict[str, Attribute]:
    """The attributes of a results file that say what determines its columns."""
    identity = json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return {"request_sha256": sha256(identity.encode()).hexdigest(), "determines": identity}


def write_at_once(
    path: Path, columns: Sequence[Column], arrays: Arrays, attributes: Mapping[str, Attribute], *, restart: bool
) -> bool:
    """Write designs whose columns are known, all but the index, as a results file; one that has them is left as it is.

    Designs are numbered from 0. Return whether any were written.
    """
    count = len(next(iter(arrays.values())))
    with AllDesignsWriter(path, tuple(columns), count, BLOCK_SIZE, attributes, restart=restart) as writer:
        pending = list(writer.pending)
        for number in pending:
            rows = slice(number * BLOCK_SIZE, (number + 1) * BLOCK_SIZE)
            writer.commit(number, {name: values[rows] for name, values in arrays.items()})
    return bool(pending)


def study_attributes(study: Study) -> dict[str, Attribute]:
    """Attributes of the results file; none of them differs between two runs of the same study."""
    import h5py
    import numba
    import scipy

    request = study.request
    senses = {metric.name: metric.sense for metric in (*request.metrics, *request.mechanism.given)}
    powers = {metric.name: speed_power(metric) for metric in request.metrics}
    powers |= {f"{constraint.metric.name}_margin": speed_power(constraint.metric) for constraint in request.constraints}
    return {
        "config": study.to_toml(),
        "request_sha256": study.sha256,
        "determines": study.identity,
        "mechanism": request.mechanism.name,
        "kernel": request.mechanism.kernel,
        "sampler": study.space.method,
        "seed": study.space.seed,
        "objectives": json.dumps([f"{o.metric}:{o.sense}" for o in study.objectives]),
        "senses": json.dumps(senses),
        "speed_powers": json.dumps(powers),
        "speed": request.mechanism.speed.name if request.mechanism.speed else "",
        "status_sentences": json.dumps(request.mechanism.status_sentences),
        "explore_version": __version__,
        "numpy_version": np.__version__,
        "scipy_version": scipy.__version__,
        "numba_version": numba.__version__,
        "h5py_version": h5py.__version__,
        "hdf5_version": h5py.version.hdf5_version,
        "machine": platform.machine(),
    }
