"""Events of the jobs for clients that watch: numbered, kept for a while, and sent to each from where it was."""

from __future__ import annotations

import secrets
import threading
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from explore.serving.jobs import Job

#: Events that are kept for clients that come back.
MOST_KEPT = 4096


@dataclass(frozen=True)
class Event:
    """One event: its number, its kind ("job", "deleted") and its content for JSON."""

    number: int
    kind: str
    data: dict[str, Any]


class Events:
    """The events since the service started; safe to use from several threads.

    Attributes
    ----------
    epoch
        Distinguishes the numbers of this service from those before it was restarted.
    """

    def __init__(self) -> None:
        self.epoch = secrets.token_hex(4)
        self._kept: deque[Event] = deque(maxlen=MOST_KEPT)
        self._number = 0
        self._watchers: set[Callable[[], object]] = set()
        self._guard = threading.Lock()

    def note_job(self, name: str, job: Job | None) -> None:
        """Add the event that a job changed, or was deleted."""
        kind, data = ("job", job.to_json()) if job is not None else ("deleted", {"name": name})
        with self._guard:
            self._number += 1
            self._kept.append(Event(self._number, kind, data))
            for notify in self._watchers:
                notify()

    @contextmanager
    def watched(self, notify: Callable[[], object]) -> Iterator[None]:
        """Call a function after each event, which must return at once, until the block ends."""
        with self._guard:
            self._watchers.add(notify)
        try:
            yield
        finally:
            with self._guard:
                self._watchers.discard(notify)

    @property
    def n_watchers(self) -> int:
        """Number of clients that watch."""
        with self._guard:
            return len(self._watchers)

    @property
    def last(self) -> int:
        """The number of the last event; 0 before the first."""
        with self._guard:
            return self._number

    def after(self, number: int) -> list[Event] | None:
        """The events after a number, or None if some of them are kept no more or it is not a number of this service."""
        with self._guard:
            first = self._number - len(self._kept)
            if not first <= number <= self._number:
                return None
            return [event for event in self._kept if event.number > number]
