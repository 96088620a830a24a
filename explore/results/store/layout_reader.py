"""Read and check the layout of a results file, which may be damaged or forged."""

import itertools
import os
import stat
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from h5py import h5d

from explore.base.errors import ResultsError
from explore.model.columns import Attribute
from explore.results.store.attributes import read_attributes, read_column, text_of
from explore.results.store.chunks import ChunkTable, chunk_length, read_chunk_table
from explore.results.store.layout import FORMAT, FORMAT_VERSION, INDEX, KEEP_FRONT, PAGE, Layout
from explore.results.store.sealing import COMMIT_OFFSET, SEAL, check_seal
from explore.results.store.study_record import StudyRecord

#: First version of the format whose attributes have a checksum.
_SEALED_VERSION = 3
# Far above all that a sweep writes, because these are read as a whole.
#: Largest number of rows of a block.
_MOST_ROWS = 1 << 20
#: Largest number of blocks of a file.
_MOST_BLOCKS = 1 << 24
#: Length of the longest name of a column, bytes.
_LONGEST_NAME = 1000
#: Size of all texts too long for an attribute, bytes, at most.
_LARGEST_TEXTS = 1 << 26


def read_layout(path: Path) -> Layout:
    """Read and check the offsets of all data; `ResultsError` unless the file is a sound results file."""
    try:
        size = _regular_size(path)
        if h5py.is_hdf5(path):
            with h5py.File(path, "r") as file:
                return _parse(file, path, size)
    except FileNotFoundError:
        raise ResultsError(f"{path} does not exist; sweep its study first") from None
    except ResultsError:
        raise
    except BlockingIOError:
        raise ResultsError(f"{path} is open for writing in another program; close it there") from None
    except (OSError, RuntimeError, KeyError, ValueError, TypeError, AttributeError, MemoryError) as error:
        # h5py raises any of these, with HDF5's message, for a file that was cut or overwritten
        if isinstance(error, OSError) and error.errno:
            raise ResultsError(f"{path} cannot be read: {os.strerror(error.errno)}") from error
        state = "cut short" if "truncated" in str(error) else "damaged"
        message = " ".join(str(error).split())  # HDF5 may use several lines
        raise ResultsError(f"{path} is {state} and cannot be read: {message}") from error
    raise ResultsError(f"{path} is not an HDF5 file{'' if size else ': it is empty'}")


def _regular_size(path: Path) -> int:
    """Length of a regular file, bytes; `ResultsError` for a pipe, whose reading would block."""
    status = path.stat()
    if not stat.S_ISREG(status.st_mode):
        what = "a folder" if stat.S_ISDIR(status.st_mode) else "a pipe or a device"
        raise ResultsError(f"{path} is {what}, not a results file")
    return status.st_size


def _parse(file: h5py.File, path: Path, size: int) -> Layout:
    attributes = _read_attributes(file)
    if attributes.get("format") != FORMAT:
        raise ResultsError(f"{path} is an HDF5 file, but not one written by explore")
    version = attributes.get("format_version")
    if not isinstance(version, int) or not 1 <= version <= FORMAT_VERSION:
        newer = isinstance(version, int) and version > FORMAT_VERSION
        advice = "it was written by a newer explore; update explore to read it" if newer else "it is damaged"
        raise ResultsError(f"{path} has format version {version}, this explore reads 1 to {FORMAT_VERSION}: {advice}")
    n_designs, block_size = _read_shape(attributes)
    designs = _member(file, "designs", h5py.Group)
    axis = _member(_member(file, "frame", h5py.Group), "axis0", h5py.Dataset)
    names = [INDEX, *_read_names(axis, len(designs) - 1, size)]
    datasets = {name: _member(designs, name, h5py.Dataset) for name in names}
    if len(datasets) < len(names):
        raise ValueError("two columns have the same name")
    columns = tuple(read_column(name, dataset) for name, dataset in datasets.items())
    offsets, chunks = _read_places(datasets, n_designs, block_size, size)
    commit = _member(_member(file, "progress", h5py.Group), "commit", h5py.Dataset)
    if commit.dtype != np.dtype("<u8"):
        raise ValueError("the commit words are not u8")
    shape: tuple[int, ...] = (-(-n_designs // block_size),)
    shape += (PAGE // commit.dtype.itemsize,) if version > 1 else ()
    commit_offset = _checked_offset(commit, shape, size)
    step = PAGE if version > 1 else commit.dtype.itemsize
    study = StudyRecord.from_attributes(attributes)
    check_seal(attributes, columns, is_required=version >= _SEALED_VERSION)
    if attributes.get(COMMIT_OFFSET, commit_offset) != commit_offset and not commit[:, 0].any():
        raise ValueError("the commit words are not where they were put")  # else all blocks would seem to be pending
    attributes = {name: value for name, value in attributes.items() if name not in (SEAL, COMMIT_OFFSET)}
    layout = Layout(columns, offsets, chunks, n_designs, block_size, commit_offset, step, size, attributes, study)
    _check_apart(layout)
    return layout


def _check_apart(layout: Layout) -> None:
    """Raise ValueError if columns or commit words overlap: writing one would change another."""
    pieces = [(layout.commit_offset, layout.commit_step * layout.n_blocks)]
    if not layout.is_packed:
        pieces += [(layout.offsets[c.name], layout.n_designs * np.dtype(c.dtype).itemsize) for c in layout.columns]
    for (start, length), (following, _) in itertools.pairwise(sorted(pieces)):
        if start + length > following:
            raise ValueError("columns overlap")


def _read_shape(attributes: Mapping[str, Attribute]) -> tuple[int, int]:
    """Rows of the file and of a block."""
    n_designs, block_size = attributes.get("n_designs"), attributes.get("block_size")
    keep = attributes.get("keep", "all")
    is_front = keep == KEEP_FRONT
    if not is_front and keep != "all":
        raise ValueError(f"keep is {keep!r}, not all or {KEEP_FRONT}")
    fewest = 0 if is_front else 1
    if not isinstance(n_designs, int) or not isinstance(block_size, int) or n_designs < fewest or block_size < 1:
        raise ValueError("n_designs and block_size must be positive integers")
    if is_front:
        studied = attributes.get("studied_designs")
        if not isinstance(studied, int) or studied < n_designs or "studied_counts" not in attributes:
            raise ValueError("studied_designs and studied_counts must be numbers of designs")
    if block_size > _MOST_ROWS or n_designs > _MOST_BLOCKS * block_size:
        raise ValueError(f"it has more than {_MOST_BLOCKS:,} blocks, or blocks of more than {_MOST_ROWS:,} rows")
    return n_designs, block_size


def _read_places(
    datasets: Mapping[str, h5py.Dataset], n_designs: int, block_size: int, size: int
) -> tuple[dict[str, int], dict[str, ChunkTable]]:
    """Offsets of the columns, or their tables of chunks when the file is packed."""
    if datasets[INDEX].chunks is None:
        return {name: _checked_offset(dataset, (n_designs,), size) for name, dataset in datasets.items()}, {}
    chunk = chunk_length(n_designs, block_size)
    chunks = {name: read_chunk_table(dataset, n_designs, chunk, size) for name, dataset in datasets.items()}
    # A small file whose chunks share bytes could decompress to a large array.
    if sum(int(table[:, 1].sum()) for table in chunks.values()) > size:
        raise ValueError("chunks overlap")
    return {}, chunks


def _read_attributes(file: h5py.File) -> dict[str, Attribute]:
    attributes = read_attributes(file)
    if "study" in file:
        study = _member(file, "study", h5py.Group)
        texts = {name: _member(study, name, h5py.Dataset) for name in study}
        for dataset in texts.values():
            _checked_offset(dataset, (), file.id.get_filesize())
            if dataset.dtype.kind not in "SO":
                raise ValueError(f"{dataset.name} is not a text")
        if sum(dataset.dtype.itemsize for dataset in texts.values()) > _LARGEST_TEXTS:
            raise ValueError("the texts of the study are too long")
        attributes |= {name: text_of(dataset[()]) for name, dataset in texts.items()}
    return attributes


def _member(group: h5py.Group, name: str, kind: type[Any]) -> Any:
    """A member stored in this file; ValueError for soft and external links, which may lead anywhere."""
    is_hard_link = isinstance(group.get(name, getlink=True), h5py.HardLink)
    member = group[name] if is_hard_link else None
    if isinstance(member, kind):
        return member
    raise ValueError(f"{group.name} has no {kind.__name__.lower()} {name!r} of its own")


def _read_names(axis: h5py.Dataset, count: int, size: int) -> list[str]:
    """The names of the columns in their order, which the HDF5 group does not store."""
    _checked_offset(axis, (count,), size)
    if axis.dtype.kind != "S" or axis.dtype.itemsize > _LONGEST_NAME:
        raise ValueError(f"{axis.name} does not hold names")
    return [name.decode() for name in axis[:].tolist()]


def _checked_offset(dataset: h5py.Dataset, shape: tuple[int, ...], size: int) -> int:
    """Offset of a dataset's first byte; ValueError unless it is contiguous, of this shape and inside the file."""
    plist = dataset.id.get_create_plist()
    if dataset.shape != shape or plist.get_layout() != h5d.CONTIGUOUS or plist.get_external_count():
        raise ValueError(f"{dataset.name} is not a contiguous array of shape {shape}")
    offset = 0 if 0 in shape else dataset.id.get_offset()
    length = int(np.prod(shape, dtype=object)) * dataset.dtype.itemsize
    if offset is None or offset + length > size:
        raise ValueError(f"{dataset.name} reaches beyond the end of the file")
    return int(offset)
