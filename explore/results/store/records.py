"""The records of a journal as bytes.

A record is the length of its content, the CRC-32 of length and content, and the content: the length of a JSON text, the
text, and the bytes of the arrays that the text describes.
"""

import contextlib
import json
import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from explore.base.checksums import crc32
from explore.results.store.layout import PAGE
from explore.results.store.sidecar_files import JOURNAL, JOURNAL_1

FRAME = struct.Struct("<QI")
LENGTH = struct.Struct("<Q")
#: Errors of `decode_record` on bytes that are not a record.
DECODING_ERRORS = (ValueError, KeyError, TypeError, struct.error, RecursionError)
#: Numpy kinds that an array may have.
_KINDS = "biuf"

Record = tuple[dict[str, Any], dict[str, npt.NDArray[Any]]]


def count_records(path: Path) -> tuple[int, dict[str, Any]]:
    """Number of complete records of a journal, sound or damaged, and its header; a sweep may be writing the journal."""
    if not path.is_file():
        return 0, {}
    count, size, header = -1, path.stat().st_size, b""  # the header is a record too
    with path.open("rb") as file:
        if not (alignment := record_alignment(file.read(len(JOURNAL)))):
            return 0, {}
        offset = len(JOURNAL)
        while offset + FRAME.size <= size:
            file.seek(offset)
            length = FRAME.unpack(file.read(FRAME.size))[0]
            end = offset + FRAME.size + length
            if count < 0 and end <= size:
                header = file.read(length)
            count += end <= size
            offset = align_offset(end, alignment)
    with contextlib.suppress(*DECODING_ERRORS):
        return max(count, 0), dict(decode_record(header)[0]["header"])
    return max(count, 0), {}


def record_alignment(signature: bytes) -> int:
    """Alignment of the records in a journal of this signature, bytes; 0 if it is not the signature of a journal."""
    return {JOURNAL: PAGE, JOURNAL_1: 1}.get(signature, 0)


def align_offset(end: int, alignment: int) -> int:
    """The first aligned offset at or after `end`."""
    return -(-end // alignment) * alignment


def checksum_of(content: bytes) -> int:
    """CRC-32 of length and content: without the length, zeros would be an empty record with the right checksum, 0."""
    return crc32(content, crc32(LENGTH.pack(len(content))))


def frame_record(content: bytes) -> bytes:
    """The bytes of a record: length, checksum and content."""
    return FRAME.pack(len(content), checksum_of(content)) + content


def encode_record(meta: Mapping[str, Any], arrays: Mapping[str, npt.NDArray[Any]]) -> bytes:
    """Encode a record's content: JSON data and arrays of numbers or booleans, each of shape (n,)."""
    little_endian = {name: np.ascontiguousarray(a, a.dtype.newbyteorder("<")) for name, a in arrays.items()}
    for name, values in arrays.items():
        if values.ndim != 1 or values.dtype.kind not in _KINDS:
            raise ValueError(f"{name} is not a one-dimensional array of numbers")
    columns = [[name, values.dtype.str, len(values)] for name, values in little_endian.items()]
    text = json.dumps({"meta": dict(meta), "columns": columns}).encode()
    return b"".join([LENGTH.pack(len(text)), text, *(values.tobytes() for values in little_endian.values())])


def decode_record(content: bytes) -> Record:
    """Decode a record's content; raises one of `DECODING_ERRORS` if it is not a record's."""
    (length,) = LENGTH.unpack_from(content)
    offset = LENGTH.size + length
    description = json.loads(content[LENGTH.size : offset])
    arrays: dict[str, npt.NDArray[Any]] = {}
    for name, kind, count in description["columns"]:
        dtype = np.dtype(kind)
        if dtype.kind not in _KINDS or not 0 <= count <= (len(content) - offset) // dtype.itemsize:
            raise ValueError(f"{name!r} is not in the record")
        arrays[name] = np.frombuffer(content, dtype, count, offset)
        offset += count * dtype.itemsize
    return dict(description["meta"]), arrays
