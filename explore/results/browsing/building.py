"""Make the index of a results file: a pass over its blocks for the values, and one over these for the cells."""

import os
import shutil
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt

from explore.base.checksums import crc32
from explore.base.errors import RequestError, ResultsError
from explore.model.quantities import FloatArray
from explore.results.browsing.cells import MOST_DISTINCT, Cells, cell_edges
from explore.results.browsing.index_files import BLOCK, ColumnFacts, column_path, identify, new_index, write_facts
from explore.results.browsing.kernels import assign_cells
from explore.results.store.results import Results

#: Approximate number of values of a column from which the widths of its cells are chosen.
_SAMPLE = 1 << 18

#: Function of the share that is done; it may raise to give up.
ReportShare = Callable[[float], None]


def build_index(results: Results, folder: Path, report: ReportShare) -> None:
    """Make the index of the committed designs of results in a folder, which gets its name when it is complete.

    The results may be in any units; the index is in declared ones. `report` is called after each block with the share
    that is done. A `RequestError` says that the results hold no designs, a `ResultsError` that the file was changed
    meanwhile.
    """
    if results.n_committed == 0:
        raise RequestError("the results hold no designs yet, so there is nothing to browse")
    # A value and the number of its cell have ten bytes.
    needed, free = 10 * len(results.columns) * results.n_committed, shutil.disk_usage(folder.parent).free
    if needed > free:
        raise RequestError(f"the index needs {needed / 1e6:,.0f} MB of disk space, and {free / 1e6:,.0f} MB are free")
    identity = identify(results.path)
    names = [column.name for column in results.columns]
    step = -(-results.n_committed // _SAMPLE)
    with new_index(folder) as unfinished:
        writers = [_ColumnWriter(unfinished, number, step) for number in range(len(names))]
        with ExitStack() as stack:
            files = [stack.enter_context(writer.path("values").open("xb")) for writer in writers]
            done = 0
            for block in results.declared.blocks(names):
                for writer, file, name in zip(writers, files, names, strict=True):
                    file.write(writer.note(block[name]).tobytes())
                done += len(block[names[0]])
                report(0.5 * done / results.n_committed)
            for file in files:
                _sync(file)
        facts = []
        for number, (writer, name) in enumerate(zip(writers, names, strict=True)):
            writer.write_cells(report, 0.5 + 0.5 * number / len(names))
            facts.append(writer.facts(name))
        if identify(results.path) != identity:
            raise ResultsError("the results were changed while their index was made; make it again")
        write_facts(unfinished, identity, done, facts)


class _ColumnWriter:
    """Writes the files of a column and notes its facts; `step` thins out the sample of its values."""

    def __init__(self, folder: Path, number: int, step: int) -> None:
        self._folder, self._number, self._step = folder, number, step
        self._low, self._high, self._missing, self._length = np.inf, -np.inf, 0, 0
        self._distinct: FloatArray | None = np.empty(0)
        self._samples: list[FloatArray] = []
        self._written, self._checksums = 0, {"cells": [0], "ranges": [0], "values": [0]}

    def path(self, kind: str) -> Path:
        """A file of the column."""
        return column_path(self._folder, self._number, kind)

    def note(self, values: npt.NDArray[Any]) -> FloatArray:
        """Note the values of a block; returns them as they are written."""
        own = values.astype("<f8")
        finite = own[np.isfinite(own)]
        self._length += len(own)
        self._written = crc32(own, self._written)
        self._missing += len(own) - len(finite)
        self._samples.append(finite[:: self._step])
        if len(finite):
            self._low, self._high = min(self._low, float(finite.min())), max(self._high, float(finite.max()))
        if self._distinct is not None:
            distinct = np.union1d(self._distinct, finite)
            self._distinct = distinct if len(distinct) <= MOST_DISTINCT else None
        return own

    def write_cells(self, report: ReportShare, share: float) -> None:
        """Find the cell of each value that was written; reports `share` again and again.

        Raises ResultsError if other values are read than were written.
        """
        edges = cell_edges(*self._ends(), self._distinct, np.concatenate(self._samples))
        least, greatest = np.full(len(edges) + 2, np.inf), np.full(len(edges) + 2, -np.inf)
        least[0] = greatest[0] = np.nan
        counts = np.zeros(len(edges) + 2, np.int64)
        with self.path("values").open("rb") as source, self.path("cells").open("xb") as file:
            for _ in range(0, self._length, BLOCK):
                values = np.fromfile(source, "<f8", BLOCK)
                self._add_checksum("values", values)
                cells = np.empty(len(values), "<u2")
                assign_cells(values, edges, cells, least, greatest, counts)
                self._add_checksum("cells", cells)
                file.write(cells.tobytes())
                report(share)
            _sync(file)
        if self._checksums["values"][-1] != self._written:
            raise ResultsError("the disk gives back other values than were written to it")
        with self.path("ranges").open("xb") as file:
            ranges = np.stack([least, greatest, counts.astype("<f8")])
            self._add_checksum("ranges", ranges)
            file.write(ranges.tobytes())
            _sync(file)
        if Cells(least, greatest, counts).are_exact:
            self.path("values").unlink()

    def facts(self, name: str) -> ColumnFacts:
        """The facts of all values."""
        distinct = None if self._distinct is None else len(self._distinct)
        checksums = {kind: found[1:] for kind, found in self._checksums.items()}
        return ColumnFacts(name, *self._ends(), self._missing, distinct, checksums)

    def _add_checksum(self, kind: str, values: npt.NDArray[Any]) -> None:
        found = self._checksums[kind]
        found.append(crc32(values, found[-1]))

    def _ends(self) -> tuple[float | None, float | None]:
        return (None, None) if self._low > self._high else (self._low, self._high)


def _sync(file: BinaryIO) -> None:
    file.flush()
    os.fsync(file.fileno())
