"""Serve a folder over HTTP until the process is told to stop."""

from __future__ import annotations

import json
import logging
import signal
import socket
import ssl
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from ipaddress import ip_address
from logging.handlers import RotatingFileHandler
from pathlib import Path
from types import FrameType
from typing import Any
from urllib.parse import urlsplit

import uvicorn

from explore._version import __version__
from explore.base.errors import RequestError
from explore.service.access import Access, Right
from explore.service.application import make_application
from explore.service.connections import Connection
from explore.service.events import Events
from explore.service.folder import own_file
from explore.service.guard import Guard
from explore.service.jobs import now
from explore.service.plans import Limits
from explore.service.requester import split_address
from explore.service.runner import Work
from explore.service.station import open_station

#: Size at which a log is closed and a new one begun, bytes.
_LOG_BYTES = 10_000_000
#: Number of older logs that are kept.
_OLDER_LOGS = 4
#: Time that requests have to end when the service stops, s.
_PATIENCE = 5
#: Number of files and connections to allow at a time, where the system lets it.
_MOST_OPEN = 65_536
#: Number of connections accepted before the loop reads from any; far below `_MOST_CONNECTIONS`.
_AT_ONCE = 32
#: Number of connections that the system keeps until they are accepted.
_MOST_QUEUED = 2048


@dataclass(frozen=True)
class Place:
    """Where a service listens; port 0 is a free one.

    Browsers use the public URL, if it is another address, such as that of a reverse proxy with TLS before this one.
    """

    host: str = "127.0.0.1"
    port: int = 8765
    public_url: str | None = None
    certificate: Path | None = None
    key: Path | None = None
    is_behind_proxy: bool = False

    def check(self) -> None:
        """Raise `RequestError` that says what to do if tokens would travel unencrypted."""
        if (self.certificate is None) != (self.key is None):
            raise RequestError("TLS needs both `certificate` and `key`")
        if self.certificate is not None and self.key is not None:
            _check_pair(self.certificate, self.key)
        if self.public_url is not None and not _is_origin(self.public_url):
            raise RequestError("`public_url`: write https://HOST or https://HOST:PORT, without a path")
        parts = urlsplit(self.public_url or "")
        if parts.scheme == "http" and not _is_loopback(parts.hostname or ""):
            raise RequestError(
                f"`public_url` {self.public_url} would send tokens and results unencrypted; write https://, and let "
                "this server (`certificate` and `key`) or a reverse proxy speak TLS"
            )
        if _is_loopback(self.host):
            return
        if self.certificate is None and not self.is_behind_proxy:
            raise RequestError(
                f"`host` {self.host} would send tokens and results unencrypted; give `certificate` and `key` for TLS, "
                "or put a reverse proxy with TLS in front and say `is_behind_proxy`; to use it alone from elsewhere, "
                "leave out `host` and forward the port: ssh -L 8765:127.0.0.1:8765 SERVER"
            )
        if self.public_url is None:
            raise RequestError(
                f"`host` {self.host} needs `public_url` https://NAME, the address that browsers use: "
                "requests to any other are refused"
            )


def serve(path: Path, place: Place, limits: Limits, work: Work, announce: Callable[[str, str], None]) -> None:
    """Serve a folder until SIGTERM or Ctrl-C; the sweep under way goes on at the next start.

    `announce` is called with a link for everything and one to look, when the service listens. Raises `RequestError` if
    the place is not safe, or the port is taken, and `ResultsError` if another process serves the folder.
    """
    place.check()
    _allow_open_files()
    with open_station(path, limits, work) as station, _listen(place) as listener:
        access = Access(place.public_url or _url(place, listener))
        log = _ServerLog(station.folder.log / "server.jsonl")
        access.write_tokens(path)
        try:
            guarded = _Guarded(log)
            server = _Server(_config(guarded, place), station.events)
            application = make_application(station, access, lambda: server.should_exit)
            guarded.guard = Guard(application, access, log.note_request)
            log("start", address=access.origin, version=__version__)
            with _stopping(server):
                announce(access.make_link(Right.full), access.make_link(Right.read))
                server.run(sockets=[listener])
        finally:
            access.remove_tokens(path)
            log("stop")
            log.close()


class _Guarded:
    """The guarded application, and the log of what it did not expect."""

    guard: Guard

    def __init__(self, log: _ServerLog) -> None:
        self._log = log

    async def __call__(self, scope: Any, receive: Any, send: Any) -> None:
        try:
            await self.guard(scope, receive, send)
        except Exception as error:
            self._log("error", path=scope["path"][:200], problem=f"{type(error).__name__}: {error}"[:1000])
            raise


class _Server(uvicorn.Server):
    def __init__(self, config: uvicorn.Config, events: Events) -> None:
        super().__init__(config)
        self._events = events

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Let the system keep more connections than asyncio accepts at once, which has one number for both."""
        await super().startup(sockets)
        for listener in sockets or []:
            listener.listen(_MOST_QUEUED)

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Let watchers see that the service stops, which would otherwise wait for the next event."""
        self._events.wake()
        await super().shutdown(sockets)

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        """Stop in order; uvicorn would raise the signal again at the end, before the sweep is interrupted."""
        del sig, frame
        self.force_exit = self.should_exit
        self.should_exit = True


@contextmanager
def _stopping(server: _Server) -> Iterator[None]:
    """Let signals stop the server in order before uvicorn listens to them, and after."""
    if threading.current_thread() is not threading.main_thread():
        yield  # signals are the main thread's
        return
    before = {which: signal.signal(which, server.handle_exit) for which in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for which, handler in before.items():
            signal.signal(which, handler)


class _LogFile(RotatingFileHandler):
    def handleError(self, record: logging.LogRecord) -> None:  # noqa: N802 -- its name in logging
        """Leave the line out: on a full disk, its traceback would be printed for every request."""


class _ServerLog:
    """The structured log of the service, a JSON object a line; without queries, headers and bodies."""

    def __init__(self, path: Path) -> None:
        self._handler = _LogFile(own_file(path), maxBytes=_LOG_BYTES, backupCount=_OLDER_LOGS, encoding="utf-8")

    def __call__(self, event: str, **facts: Any) -> None:
        line = json.dumps({"time": now(), "event": event, **facts})
        self._handler.handle(logging.LogRecord("explore.service", logging.INFO, "", 0, line, None, None))

    def note_request(self, method: str, path: str, status: int, seconds: float, right: str) -> None:
        """Log a request."""
        milliseconds = round(1000 * seconds, 1)
        self("request", method=method[:20], path=path[:200], status=status, milliseconds=milliseconds, right=right)

    def close(self) -> None:
        self._handler.close()


def _config(application: Any, place: Place) -> uvicorn.Config:
    return uvicorn.Config(
        application,
        http=Connection,
        lifespan="off",
        ws="none",
        access_log=False,
        log_level="critical",
        server_header=False,
        proxy_headers=False,
        backlog=_AT_ONCE,
        timeout_graceful_shutdown=_PATIENCE,
        ssl_certfile=place.certificate,
        ssl_keyfile=place.key,
    )


def _listen(place: Place) -> socket.socket:
    family = socket.AF_INET6 if ":" in place.host else socket.AF_INET
    try:
        listener = socket.create_server((place.host, place.port), family=family)
    except OSError as error:
        raise RequestError(
            f"{place.host}:{place.port} cannot be listened to: {error.strerror or error}; choose another with `port`"
        ) from None
    # Connections inherit it; an answer is several writes. asyncio sets it for sockets alone that name their protocol.
    listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return listener


def _url(place: Place, listener: socket.socket) -> str:
    host = f"[{place.host}]" if ":" in place.host else place.host
    scheme = "http" if place.certificate is None else "https"
    return f"{scheme}://{host}:{listener.getsockname()[1]}"


def _check_pair(certificate: Path, key: Path) -> None:
    try:
        ssl.create_default_context(ssl.Purpose.CLIENT_AUTH).load_cert_chain(certificate, key)
    except OSError as error:
        reason = f"`certificate` {certificate} and `key` {key} cannot be used: {error.strerror or error}"
        raise RequestError(f"{reason}; give the files of a certificate and of its private key, PEM") from None


def _is_origin(url: str) -> bool:
    """Whether an address has a scheme, a host and perhaps a port, and nothing else."""
    parts = split_address(url)
    return parts is not None and not (parts.path.strip("/") or parts.query or parts.fragment)


def _allow_open_files() -> None:
    """Raise the number of open files: the usual 1,024 are soon taken by connections, and no sweep could start then."""
    try:
        import resource
    except ImportError:  # on Windows, which has no such limit
        return
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = _MOST_OPEN if hard == resource.RLIM_INFINITY else min(hard, _MOST_OPEN)
    if soft != resource.RLIM_INFINITY and soft < wanted:
        resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))


def _is_loopback(host: str) -> bool:
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"
