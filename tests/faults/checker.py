"""Check a results file by h5py and zlib alone, and by the readers of explore."""

import contextlib
import hashlib
import json
import zlib
from collections.abc import Collection
from dataclasses import dataclass, field
from pathlib import Path

import h5py
import numpy as np

from explore.results.store.open_results import open_results
from explore.results.store.sidecar_files import journal_name
from explore.studies.designs.spaces import BLOCK_SIZE
from faults.content import BLOCK, COLUMNS, N_BLOCKS, kept_values, rows, values

_EXPECTED = [[values(n)[column.name].tobytes() for column in COLUMNS] for n in range(N_BLOCKS)]
_KEPT = [[kept_values(n)[column.name].tobytes() for column in COLUMNS] for n in range(N_BLOCKS)]


@dataclass
class Verdict:
    """State of a file after a fault; sets hold numbers of blocks.

    Attributes
    ----------
    lost
        Acknowledged, but not there or of wrong values.
    phantom
        Committed with the right checksum, but of wrong values: silent damage.
    detected
        Committed with a wrong checksum: damage that the checksum shows.
    """

    absent: bool = False
    unreadable: str = ""
    committed: set[int] = field(default_factory=set)
    lost: set[int] = field(default_factory=set)
    phantom: set[int] = field(default_factory=set)
    detected: set[int] = field(default_factory=set)

    @property
    def sound(self) -> bool:
        """Whether the file is absent or readable, without lost, phantom or damaged committed blocks."""
        return not (self.unreadable or self.lost or self.phantom or self.detected & self.committed)


def check(path: Path, acknowledged: Collection[int] = (), keep: str = "all") -> Verdict:
    """Check a file, given the blocks whose commit had returned."""
    if keep == "front":
        return _check_kept(path, set(acknowledged))
    if not path.exists():
        return Verdict(absent=True, lost=set(acknowledged))
    try:
        words, blocks = _read(path)
        results = open_results(path)
        by_product = set(results.verify()), results.n_committed
    except (OSError, RuntimeError, KeyError, ValueError) as error:  # what h5py may raise, and the product's own
        return Verdict(unreadable=str(error), lost=set(acknowledged))
    verdict = Verdict(committed={number for number, word in enumerate(words) if word >> 32 == 1})
    for number, pieces in enumerate(blocks):
        word = words[number]
        if word and word != (1 << 32) + _crc(pieces):
            verdict.detected.add(number)
        elif word and pieces != _EXPECTED[number]:
            verdict.phantom.add(number)
        if number in acknowledged and (word >> 32 != 1 or pieces != _EXPECTED[number]):
            verdict.lost.add(number)
    by_bytes = verdict.detected, sum(len(rows(number)) for number in verdict.committed)
    assert by_product == by_bytes, f"{path}: damaged and committed: {by_product} by explore, {by_bytes} by the bytes"
    return verdict


def _check_kept(path: Path, acknowledged: set[int]) -> Verdict:
    """Check the journal, or the results file that replaces it at the end."""
    if not path.exists():
        blocks = journal_blocks(path)
        phantom = {number for number, data in blocks.items() if data != b"".join(_KEPT[number])}
        lost = acknowledged - (blocks.keys() - phantom)
        return Verdict(absent=True, committed=set(blocks), lost=lost, phantom=phantom)
    try:
        with h5py.File(path, "r") as file:
            columns = [file["designs"][column.name][:].tobytes() for column in COLUMNS]
        assert open_results(path).verify() == []
    except (OSError, RuntimeError, KeyError, ValueError, AssertionError) as error:
        return Verdict(unreadable=str(error), lost=acknowledged)
    whole = columns == [b"".join(pieces) for pieces in zip(*_KEPT, strict=True)]
    return Verdict(committed=set(range(N_BLOCKS)), phantom=set() if whole else set(range(N_BLOCKS)))


def journal_blocks(path: Path) -> dict[int, bytes]:
    """Bytes of the columns by block in the intact records of a journal, read as docs/results-format.md describes."""
    raw = b""
    with contextlib.suppress(FileNotFoundError):  # it may be removed between two calls
        raw = journal_name(path).read_bytes()
    offset, blocks = len(b"explore journal 2\n"), {}
    while offset + 12 <= len(raw):
        length, checksum = int.from_bytes(raw[offset : offset + 8], "little"), raw[offset + 8 : offset + 12]
        content = raw[offset + 12 : offset + 12 + length]
        if zlib.crc32(raw[offset : offset + 8] + content).to_bytes(4, "little") == checksum:
            text_end = 8 + int.from_bytes(content[:8], "little")
            meta = json.loads(content[8:text_end])["meta"]
            if "block" in meta:  # the header has none
                blocks[meta["block"]] = content[text_end:]
        offset = -(-(offset + 12 + length) // 4096) * 4096  # records begin on pages
    return blocks


def _read(path: Path) -> tuple[list[int], list[list[bytes]]]:
    """The commit words, and the bytes of the columns of each block."""
    with h5py.File(path, "r") as file:
        assert set(file["designs"]) == {column.name for column in COLUMNS}
        columns = [file["designs"][column.name][:] for column in COLUMNS]
        pages = file["progress/commit"][:]
        words = np.where(pages[:, 1:].any(axis=1), 2**64 - 1, pages[:, 0]).tolist()  # a word is alone on its page
    assert [c.dtype.str for c in columns] == [column.dtype for column in COLUMNS]
    return words, [[c[n * BLOCK : (n + 1) * BLOCK].tobytes() for c in columns] for n in range(N_BLOCKS)]


def _crc(pieces: list[bytes]) -> int:
    return zlib.crc32(b"".join(pieces))


def done_blocks(path: Path) -> set[int]:
    """Numbers of the committed blocks of any study, in its results file or its journal."""
    if not path.exists():
        return set(journal_blocks(path))
    with h5py.File(path, "r") as file:
        if "studied_designs" in file.attrs:
            return set(range(-(-int(file.attrs["studied_designs"]) // BLOCK_SIZE)))
        return set(np.flatnonzero(file["progress/commit"][:, 0] >> 32 == 1).tolist())


def sha256(path: Path) -> str:
    """SHA-256 of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()
