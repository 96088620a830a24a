"""A packed copy of a finished results file: the same content, compressed block by block."""

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

from explore.errors import ResultsError
from explore.store.chunks import chunk_length, compressed, make_chunked
from explore.store.creation import new_file
from explore.store.image import lay_out
from explore.store.layout import Layout
from explore.store.locking import LockFile
from explore.store.names import ELSEWHERE
from explore.store.parsing import read_layout
from explore.store.reading import Progress, commit_word, damaged_blocks, read_rows, read_words

_OWN = ("format", "format_version", "n_designs", "block_size")


def pack(source: Path, target: Path, progress: Progress | None = None) -> None:
    """Write a packed copy of a finished results file, and read all of it back before it gets its name.

    Parameters
    ----------
    source
        The results file; it is not changed.
    target
        The copy; folders are made, a file that is there is left alone.
    progress
        Called with what is done and what is to be done; each block counts twice, when written and when read back.

    Raises
    ------
    ResultsError
        The source is not finished, packed already or damaged; the target is there, is being written or cannot be
        written, the disk is full. Nothing is left behind.
    """
    _run_apart(lambda stop: _pack(source, target, _Report(progress, stop)))


def _pack(source: Path, target: Path, report: _Report) -> None:
    layout = read_layout(source)
    if layout.packed:
        raise ResultsError(f"{source} is packed already")
    with io.FileIO(source) as file:
        words = read_words(file, layout)
        if not words.all():
            raise ResultsError(f"{source} is not finished; run the sweep again to go on, then pack it")
        with LockFile(target):
            _check_target(source, target)
            with new_file(target) as temporary:
                _write(file, layout, words, temporary, report)
                _read_back(temporary, layout, words, report)


def _check_target(source: Path, target: Path) -> None:
    if target.exists():
        reason = "is the file to be packed" if target.samefile(source) else "exists already"
        raise ResultsError(f"{target} {reason}; {ELSEWHERE}")


def _run_apart(work: Callable[[threading.Event], None]) -> None:
    """Run in a thread of its own, which is told to stop when this one is interrupted, and cleans up by itself.

    The main thread alone receives Ctrl-C, and in a callback of HDF5 it would be lost or crash the process.
    """
    stop = threading.Event()
    with ThreadPoolExecutor(1) as thread:
        try:
            thread.submit(work, stop).result()
        finally:
            stop.set()


class _Report:
    """Passes progress on, and stops the work between two blocks."""

    def __init__(self, progress: Progress | None, stop: threading.Event) -> None:
        self._progress, self._stop = progress, stop

    def __call__(self, done: int, total: int) -> None:
        if self._stop.is_set():
            raise KeyboardInterrupt
        if self._progress is not None:
            self._progress(done, total)


class Sink(io.RawIOBase):
    """A file for HDF5 to write, which never fails: HDF5 ignores some errors of a full disk and crashes on others.

    After the first failure nothing is written any more, and `check` raises it.
    """

    def __init__(self, path: Path) -> None:
        self._file = io.FileIO(path, "x+")
        self._error: OSError | None = None

    def check(self) -> None:
        """Raise what went wrong, if anything."""
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
        """Go to a place."""
        return self._file.seek(offset, whence)

    def tell(self) -> int:
        """Where the next byte goes."""
        return self._file.tell()

    def write(self, data: Any, /) -> int:
        """Write everything, or remember why not."""
        left = memoryview(data).cast("B")
        count = len(left)
        try:
            while left and self._error is None:
                left = left[self._file.write(left) :]
        except OSError as error:
            self._error = error
        return count

    def readinto(self, buffer: Any, /) -> int:
        """Read what is there; the rest is zeros."""
        view = memoryview(buffer).cast("B")
        done = 0
        try:
            while done < len(view) and (read := self._file.readinto(view[done:])):
                done += read
        except OSError as error:
            self._error = self._error or error
        view[done:] = bytes(len(view) - done)
        return len(view)

    def truncate(self, size: int | None = None, /) -> int:
        """Set the length of the file, or remember why not."""
        try:
            if self._error is None:
                return self._file.truncate(size)
        except OSError as error:
            self._error = error
        return size or 0


@contextmanager
def _new_hdf5(path: Path) -> Iterator[tuple[h5py.File, Sink]]:
    """A new HDF5 file, durable at the end."""
    with Sink(path) as sink:
        try:
            with h5py.File(sink, "w", libver="earliest", track_order=False) as file:
                yield file, sink
            sink.sync()
        finally:
            sink.check()  # what HDF5 says after a failure is only its consequence


def _write(file: io.FileIO, layout: Layout, words: npt.NDArray[np.uint64], path: Path, report: _Report) -> None:
    """Write the copy. The time goes into compressing, so all processors share the columns of a block."""
    chunk = chunk_length(layout.n_designs, layout.block_size)
    attributes = {name: value for name, value in layout.attributes.items() if name not in _OWN}
    with _new_hdf5(path) as (packed, sink), ThreadPoolExecutor(os.cpu_count()) as pool:
        make = partial(make_chunked, chunk=chunk)
        lay_out(packed, layout.columns, layout.n_designs, layout.block_size, attributes, make)
        datasets = [packed["designs"][column.name].id for column in layout.columns]
        for number in range(layout.n_blocks):
            start, _ = layout.rows(number)
            arrays = _sound_block(file, layout, number, int(words[number]))
            stored = pool.map(partial(compressed, chunk=chunk), arrays)
            for dataset, data in zip(datasets, stored, strict=True):
                dataset.write_direct_chunk((start,), data)
                sink.check()
            report(number + 1, 2 * layout.n_blocks)
        packed["progress/commit"][...] = words


def _sound_block(file: io.FileIO, layout: Layout, number: int, word: int) -> list[npt.NDArray[Any]]:
    """The columns of a block, whose bytes are those that were committed."""
    start, stop = layout.rows(number)
    arrays = [read_rows(file, layout, column, start, stop) for column in layout.columns]
    if commit_word(arrays) != word:
        where = f"block {number} (rows {start} to {stop - 1}) is damaged"
        raise ResultsError(f"{file.name}: {where}; run the sweep again to compute it anew, then pack it")
    return arrays


def _read_back(path: Path, source: Layout, words: npt.NDArray[np.uint64], report: _Report) -> None:
    """Make sure that the copy says what the source says, down to the last byte."""
    copy, n_blocks = read_layout(path), source.n_blocks
    same = (copy.columns, copy.attributes) == (source.columns, source.attributes)
    with io.FileIO(path) as file:
        same = same and np.array_equal(read_words(file, copy), words)
        if not same or damaged_blocks(file, copy, lambda done, _: report(n_blocks + done, 2 * n_blocks)):
            raise ResultsError("the packed file does not read back as written; check the disk")
