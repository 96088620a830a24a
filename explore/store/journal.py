"""An append-only file of records: each is durable when `append` returns, and damage costs only the record that it hits.

After the signature follow records: length of the content, CRC-32 of the length and the content, the content. That is
the length of a JSON text, the text, and the bytes of the arrays that the text describes. A record that is not as it was
written is stepped over by its length. Where that is damaged nobody knows where the next record begins, so what follows
is cut off, as is a torn end.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import struct
import zlib
from array import array
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from explore.errors import ResultsError
from explore.store import platform
from explore.store.creation import new_file
from explore.store.difference import other_study

_SIGNATURE = b"explore journal 1\n"
_FRAME = struct.Struct("<QI")
_LENGTH = struct.Struct("<Q")
#: Kinds of numbers that an array may hold.
_KINDS = "biuf"
#: What bytes that were not written as a record may raise.
_UNREADABLE = (ValueError, KeyError, TypeError, struct.error, RecursionError)

Record = tuple[dict[str, Any], dict[str, npt.NDArray[Any]]]


def count_records(path: Path) -> tuple[int, dict[str, Any]]:
    """How many records a journal holds, sound or not, also while it grows, and its header.

    What is torn is not counted.
    """
    if not path.is_file():
        return 0, {}
    count, size, header = -1, path.stat().st_size, b""  # the header is a record too
    with path.open("rb") as file:
        place = len(_SIGNATURE)
        while place + _FRAME.size <= size:
            file.seek(place)
            length = _FRAME.unpack(file.read(_FRAME.size))[0]
            place += _FRAME.size + length
            if count < 0 and place <= size:
                header = file.read(length)
            count += place <= size
    with contextlib.suppress(*_UNREADABLE):
        return max(count, 0), dict(_decoded(header)[0]["header"])
    return max(count, 0), {}


class Journal:
    """A journal of a study, a context manager. The caller holds the lock of the results file that it belongs to.

    Attributes
    ----------
    damaged
        How many records were found on entering that are not as they were written; what they held is not believed.

    Parameters
    ----------
    path
        The file; it is created unless it is there.
    header
        What the records belong to, for JSON: the text ``determines``, the kernel and so on.

    Raises
    ------
    ResultsError
        On entering: the journal belongs to another study, is no journal or is damaged at its beginning, the disk is
        full or the folder cannot be written. On appending: the disk reports an error.
    """

    def __init__(self, path: Path, header: Mapping[str, Any]) -> None:
        self.path = Path(path)
        self._header = json.loads(json.dumps(header))
        self._places = array("Q")  # of the sound records; 8 bytes each, as there may be millions
        self.damaged = 0

    def __enter__(self) -> Self:
        if not self.path.exists():
            self._create()
        try:
            with contextlib.ExitStack() as stack:
                self._descriptor = platform.open_binary(self.path, os.O_RDWR)
                stack.callback(os.close, self._descriptor)
                self._file = stack.enter_context(io.FileIO(self._descriptor, closefd=False))
                self._first = self._check_header()
                self._find_sound_records()
                # A killed run may have left a name or a record that is seen but not durable.
                platform.sync_data(self._descriptor)
                platform.sync_folder(self.path.parent)
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

    def append(self, meta: Mapping[str, Any], arrays: Mapping[str, npt.NDArray[Any]]) -> None:
        """Add a record and return when it is durable.

        Parameters
        ----------
        meta
            Anything that JSON can hold.
        arrays
            Numbers or booleans by name, each of shape (n,) with an n of its own.
        """
        record = _framed(_encoded(meta, arrays))
        try:
            platform.write_at(self._descriptor, record, self._end)
            platform.sync_data(self._descriptor)
        except OSError as error:
            with contextlib.suppress(OSError):  # what is left of the record is cut off when the journal is opened
                os.ftruncate(self._descriptor, self._end)
            text = f"{self.path} cannot be written: {error.strerror or error}"
            raise ResultsError(f"{text}; run the sweep again to go on once the cause is gone") from error
        self._places.append(self._end)
        self._end += len(record)

    def records(self) -> Iterator[Record]:
        """The records in the order of their coming, each read when its turn comes; the arrays are read-only."""
        for place in self._places:  # which may grow meanwhile
            content = self._read(place, self._end)
            if content is None:
                raise ResultsError(f"{self.path} was damaged after it was opened; run the sweep again to go on")
            yield self._decoded(content)

    def _create(self) -> None:
        """Make a journal with its header, complete from the moment when it has its name."""
        content = _SIGNATURE + _framed(_encoded({"header": self._header}, {}))
        with new_file(self.path, len(content)) as temporary:
            descriptor = platform.open_binary(temporary, os.O_RDWR | os.O_CREAT | os.O_EXCL)
            try:
                platform.write_at(descriptor, content, 0)
                os.fsync(descriptor)
            finally:
                os.close(descriptor)

    def _check_header(self) -> int:
        """Make sure that the journal is of this study; returns the place of the first record."""
        advice = "move it away to start over"
        if self._file.read(len(_SIGNATURE)) != _SIGNATURE:
            raise ResultsError(f"{self.path} is no journal, or damaged at its beginning; {advice}")
        content = self._read(len(_SIGNATURE), os.fstat(self._descriptor).st_size)
        if content is None:
            raise ResultsError(f"{self.path} is damaged at its beginning, so its study is unknown; {advice}")
        header = self._decoded(content)[0].get("header")
        if header != self._header:
            raise other_study(self.path, header if isinstance(header, dict) else {}, self._header)
        return len(_SIGNATURE) + _FRAME.size + len(content)

    def _find_sound_records(self) -> None:
        """Note where they are and cut off what follows the last one; what is missing is computed again."""
        size = os.fstat(self._descriptor).st_size
        place = self._end = self._first
        self._places, self.damaged = array("Q"), 0
        doubtful = 0  # the last record may be torn, which is no damage
        while (frame := self._frame(place, size)) is not None:
            following = place + _FRAME.size + frame[0]
            if self._read(place, size) is None:
                doubtful += 1
            else:
                self._places.append(place)
                self._end = following
                self.damaged, doubtful = self.damaged + doubtful, 0
            place = following
        if self._end < size:
            os.ftruncate(self._descriptor, self._end)
            platform.sync_data(self._descriptor)

    def _frame(self, place: int, end: int) -> tuple[int, int] | None:
        """Length and checksum of the record at a place, or None when no record can have that length."""
        self._file.seek(place)
        frame = self._file.read(_FRAME.size)
        if len(frame) < _FRAME.size:
            return None
        length, checksum = _FRAME.unpack(frame)
        return (length, checksum) if _LENGTH.size <= length <= end - place - _FRAME.size else None

    def _read(self, place: int, end: int) -> bytes | None:
        """The content of the record at a place, or None when it is not sound."""
        frame = self._frame(place, end)
        if frame is None:
            return None
        length, checksum = frame
        content = _read_all(self._file, length)
        return content if len(content) == length and _checksum(content) == checksum else None

    def _decoded(self, content: bytes) -> Record:
        try:
            return _decoded(content)
        except _UNREADABLE as error:
            raise ResultsError(f"{self.path} was not written by this explore: {error}; move it away") from error


def _read_all(file: io.FileIO, length: int) -> bytes:
    """As many bytes as there are, up to a length: one call reads 2 GiB at most."""
    content = bytearray()
    while len(content) < length and (piece := file.read(length - len(content))):
        content += piece
    return bytes(content)


def _checksum(content: bytes) -> int:
    # The length is part of it, because the sum of nothing is 0: a file filled up with zeros holds no records.
    return zlib.crc32(content, zlib.crc32(_LENGTH.pack(len(content))))


def _framed(content: bytes) -> bytes:
    return _FRAME.pack(len(content), _checksum(content)) + content


def _encoded(meta: Mapping[str, Any], arrays: Mapping[str, npt.NDArray[Any]]) -> bytes:
    little = {name: np.ascontiguousarray(a, a.dtype.newbyteorder("<")) for name, a in arrays.items()}
    for name, values in arrays.items():
        if values.ndim != 1 or values.dtype.kind not in _KINDS:
            raise ValueError(f"{name} is not a one-dimensional array of numbers")
    columns = [[name, values.dtype.str, len(values)] for name, values in little.items()]
    text = json.dumps({"meta": dict(meta), "columns": columns}).encode()
    return b"".join([_LENGTH.pack(len(text)), text, *(values.tobytes() for values in little.values())])


def _decoded(content: bytes) -> Record:
    (length,) = _LENGTH.unpack_from(content)
    place = _LENGTH.size + length
    description = json.loads(content[_LENGTH.size : place])
    arrays: dict[str, npt.NDArray[Any]] = {}
    for name, kind, count in description["columns"]:
        dtype = np.dtype(kind)
        if dtype.kind not in _KINDS or not 0 <= count <= (len(content) - place) // dtype.itemsize:
            raise ValueError(f"{name!r} is not in the record")
        arrays[name] = np.frombuffer(content, dtype, count, place)
        place += count * dtype.itemsize
    return dict(description["meta"]), arrays
