"""What is in a results file, seen with h5py and zlib only, and what the product says of the same file."""

from __future__ import annotations

import contextlib
import hashlib
import json
import zlib
from collections.abc import Collection
from dataclasses import dataclass, field
from pathlib import Path

import h5py
import numpy as np

from explore.design_space import BLOCK_SIZE
from explore.store.names import journal_name
from explore.store.opening import open_results
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
        """Absent or complete, nothing lost, no block that is not what it says."""
        return not (self.unreadable or self.lost or self.phantom or self.detected)


def check(path: Path, acknowledged: Collection[int] = (), keep: str = "all") -> Verdict:
    """Judge a file, given the blocks whose commit had returned."""
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
    for number, found in enumerate(blocks):
        word = words[number]
        if word and word != (1 << 32) + _crc(found):
            verdict.detected.add(number)
        elif word and found != _EXPECTED[number]:
            verdict.phantom.add(number)
        if number in acknowledged and (word >> 32 != 1 or found != _EXPECTED[number]):
            verdict.lost.add(number)
    said = verdict.detected, sum(len(rows(number)) for number in verdict.committed)
    assert by_product == said, f"{path}: the product says {by_product}, the bytes say {said}"
    return verdict


def _check_kept(path: Path, acknowledged: set[int]) -> Verdict:
    """Judge a results file that is there at the end only, and its journal before."""
    if not path.exists():
        found = journal_blocks(path)
        phantom = {number for number, data in found.items() if data != b"".join(_KEPT[number])}
        lost = acknowledged - (found.keys() - phantom)
        return Verdict(absent=True, committed=set(found), lost=lost, phantom=phantom)
    try:
        with h5py.File(path, "r") as file:
            columns = [file["designs"][column.name][:].tobytes() for column in COLUMNS]
        assert open_results(path).verify() == []
    except (OSError, RuntimeError, KeyError, ValueError, AssertionError) as error:
        return Verdict(unreadable=str(error), lost=acknowledged)
    whole = columns == [b"".join(pieces) for pieces in zip(*_KEPT, strict=True)]
    return Verdict(committed=set(range(N_BLOCKS)), phantom=set() if whole else set(range(N_BLOCKS)))


def journal_blocks(path: Path) -> dict[int, bytes]:
    """What a journal's sound records hold: the bytes of the columns by block, read by the format's description."""
    raw = b""
    with contextlib.suppress(FileNotFoundError):  # also when it goes just now
        raw = journal_name(path).read_bytes()
    place, found = len(b"explore journal 1\n"), {}
    while place + 12 <= len(raw):
        length, checksum = int.from_bytes(raw[place : place + 8], "little"), raw[place + 8 : place + 12]
        content = raw[place + 12 : place + 12 + length]
        if zlib.crc32(raw[place : place + 8] + content).to_bytes(4, "little") == checksum:
            text = 8 + int.from_bytes(content[:8], "little")
            meta = json.loads(content[8:text])["meta"]
            if "block" in meta:  # the header has none
                found[meta["block"]] = content[text:]
        place += 12 + length
    return found


def _read(path: Path) -> tuple[list[int], list[list[bytes]]]:
    """The commit words, and of each block the bytes of its columns."""
    with h5py.File(path, "r") as file:
        assert set(file["designs"]) == {column.name for column in COLUMNS}
        columns = [file["designs"][column.name][:] for column in COLUMNS]
        words = file["progress/commit"][:].tolist()
    assert [c.dtype.str for c in columns] == [column.dtype for column in COLUMNS]
    return words, [[c[n * BLOCK : (n + 1) * BLOCK].tobytes() for c in columns] for n in range(N_BLOCKS)]


def _crc(pieces: list[bytes]) -> int:
    return zlib.crc32(b"".join(pieces))


def done_blocks(path: Path) -> set[int]:
    """Numbers of the blocks of any study that are done, in a results file or in its journal."""
    if not path.exists():
        return set(journal_blocks(path))
    with h5py.File(path, "r") as file:
        if "studied_designs" in file.attrs:
            return set(range(-(-int(file.attrs["studied_designs"]) // BLOCK_SIZE)))
        return set(np.flatnonzero(file["progress/commit"][:] >> 32 == 1).tolist())


def sha256(path: Path) -> str:
    """Digest of a whole file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()
