"""A job of a service, and the log of its events, from which it is read again when the service starts."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from explore.base.files import open_regular
from explore.service.folder import State, own_file, read_regular
from explore.service.job_files import Kind

#: Facts that a job reports while it runs; logged when it has ended.
PROGRESS = ("done", "feasible", "computed", "seconds", "steps_done", "steps")

#: Words that a field of a log may have.
_WORDS: dict[str, tuple[str, ...]] = {"keep": ("all", "front"), "kind": tuple(Kind)}


@dataclass(frozen=True)
class Job:
    """A study, a task or a refinement on its way through the service.

    Attributes
    ----------
    name
        Its name, and that of its file and results.
    state
        Where it is.
    priority, number
        Jobs run by priority, 1 first and 9 last; those of equal priority by number.
    kind
        What its file is.
    refine
        The job whose results a refinement starts from; empty for others.
    keep
        Which designs a sweep keeps: "all" or "front".
    owner
        The name of who submitted it, which the link of their browser was made for; empty for a script.
    remarks
        What may not be meant in the file, with its lines.
    mechanism, designs, bytes
        What the file asks for; 0 designs for a task that has not found any yet. `bytes` is None for a task, and where
        only the front is kept.
    submitted, started, ended
        Times, UTC, ISO 8601; None for what has not happened since the job was last queued. Nothing is ordered by them,
        for clocks are set.
    ended_number
        Its place in the order in which jobs ended, from 1 on; 0 before.
    reason
        Why it failed or what it waits for; else empty.
    done, feasible, computed, seconds
        Designs that are committed; of those that the running process computed, the feasible ones and all; seconds
        since it started.
    steps_done, steps
        Those of the search of a task; 0 for others.
    """

    name: str
    state: State
    priority: int = 5
    number: int = 0
    kind: str = Kind.study
    refine: str = ""
    keep: str = "all"
    owner: str = ""
    mechanism: str = ""
    remarks: tuple[str, ...] = ()
    designs: int = 0
    bytes: int | None = None
    submitted: str | None = None
    started: str | None = None
    ended: str | None = None
    ended_number: int = 0
    reason: str = ""
    done: int = 0
    feasible: int = 0
    computed: int = 0
    seconds: float = 0.0
    steps_done: int = 0
    steps: int = 0

    def to_json(self) -> dict[str, Any]:
        """Everything for clients, with the rate in designs per second and the seconds left where they are known."""
        rate = self.computed / self.seconds if self.seconds > 0 else None
        left = None
        if self.state == State.running and rate:
            left = (self.designs - self.done) / rate
        elif self.state == State.running and self.steps_done:
            left = self.seconds / self.steps_done * (self.steps - self.steps_done)
        return {**asdict(self), "rate": rate, "seconds_left": left}

    def after(self, event: Mapping[str, Any]) -> Job:
        """The job after an event; unknown facts are ignored, because a newer version may have written them."""
        known = {field.name for field in fields(self)} - {"name", "state", "priority", "number"}
        facts: dict[str, Any] = {
            name: tuple(value) if isinstance(value, list) else value
            for name, value in event.items()
            if name in known and _fits(name, value)
        }
        return replace(self, **facts)


def _fits(name: str, value: object) -> bool:
    """Whether a fact of a log has the type of its field; a log may come from anywhere."""
    if name in ("submitted", "started", "ended"):
        return value is None or isinstance(value, str)
    if name in _WORDS:
        return value in _WORDS[name]
    if name == "remarks":
        return isinstance(value, list) and all(isinstance(each, str) for each in value)
    if name in ("refine", "owner", "mechanism", "reason"):
        return isinstance(value, str)
    if name == "seconds":
        return isinstance(value, int | float) and not isinstance(value, bool)
    return (value is None and name == "bytes") or (isinstance(value, int) and not isinstance(value, bool))


def now() -> str:
    """The time, UTC, to the millisecond."""
    return datetime.now(UTC).isoformat(timespec="milliseconds")


def append_event(path: Path, event: str, facts: Mapping[str, Any]) -> None:
    """Append an event to a log durably, on a line of its own even after a line that a kill cut short."""
    line = json.dumps({"time": now(), "event": event, **facts}).encode() + b"\n"
    descriptor = open_regular(own_file(path), os.O_RDWR | os.O_APPEND | os.O_CREAT)
    with os.fdopen(descriptor, "r+b", buffering=0) as file:
        size = file.seek(0, os.SEEK_END)
        if size:
            file.seek(size - 1)
            line = line if file.read(1) == b"\n" else b"\n" + line
        while line:  # a disk that is nearly full takes a part, and the next one raises
            line = line[file.write(line) :]
        os.fsync(descriptor)


def read_events(path: Path) -> list[dict[str, Any]]:
    """The events of a log; lines that a kill or a power cut damaged are left out."""
    try:
        lines = read_regular(path).splitlines()
    except OSError:
        return []
    events = []
    for line in lines:
        try:
            event = json.loads(line)
        except ValueError:
            continue
        if isinstance(event, dict):
            events.append(event)
    return events
