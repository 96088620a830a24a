"""Write a results file of the Pareto set only: a journal while the sweep runs, then the complete file.

The number of kept designs is known only after the last block, so the file cannot be created earlier.
"""

import contextlib
import io
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from explore.base.errors import ResultsError
from explore.base.files import NAME_ANOTHER_FILE, START_OVER, sync_folder
from explore.model.columns import Attribute, Column
from explore.results.store import system_calls
from explore.results.store.block_bytes import commit_word, damaged_blocks, read_words
from explore.results.store.creation import new_results_file
from explore.results.store.difference import other_study_error, study_description
from explore.results.store.journal import Journal
from explore.results.store.layout import INDEX, KEEP_FRONT
from explore.results.store.layout_reader import read_layout
from explore.results.store.records import Record
from explore.results.store.sidecar_files import is_hdf5, journal_name
from explore.results.store.writer import SweepWriter


def write_front(
    path: Path,
    columns: Sequence[Column],
    arrays: Mapping[str, npt.NDArray[Any]],
    block_size: int,
    attributes: Mapping[str, Attribute],
) -> None:
    """Create a finished results file of some designs of a study. The caller holds the lock of the path.

    The file must not exist, the first column is the index "design". `arrays` are all columns by name, each of shape
    (n,) and of exactly its column's dtype; n may be 0. Design numbers ascend; the last block may be shorter. The
    attributes are the study's, with "keep": "front", "studied_designs": number of its designs, "studied_counts": JSON
    from the label of a status to the number of designs. No file is left after a `ResultsError`.
    """
    n_designs = _count_rows(columns, arrays)
    if attributes.get("keep") != KEEP_FRONT:
        raise ValueError(f"the attribute keep must be {KEEP_FRONT!r}")
    with new_results_file(path, columns, n_designs, block_size, attributes) as (descriptor, layout):
        ordered = [np.ascontiguousarray(arrays[column.name]) for column in columns]
        if n_designs:
            for column, values in zip(columns, ordered, strict=True):
                system_calls.write_at(descriptor, values.data, layout.offset(column, 0))
        for number in range(layout.n_blocks):
            word = commit_word(values[slice(*layout.row_range(number))] for values in ordered)
            system_calls.write_at(descriptor, word.to_bytes(8, "little"), layout.word_offset(number))
        with io.FileIO(descriptor, closefd=False) as file:
            if damaged_blocks(file, layout):
                raise ResultsError("the new results file does not read back as written; check the disk")


def _count_rows(columns: Sequence[Column], arrays: Mapping[str, npt.NDArray[Any]]) -> int:
    """Number of rows; ValueError unless the arrays are those of the columns and the design numbers ascend."""
    if arrays.keys() != {column.name for column in columns}:
        raise ValueError(f"missing or unknown columns {sorted(arrays.keys() ^ {column.name for column in columns})}")
    shape = (len(arrays[INDEX]),)
    for column in columns:
        values = arrays[column.name]
        if values.shape != shape or values.dtype != np.dtype(column.dtype):
            expected = f"shape {shape} and dtype {column.dtype}"
            raise ValueError(f"{column.name} has {values.shape}, {values.dtype.str}, not {expected}")
    if np.any(np.diff(arrays[INDEX]) <= 0):
        raise ValueError("design numbers must ascend")
    return shape[0]


class FrontWriter(SweepWriter):
    """The single writer of a file that keeps the front only: it writes the journal, and at the end the file.

    The numbers of designs are those of the study and of a block; the attributes are the study's, with "keep": "front".
    When the results file exists, `is_finished`, nothing is left to compute. Errors are those of `AllDesignsWriter`.
    """

    @property
    def n_damaged(self) -> int:
        """Number of records of the journal that were damaged when it was opened; their blocks are computed again."""
        return self._journal.n_damaged

    def records(self) -> Iterator[Record]:
        """Read the records of earlier runs and of this one."""
        return self._journal.records()

    def append(self, meta: Mapping[str, Any], arrays: Mapping[str, npt.NDArray[Any]]) -> None:
        """Add a record and return when it is durable."""
        self._journal.append(meta, arrays)

    def finish(self, arrays: Mapping[str, npt.NDArray[Any]], attributes: Mapping[str, Attribute]) -> None:
        """Write the results file, with attributes that are known only at the end, and remove the journal."""
        columns, _, block_size, own = self._content
        write_front(self.path, columns, arrays, block_size, {**own, **attributes})
        self.is_finished = True
        self._journal.remove()

    def _open(self, stack: contextlib.ExitStack) -> None:
        columns, n_designs, block_size, attributes = self._content
        study = study_description(attributes, n_designs, columns)
        self._journal = Journal(journal_name(self.path), {**study, "blocks": -(-n_designs // block_size)})
        self.is_finished = self.path.exists()
        if self.is_finished:
            self._check_finished(study)
            sync_folder(self.path.parent)  # a killed run may have left a name that is not durable
            journal_name(self.path).unlink(missing_ok=True)  # left by a kill between the last two steps
        else:
            stack.enter_context(self._journal)

    def _check_finished(self, study: Mapping[str, Any]) -> None:
        """Raise `ResultsError` if the file is of another study or does not have its checksums."""
        if not is_hdf5(self.path):
            unfinished = journal_name(self.path).exists()
            advice = "move it away to go on with the sweep" if unfinished else NAME_ANOTHER_FILE
            raise ResultsError(f"{self.path} is not a results file, so it is left alone; {advice}")
        try:
            layout = read_layout(self.path)
        except ResultsError as error:
            raise ResultsError(f"{error}; {START_OVER}") from error
        n_designs = int(layout.attributes.get("studied_designs", layout.n_designs))
        file_study = study_description(layout.attributes, n_designs, layout.columns)
        if file_study != study:
            raise other_study_error(self.path, file_study, study)
        with io.FileIO(self.path) as file:
            if not read_words(file, layout).all() or damaged_blocks(file, layout):
                raise ResultsError(f"{self.path} is damaged; {START_OVER}")
