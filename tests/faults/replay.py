"""The states of a folder after a kill or a power cut, derived from a trace of system calls.

What POSIX leaves open is taken at its worst. Until a file is synchronised, each of its writes may be there, missing or
torn between sectors of the disk, independent of all others, and in any order; likewise its length. Sectors that a write
touches may hold anything, also where other bytes of them were durable before. Until a folder is synchronised, each
change of a name in it may be there or not.
"""

import random
import struct
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

_SECTOR = 512
_HEAD = struct.Struct("=iiqqii")
#: Calls that the recorder counts: they change the folder or make it durable.
COUNTED = frozenset("cwtasdrulm")


class Call(NamedTuple):
    """One record of `recorder.c`."""

    operation: str
    descriptor: int
    offset: int
    length: int
    path: str
    other: str
    data: bytes


def read_trace(path: Path) -> list[Call]:
    """All calls of a trace."""
    return list(_calls(path.read_bytes()))


def _calls(raw: bytes) -> Iterator[Call]:
    position = 0

    def take(length: int) -> bytes:
        nonlocal position
        position += length
        return raw[position - length : position]

    while position < len(raw):
        operation, descriptor, offset, length, first, second = _HEAD.unpack(take(_HEAD.size))
        path, other = take(first).decode(), take(second).decode()
        data = take(length) if operation == ord("w") else b""
        yield Call(chr(operation), descriptor, offset, length, path, other, data)


@dataclass(eq=False)
class _File:
    """A file: its bytes as processes see them, those certainly on the disk, and the writes in between."""

    seen: bytearray = field(default_factory=bytearray)
    durable: bytes = b""
    unsure: list[Call] = field(default_factory=list)

    def change(self, call: Call) -> None:
        _apply(self.seen, call)
        self.unsure.append(call)

    def synchronise(self) -> None:
        self.durable, self.unsure = bytes(self.seen), []

    def after_cut(self, chance: random.Random) -> bytes:
        content = bytearray(self.durable)
        for call in chance.sample(self.unsure, len(self.unsure)):
            draw = chance.random()
            if call.operation != "w":
                if draw < 0.5:
                    _apply(content, call)
            elif draw < 0.5:
                _apply(content, call)
            elif draw < 0.65:
                _tear(content, call, chance)
            elif draw < 0.8:
                _garble(content, call, chance)
        return bytes(content)


def _apply(content: bytearray, call: Call) -> None:
    if call.operation == "w":
        _put(content, call.offset, call.data)
    elif call.operation == "t":
        del content[call.length :]
        content.extend(bytes(call.length - len(content)))
    else:  # reserve
        content.extend(bytes(max(0, call.offset + call.length - len(content))))


def _put(content: bytearray, offset: int, data: bytes) -> None:
    content.extend(bytes(max(0, offset - len(content))))
    content[offset : offset + len(data)] = data


def _tear(content: bytearray, call: Call, chance: random.Random) -> None:
    """Carry out a write in some of its sectors only."""
    start = call.offset
    while start < call.offset + call.length:
        stop = min((start // _SECTOR + 1) * _SECTOR, call.offset + call.length)
        if chance.random() < 0.5:
            _put(content, start, call.data[start - call.offset : stop - call.offset])
        start = stop


def _garble(content: bytearray, call: Call, chance: random.Random) -> None:
    """Fill some of the sectors that a write touches with random bytes."""
    content.extend(bytes(max(0, call.offset + call.length - len(content))))
    for start in range(call.offset // _SECTOR * _SECTOR, call.offset + call.length, _SECTOR):
        if chance.random() < 0.5:
            stop = min(start + _SECTOR, len(content))
            content[start:stop] = chance.randbytes(stop - start)


class Disk:
    """A folder and its content.

    Parameters
    ----------
    folder
        The folder that was recorded, which is durable itself.
    files
        What was durable in it before, by path.
    """

    def __init__(self, folder: Path, files: dict[str, bytes] | None = None) -> None:
        self.folder = folder
        self._folder = str(folder)
        self._names: dict[str, _File | None] = {  # None: a folder
            path: _File(bytearray(content), content) for path, content in (files or {}).items()
        }
        self._durable_names = dict(self._names)
        self._unsure_names: list[tuple[Call, _File | None]] = []
        self._open: dict[int, _File | str] = {}
        self.acknowledged: set[int] = set()

    def new_process(self) -> None:
        """Close all descriptors: the process has ended."""
        self._open.clear()

    def do(self, call: Call) -> None:
        """Carry out one call."""
        match call.operation:
            case "o" | "c":
                self._do_open(call)
            case "x":
                self._open.pop(call.descriptor, None)
            case "w" | "t" | "a":
                self._open[call.descriptor].change(call)
            case "s" | "d":
                self._synchronise(self._open[call.descriptor])
            case "r" | "u" | "m" | "l":
                self._rename(call, self._names.get(call.path))
            case "k" if call.path.startswith("done "):
                self.acknowledged.add(int(call.path.split()[1]))

    def _do_open(self, call: Call) -> None:
        if call.path == self._folder or self._names.get(call.path, 0) is None:
            self._open[call.descriptor] = call.path
            return
        if call.path not in self._names:
            self._rename(call, _File())
        elif call.operation == "c":
            self._names[call.path].change(call._replace(operation="t", length=0))
        self._open[call.descriptor] = self._names[call.path]

    def _rename(self, call: Call, file: _File | None) -> None:
        _change(self._names, call, file)
        self._unsure_names.append((call, file))

    def _synchronise(self, target: _File | str) -> None:
        """Make a file, or the names in a folder, durable."""
        if isinstance(target, _File):
            target.synchronise()
            return
        still_unsure = []
        for call, file in self._unsure_names:
            if _parent(call.path) == target:
                _change(self._durable_names, call, file)
            else:
                still_unsure.append((call, file))
        self._unsure_names = still_unsure

    def after_kill(self, during: Call | None = None) -> dict[str, bytes | None]:
        """Content by path if the process is killed now or in the middle of a write; None stands for a folder."""
        contents = {path: None if file is None else bytes(file.seen) for path, file in self._names.items()}
        if during is not None:
            torn = self._open[during.descriptor]
            content = bytearray(torn.seen)
            _put(content, during.offset, during.data[: (during.length + 1) // 2])
            contents |= {path: bytes(content) for path, file in self._names.items() if file is torn}
        return contents

    def after_cut(self, chance: random.Random) -> dict[str, bytes | None]:
        """A possible content by path if the power is cut now."""
        names = dict(self._durable_names)
        for call, file in self._unsure_names:
            if chance.random() < 0.5:
                _change(names, call, file)
        content = {}  # a file may have two names, or none, but one content
        for file in names.values():
            if file is not None and file not in content:
                content[file] = file.after_cut(chance)
        contents = {path: None if file is None else content[file] for path, file in names.items()}
        return {path: data for path, data in contents.items() if self._is_reachable(path, names)}

    def _is_reachable(self, path: str, names: dict[str, _File | None]) -> bool:
        parent = _parent(path)
        return parent == self._folder or (parent in names and self._is_reachable(parent, names))


def _change(names: dict[str, _File | None], call: Call, file: _File | None) -> None:
    """Create, rename or remove a name."""
    if call.operation == "u":
        names.pop(call.path, None)
        return
    if call.operation == "r" and names.get(call.path) is file:
        names.pop(call.path, None)
    names[call.other or call.path] = file


def _parent(path: str) -> str:
    return path.rsplit("/", 1)[0]


def put_down(state: dict[str, bytes | None], recorded: Path, folder: Path) -> None:
    """Write a state into an empty folder."""
    for path in sorted(state, key=len):  # folders before their files
        target = folder / Path(path).relative_to(recorded)
        content = state[path]
        if content is None:
            target.mkdir()
        else:
            target.write_bytes(content)


def boundaries(calls: Sequence[Call]) -> list[int]:
    """Positions in a trace just before each counted call, and its end."""
    return [i for i, call in enumerate(calls) if call.operation in COUNTED] + [len(calls)]


def power_cuts(disk: Disk, calls: Sequence[Call], count: int, chance: random.Random) -> Iterator[dict]:
    """States after power cuts at random moments of a run, during which the disk writes some sectors by itself."""
    moments = sorted(chance.choices(boundaries(calls), k=count))
    for position in range(len(calls) + 1):
        while moments and moments[0] == position:
            moments.pop(0)
            yield disk.after_cut(chance)
        if position < len(calls):
            disk.do(calls[position])


def ends_at(disk: Disk, calls: Sequence[Call], moments: Collection[int], *cuts: random.Random) -> Iterator[dict]:
    """States after power cuts by chance before each of these calls; without any, after a kill before it or within."""
    for position in range(len(calls) + 1):
        if position in moments:
            yield from map(disk.after_cut, cuts) if cuts else [disk.after_kill()]
            if not cuts and position < len(calls) and calls[position].operation == "w":
                yield disk.after_kill(during=calls[position])
        if position < len(calls):
            disk.do(calls[position])
