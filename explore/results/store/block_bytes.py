"""Reading values, commit words and checksums from a file of known layout, without HDF5.

HDF5 may return bytes that it cached earlier, and would run any filter that a foreign file names.
"""

import io
from collections.abc import Iterable
from typing import Any

import numpy as np
import numpy.typing as npt

from explore.base.checksums import crc32
from explore.base.errors import ResultsError
from explore.model.columns import Column
from explore.model.progress import ReportProgress
from explore.results.store.chunks import chunk_length, decompress_chunk
from explore.results.store.layout import KEEP_FRONT, Layout

#: Upper half of a commit word; the lower half is the CRC-32 of the block.
COMMITTED = 1 << 32

#: Number of commit words that are read at a time, each with its page.
_WORDS = 4096
#: Word of a page with bytes other than 0 after its commit word; no block has this word.
_GARBLED = np.uint64(2**64 - 1)


class DamagedChunkError(ResultsError):
    """A compressed chunk cannot be decompressed to its length."""


def read_column_rows(file: io.FileIO, layout: Layout, column: Column, start: int, stop: int) -> npt.NDArray[Any]:
    """The values of consecutive rows of a column, shape (stop - start,)."""
    if not layout.is_packed:
        return _read_values(file, layout.offset(column, start), stop - start, column.dtype)
    values = np.empty(stop - start, column.dtype)
    for block in range(start // layout.block_size, -(-stop // layout.block_size)):
        first, last = layout.row_range(block)
        low, high = max(start, first), min(stop, last)
        values[low - start : high - start] = _read_chunk(file, layout, column, block)[low - first : high - first]
    return values


def _read_values(file: io.FileIO, offset: int, count: int, dtype: str) -> npt.NDArray[Any]:
    """Consecutive values, shape (count,)."""
    values = np.empty(count, dtype)
    remaining = values.data.cast("B") if count else memoryview(b"")
    file.seek(offset)
    while remaining:  # one call reads 2 GiB at most
        n_read = file.readinto(remaining)
        if not n_read:
            raise ResultsError(f"{file.name} is cut short: restore it from a copy or use `restart=True` to start over")
        remaining = remaining[n_read:]
    return values


def _read_chunk(file: io.FileIO, layout: Layout, column: Column, block: int) -> npt.NDArray[Any]:
    """All values of a chunk, including those beyond the last row."""
    offset, stored = layout.chunks[column.name][block].tolist()
    data = _read_values(file, offset, stored, "|u1").tobytes()
    try:
        return decompress_chunk(data, column.dtype, chunk_length(layout.n_designs, layout.block_size))
    except ValueError as error:
        start, stop = layout.row_range(block)
        where = f"{column.name} in rows {start} to {stop - 1}"
        advice = "pack the original again or restore the file from a copy"
        raise DamagedChunkError(f"{file.name} is damaged: {where} cannot be decompressed ({error}); {advice}") from None


def read_words(file: io.FileIO, layout: Layout) -> npt.NDArray[np.uint64]:
    """The commit words of all blocks, shape (blocks,)."""
    words = np.empty(layout.n_blocks, "<u8")
    step = layout.commit_step // words.itemsize
    for start in range(0, layout.n_blocks, _WORDS):
        stop = min(start + _WORDS, layout.n_blocks)
        pages = _read_values(file, layout.word_offset(start), (stop - start) * step, "<u8").reshape(-1, step)
        words[start:stop] = np.where(pages[:, 1:].any(axis=1), _GARBLED, pages[:, 0])
    return words


def commit_word(arrays: Iterable[npt.NDArray[Any]]) -> int:
    """The commit word of a block: `COMMITTED` and the CRC-32 of its columns in order."""
    checksum = 0
    for values in arrays:
        checksum = crc32(values.data.cast("B"), checksum)
    return COMMITTED | checksum


def is_written(file: io.FileIO, layout: Layout, number: int) -> bool:
    """Whether the first and the last row of a block have possible design numbers.

    Rows that were never written read as zeros; in a sparse file they may be more than the memory holds. A packed block
    cannot be sparse: it is decompressed as a whole.
    """
    if layout.is_packed:
        return True
    start, stop = layout.row_range(number)
    first, last = (int(read_column_rows(file, layout, layout.columns[0], row, row + 1)[0]) for row in (start, stop - 1))
    if layout.attributes.get("keep") == KEEP_FRONT:  # design numbers ascend with gaps
        return start <= first and stop - 1 <= last
    return (first, last) == (start, stop - 1)


def is_sound(file: io.FileIO, layout: Layout, number: int, word: int) -> bool:
    """Whether the bytes of a block have the checksum of its commit word; one column is in memory at a time."""
    start, stop = layout.row_range(number)
    arrays = (read_column_rows(file, layout, column, start, stop) for column in layout.columns)
    return is_written(file, layout, number) and commit_word(arrays) == word


def damaged_blocks(file: io.FileIO, layout: Layout, progress: ReportProgress | None = None) -> list[int]:
    """Numbers of the committed blocks whose bytes do not have the committed checksum.

    `progress` is called after each block that was checked.
    """
    damaged = []
    words = read_words(file, layout)
    committed = np.flatnonzero(words)
    for n_checked, number in enumerate(committed.tolist(), 1):
        try:
            is_damaged = not is_sound(file, layout, number, int(words[number]))
        except DamagedChunkError:
            is_damaged = True
        if is_damaged:
            damaged.append(number)
        if progress is not None:
            progress(n_checked, len(committed))
    return damaged
