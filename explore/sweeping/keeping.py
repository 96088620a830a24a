"""What a sweep keeps of its blocks, and where: all designs in the results file."""

from __future__ import annotations

import json
import platform
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np

from explore._version import __version__
from explore.design_space import BLOCK_SIZE
from explore.evaluation import output_columns, speed_power
from explore.store.writer import Writer
from explore.study import Study
from explore.sweeping.blocks import Block
from explore.vocabulary import Column, Objective, Status


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
    """

    objectives: tuple[Objective, ...] = ()

    def __init__(self, study: Study, path: Path, *, restart: bool) -> None:
        columns, attributes = results_columns(study), study_attributes(study)
        self._writer = Writer(path, columns, study.space.count, BLOCK_SIZE, attributes, restart=restart)

    def __enter__(self) -> Self:
        self._writer.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._writer.__exit__(kind, error, trace)

    @property
    def pending(self) -> list[int]:
        """Numbers of the blocks still to compute."""
        return self._writer.pending

    @property
    def designs(self) -> int:
        """Number of designs that are done and durable."""
        return self._writer.committed_designs

    def commit(self, block: Block) -> None:
        """Make a block durable."""
        self._writer.commit(block.number, block.columns)

    def finish(self) -> None:
        """Nothing is left to do when the last block is committed."""


def study_attributes(study: Study) -> dict[str, str | int | float]:
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
