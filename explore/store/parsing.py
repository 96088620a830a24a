"""Reading the layout of a results file, which may come from anywhere: nothing in it is trusted."""

from __future__ import annotations

import itertools
import json
import os
import stat
from collections.abc import Mapping
from pathlib import Path
from types import NoneType
from typing import Any

import h5py
import numpy as np
from h5py import h5a, h5d, h5s

from explore.errors import ResultsError
from explore.store.chunks import ChunkTable, chunk_length, read_chunk_table
from explore.store.layout import FORMAT, FORMAT_VERSION, INDEX, KEEP_FRONT, Attribute, Layout
from explore.vocabulary import Column

_LARGEST_ATTRIBUTE = 65_536
#: Types that columns have.
_TYPES = ("<f8", "<i8", "<i4", "|i1")
#: Attributes that hold JSON: a list or an object, and of what.
_JSON: dict[str, tuple[type, tuple[type, ...]]] = {
    "objectives": (list, (str,)),
    "senses": (dict, (str, NoneType)),
    "speed_powers": (dict, (int, float, NoneType)),
    "status_sentences": (dict, (str,)),
    "tally": (dict, (int, list, dict)),
}


def read_layout(path: Path) -> Layout:
    """Read where everything is, trusting nothing: `ResultsError` when the file is not a sound results file."""
    try:
        size = _regular_size(path)
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
        if isinstance(error, OSError) and error.errno:
            raise ResultsError(f"{path} cannot be read: {os.strerror(error.errno)}") from error
        cut = "truncated" in str(error)
        words = " ".join(str(error).split())  # HDF5 may use several lines
        raise ResultsError(f"{path} is {'cut short' if cut else 'damaged'} and cannot be read: {words}") from error
    raise ResultsError(f"{path} is not an HDF5 file{'' if size else ': it is empty'}")


def _regular_size(path: Path) -> int:
    """Length of a file; a pipe would be waited for."""
    status = path.stat()
    if not stat.S_ISREG(status.st_mode):
        what = "a folder" if stat.S_ISDIR(status.st_mode) else "a pipe or a device"
        raise ResultsError(f"{path} is {what}, no results file")
    return status.st_size


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
    layout = Layout(columns, offsets, chunks, n_designs, block_size, commit_offset, size, attributes)
    _check_apart(layout)
    _check_json(attributes)
    return layout


def _check_apart(layout: Layout) -> None:
    """Whether the columns and the commit words lie apart: writing one of them must not change another."""
    pieces = [(layout.commit_offset, 8 * layout.n_blocks)]
    if not layout.packed:
        pieces += [(layout.offsets[c.name], layout.n_designs * np.dtype(c.dtype).itemsize) for c in layout.columns]
    for (start, length), (following, _) in itertools.pairwise(sorted(pieces)):
        if start + length > following:
            raise ValueError("columns lie over each other")


def _check_json(attributes: Mapping[str, Attribute]) -> None:
    """Whether the attributes that are JSON can be read as what they are."""
    for name, (kind, items) in _JSON.items():
        content = json.loads(str(attributes[name])) if name in attributes else kind()
        values = content.values() if isinstance(content, dict) else content
        if not isinstance(content, kind) or not all(isinstance(value, items) for value in values):
            raise ValueError(f"attribute {name} does not hold what it should")


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
        attribute = h5a.open(file.id, name.encode())
        if attribute.get_space().get_simple_extent_type() == h5s.NULL:
            continue  # empty, and of another program
        if attribute.get_storage_size() > _LARGEST_ATTRIBUTE:
            raise ValueError(f"attribute {name} is too long")
        value = file.attrs[name]
        value = _text(value) if isinstance(value, bytes | str) else getattr(value, "tolist", lambda: None)()
        if isinstance(value, str | int | float):  # others were added by other programs
            attributes[name] = value
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
    if dataset.dtype.str not in _TYPES:
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
