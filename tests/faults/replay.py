"""A folder after a kill or a power cut, worked out from a trace of the calls that made it.

What POSIX leaves open is taken at its worst. Until a file is synchronised, each of its writes may be there, missing or
torn between sectors of the disk, independent of all others, and in any order; likewise its length. Until a folder is
synchronised, each change of a name in it may be there or not.
"""

from __future__ import annotations

import random
import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

_SECTOR = 512
_HEAD = struct.Struct("=iiqqii")
#: The calls that the recorder counts: those that change the folder or make it durable.
COUNTED = frozenset("cwtasdrum")


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
    """Bytes as processes see them, as the disk has them for certain, and what is between."""

    seen: bytearray = field(default_factory=bytearray)
    durable: bytes = b""
    unsure: list[Call] = field(default_factory=list)

    def change(self, call: Call) -> None:
        _apply(self.seen, call)
        self.unsure.append(call)

    def synchronise(self) -> None:
        self.durable, self.unsure = bytes(self.seen), []

    def after_cut(self, chance: random.Random) -> bytes:
        left = bytearray(self.durable)
        for call in chance.sample(self.unsure, len(self.unsure)):
            fate = chance.random()
            if call.operation != "w":
                if fate < 0.5:
                    _apply(left, call)
            elif fate < 0.5:
                _apply(left, call)
            elif fate < 0.65:
                _tear(left, call, chance)
        return bytes(left)


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
    """Write some sectors of a write."""
    start = call.offset
    while start < call.offset + call.length:
        stop = min((start // _SECTOR + 1) * _SECTOR, call.offset + call.length)
        if chance.random() < 0.5:
            _put(content, start, call.data[start - call.offset : stop - call.offset])
        start = stop


class Disk:
    """One folder and all in it.

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
        """The process ended: its descriptors mean nothing any more."""
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
            case "r" | "u" | "m":
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

    def _synchronise(self, what: _File | str) -> None:
        if isinstance(what, _File):
            what.synchronise()
            return
        left = []
        for call, file in self._unsure_names:
            if _parent(call.path) == what:
                _change(self._durable_names, call, file)
            else:
                left.append((call, file))
        self._unsure_names = left

    def after_kill(self, during: Call | None = None) -> dict[str, bytes | None]:
        """What is there when the process is killed now, or half through a write, by path; None stands for a folder."""
        there = {path: None if file is None else bytes(file.seen) for path, file in self._names.items()}
        if during is not None:
            torn = self._open[during.descriptor]
            content = bytearray(torn.seen)
            _put(content, during.offset, during.data[: (during.length + 1) // 2])
            there |= {path: bytes(content) for path, file in self._names.items() if file is torn}
        return there

    def after_cut(self, chance: random.Random) -> dict[str, bytes | None]:
        """What may be there when the power is cut now."""
        names = dict(self._durable_names)
        for call, file in self._unsure_names:
            if chance.random() < 0.5:
                _change(names, call, file)
        content = {}  # a file may have two names, or none, but one content
        for file in names.values():
            if file is not None and file not in content:
                content[file] = file.after_cut(chance)
        there = {path: None if file is None else content[file] for path, file in names.items()}
        return {path: data for path, data in there.items() if self._reachable(path, names)}

    def _reachable(self, path: str, names: dict[str, _File | None]) -> bool:
        parent = _parent(path)
        return parent == self._folder or (parent in names and self._reachable(parent, names))


def _change(names: dict[str, _File | None], call: Call, file: _File | None) -> None:
    """Give, change or take a name."""
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
    for path in sorted(state, key=len):  # folders before what is in them
        place = folder / Path(path).relative_to(recorded)
        content = state[path]
        if content is None:
            place.mkdir()
        else:
            place.write_bytes(content)


def boundaries(calls: Sequence[Call]) -> list[int]:
    """Positions in a trace just before each counted call, and its end."""
    return [i for i, call in enumerate(calls) if call.operation in COUNTED] + [len(calls)]


def power_cuts(disk: Disk, calls: Sequence[Call], count: int, chance: random.Random) -> Iterator[dict]:
    """States after power cuts at random moments of a run, while the disk goes along."""
    moments = sorted(chance.choices(boundaries(calls), k=count))
    for position in range(len(calls) + 1):
        while moments and moments[0] == position:
            moments.pop(0)
            yield disk.after_cut(chance)
        if position < len(calls):
            disk.do(calls[position])
