"""Make the index of a results file: one pass over its committed blocks."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt

from explore.browsing.index_files import ColumnFacts, identify, new_index, values_path, write_facts
from explore.errors import RequestError, ResultsError
from explore.model.quantities import FloatArray
from explore.store.results import Results

#: Distinct values of a column are counted up to this many.
MOST_DISTINCT = 4096

#: Called with the share that is done; may raise to give up.
ReportShare = Callable[[float], None]


def build_index(results: Results, folder: Path, report: ReportShare) -> None:
    """Make the index of the committed designs of results.

    Parameters
    ----------
    results
        The results, in any units; the index is in declared ones.
    folder
        Where the index is put when it is complete.
    report
        Called after each block with the share that is done.

    Raises
    ------
    RequestError
        The results hold no designs.
    ResultsError
        The file was changed meanwhile.
    """
    if results.n_committed == 0:
        raise RequestError("the results hold no designs yet, so there is nothing to browse")
    identity = identify(results.path)
    names = [column.name for column in results.columns]
    with new_index(folder) as unfinished:
        with ExitStack() as stack:
            writers = [_ColumnWriter(stack.enter_context(_file(unfinished, number))) for number in range(len(names))]
            done = 0
            for block in results.declared.blocks(names):
                for writer, name in zip(writers, names, strict=True):
                    writer.add(block[name])
                done += len(block[names[0]])
                report(done / results.n_committed)
            facts = [writer.finish(name) for writer, name in zip(writers, names, strict=True)]
        if identify(results.path) != identity:
            raise ResultsError("the results were changed while their index was made; make it again")
        write_facts(unfinished, identity, done, facts)


def _file(folder: Path, number: int) -> BinaryIO:
    return values_path(folder, number).open("xb")


class _ColumnWriter:
    """Writes the values of a column and notes their facts."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self._low, self._high, self._missing = np.inf, -np.inf, 0
        self._distinct: FloatArray | None = np.empty(0)

    def add(self, values: npt.NDArray[Any]) -> None:
        """Add the values of a block."""
        own = values.astype("<f8")
        self._file.write(own.tobytes())
        finite = own[np.isfinite(own)]
        self._missing += len(own) - len(finite)
        if len(finite):
            self._low, self._high = min(self._low, float(finite.min())), max(self._high, float(finite.max()))
        if self._distinct is not None:
            distinct = np.union1d(self._distinct, finite)
            self._distinct = distinct if len(distinct) <= MOST_DISTINCT else None

    def finish(self, name: str) -> ColumnFacts:
        """Make the file durable; returns the facts."""
        self._file.flush()
        os.fsync(self._file.fileno())
        is_empty = self._low > self._high
        low, high = (None, None) if is_empty else (self._low, self._high)
        return ColumnFacts(name, low, high, self._missing, None if self._distinct is None else len(self._distinct))
