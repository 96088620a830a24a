"""Turns of requests that keep a processor busy: few work, some wait, and others are refused at once.

The routes run in threads, so these are semaphores: anyio's limiter would need every route to be asynchronous.
"""

import threading
from collections.abc import Iterator
from contextlib import contextmanager

from fastapi import HTTPException

#: Longest wait of a request for its turn, s.
_PATIENCE = 30.0
#: Reason of a refusal.
_BUSY = "the server is busy with other requests of this kind; try again later"


class Turns:
    """Turns that so many threads have at a time, for which so many more wait; `most` are both together.

    All kinds of turns together must leave threads of the server free, or requests that need no turn would wait too.
    """

    def __init__(self, at_a_time: int, waiting: int) -> None:
        self.most = at_a_time + waiting
        self._present = threading.BoundedSemaphore(self.most)
        self._working = threading.BoundedSemaphore(at_a_time)

    @contextmanager
    def taken(self) -> Iterator[None]:
        """Have a turn; refuses with 503 if too many wait, or the wait is too long."""
        if not self._present.acquire(blocking=False):
            raise HTTPException(503, _BUSY)
        try:
            if not self._working.acquire(timeout=_PATIENCE):
                raise HTTPException(503, _BUSY)
            try:
                yield
            finally:
                self._working.release()
        finally:
            self._present.release()
