"""The layout of a results file: where each byte is. HDF5 is used twice, to lay the file out and to read the layout.

==========  =======================================================================================
/           attributes of the study, format, format_version, n_designs, block_size
/designs    one dataset for each column, with its unit, long_name, role and labels: contiguous, or packed into
            one compressed chunk for each block
/frame      hard links to the columns in the form that ``pandas.read_hdf(path)`` expects
/progress   commit: a page for each block that begins with its word, 0 or 2**32 + CRC-32 of the block's bytes
/study      texts too long for an attribute
==========  =======================================================================================
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from explore.model.columns import Attribute, Column
from explore.results.store.chunks import ChunkTable
from explore.results.store.study_record import StudyRecord

FORMAT = "explore-results"
INDEX = "design"
# Version 1 kept the commit words side by side, next to HDF5's own bytes; version 2 had no checksum of the attributes.
#: Version of the format.
FORMAT_VERSION = 3
# Bytes written after the file was created share no page with others: a power cut may garble whole sectors of the disk.
#: Size of a page, bytes.
PAGE = 4096
#: Attribute "keep" of a file with the Pareto-optimal designs only; a file without the attribute has all designs.
KEEP_FRONT = "front"


@dataclass(frozen=True)
class Layout:
    """Where the bytes of a results file are; fixed when the file is created.

    Attributes
    ----------
    offsets
        Offset of each column's first byte; empty in a packed file.
    chunks
        Table of each column's chunks, one chunk for each block; empty unless the file is packed.
    n_designs
        Rows of the file.
    commit_offset
        Offset of the first commit word.
    commit_step
        Bytes from one commit word to the next.
    size
        Length of the file, bytes.
    study
        The parsed part of the attributes.
    """

    columns: tuple[Column, ...]
    offsets: Mapping[str, int]
    chunks: Mapping[str, ChunkTable]
    n_designs: int
    block_size: int
    commit_offset: int
    commit_step: int
    size: int
    attributes: Mapping[str, Attribute]
    study: StudyRecord = field(compare=False)

    @property
    def is_packed(self) -> bool:
        """Whether the columns are compressed."""
        return bool(self.chunks)

    @property
    def n_blocks(self) -> int:
        """Number of blocks; the last may be shorter."""
        return -(-self.n_designs // self.block_size)

    def row_range(self, block: int) -> tuple[int, int]:
        """First row of a block and the first row after it."""
        start = block * self.block_size
        return start, min(start + self.block_size, self.n_designs)

    def count_rows(self, blocks: npt.NDArray[np.bool_]) -> int:
        """Number of rows of the marked blocks; marks of shape (blocks,)."""
        count = int(np.count_nonzero(blocks)) * self.block_size
        return count - (self.n_blocks * self.block_size - self.n_designs if len(blocks) and blocks[-1] else 0)

    def offset(self, column: Column, row: int) -> int:
        """Offset of one value in the file, bytes."""
        return self.offsets[column.name] + row * np.dtype(column.dtype).itemsize

    def padding(self, column: Column) -> int:
        """Bytes from the end of a column to the end of its last page if no others can be there, else 0.

        Between the columns of a file of version 1, or of a copy that another program made, there may be other data.
        """
        starts = (*self.offsets.values(), self.commit_offset)
        end = self.offset(column, self.n_designs)
        gap = min((start for start in starts if start >= end), default=end) - end
        is_unused = self.commit_step == PAGE and gap < PAGE and all(start % PAGE == 0 for start in starts)
        return gap if is_unused else 0

    def word_offset(self, block: int) -> int:
        """Offset of a block's commit word in the file, bytes."""
        return self.commit_offset + block * self.commit_step
