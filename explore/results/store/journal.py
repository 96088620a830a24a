"""An append-only file of records: each is durable when `append` returns, and damage costs only the record that it hits.

Records follow the signature; the first is the header. Each of the others begins on a new page, because a power cut
during a write may garble whole sectors of the disk. A damaged record is skipped by its length. If the length itself is
damaged, the offset of the next record is unknown, so the rest of the file is cut off, like an incomplete last record.
"""

import contextlib
import io
import json
import os
from array import array
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Self

import numpy.typing as npt

from explore.base.errors import ResultsError
from explore.base.files import new_file, open_binary, open_regular, sync_folder
from explore.results.store import system_calls
from explore.results.store.difference import other_study_error
from explore.results.store.presence import DisplacedError, check_present
from explore.results.store.records import (
    DECODING_ERRORS,
    FRAME,
    LENGTH,
    Record,
    align_offset,
    checksum_of,
    decode_record,
    encode_record,
    frame_record,
    record_alignment,
)
from explore.results.store.sidecar_files import JOURNAL

#: Number of bytes that are copied at a time.
_PIECE = 1 << 20


class Journal:
    """A journal of a study, a context manager. The caller holds the lock of the results file that it belongs to.

    The header is what JSON can hold of the study: the text ``determines``, the kernel and so on. The file is created
    unless it exists. A `ResultsError` says that it is no journal or that of another study, its header is damaged, or
    the disk reports an error. The `n_damaged` damaged records found on entering are skipped.
    """

    def __init__(self, path: Path, header: Mapping[str, Any]) -> None:
        self.path = Path(path)
        self._header = json.loads(json.dumps(header))
        self._offsets = array("Q")  # of the sound records, of which there may be millions
        self._end = 0
        self.n_damaged = 0

    def __enter__(self) -> Self:
        if not self.path.exists():
            self._create()
        try:
            with contextlib.ExitStack() as stack:
                self._descriptor = open_regular(self.path, os.O_RDWR)
                stack.callback(os.close, self._descriptor)
                self._file = stack.enter_context(io.FileIO(self._descriptor, closefd=False))
                self._find_sound_records(self._check_header())
                # A killed run may have left a name or a record that can be read but is not durable.
                system_calls.sync_data(self._descriptor)
                sync_folder(self.path.parent)
                self._closing = stack.pop_all()
        except ResultsError:
            raise
        except OSError as error:
            raise ResultsError(f"{self.path} cannot be written: {error.strerror or error}") from error
        return self

    def __exit__(self, *_: object) -> None:
        self._closing.close()

    def append(self, meta: Mapping[str, Any], arrays: Mapping[str, npt.NDArray[Any]]) -> None:
        """Add a record of what JSON can hold and of one-dimensional arrays by name; return when it is durable."""
        try:
            check_present(self.path, self._descriptor, "blocks")
        except DisplacedError as error:
            if not error.is_removed:
                raise
            self._restore()  # so that the next run finds it
        record = frame_record(encode_record(meta, arrays))
        offset = align_offset(self._end, self._alignment)
        try:
            system_calls.write_at(self._descriptor, record, offset)
            system_calls.sync_data(self._descriptor)
        except OSError as error:
            with contextlib.suppress(OSError):  # an incomplete record is cut off when the journal is opened
                os.ftruncate(self._descriptor, self._end)
            text = f"{self.path} cannot be written: {error.strerror or error}"
            raise ResultsError(f"{text}; run the sweep again to go on once the cause is gone") from error
        self._offsets.append(offset)
        self._end = offset + len(record)

    def remove(self) -> None:
        """Remove the file."""
        with contextlib.suppress(DisplacedError):  # it was removed already, or another file has its name
            check_present(self.path, self._descriptor, "")
            self.path.unlink()

    def records(self) -> Iterator[Record]:
        """Read the records one by one in the order of writing; the arrays are read-only."""
        for offset in self._offsets:  # which may grow meanwhile
            content = self._read(offset, self._end)
            if content is None:
                raise ResultsError(f"{self.path} was damaged after it was opened; run the sweep again to go on")
            yield self._decode(content)

    def _create(self) -> None:
        """Create a journal with its header, which is durable before the file has its name."""
        content = JOURNAL + frame_record(encode_record({"header": self._header}, {}))
        with new_file(self.path, len(content), replace=False) as temporary:
            descriptor = open_binary(temporary, os.O_RDWR | os.O_CREAT | os.O_EXCL)
            try:
                system_calls.write_at(descriptor, content, 0)
                os.fsync(descriptor)
            finally:
                os.close(descriptor)

    def _restore(self) -> None:
        """Write the content of the open, removed file to a new one of its name, and go on with that."""
        with new_file(self.path, self._end, replace=False) as temporary:
            descriptor = open_binary(temporary, os.O_RDWR | os.O_CREAT | os.O_EXCL)
            try:
                for start in range(0, self._end, _PIECE):
                    self._file.seek(start)
                    system_calls.write_at(descriptor, _read_all(self._file, min(_PIECE, self._end - start)), start)
                os.fsync(descriptor)
                os.dup2(descriptor, self._descriptor, inheritable=False)
            finally:
                os.close(descriptor)

    def _check_header(self) -> int:
        """Return the offset of the end of the header; `ResultsError` unless the journal is of this study."""
        advice = "move it away to start over"
        self._alignment = record_alignment(self._file.read(len(JOURNAL)))
        if not self._alignment:
            raise ResultsError(f"{self.path} is not a journal, or damaged at its beginning; {advice}")
        content = self._read(len(JOURNAL), os.fstat(self._descriptor).st_size)
        if content is None:
            raise ResultsError(f"{self.path} is damaged at its beginning, so its study is unknown; {advice}")
        header = self._decode(content)[0].get("header")
        if header != self._header:
            raise other_study_error(self.path, header if isinstance(header, dict) else {}, self._header)
        return len(JOURNAL) + FRAME.size + len(content)

    def _find_sound_records(self, header_end: int) -> None:
        """Find the offsets of sound records and cut off what follows the last one."""
        size = os.fstat(self._descriptor).st_size
        self._end = header_end
        offset = align_offset(self._end, self._alignment)
        self._offsets, self.n_damaged = array("Q"), 0
        n_unsound = 0  # since the last sound record: an incomplete last record does not count as damage
        while (frame := self._read_frame(offset, size)) is not None:
            record_end = offset + FRAME.size + frame[0]
            if self._read(offset, size) is None:
                n_unsound += 1
            else:
                self._offsets.append(offset)
                self._end = record_end
                self.n_damaged, n_unsound = self.n_damaged + n_unsound, 0
            offset = align_offset(record_end, self._alignment)
        if self._end < size:
            os.ftruncate(self._descriptor, self._end)
            system_calls.sync_data(self._descriptor)

    def _read_frame(self, offset: int, end: int) -> tuple[int, int] | None:
        """Length and checksum of the record at an offset; None if no record of that length ends before `end`."""
        self._file.seek(offset)
        frame = self._file.read(FRAME.size)
        if len(frame) < FRAME.size:
            return None
        length, checksum = FRAME.unpack(frame)
        return (length, checksum) if LENGTH.size <= length <= end - offset - FRAME.size else None

    def _read(self, offset: int, end: int) -> bytes | None:
        """The content of the record at an offset; None if it is not sound."""
        frame = self._read_frame(offset, end)
        if frame is None:
            return None
        length, checksum = frame
        content = _read_all(self._file, length)
        return content if len(content) == length and checksum_of(content) == checksum else None

    def _decode(self, content: bytes) -> Record:
        try:
            return decode_record(content)
        except DECODING_ERRORS as error:
            raise ResultsError(f"{self.path} was not written by this explore: {error}; move it away") from error


def _read_all(file: io.FileIO, length: int) -> bytes:
    """All bytes up to a length or to the end of the file; one call reads 2 GiB at most."""
    content = bytearray()
    while len(content) < length and (piece := file.read(length - len(content))):
        content += piece
    return bytes(content)
