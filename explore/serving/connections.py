"""Connections that wait for a bounded time, for a request and for a client that takes an answer."""

from __future__ import annotations

import asyncio

from uvicorn.protocols.http.h11_impl import H11Protocol

#: Seconds in which the head of a request has to arrive.
_HEAD_SECONDS = 20.0
#: Seconds in which a client has to take what was written to it, beyond what the system keeps for it.
_TAKE_SECONDS = 60.0
#: Connections at a time; more are closed unread, so that files are left to open for the service itself.
_MOST_CONNECTIONS = 500


class Connection(H11Protocol):
    """A connection that is closed if the head of its request does not arrive, or its answer is not taken, in time.

    uvicorn would wait for ever, and a few hundred clients that send or read nothing would keep all others out.
    """

    _deadline: asyncio.TimerHandle | None = None
    _take_deadline: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]  # as uvicorn has it
        """Begin to wait for the first request."""
        super().connection_made(transport)
        if len(self.connections) > _MOST_CONNECTIONS:
            transport.abort()
            return
        # `pause_writing` is called as soon as the system takes no more, `resume_writing` when it has taken all.
        transport.set_write_buffer_limits(high=1, low=0)
        self._watch()

    def pause_writing(self) -> None:
        """Begin to wait for the client to take what was written."""
        super().pause_writing()
        self._take_deadline = self.loop.call_later(_TAKE_SECONDS, self.transport.abort)

    def resume_writing(self) -> None:
        """Write further."""
        self._forget_taking()
        super().resume_writing()

    def data_received(self, data: bytes) -> None:
        """Read; wait further if the head of a request is still incomplete."""
        super().data_received(data)
        self._watch()

    def connection_lost(self, exc: Exception | None) -> None:
        """Wait no more."""
        self._forget()
        self._forget_taking()
        super().connection_lost(exc)

    def _watch(self) -> None:
        if not self._is_waiting():
            self._forget()
        elif self._deadline is None:
            self._deadline = self.loop.call_later(_HEAD_SECONDS, self._give_up)

    def _is_waiting(self) -> bool:
        """Whether no request is being answered; uvicorn sets `cycle` when the head of one is complete."""
        return self.cycle is None or self.cycle.response_complete

    def _give_up(self) -> None:
        self._deadline = None
        if self._is_waiting():
            self.transport.close()

    def _forget(self) -> None:
        if self._deadline is not None:
            self._deadline.cancel()
            self._deadline = None

    def _forget_taking(self) -> None:
        if self._take_deadline is not None:
            self._take_deadline.cancel()
            self._take_deadline = None
