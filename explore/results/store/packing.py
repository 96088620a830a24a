"""Write a packed copy of a finished results file: the same content, compressed block by block."""

from __future__ import annotations

import io
import os
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import numpy.typing as npt

from explore.base.errors import ResultsError
from explore.base.files import NAME_ANOTHER_FILE, new_file
from explore.model.columns import Attribute
from explore.model.progress import ReportProgress
from explore.results.store.block_bytes import commit_word, damaged_blocks, read_column_rows, read_words
from explore.results.store.chunks import chunk_length, compress_chunk, make_chunked
from explore.results.store.layout import Layout
from explore.results.store.layout_reader import read_layout
from explore.results.store.memory_file import lay_out_datasets, seal
from explore.results.store.writer import exclusive_access

#: Attributes of the file format; the others are of the study.
_FORMAT_ATTRIBUTES = ("format", "format_version", "n_designs", "block_size")


def pack(source: Path, target: Path, progress: ReportProgress | None = None) -> None:
    """Write a packed copy of a finished results file, which is read back before it gets its name.

    The source is not changed; the target must not exist, and its folder is made. Progress is the number of blocks done
    and to do: each counts twice, when written and when read back. No file is left after a `ResultsError`.
    """
    _run_in_thread(lambda stop: _pack(source, target, _Report(progress, stop)))


def _pack(source: Path, target: Path, report: _Report) -> None:
    layout = read_layout(source)
    if layout.is_packed:
        raise ResultsError(f"{source} is packed already")
    with io.FileIO(source) as file:
        words = read_words(file, layout)
        if not words.all():
            raise ResultsError(f"{source} is not finished; run the sweep or refinement again to go on, then pack it")
        with exclusive_access(target):
            if target.exists():
                reason = "is the file to be packed" if target.samefile(source) else "exists already"
                raise ResultsError(f"{target} {reason}; {NAME_ANOTHER_FILE}")
            with new_file(target, replace=False) as temporary:
                _write(file, layout, words, temporary, report)
                _read_back(temporary, layout, words, report)


def _run_in_thread(work: Callable[[threading.Event], None]) -> None:
    """Run in another thread, and set its event to stop it when this thread is interrupted.

    Python raises Ctrl-C in the main thread; in a callback of HDF5 it would be lost or crash the process.
    """
    stop = threading.Event()
    with ThreadPoolExecutor(1) as thread:
        thread.submit(stop.is_set).result()  # a thread that is interrupted while it starts is not waited for
        try:
            thread.submit(work, stop).result()
        finally:
            stop.set()


class _Report:
    """Reports progress, and stops the work between two blocks when the event is set."""

    def __init__(self, progress: ReportProgress | None, stop: threading.Event) -> None:
        self._progress, self._stop = progress, stop

    def __call__(self, done: int, total: int) -> None:
        if self._stop.is_set():
            raise KeyboardInterrupt
        if self._progress is not None:
            self._progress(done, total)


class Sink(io.RawIOBase):
    """A file for HDF5 whose methods raise no OSError: HDF5 ignores some errors of a full disk and crashes on others.

    After the first error nothing more is written, and `check` raises the error.
    """

    def __init__(self, path: Path) -> None:
        self._file = io.FileIO(path, "x+")
        self._error: OSError | None = None

    def check(self) -> None:
        """Raise the first error, if there was one."""
        if self._error is not None:
            raise self._error

    def sync(self) -> None:
        """Return when everything is durable."""
        self.check()
        os.fsync(self._file.fileno())

    def close(self) -> None:
        """Close the file."""
        self._file.close()
        super().close()

    def seek(self, offset: int, whence: int = io.SEEK_SET, /) -> int:
        """Move to an offset."""
        return self._file.seek(offset, whence)

    def tell(self) -> int:
        """Offset of the next byte."""
        return self._file.tell()

    def write(self, data: Any, /) -> int:
        """Write all bytes, or store the error."""
        remaining = memoryview(data).cast("B")
        length = len(remaining)
        try:
            while remaining and self._error is None:
                remaining = remaining[self._file.write(remaining) :]
        except OSError as error:
            self._error = error
        return length

    def readinto(self, buffer: Any, /) -> int:
        """Fill the buffer, with zeros after the end of the file or after an error."""
        view = memoryview(buffer).cast("B")
        filled = 0
        try:
            while filled < len(view) and (n_read := self._file.readinto(view[filled:])):
                filled += n_read
        except OSError as error:
            self._error = self._error or error
        view[filled:] = bytes(len(view) - filled)
        return len(view)

    def truncate(self, size: int | None = None, /) -> int:
        """Set the length of the file, or store the error."""
        try:
            if self._error is None:
                return self._file.truncate(size)
        except OSError as error:
            self._error = error
        return size or 0


@contextmanager
def _new_hdf5(path: Path) -> Iterator[tuple[h5py.File, Sink]]:
    """Create an HDF5 file, which is durable when the context ends."""
    with Sink(path) as sink:
        try:
            with h5py.File(sink, "w", libver="earliest", track_order=False) as file:
                yield file, sink
            sink.sync()
        finally:
            sink.check()  # errors of HDF5 after a failed write are only consequences


def _write(file: io.FileIO, layout: Layout, words: npt.NDArray[np.uint64], path: Path, report: _Report) -> None:
    """Write the copy; all processors share the columns of a block, because compression takes most of the time."""
    chunk = chunk_length(layout.n_designs, layout.block_size)
    with _new_hdf5(path) as (packed, sink), ThreadPoolExecutor(os.cpu_count()) as pool:
        make = partial(make_chunked, chunk=chunk)
        attributes = _study_attributes(layout)
        lay_out_datasets(packed, layout.columns, layout.n_designs, layout.block_size, attributes, make)
        datasets = [packed["designs"][column.name].id for column in layout.columns]
        for number in range(layout.n_blocks):
            start, _ = layout.row_range(number)
            arrays = _sound_block(file, layout, number, int(words[number]))
            stored = pool.map(partial(compress_chunk, chunk=chunk), arrays)
            for dataset, data in zip(datasets, stored, strict=True):
                dataset.write_direct_chunk((start,), data)
                sink.check()
            report(number + 1, 2 * layout.n_blocks)
        packed["progress/commit"][:, 0] = words
        seal(packed, layout.columns, attributes)


def _sound_block(file: io.FileIO, layout: Layout, number: int, word: int) -> list[npt.NDArray[Any]]:
    """The columns of a block; `ResultsError` if their checksum is not the committed one."""
    start, stop = layout.row_range(number)
    arrays = [read_column_rows(file, layout, column, start, stop) for column in layout.columns]
    if commit_word(arrays) != word:
        where = f"block {number} (rows {start} to {stop - 1}) is damaged"
        raise ResultsError(f"{file.name}: {where}; run the sweep or refinement again to compute it anew, then pack it")
    return arrays


def _study_attributes(layout: Layout) -> dict[str, Attribute]:
    """The attributes of the study, without those of the format."""
    return {name: value for name, value in layout.attributes.items() if name not in _FORMAT_ATTRIBUTES}


def _read_back(path: Path, source: Layout, words: npt.NDArray[np.uint64], report: _Report) -> None:
    """Raise `ResultsError` unless the copy has the source's columns, attributes and checksums."""
    copy, n_blocks = read_layout(path), source.n_blocks
    same = (copy.columns, _study_attributes(copy)) == (source.columns, _study_attributes(source))
    with io.FileIO(path) as file:
        same = same and np.array_equal(read_words(file, copy), words)
        if not same or damaged_blocks(file, copy, lambda done, _: report(n_blocks + done, 2 * n_blocks)):
            raise ResultsError("the packed file does not read back as written; check the disk")
