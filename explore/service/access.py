"""Who may do what: one-time links for browsers, cookies for their sessions, and tokens for scripts.

All are random, of 256 bits, kept in memory as hashes, and new after each start. Only the tokens for scripts are
written, into files that the owner of the folder alone can read.
"""

import hashlib
import os
import secrets
import threading
import time
from collections import OrderedDict
from enum import StrEnum
from pathlib import Path
from urllib.parse import urlsplit

from explore.base.files import new_file

#: Largest number of sessions; the oldest ends for a newer one.
_MOST_SESSIONS = 1000
#: Largest number of links that were not followed yet; the oldest ends for a newer one.
_MOST_LINKS = 100
#: Life of a session, s.
_SESSION_SECONDS = 30 * 86_400.0
#: Life of a link that is not followed, s.
_LINK_SECONDS = 86_400.0
#: Names of this machine in the header Host.
_LOOPBACK = ("127.0.0.1", "localhost", "[::1]")


class Right(StrEnum):
    """What a client may do: everything, or only look."""

    full = "full"
    read = "read"


class Access:
    """The links, sessions and tokens of one run of a service; safe to use from several threads.

    Parameters
    ----------
    public_url
        The address that browsers use, such as ``https://explore.example.org``, without a path.

    Attributes
    ----------
    origin, host
        Values of the headers Origin and Host of requests to that address.
    cookie
        Name of the cookie. It has the port, because browsers send cookies to all ports of a host. With TLS it begins
        with ``__Host-``, so that no other host of the domain can set it.
    """

    def __init__(self, public_url: str) -> None:
        parts = urlsplit(public_url)
        self.is_secure = parts.scheme == "https"
        usual = 443 if self.is_secure else 80
        self.host = parts.netloc.lower().removesuffix(f":{usual}")  # browsers leave the usual port out
        self.origin = f"{parts.scheme}://{self.host}"
        self.cookie = f"{'__Host-' if self.is_secure else ''}explore-{parts.port or usual}"
        self._tokens = {right: secrets.token_urlsafe(32) for right in Right}
        self._known = {_hash(token): right for right, token in self._tokens.items()}
        self._links: OrderedDict[bytes, tuple[Right, str, float]] = OrderedDict()
        self._sessions: OrderedDict[bytes, tuple[Right, str, float]] = OrderedDict()
        self._guard = threading.Lock()

    @property
    def hosts(self) -> frozenset[str]:
        """All values of the header Host that requests to this address have."""
        name, colon, port = self.host.rpartition(":")
        if name in _LOOPBACK:
            return frozenset(f"{name}{colon}{port}" for name in _LOOPBACK)
        return frozenset({self.host})

    @property
    def origins(self) -> frozenset[str]:
        """All values of the header Origin that requests of our own pages have."""
        scheme = self.origin.partition("://")[0]
        return frozenset(f"{scheme}://{host}" for host in self.hosts)

    def make_link(self, right: Right, name: str = "") -> str:
        """An address that opens the service in one browser, once; what follows # is never sent in a request's line.

        The name is that of who will use it, the owner of the jobs that they submit.
        """
        token = secrets.token_urlsafe(32)
        self._store(self._links, token, right, name, _LINK_SECONDS, _MOST_LINKS)
        return f"{self.origin}/#token={token}"

    def open_session(self, token: str) -> tuple[str, Right] | None:
        """The cookie's value and the right for the token of a link, which is worth nothing from then on."""
        with self._guard:
            right, name, end = self._links.pop(_hash(token), (Right.read, "", 0.0))
        if end < time.monotonic():
            return None
        session = secrets.token_urlsafe(32)
        self._store(self._sessions, session, right, name, _SESSION_SECONDS, _MOST_SESSIONS)
        return session, right

    def of_session(self, session: str) -> Right | None:
        """The right of a cookie; None if there is no such session."""
        with self._guard:
            right, _, end = self._sessions.get(_hash(session), (Right.read, "", 0.0))
        return right if end >= time.monotonic() else None

    def name_of(self, session: str | None) -> str:
        """The name that the link of a session was made for; empty without one, as for a script's token."""
        with self._guard:
            return self._sessions.get(_hash(session or ""), (Right.read, "", 0.0))[1]

    def of_token(self, token: str) -> Right | None:
        """The right of a script's token; None if it is none."""
        return self._known.get(_hash(token))

    def write_tokens(self, folder: Path) -> None:
        """Write the tokens for scripts to files that only their owner can read."""
        for path, right in _token_files(folder):
            with new_file(path) as unfinished:
                descriptor = os.open(unfinished, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
                with os.fdopen(descriptor, "w", encoding="ascii") as file:
                    file.write(f"{self._tokens[right]}\n")

    @staticmethod
    def remove_tokens(folder: Path) -> None:
        """Remove the files of the tokens."""
        for path, _ in _token_files(folder):
            path.unlink(missing_ok=True)

    def _store(
        self,
        place: OrderedDict[bytes, tuple[Right, str, float]],
        token: str,
        right: Right,
        name: str,
        seconds: float,
        most: int,
    ) -> None:
        with self._guard:
            place[_hash(token)] = (right, name, time.monotonic() + seconds)
            while len(place) > most:
                place.popitem(last=False)


def _token_files(folder: Path) -> tuple[tuple[Path, Right], ...]:
    return (folder / "token", Right.full), (folder / "token.read-only", Right.read)


def _hash(token: str) -> bytes:
    """The hash that is compared in place of a token, so that the time of a comparison tells nothing."""
    return hashlib.sha256(token.encode("utf-8", "surrogatepass")).digest()
