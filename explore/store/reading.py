"""Reading values, commit words and checksums from a file whose layout is known; HDF5 is not needed for that.

HDF5 may keep old bytes in memory, and would run whatever filters a foreign file names.
"""

from __future__ import annotations

import io
import zlib
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
import numpy.typing as npt

from explore.errors import ResultsError
from explore.store.chunks import chunk_length, decompressed
from explore.store.layout import Layout
from explore.vocabulary import Column

#: Upper half of a commit word; the lower half is the CRC-32 of the block.
COMMITTED = 1 << 32

#: Called with what is done and what is to be done.
Progress = Callable[[int, int], None]


class DamagedChunkError(ResultsError):
    """A compressed chunk does not hold what a chunk must."""


def read_rows(file: io.FileIO, layout: Layout, column: Column, start: int, stop: int) -> npt.NDArray[Any]:
    """The values of consecutive rows of a column, shape (stop - start,)."""
    if not layout.packed:
        return _read_values(file, layout.offset(column, start), stop - start, column.dtype)
    values = np.empty(stop - start, column.dtype)
    for block in range(start // layout.block_size, -(-stop // layout.block_size)):
        first, last = layout.rows(block)
        low, high = max(start, first), min(stop, last)
        values[low - start : high - start] = _read_chunk(file, layout, column, block)[low - first : high - first]
    return values


def _read_values(file: io.FileIO, offset: int, count: int, dtype: str) -> npt.NDArray[Any]:
    """Values that lie side by side in the file."""
    values = np.empty(count, dtype)
    left = values.data.cast("B") if count else memoryview(b"")
    file.seek(offset)
    while left:  # one call reads 2 GiB at most
        read = file.readinto(left)
        if not read:
            raise ResultsError(f"{file.name} is cut short: restore it from a copy or use --restart to start over")
        left = left[read:]
    return values


def _read_chunk(file: io.FileIO, layout: Layout, column: Column, block: int) -> npt.NDArray[Any]:
    """All values of a chunk, those beyond the last row included."""
    offset, stored = layout.chunks[column.name][block].tolist()
    data = _read_values(file, offset, stored, "|u1").tobytes()
    try:
        return decompressed(data, column.dtype, chunk_length(layout.n_designs, layout.block_size))
    except ValueError as error:
        start, stop = layout.rows(block)
        where = f"{column.name} in rows {start} to {stop - 1}"
        advice = "pack the original again or restore the file from a copy"
        raise DamagedChunkError(f"{file.name} is damaged: {where} cannot be decompressed ({error}); {advice}") from None


def read_words(file: io.FileIO, layout: Layout) -> npt.NDArray[np.uint64]:
    """The commit words of all blocks, shape (blocks,)."""
    return _read_values(file, layout.commit_offset, layout.n_blocks, "<u8")


def commit_word(arrays: Iterable[npt.NDArray[Any]]) -> int:
    """The word that says that a block is there, and what its bytes are: the columns in order."""
    checksum = 0
    for values in arrays:
        checksum = zlib.crc32(values.data.cast("B"), checksum)
    return COMMITTED | checksum


def damaged_blocks(file: io.FileIO, layout: Layout, progress: Progress | None = None) -> list[int]:
    """Numbers of the blocks that are said to be there, but whose bytes are not those that were written.

    One column of one block is in memory at a time; `progress` is called after each block that was checked.
    """
    damaged = []
    words = read_words(file, layout)
    there = np.flatnonzero(words)
    for done, number in enumerate(there.tolist(), 1):
        start, stop = layout.rows(number)
        try:
            sound = commit_word(read_rows(file, layout, c, start, stop) for c in layout.columns) == int(words[number])
        except DamagedChunkError:
            sound = False
        if not sound:
            damaged.append(number)
        if progress is not None:
            progress(done, len(there))
    return damaged
