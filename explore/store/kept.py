"""A results file of the designs that were kept of a study: a journal while the study runs, one complete file after.

How many designs are kept is not known before the last block, so there is nothing to create before.
"""

from __future__ import annotations

import contextlib
import io
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from explore.errors import ResultsError
from explore.store import platform
from explore.store.creation import laid_out
from explore.store.difference import described, other_study
from explore.store.journal import Journal, Record
from explore.store.layout import INDEX, KEEP_FRONT, Attribute
from explore.store.locking import LockFile
from explore.store.names import ELSEWHERE, is_hdf5, journal_name, real_path, set_aside, temporary_name
from explore.store.parsing import read_layout
from explore.store.reading import commit_word, damaged_blocks, read_words
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


class KeptWriter:
    """The single writer of a kept results file, a context manager: of its journal, and at the end of the file.

    Attributes
    ----------
    finished
        Whether the file is there already, so that nothing is left to do.

    Parameters
    ----------
    path
        The results file.
    columns
        The index "design" first.
    n_designs, block_size
        Of the study.
    attributes
        Of the study, with "keep": "front".
    restart
        Move a file and a journal that are there aside and start over.

    Raises
    ------
    ResultsError
        As `Writer` does.
    """

    def __init__(
        self,
        path: Path,
        columns: Sequence[Column],
        n_designs: int,
        block_size: int,
        attributes: Mapping[str, Attribute],
        *,
        restart: bool = False,
    ) -> None:
        self.path = real_path(path)
        self._columns, self._attributes, self._restart = tuple(columns), dict(attributes), restart
        self._study = described(attributes, n_designs, columns)
        self._block_size = block_size
        self._journal = Journal(journal_name(self.path), {**self._study, "blocks": -(-n_designs // block_size)})
        self._closing = contextlib.ExitStack()
        self.finished = False

    def __enter__(self) -> Self:
        try:
            with contextlib.ExitStack() as stack:
                stack.enter_context(LockFile(self.path))
                self._open(stack)
                self._closing = stack.pop_all()
        except ResultsError:
            raise
        except OSError as error:
            raise ResultsError(f"{self.path} cannot be written: {error.strerror or error}") from error
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._closing.close()

    @property
    def damaged(self) -> int:
        """How many records of the journal were damaged when it was opened; their blocks are to be computed again."""
        return self._journal.damaged

    def records(self) -> Iterator[Record]:
        """What was appended in earlier runs and in this one."""
        return self._journal.records()

    def append(self, meta: Mapping[str, Any], arrays: Mapping[str, npt.NDArray[Any]]) -> None:
        """Add a record and return when it is durable."""
        self._journal.append(meta, arrays)

    def finish(self, arrays: Mapping[str, npt.NDArray[Any]], attributes: Mapping[str, Attribute]) -> None:
        """Write the results file, with attributes that were not known before, and remove the journal."""
        write_kept(self.path, self._columns, arrays, self._block_size, {**self._attributes, **attributes})
        self.finished = True
        journal_name(self.path).unlink()

    def _open(self, stack: contextlib.ExitStack) -> None:
        temporary_name(self.path).unlink(missing_ok=True)
        if self._restart:
            set_aside(self.path)
        self.finished = self.path.exists()
        if self.finished:
            self._check_finished()
            platform.sync_folder(self.path.parent)  # a killed run may have left a name that is not durable
            journal_name(self.path).unlink(missing_ok=True)  # left by a kill between the last two steps
        else:
            stack.enter_context(self._journal)

    def _check_finished(self) -> None:
        """Make sure that the file is of this study, and that every byte of it is as it was written."""
        if not is_hdf5(self.path):
            raise ResultsError(f"{self.path} is no results file, so it is left alone; {ELSEWHERE}")
        advice = "use --restart to start over (the file is moved aside)"
        try:
            layout = read_layout(self.path)
        except ResultsError as error:
            raise ResultsError(f"{error}; {advice}") from error
        n_designs = int(layout.attributes.get("studied_designs", layout.n_designs))
        theirs = described(layout.attributes, n_designs, layout.columns)
        if theirs != self._study:
            raise other_study(self.path, theirs, self._study)
        with io.FileIO(self.path) as file:
            if not read_words(file, layout).all() or damaged_blocks(file, layout):
                raise ResultsError(f"{self.path} is damaged; {advice}")
