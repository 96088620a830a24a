"""Create a results file: write it under an unfinished name, read it back, make it durable and rename it."""

import contextlib
import errno
import os
import shutil
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from explore.base.errors import ResultsError
from explore.base.files import new_file, open_binary
from explore.model.columns import Attribute, Column
from explore.results.store import system_calls
from explore.results.store.layout import Layout
from explore.results.store.layout_reader import read_layout
from explore.results.store.memory_file import build_memory_file

#: Number of values of the index that are written at a time.
_CHUNK = 1 << 17


def create_results_file(
    path: Path, columns: Sequence[Column], n_designs: int, block_size: int, attributes: Mapping[str, Attribute]
) -> None:
    """Create a complete results file without any committed block. The caller holds the lock of the path.

    The file must not exist, the first column is the index "design", and the attributes are those of the study: config,
    request_sha256, determines, kernel, versions, seed, sampler. No file is left after a `ResultsError`.
    """
    with new_results_file(path, columns, n_designs, block_size, attributes) as (descriptor, layout):
        for start in range(0, n_designs, _CHUNK):
            numbers = np.arange(start, min(start + _CHUNK, n_designs), dtype="<i8")
            system_calls.write_at(descriptor, numbers.data, layout.offset(columns[0], start))


@contextlib.contextmanager
def new_results_file(
    path: Path, columns: Sequence[Column], n_designs: int, block_size: int, attributes: Mapping[str, Attribute]
) -> Iterator[tuple[int, Layout]]:
    """Yield the descriptor and layout of a new file for the caller to write the values; then sync and rename it."""
    memory_file = build_memory_file(columns, n_designs, block_size, attributes)
    with new_file(path, memory_file.size, replace=False) as temporary:
        if memory_file.size > shutil.disk_usage(path.parent).free:  # said before reserving it fills the disk with zeros
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        descriptor = open_binary(temporary, os.O_RDWR | os.O_CREAT | os.O_EXCL)
        try:
            system_calls.reserve(descriptor, memory_file.size)
            for offset, piece in memory_file.pieces:
                system_calls.write_at(descriptor, piece, offset)
            layout = read_layout(temporary)
            _read_back(layout, columns, attributes)
            yield descriptor, layout
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def _read_back(layout: Layout, columns: Sequence[Column], attributes: Mapping[str, Attribute]) -> None:
    """Raise `ResultsError` unless the new file has the columns and attributes that were written."""
    if layout.columns != tuple(columns) or any(layout.attributes[name] != value for name, value in attributes.items()):
        raise ResultsError("the new results file does not read back as written; check the disk")
