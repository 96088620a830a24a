"""A results file of the designs that were kept of a study: created once, complete, from arrays in memory."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from explore.errors import ResultsError
from explore.store import platform
from explore.store.creation import laid_out
from explore.store.layout import INDEX, KEEP_FRONT, Attribute
from explore.store.reading import commit_word, damaged_blocks
from explore.vocabulary import Column


def write_kept(
    path: Path,
    columns: Sequence[Column],
    arrays: Mapping[str, npt.NDArray[Any]],
    block_size: int,
    attributes: Mapping[str, Attribute],
) -> None:
    """Create a finished results file of some designs of a study. The caller holds the lock of the path.

    Parameters
    ----------
    path
        The file; one that is there is replaced.
    columns
        The index "design" first.
    arrays
        All columns by name, each of shape (n,) and of exactly its column's dtype; n may be 0. Design numbers ascend.
    block_size
        Rows of a block; the last may be shorter.
    attributes
        Of the study, and "keep": "front", "studied_designs": number of its designs, "studied_counts": JSON from the
        label of a status to the number of designs.

    Raises
    ------
    ResultsError
        The disk is full or the folder cannot be written. Nothing is left behind.
    """
    n_designs = _checked_length(columns, arrays)
    if attributes.get("keep") != KEEP_FRONT:
        raise ValueError(f"the attribute keep must be {KEEP_FRONT!r}")
    with laid_out(path, columns, n_designs, block_size, attributes) as (descriptor, layout):
        values = [np.ascontiguousarray(arrays[column.name]) for column in columns]
        if n_designs:
            for column, each in zip(columns, values, strict=True):
                platform.write_at(descriptor, each.data, layout.offset(column, 0))
        blocks = [slice(*layout.rows(number)) for number in range(layout.n_blocks)]
        words = np.array([commit_word(each[block] for each in values) for block in blocks], dtype="<u8")
        platform.write_at(descriptor, words.tobytes(), layout.commit_offset)
        with io.FileIO(descriptor, closefd=False) as file:
            if damaged_blocks(file, layout):
                raise ResultsError("the new results file does not read back as written; check the disk")


def _checked_length(columns: Sequence[Column], arrays: Mapping[str, npt.NDArray[Any]]) -> int:
    if arrays.keys() != {column.name for column in columns}:
        raise ValueError(f"missing or unknown columns {sorted(arrays.keys() ^ {column.name for column in columns})}")
    shape = (len(arrays[INDEX]),)
    for column in columns:
        values = arrays[column.name]
        if values.shape != shape or values.dtype != np.dtype(column.dtype):
            wanted = f"shape {shape} and dtype {column.dtype}"
            raise ValueError(f"{column.name} has {values.shape}, {values.dtype.str}, not {wanted}")
    if np.any(np.diff(arrays[INDEX]) <= 0):
        raise ValueError("design numbers must ascend")
    return shape[0]
