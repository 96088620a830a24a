"""What every request passes before any route: host, origin, rights, size and time; and headers of every answer.

Starlette checks hosts alone, and no well-kept library bounds the size and the time of a body by who sends it.
"""

import asyncio
import json
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from starlette.requests import cookie_parser
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from explore.service.access import Access, Right

#: Largest body, that of a study of the largest size escaped as JSON, bytes.
MOST_BODY_BYTES = 5 << 20
#: Largest number of requests with a right at a time; connections bound the number of requests without one.
_MOST_REQUESTS = 400
#: Largest body of a client without a right, that of a login with the token of a link, bytes.
_MOST_LOGIN_BYTES = 1 << 12
#: Time in which a body has to arrive, s.
_BODY_SECONDS = 30.0
#: Requests that need no right: the page without data, its session, and whether the service lives.
_OPEN = frozenset({("GET", "/"), ("HEAD", "/"), ("POST", "/api/session"), ("GET", "/healthz"), ("HEAD", "/healthz")})
#: Folder whose files need no right, as they are the page's.
_OPEN_FOLDER = "/page/"
#: Methods that change nothing.
_SAFE = ("GET", "HEAD", "OPTIONS")
#: Content security policy of every answer.
_POLICY = (
    b"default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; "
    b"base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
#: Headers of every answer that does not set them itself.
_HEADERS = [
    (b"content-security-policy", _POLICY),
    (b"x-content-type-options", b"nosniff"),
    (b"x-frame-options", b"DENY"),
    (b"referrer-policy", b"no-referrer"),
    (b"cross-origin-opener-policy", b"same-origin"),
    (b"cross-origin-resource-policy", b"same-origin"),
]

#: Function that is told of each request: method, path, status, seconds and right.
NoteRequest = Callable[[str, str, int, float, str], None]


class _RefusedError(Exception):
    """A request that goes no further: the status and the reason."""

    def __init__(self, status: int, reason: str) -> None:
        super().__init__(reason)
        self.status, self.reason = status, reason


class Guard:
    """Wraps an application, which finds the right of a request that passes in ``scope["state"]["right"]``.

    `note` is told of every request; it gets no query, header or body.
    """

    def __init__(self, application: ASGIApp, access: Access, note: NoteRequest) -> None:
        self._application, self._access, self._note = application, access, note
        self._n_requests = 0

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request."""
        if scope["type"] != "http":
            return  # no web sockets
        start, status, right = time.monotonic(), 500, ""

        async def send_guarded(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                own = {name for name, _ in message["headers"]}
                message["headers"] = [*message["headers"], *(entry for entry in _HEADERS if entry[0] not in own)]
                if b"cache-control" not in own:
                    message["headers"].append((b"cache-control", b"no-store"))
            await send(message)

        try:
            headers = _headers(scope)
            self._check_source(headers)
            right = self._check_right(scope, headers) or ""
            scope.setdefault("state", {})["right"] = right  # at once: a connection without one may have to give way
            with self._counted(right):
                body = await _read_body(headers, receive, MOST_BODY_BYTES if right else _MOST_LOGIN_BYTES)
                await self._application(scope, _replay(body, receive), send_guarded)
        except _RefusedError as refused:
            await _answer(send_guarded, refused)
        finally:
            self._note(scope["method"], scope["path"], status, time.monotonic() - start, right)

    @contextmanager
    def _counted(self, right: str) -> Iterator[None]:
        """Count a request, if it has a right."""
        if right and self._n_requests >= _MOST_REQUESTS:
            raise _RefusedError(503, f"{_MOST_REQUESTS} requests are being answered already; try again later")
        self._n_requests += bool(right)
        try:
            yield
        finally:
            self._n_requests -= bool(right)

    def _check_source(self, headers: dict[bytes, bytes]) -> None:
        """Refuse requests to another host name (DNS rebinding) and of pages of another origin (CSRF)."""
        if headers.get(b"host", b"").decode("latin-1").lower() not in self._access.hosts:
            raise _RefusedError(421, f"this server answers to {self._access.host} only")
        if (origin := headers.get(b"origin")) is not None and origin.decode("latin-1") not in self._access.origins:
            raise _RefusedError(403, "requests of pages of another origin are refused")

    def _check_right(self, scope: Scope, headers: dict[bytes, bytes]) -> Right | None:
        """The right of a request; refuses one that has none where one is needed."""
        method, path = scope["method"], scope["path"]
        right, by_cookie = self._right(headers)
        if (method, path) in _OPEN or (method in _SAFE and path.startswith(_OPEN_FOLDER)):
            return right
        if right is None:
            reason = "open the link that the server printed, or send a token: Authorization: Bearer TOKEN"
            raise _RefusedError(401, reason)
        # Browsers send the cookie for pages of another port of this host too, and no Origin with what these GET.
        if by_cookie and headers.get(b"sec-fetch-site", b"none") not in (b"same-origin", b"none"):
            raise _RefusedError(403, "requests of pages of another origin are refused")
        if method not in _SAFE:
            if by_cookie and b"origin" not in headers:  # every browser sends it; without it the page is unknown
                raise _RefusedError(403, "a browser's request must have the header Origin")
            if right != Right.full:
                raise _RefusedError(403, "this token or link may only look")
        return right

    def _right(self, headers: dict[bytes, bytes]) -> tuple[Right | None, bool]:
        scheme, _, token = headers.get(b"authorization", b"").decode("latin-1").partition(" ")
        if scheme:
            return (self._access.of_token(token.strip()) if scheme.lower() == "bearer" else None), False
        # As browsers read cookies: those of other services on this host, which come too, may have any form.
        session = cookie_parser(headers.get(b"cookie", b"").decode("latin-1")).get(self._access.cookie)
        return (self._access.of_session(session) if session else None), True


def _headers(scope: Scope) -> dict[bytes, bytes]:
    """The headers by name; refuses two of a name that decides who asks."""
    headers: dict[bytes, bytes] = {}
    for name, value in scope["headers"]:
        if name in headers and name in (b"host", b"origin", b"authorization"):
            raise _RefusedError(400, f"the header {name.decode('latin-1')} occurs twice")
        headers[name] = headers[name] + b"; " + value if name == b"cookie" and name in headers else value
    if b"content-length" in headers and b"transfer-encoding" in headers:  # a proxy may have read another end of it
        raise _RefusedError(400, "a request has Content-Length or Transfer-Encoding, not both")
    return headers


async def _read_body(headers: dict[bytes, bytes], receive: Receive, most: int) -> bytes:
    """The whole body, of at most so many bytes and in bounded time."""
    length = headers.get(b"content-length", b"0")
    if length.isdigit() and (len(length) > 12 or int(length) > most):
        raise _RefusedError(413, f"the body has more than {most:,} bytes")
    chunks, size, more = [], 0, True
    try:
        async with asyncio.timeout(_BODY_SECONDS):
            while more:
                message: Any = await receive()
                if message["type"] == "http.disconnect":
                    raise _RefusedError(400, "the client left before the body was complete")
                chunks.append(message.get("body", b""))
                size += len(chunks[-1])
                if size > most:
                    raise _RefusedError(413, f"the body has more than {most:,} bytes")
                more = message.get("more_body", False)
    except TimeoutError:
        raise _RefusedError(408, f"the body did not arrive within {_BODY_SECONDS:.0f} s") from None
    return b"".join(chunks)


def _replay(body: bytes, receive: Receive) -> Receive:
    """A receiver that gives the body first and then what comes after it."""
    is_given = False

    async def replay() -> Message:
        nonlocal is_given
        if is_given:
            return await receive()
        is_given = True
        return {"type": "http.request", "body": body, "more_body": False}

    return replay


async def _answer(send: Send, refused: _RefusedError) -> None:
    body = json.dumps({"detail": refused.reason}).encode()
    headers = [(b"content-type", b"application/json"), (b"content-length", str(len(body)).encode())]
    if refused.status == 401:
        headers.append((b"www-authenticate", b"Bearer"))
    if refused.status in (400, 408, 413):
        headers.append((b"connection", b"close"))
    await send({"type": "http.response.start", "status": refused.status, "headers": headers})
    await send({"type": "http.response.body", "body": body})


class Head:
    """Answers HEAD by what GET answers, up to the first part of the body."""

    def __init__(self, app: ASGIApp) -> None:
        self._application = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request."""
        if scope["type"] != "http" or scope["method"] != "HEAD":
            await self._application(scope, receive, send)
            return
        has_answered = asyncio.Event()

        async def send_head(message: Message) -> None:
            if message["type"] == "http.response.start":
                await send(message)
                await send({"type": "http.response.body", "body": b""})
                has_answered.set()

        answering = asyncio.ensure_future(self._application({**scope, "method": "GET"}, receive, send_head))
        waiting = asyncio.ensure_future(has_answered.wait())
        await asyncio.wait({answering, waiting}, return_when=asyncio.FIRST_COMPLETED)
        waiting.cancel()
        answering.cancel()  # the body of a file is long, and that of a stream of events has no end
        await asyncio.wait({answering})
        if not answering.cancelled() and (error := answering.exception()) is not None:
            raise error
