"""Lay out a new results file in memory: everything but the columns' values."""

import io
import json
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import h5py
import numpy as np
import numpy.typing as npt
from h5py import h5a, h5d, h5p, h5s, h5t

from explore.model.columns import Attribute, Column
from explore.results.store.layout import FORMAT, FORMAT_VERSION, INDEX, KEEP_FRONT, PAGE
from explore.results.store.sealing import COMMIT_OFFSET, SEAL, seal_text

#: Length of the longest text in an attribute, of which HDF5 allows 64 KiB; longer ones are datasets in /study, bytes.
_LONGEST_ATTRIBUTE = 60_000
#: Number of words of 8 bytes on the page of a block's commit word, which is the first of them.
_WORDS_PER_PAGE = PAGE // 8

#: Function of group, name, dtype and length that makes a column's dataset.
DatasetMaker = Callable[[h5py.Group, str, str, int], h5py.Dataset]


class MemoryFile(io.RawIOBase):
    """An HDF5 file in memory that stores only the bytes that were written: the columns' space takes no memory.

    HDF5 never writes to the disk itself, because it does not report all write errors and may crash on a full disk.
    """

    def __init__(self) -> None:
        self.pieces: list[tuple[int, bytes]] = []
        self.size = 0
        self._position = 0

    def seek(self, offset: int, whence: int = io.SEEK_SET, /) -> int:
        """Move to an offset."""
        self._position = offset + (0, self._position, self.size)[whence]
        return self._position

    def tell(self) -> int:
        """Offset of the next byte."""
        return self._position

    def write(self, data: Any, /) -> int:
        """Store a piece."""
        piece = bytes(data)
        self.pieces.append((self._position, piece))
        self._position += len(piece)
        self.size = max(self.size, self._position)
        return len(piece)

    def readinto(self, buffer: Any, /) -> int:
        """Read bytes; those never written are zeros."""
        view, first = memoryview(buffer).cast("B"), self._position
        view[:] = bytes(len(view))
        for start, piece in self.pieces:  # later pieces over earlier ones
            low, high = max(start, first), min(start + len(piece), first + len(view))
            if low < high:
                view[low - first : high - first] = piece[low - start : high - start]
        self._position += len(view)
        return len(view)

    def truncate(self, size: int | None = None, /) -> int:
        """Set the length of the file, which takes no memory."""
        self.size = self._position if size is None else size
        return self.size


def build_memory_file(
    columns: Sequence[Column], n_designs: int, block_size: int, attributes: Mapping[str, Attribute]
) -> MemoryFile:
    """Lay out a results file; it has every byte but those of the columns and the commit words."""
    _check_request(columns, n_designs, block_size, attributes)
    memory_file = MemoryFile()
    with h5py.File(memory_file, "w", libver="earliest", track_order=False) as file:
        lay_out_datasets(file, columns, n_designs, block_size, attributes, _declare)
    # HDF5's structures are complete now. All that it allocates from here on is for values, and begins on a new page.
    with h5py.File(memory_file, "r+", libver="earliest", alignment_threshold=1, alignment_interval=PAGE) as file:
        for dataset in (*(file["designs"][column.name] for column in columns), file["progress/commit"]):
            if dataset.size:
                dataset[(0,) * dataset.ndim] = 0  # the first value written makes HDF5 allocate the whole dataset
        seal(file, columns, attributes)
    return memory_file


def lay_out_datasets(
    file: h5py.File,
    columns: Sequence[Column],
    n_designs: int,
    block_size: int,
    attributes: Mapping[str, Attribute],
    make_dataset: DatasetMaker,
) -> None:
    """Put everything but values into a new HDF5 file; `make_dataset` decides how the columns are stored.

    `seal` is to be called when the commit words have their place.
    """
    all_attributes = _all_attributes(attributes, n_designs, block_size)
    for name, value in {**all_attributes, SEAL: seal_text(all_attributes, columns)}.items():
        _put_attribute(file, name, value)
    designs = file.create_group("designs", track_order=False)
    for column in columns:
        _describe(make_dataset(designs, column.name, column.dtype, n_designs), column)
    _put_frame(file, [column.name for column in columns[1:]])
    progress = file.create_group("progress", track_order=False)
    _declare(progress, "commit", "<u8", -(-n_designs // block_size), _WORDS_PER_PAGE)


def seal(file: h5py.File, columns: Sequence[Column], attributes: Mapping[str, Attribute]) -> None:
    """Store where the commit words are, and the checksum of all attributes, over the bytes reserved for them."""
    shape = {name: int(file.attrs[name]) for name in ("n_designs", "block_size")}
    commit_offset = file["progress/commit"].id.get_offset() or 0
    all_attributes = _all_attributes(attributes, **shape, commit_offset=commit_offset)
    _overwrite(file, COMMIT_OFFSET, np.array(commit_offset))
    _overwrite(file, SEAL, np.array(seal_text(all_attributes, columns).encode()))


def _all_attributes(
    attributes: Mapping[str, Attribute], n_designs: int, block_size: int, commit_offset: int = 0
) -> dict[str, Attribute]:
    """The attributes of the study and of the format."""
    return {
        **attributes,
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "n_designs": n_designs,
        "block_size": block_size,
        COMMIT_OFFSET: commit_offset,
    }


def _overwrite(file: h5py.File, name: str, value: npt.NDArray[Any]) -> None:
    """Write another value of the same length into an attribute."""
    attribute = h5a.open(file.id, name.encode())
    attribute.write(value, mtype=attribute.get_type())


def _check_request(
    columns: Sequence[Column], n_designs: int, block_size: int, attributes: Mapping[str, Attribute]
) -> None:
    names = [column.name for column in columns]
    if not names or names[0] != INDEX or columns[0].dtype != "<i8":
        raise ValueError("the first column must be 'design' of dtype '<i8'")
    if len(set(names)) != len(names) or any(not name or "/" in name or name == "." for name in names):
        raise ValueError("column names must be unique, not empty and without '/'")
    if len(names) < 2:
        raise ValueError("a results file needs a column besides 'design'")
    if n_designs < (attributes.get("keep") != KEEP_FRONT) or block_size < 1:
        raise ValueError("a results file needs at least one design and blocks of at least one design")


def _declare(group: h5py.Group, name: str, dtype: str, *shape: int) -> h5py.Dataset:
    """Create a contiguous dataset, which HDF5 allocates when its first value is written and never fills."""
    plist = h5p.create(h5p.DATASET_CREATE)
    plist.set_layout(h5d.CONTIGUOUS)
    plist.set_alloc_time(h5d.ALLOC_TIME_LATE)
    plist.set_fill_time(h5d.FILL_TIME_NEVER)
    plist.set_obj_track_times(False)  # a time would make the bytes differ from run to run
    kind = h5t.py_create(np.dtype(dtype), logical=True)
    return h5py.Dataset(h5d.create(group.id, name.encode(), kind, h5s.create_simple(shape), plist))


def _describe(dataset: h5py.Dataset, column: Column) -> None:
    texts = {"units": column.unit, "long_name": column.long_name, "role": column.role}
    if column.labels:
        texts["labels"] = json.dumps({str(code): label for code, label in column.labels.items()})
    for name, text in texts.items():
        _put_attribute(dataset, name, text)


def _put_attribute(owner: h5py.HLObject, name: str, value: Attribute) -> None:
    if not isinstance(value, str):
        owner.attrs.create(name, value, dtype="<f8" if isinstance(value, float) else "<i8")
        return
    # Fixed length: variable-length texts are in a separate heap, which fewer programs read.
    data = value.encode()
    kind = h5py.string_dtype("utf-8", max(1, len(data)))
    if len(data) > _LONGEST_ATTRIBUTE:
        owner.require_group("study").create_dataset(name, data=np.array(data, dtype=kind), track_times=False)
    else:
        owner.attrs.create(name, np.array(data, dtype=kind), dtype=kind)


def _put_frame(file: h5py.File, names: Sequence[str]) -> None:
    """Describe the columns as pandas does, one of its blocks for each column; the values are links, not copies."""
    frame = file.create_group("frame", track_order=False)
    frame_attributes: dict[str, Attribute] = {
        "pandas_type": "frame",
        "encoding": "UTF-8",
        "errors": "strict",
        "ndim": 2,
        "nblocks": len(names),
    }
    frame_attributes |= {"axis0_variety": "regular", "axis1_variety": "regular"}
    frame_attributes |= {f"block{i}_items_variety": "regular" for i in range(len(names))}
    for name, value in frame_attributes.items():
        _put_attribute(frame, name, value)
    encoded = np.array([name.encode() for name in names], dtype=f"S{max(map(len, map(str.encode, names)), default=1)}")
    _put_names(frame, "axis0", encoded)
    frame["axis1"] = file["designs"][INDEX]
    _put_attribute(frame["axis1"], "kind", "integer")
    _put_attribute(frame["axis1"], "name", INDEX)
    for i, name in enumerate(names):
        _put_names(frame, f"block{i}_items", encoded[i : i + 1])
        frame[f"block{i}_values"] = file["designs"][name]


def _put_names(frame: h5py.Group, name: str, encoded: Any) -> None:
    _put_attribute(frame.create_dataset(name, data=encoded, track_times=False), "kind", "string")
