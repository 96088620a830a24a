"""Ask a service over HTTP, with its token; refusals become errors with the reason that the service gave."""

import json
import os
import urllib.error
import urllib.request
from http.client import HTTPException
from pathlib import Path
from typing import Any
from urllib.parse import SplitResult, urlsplit

from explore.base.errors import ConfigError, ExploreError, RequestError

#: Environment variable of the token, for clients that give none.
TOKEN_VARIABLE = "EXPLORE_TOKEN"  # noqa: S105 -- the name of a variable
#: Longest time of a request, s.
_TIMEOUT = 180.0


class ServiceError(ExploreError, RuntimeError):
    """The service cannot be reached, or refuses."""


class Unreachable(ServiceError):  # noqa: N818 -- a state of the service
    """Nothing answers at the address."""


def split_address(url: str) -> SplitResult | None:
    """The parts of an address of http or https; None of others, and of those that name a user."""
    try:
        parts = urlsplit(url)
        is_usual = parts.scheme in ("http", "https") and bool(parts.hostname) and parts.port != 0
    except ValueError:  # a port beyond 65,535, or an IPv6 address without its end
        return None
    return parts if is_usual and "@" not in parts.netloc else None


class Requester:
    """Asks the service at an address; see `explore.Service` for the parameters."""

    def __init__(self, url: str, token: str | Path | None) -> None:
        parts = split_address(url)
        if parts is None:
            raise RequestError(f"{url!r:.200} is no address of a service; write one such as http://127.0.0.1:8765")
        self.url = f"{parts.scheme}://{parts.netloc}"
        self._token = token if token is not None else os.environ.get(TOKEN_VARIABLE, "")
        handlers: list[urllib.request.BaseHandler] = [_NoRedirects()]
        if parts.hostname in ("127.0.0.1", "::1", "localhost"):  # a proxy is for other machines
            handlers.append(urllib.request.ProxyHandler({}))
        self._opener = urllib.request.build_opener(*handlers)

    def get(self, path: str) -> Any:
        """The answer to GET."""
        return self._ask("GET", path)

    def post(self, path: str, content: Any = None) -> Any:
        """The answer to POST with this content as JSON."""
        return self._ask("POST", path, content)

    def _ask(self, method: str, path: str, content: Any = None) -> Any:
        with self.open(method, path, content) as answer:
            try:
                return json.load(answer)
            except ValueError:
                raise ServiceError(f"{self.url} answers no JSON; is it a service of explore?") from None
            except (OSError, HTTPException) as error:
                raise Unreachable(f"{self.url} broke off its answer: {error or type(error).__name__}") from None

    def open(self, method: str, path: str, content: Any = None) -> Any:
        """The answer to a request, whose body is still to be read."""
        token = self._read_token()
        headers = {"Authorization": f"Bearer {token}", "Accept": "application/json"}
        data = None
        if content is not None:
            data, headers["Content-Type"] = json.dumps(content).encode(), "application/json"
        request = urllib.request.Request(  # noqa: S310 -- http or https, see __init__
            self.url + path, data, headers, method=method
        )
        try:
            return self._opener.open(request, timeout=_TIMEOUT)
        except urllib.error.HTTPError as error:
            raise _refusal(self.url, error) from None
        except (OSError, HTTPException) as error:
            cause = getattr(error, "reason", None) or error
            reason = getattr(cause, "strerror", None) or cause
            raise Unreachable(f"no service answers at {self.url}: {reason}") from None

    def _read_token(self) -> str:
        if isinstance(self._token, Path):
            try:
                token = self._token.read_text(encoding="ascii").strip()
            except (OSError, UnicodeDecodeError):
                reason = f"{self._token} cannot be read, which a service writes while it runs"
                raise Unreachable(f"{reason}; is it running?") from None
        else:
            token = self._token.strip()
        if not token:
            raise RequestError(f"the service asks for a token; give one, or set {TOKEN_VARIABLE}")
        if not (token.isascii() and token.isprintable()):
            raise RequestError("the token is none of a service: it has characters other than letters, digits, - and _")
        return token


class _NoRedirects(urllib.request.HTTPRedirectHandler):
    """A redirect would send the token elsewhere."""

    def redirect_request(self, *_: Any, **__: Any) -> None:
        return None


def _refusal(url: str, error: urllib.error.HTTPError) -> ExploreError:
    """The reason that the service gave."""
    try:
        content = json.loads(error.read(1 << 20))
        detail, problems = str(content["detail"]), content.get("problems", [])
    except (ValueError, KeyError, TypeError, AttributeError):
        return ServiceError(f"{url} answers {error.code} {error.reason}; is it a service of explore?")
    if error.code == 422 and problems:
        return ConfigError([str(problem["text"]) for problem in problems])
    if error.code == 401:
        detail = "it does not know the token, which is new after each start of the service"
    return ServiceError(f"{url} refuses: {detail}")
