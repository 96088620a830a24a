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

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import numpy.typing as npt
from h5py import h5a, h5d

from explore.errors import ResultsError
from explore.store.chunks import ChunkTable, chunk_length, read_chunk_table
from explore.vocabulary import Column

FORMAT = "explore-results"
FORMAT_VERSION = 1
INDEX = "design"

Attribute = str | int | float

#: What the attribute "keep" says of a file with the Pareto-optimal designs only; a file without it has all designs.
KEEP_FRONT = "front"
_LARGEST_ATTRIBUTE = 65_536


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


def read_layout(path: Path) -> Layout:
    """Read where everything is, trusting nothing: `ResultsError` when the file is not a sound results file."""
    try:
        size = path.stat().st_size
        if h5py.is_hdf5(path):
            with h5py.File(path, "r") as file:
                return _parse(file, path, size)
    except FileNotFoundError:
        raise ResultsError(f"{path} does not exist; run `explore sweep` first") from None
    except ResultsError:
        raise
    except BlockingIOError:
        raise ResultsError(f"{path} is open for writing in another program; close it there") from None
    except (OSError, RuntimeError, KeyError, ValueError, TypeError, AttributeError, MemoryError) as error:
        # h5py raises any of these, with HDF5's own words, for a file that was cut or scribbled on
        cut = "truncated" in str(error)
        raise ResultsError(f"{path} is {'cut short' if cut else 'damaged'} and cannot be read: {error}") from error
    raise ResultsError(f"{path} is not an HDF5 file{'' if size else ': it is empty'}")


def _parse(file: h5py.File, path: Path, size: int) -> Layout:
    attributes = _read_attributes(file)
    if attributes.get("format") != FORMAT:
        raise ResultsError(f"{path} is an HDF5 file, but not one written by explore")
    version = attributes.get("format_version")
    if version != FORMAT_VERSION:
        newer = isinstance(version, int) and version > FORMAT_VERSION
        advice = "it was written by a newer explore; update explore to read it" if newer else "it is damaged"
        raise ResultsError(f"{path} has format version {version}, this explore reads {FORMAT_VERSION}: {advice}")
    n_designs, block_size = _read_shape(attributes)
    designs = _member(file, "designs", h5py.Group)
    axis = _member(_member(file, "frame", h5py.Group), "axis0", h5py.Dataset)
    names = [INDEX, *_read_names(axis, len(designs) - 1, size)]
    datasets = {name: _member(designs, name, h5py.Dataset) for name in names}
    if len(datasets) < len(names):
        raise ValueError("two columns have the same name")
    columns = tuple(_read_column(name, dataset) for name, dataset in datasets.items())
    offsets, chunks = _read_places(datasets, n_designs, block_size, size)
    commit = _member(_member(file, "progress", h5py.Group), "commit", h5py.Dataset)
    if commit.dtype != np.dtype("<u8"):
        raise ValueError("the commit words are not u8")
    commit_offset = _checked_offset(commit, (-(-n_designs // block_size),), size)
    return Layout(columns, offsets, chunks, n_designs, block_size, commit_offset, size, attributes)


def _read_shape(attributes: Mapping[str, Attribute]) -> tuple[int, int]:
    """Rows of the file and of a block."""
    n_designs, block_size = attributes.get("n_designs"), attributes.get("block_size")
    keep = attributes.get("keep", "all")
    kept = keep == KEEP_FRONT
    if not kept and keep != "all":
        raise ValueError(f"keep is {keep!r}, not all or {KEEP_FRONT}")
    if not isinstance(n_designs, int) or not isinstance(block_size, int) or n_designs < (not kept) or block_size < 1:
        raise ValueError("n_designs and block_size must be positive integers")
    if kept:
        studied, counts = attributes.get("studied_designs"), json.loads(str(attributes.get("studied_counts")))
        if not isinstance(studied, int) or studied < n_designs:
            raise ValueError("studied_designs must be a number of designs")
        if not isinstance(counts, dict) or not all(isinstance(count, int) for count in counts.values()):
            raise ValueError("studied_counts must be numbers of designs")
    return n_designs, block_size


def _read_places(
    datasets: Mapping[str, h5py.Dataset], n_designs: int, block_size: int, size: int
) -> tuple[dict[str, int], dict[str, ChunkTable]]:
    """Where the columns are: their first bytes, or their chunks when the file is packed."""
    if datasets[INDEX].chunks is None:
        return {name: _checked_offset(dataset, (n_designs,), size) for name, dataset in datasets.items()}, {}
    chunk = chunk_length(n_designs, block_size)
    chunks = {name: read_chunk_table(dataset, n_designs, chunk, size) for name, dataset in datasets.items()}
    # The same bytes used many times over would let a small file become a large array.
    if sum(int(table[:, 1].sum()) for table in chunks.values()) > size:
        raise ValueError("chunks overlap")
    return {}, chunks


def _read_attributes(file: h5py.File) -> dict[str, Attribute]:
    attributes: dict[str, Attribute] = {}
    for name in file.attrs:
        if h5a.open(file.id, name.encode()).get_storage_size() > _LARGEST_ATTRIBUTE:
            raise ValueError(f"attribute {name} is too long")
        value = file.attrs[name]
        if isinstance(value, bytes | str | np.integer | np.floating):  # others were added by other programs
            attributes[name] = _text(value) if isinstance(value, bytes | str) else value.item()
    if "study" in file:
        study = _member(file, "study", h5py.Group)
        for name in study:
            dataset = _member(study, name, h5py.Dataset)
            _checked_offset(dataset, (), file.id.get_filesize())
            attributes[name] = _text(dataset[()])
    return attributes


def _text(value: bytes | str) -> str:
    return value.decode() if isinstance(value, bytes) else value


def _member(group: h5py.Group, name: str, kind: type[Any]) -> Any:
    """A member that is in this file: a soft or external link of a foreign file may lead anywhere."""
    own = isinstance(group.get(name, getlink=True), h5py.HardLink)
    member = group[name] if own else None
    if isinstance(member, kind):
        return member
    raise ValueError(f"{group.name} has no {kind.__name__.lower()} {name!r} of its own")


def _read_names(axis: h5py.Dataset, count: int, size: int) -> list[str]:
    """The columns' names in their order, which the group itself does not keep."""
    _checked_offset(axis, (count,), size)
    if axis.dtype.kind != "S":
        raise ValueError(f"{axis.name} does not hold names")
    return [name.decode() for name in axis[:].tolist()]


def _read_column(name: str, dataset: h5py.Dataset) -> Column:
    if dataset.dtype.kind not in "if" or dataset.dtype.byteorder == ">":
        raise ValueError(f"{dataset.name} has the unknown type {dataset.dtype}")
    texts = {key: _text(dataset.attrs.get(key, b"")) for key in ("units", "long_name", "role", "labels")}
    labels = {int(code): str(label) for code, label in json.loads(texts["labels"] or "{}").items()}
    return Column(name, texts["units"], texts["long_name"], texts["role"], dataset.dtype.str, labels)


def _checked_offset(dataset: h5py.Dataset, shape: tuple[int, ...], size: int) -> int:
    """Place of a dataset's first byte, when all its bytes are in one piece inside the file."""
    plist = dataset.id.get_create_plist()
    if dataset.shape != shape or plist.get_layout() != h5d.CONTIGUOUS or plist.get_external_count():
        raise ValueError(f"{dataset.name} is not a contiguous array of shape {shape}")
    offset = 0 if 0 in shape else dataset.id.get_offset()
    length = int(np.prod(shape, dtype=object)) * dataset.dtype.itemsize
    if offset is None or offset + length > size:
        raise ValueError(f"{dataset.name} reaches beyond the end of the file")
    return int(offset)
