"""The layout of a results file: where each byte is. HDF5 is asked twice, to lay the file out and to read the layout.

==========  =======================================================================================
/           attributes of the study, format, format_version, n_designs, block_size
/designs    one dataset for each column, with its unit, long_name, role and labels: contiguous, or packed into
            one compressed chunk for each block
/frame      hard links to the columns in the form that ``pandas.read_hdf(path)`` expects
/progress   commit: one word for each block, 0 or 2**32 + CRC-32 of the block's bytes
/study      texts too long for an attribute
==========  =======================================================================================
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from explore.store.chunks import ChunkTable
from explore.vocabulary import Column

FORMAT = "explore-results"
FORMAT_VERSION = 1
INDEX = "design"

Attribute = str | int | float

#: What the attribute "keep" says of a file with the Pareto-optimal designs only; a file without it has all designs.
KEEP_FRONT = "front"


@dataclass(frozen=True)
class Layout:
    """Where the bytes of a results file are. It never changes after the file was created.

    Attributes
    ----------
    offsets
        Of each column's first byte; empty in a packed file.
    chunks
        Where each column's chunks are, one for each block; empty unless the file is packed.
    n_designs
        Rows of the file.
    commit_offset
        Of the first commit word.
    size
        Length of the file, bytes.
    """

    columns: tuple[Column, ...]
    offsets: Mapping[str, int]
    chunks: Mapping[str, ChunkTable]
    n_designs: int
    block_size: int
    commit_offset: int
    size: int
    attributes: Mapping[str, Attribute]

    @property
    def packed(self) -> bool:
        """Whether the columns are compressed."""
        return bool(self.chunks)

    @property
    def n_blocks(self) -> int:
        """Number of blocks; the last may be shorter."""
        return -(-self.n_designs // self.block_size)

    def rows(self, block: int) -> tuple[int, int]:
        """First row of a block and the first row after it."""
        start = block * self.block_size
        return start, min(start + self.block_size, self.n_designs)

    def count_rows(self, blocks: npt.NDArray[np.bool_]) -> int:
        """How many rows the marked blocks have; marks of shape (blocks,)."""
        count = int(np.count_nonzero(blocks)) * self.block_size
        return count - (self.n_blocks * self.block_size - self.n_designs if len(blocks) and blocks[-1] else 0)

    def offset(self, column: Column, row: int) -> int:
        """Place of one value in the file, bytes."""
        return self.offsets[column.name] + row * np.dtype(column.dtype).itemsize
