"""Compressed chunks of a packed file, in HDF5's two standard filters: shuffle, then deflate.

They are compressed and decompressed here rather than by HDF5, which may load plugins for other filters and does not
limit the length of what a chunk decompresses to.
"""

import zlib
from typing import Any

import h5py
import numpy as np
import numpy.typing as npt
from h5py import h5d, h5p, h5s, h5t, h5z

_LEVEL = 1
#: Bound of the bytes to which deflate expands one, 1032.
_LARGEST_EXPANSION = 1100

#: Offset in the file and stored bytes of each chunk, a row for each.
ChunkTable = npt.NDArray[np.int64]


def chunk_length(n_designs: int, block_size: int) -> int:
    """Number of values in a chunk: those of a block, which is read and checked as a whole."""
    return max(1, min(block_size, n_designs))


def make_chunked(group: h5py.Group, name: str, dtype: str, length: int, chunk: int) -> h5py.Dataset:
    """Create a dataset without chunks, for `compress_chunk` and HDF5's direct writes."""
    plist = h5p.create(h5p.DATASET_CREATE)
    plist.set_chunk((chunk,))
    plist.set_shuffle()
    plist.set_deflate(_LEVEL)
    plist.set_fill_time(h5d.FILL_TIME_NEVER)
    plist.set_obj_track_times(False)  # a time would make the bytes differ from run to run
    kind = h5t.py_create(np.dtype(dtype), logical=True)
    return h5py.Dataset(h5d.create(group.id, name.encode(), kind, h5s.create_simple((length,)), plist))


def compress_chunk(values: npt.NDArray[Any], chunk: int) -> bytes:
    """The bytes of one chunk; a column's last chunk is padded with zeros."""
    padded = np.zeros(chunk, values.dtype)
    padded[: len(values)] = values
    return zlib.compress(np.ascontiguousarray(padded.view("u1").reshape(chunk, -1).T).data, _LEVEL)


def decompress_chunk(stored: bytes, dtype: str, chunk: int) -> npt.NDArray[Any]:
    """The values of one chunk, shape (chunk,); ValueError when the bytes are not those of a chunk."""
    kind, stream = np.dtype(dtype), zlib.decompressobj()
    try:
        data = stream.decompress(stored, chunk * kind.itemsize + 1)  # one more, to see the end of the stream
    except zlib.error as error:
        raise ValueError(str(error)) from error
    if not stream.eof or len(data) != chunk * kind.itemsize:
        raise ValueError(f"its length is not {chunk * kind.itemsize} bytes")
    return np.ascontiguousarray(np.frombuffer(data, "u1").reshape(kind.itemsize, chunk).T).view(kind).ravel()


def read_chunk_table(dataset: h5py.Dataset, n_designs: int, chunk: int, size: int) -> ChunkTable:
    """Offset and stored bytes of each chunk, shape (chunks, 2); ValueError unless all are present and in the file."""
    plist = dataset.id.get_create_plist()
    if dataset.shape != (n_designs,) or plist.get_layout() != h5d.CHUNKED or plist.get_chunk() != (chunk,):
        raise ValueError(f"{dataset.name} is not an array of shape {(n_designs,)} in chunks of {chunk}")
    filters = [plist.get_filter(i)[0] for i in range(plist.get_nfilters())]
    if filters != [h5z.FILTER_SHUFFLE, h5z.FILTER_DEFLATE]:
        raise ValueError(f"{dataset.name} has other filters than shuffle and deflate")
    count = -(-n_designs // chunk)
    if count > size or dataset.id.get_num_chunks() != count:
        raise ValueError(f"{dataset.name} lacks chunks")
    chunk_infos: list[Any] = []
    dataset.id.chunk_iter(chunk_infos.append)
    rows = [(info.chunk_offset[0], info.byte_offset, info.size, info.filter_mask) for info in chunk_infos]
    # Of objects, because a damaged offset may not fit into 64 bits.
    table = np.array(sorted(rows), dtype=object).reshape(-1, 4)
    _check_chunks(dataset, table, count, chunk, size)
    return table[:, 1:3].astype(np.int64)


def _check_chunks(dataset: h5py.Dataset, table: npt.NDArray[Any], count: int, chunk: int, size: int) -> None:
    first, offset, stored, skipped_filters = table.T
    if table.shape != (count, 4) or np.any(first != np.arange(count) * chunk):
        raise ValueError(f"{dataset.name} has chunks of wrong rows")
    if np.any(offset < 0) or np.any(offset + stored > size):
        raise ValueError(f"{dataset.name} reaches beyond the end of the file")
    whole = chunk * dataset.dtype.itemsize
    # Incompressible data grow by less than a thousandth and a header.
    is_impossible = (stored * _LARGEST_EXPANSION < whole) | (stored > whole + whole // 1000 + 100)
    if np.any(skipped_filters != 0) or np.any(is_impossible):
        raise ValueError(f"{dataset.name} has chunks of impossible lengths")
