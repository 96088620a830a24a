"""Connections that wait for a bounded time, and give way to others when room is short."""

import asyncio

from uvicorn.protocols.http.h11_impl import H11Protocol

#: Time in which the head of a request has to arrive, s.
_HEAD_SECONDS = 20.0
#: Time in which a client has to take what was written to it beyond the buffers of the system, s.
_TAKE_SECONDS = 60.0
#: Largest number of connections, so that files are left to open for the service itself; others give way to one more.
_MOST_CONNECTIONS = 500


class Connection(H11Protocol):
    """A connection that is closed if the head of its request does not arrive, or its answer is not taken, in time.

    uvicorn would wait for ever, and a few hundred clients that send or read nothing would keep all others out. Where
    room is short, the oldest connection that never showed a right gives way, whatever it sends or reads, and where all
    have shown one, the oldest that waits for a request. So nobody without a right can keep out those who have one.
    """

    # No setting of uvicorn does this: `timeout_keep_alive` begins after the first answer, `limit_concurrency` refuses
    # who comes last. A proxy has such deadlines, but knows no rights, and `explore serve` is used without one too.

    #: Start of the wait for a request, by the clock of the loop, s.
    _since = 0.0
    #: Mark of a connection on which a request had a right.
    _is_known = False
    #: Timer of the head of a request.
    _deadline: asyncio.TimerHandle | None = None
    #: Timer of what was written.
    _take_deadline: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]  # as uvicorn has it
        """Begin to wait for the first request."""
        super().connection_made(transport)
        self._since = self.loop.time()
        if len(self.connections) > _MOST_CONNECTIONS and not self._make_room():
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

    def on_response_complete(self) -> None:
        """Note whether the request had a right, and when the wait for the next one begins."""
        self._since, self._is_known = self.loop.time(), self._has_right()
        super().on_response_complete()

    def connection_lost(self, exc: Exception | None) -> None:
        """Wait no more."""
        self._forget()
        self._forget_taking()
        super().connection_lost(exc)

    def _make_room(self) -> bool:
        """Close the connection that matters least; whether there is one."""
        peers = [other for other in self.connections if isinstance(other, Connection) and other is not self]
        others = [other for other in peers if not other.transport.is_closing()]
        least = min((other for other in others if not other._has_right()), key=_age, default=None) or min(
            (other for other in others if other._is_waiting()), key=_age, default=None
        )
        if least is not None:
            least.transport.abort()
        return least is not None

    def _has_right(self) -> bool:
        """Whether a request had a right, which `Guard` writes down."""
        return self._is_known or (self.cycle is not None and bool(self.cycle.scope["state"].get("right")))

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


def _age(connection: Connection) -> float:
    return connection._since
