"""Events of the jobs for clients that watch: numbered, kept for a while, and sent to each from where it was.

FastAPI's own streams of events and sse-starlette write each event anew for each watcher, and keep none for one that
comes back; here its text is made once.
"""

import json
import secrets
import threading
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import islice
from typing import Any

from explore.service.jobs import Job

#: Number of events that are kept for clients that come back.
MOST_KEPT = 4096
#: Number of events that a watcher takes at a time, so that a slow one holds few that are not kept any more.
_MOST_TAKEN = 64


@dataclass(frozen=True)
class Event:
    """One event: its number, the job's name, whether that was deleted, and the text, made once for all watchers."""

    number: int
    name: str
    is_deleted: bool
    text: bytes


class Events:
    """The events since the service started; safe to use from several threads.

    The epoch distinguishes their numbers from those before a restart.
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
            self._kept.append(Event(self._number, name, job is None, self.text(self._number, kind, data)))
        self.wake()

    def text(self, number: int, kind: str, data: dict[str, Any]) -> bytes:
        """An event as it is sent."""
        return f"id: {self.epoch}-{number}\nevent: {kind}\ndata: {json.dumps(data)}\n\n".encode()

    def wake(self) -> None:
        """Notify all watchers."""
        with self._guard:
            for notify in self._watchers:
                notify()

    @contextmanager
    def watched(self, notify: Callable[[], object]) -> Iterator[None]:
        """Call a function after each event and by `wake`, which must return at once, until the block ends."""
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
        """The next events after a number, the oldest first.

        None if some of them are kept no more, or it is not a number of this service.
        """
        with self._guard:
            n_missed = self._number - number
            if not 0 <= n_missed <= len(self._kept):
                return None
            missed = [*islice(reversed(self._kept), n_missed)]  # deques are slow in their middle, and most miss one
        return missed[: -_MOST_TAKEN - 1 : -1]
