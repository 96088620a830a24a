"""Submit studies to a service from Python, and fetch the results."""

from __future__ import annotations

import json
import os
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from dataclasses import dataclass
from http.client import HTTPException
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal
from urllib.parse import quote, urlencode, urlsplit

from explore.errors import ConfigError, ExploreError, RequestError, ResultsError
from explore.files import new_file

if TYPE_CHECKING:
    from explore.config.study import Study
    from explore.store.results import Results

#: Where the token is looked for when none is given.
TOKEN_VARIABLE = "EXPLORE_TOKEN"  # noqa: S105 -- the name of a variable
#: Seconds that a request may take, and between two looks at a job.
_TIMEOUT, _INTERVAL = 180.0, 0.3
#: Seconds that a server may be away while a job is waited for, such as for a restart.
_MOST_AWAY = 60.0


class ServiceError(ExploreError, RuntimeError):
    """The service cannot be reached, or refuses."""


class Unreachable(ServiceError):  # noqa: N818 -- a state of the service
    """Nothing answers at the address."""


@dataclass(frozen=True)
class JobProgress:
    """How far a job is.

    Attributes
    ----------
    state
        "queued", "running", "done", "failed" or "cancelled".
    done, designs
        Designs that are computed, and all of the study.
    rate, seconds_left
        Designs per second, and an estimate of the time left; None where they are not known.
    reason
        Why it failed, or what it waits for; else empty.
    """

    state: str
    done: int
    designs: int
    rate: float | None
    seconds_left: float | None
    reason: str

    @property
    def is_settled(self) -> bool:
        """Whether nothing more happens to it by itself."""
        return self.state in ("done", "failed", "cancelled")


class Service:
    """A service that `explore serve` runs.

    Parameters
    ----------
    url
        Its address, such as ``http://127.0.0.1:8765``.
    token
        The token, or the path of the file that holds it: ``token`` in the folder of the service. The file is read at
        each request, so that it may change when the service is started again. None for the environment variable
        ``EXPLORE_TOKEN``.

    Examples
    --------
    >>> service = explore.Service("http://127.0.0.1:8765", Path("served/token"))  # doctest: +SKIP
    >>> job = service.submit(explore.load_study("configs/grid.toml"), name="grid")  # doctest: +SKIP
    >>> job.wait().state  # doctest: +SKIP
    'done'
    >>> explore.rank(job.results())  # doctest: +SKIP
    """

    def __init__(self, url: str, token: str | Path | None = None) -> None:
        try:
            parts = urlsplit(url)
            is_usual = parts.scheme in ("http", "https") and bool(parts.hostname) and parts.port != 0
        except ValueError:  # a port beyond 65,535, or an IPv6 address without its end
            is_usual = False
        if not is_usual:
            raise RequestError(f"{url!r:.200} is no address of a service; write one such as http://127.0.0.1:8765")
        self.url = f"{parts.scheme}://{parts.netloc}"
        self._token = token if token is not None else os.environ.get(TOKEN_VARIABLE, "")
        handlers: list[urllib.request.BaseHandler] = [_NoRedirects()]
        if parts.hostname in ("127.0.0.1", "::1", "localhost"):  # a proxy is for other machines
            handlers.append(urllib.request.ProxyHandler({}))
        self._opener = urllib.request.build_opener(*handlers)

    def __repr__(self) -> str:
        return f"Service({self.url!r})"

    def submit(
        self, study: Study | str, *, name: str, keep: Literal["all", "front"] = "all", priority: int = 5
    ) -> JobHandle:
        """Queue a study.

        Parameters
        ----------
        study
            A study, or the text of a study file.
        name
            Name of the job and of its results: lower-case letters, digits, - and _.
        keep
            Which designs are kept, as `explore.sweep` has it.
        priority
            1 is swept first, 9 last.

        Raises
        ------
        ConfigError
            With every problem of the study.
        ServiceError
            The service cannot be reached, or refuses; the message says why.
        """
        self._post("/api/studies", self._submission(study, name, keep, priority))
        return self.job(name)

    def plan(self, study: Study | str, *, name: str = "study", keep: Literal["all", "front"] = "all") -> dict[str, Any]:
        """What the sweep of a study would make and take: designs, bytes, seconds and so on; nothing is queued."""
        return dict(self._post("/api/studies?dry_run=true", self._submission(study, name, keep, 5)))

    def job(self, name: str) -> JobHandle:
        """A job by name."""
        return JobHandle(self, name)

    def jobs(self) -> list[dict[str, Any]]:
        """All jobs: the running one, those that wait in their order, then the others."""
        return list(self._get("/api/jobs")["jobs"])

    def rank(self, name: str, **options: Any) -> dict[str, Any]:
        """The Pareto set of a job's results, found by the service; `options` as of its route, such as `metric`."""
        query = urlencode(options, doseq=True)
        return dict(self._get(f"/api/results/{quote(name, safe='')}/rank?{query}"))

    @staticmethod
    def _submission(study: Study | str, name: str, keep: str, priority: int) -> dict[str, Any]:
        text = study if isinstance(study, str) else study.to_toml()
        return {"name": name, "study": text, "keep": keep, "priority": priority}

    def _get(self, path: str) -> Any:
        return self._ask("GET", path)

    def _post(self, path: str, content: Any = None) -> Any:
        return self._ask("POST", path, content)

    def _ask(self, method: str, path: str, content: Any = None) -> Any:
        with self._open(method, path, content) as answer:
            try:
                return json.load(answer)
            except ValueError:
                raise ServiceError(f"{self.url} answers no JSON; is it a service of explore?") from None
            except (OSError, HTTPException) as error:
                raise Unreachable(f"{self.url} broke off its answer: {error or type(error).__name__}") from None

    def _open(self, method: str, path: str, content: Any = None) -> Any:
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


class JobHandle:
    """A job of a service; `Service.submit` and `Service.job` make it."""

    def __init__(self, service: Service, name: str) -> None:
        self.service, self.name = service, name
        self._path = f"/api/jobs/{quote(name, safe='')}"

    def __repr__(self) -> str:
        return f"JobHandle({self.service.url!r}, {self.name!r})"

    def progress(self) -> JobProgress:
        """How far it is now."""
        facts = self.service._get(self._path)
        return JobProgress(**{name: facts[name] for name in JobProgress.__dataclass_fields__})

    def wait(self, seconds: float | None = None) -> JobProgress:
        """Wait until it is done, failed or cancelled, or so many seconds; a restart of the service is waited for."""
        start = last_seen = time.monotonic()
        while True:
            try:
                progress = self.progress()
                last_seen = time.monotonic()
            except Unreachable:
                if time.monotonic() - last_seen > _MOST_AWAY:
                    raise
                progress = None
            if progress is not None and (
                progress.is_settled or (seconds is not None and time.monotonic() - start >= seconds)
            ):
                return progress
            time.sleep(_INTERVAL)

    def results(self, path: Path | str | None = None) -> Results:
        """Fetch the results into a file, results/NAME.h5 by default, and open it.

        Raises
        ------
        ServiceError
            The job is not done.
        """
        from explore.store.open_results import open_results

        target = Path("results") / f"{self.name}.h5" if path is None else Path(path)
        with self.service._open("GET", f"/api/results/{quote(self.name, safe='')}/file") as answer:
            size = int(answer.headers.get("Content-Length", -1))
            if size < 0:
                raise ServiceError(f"{self.service.url} sends a file of unknown length; is it a service of explore?")
            target.parent.mkdir(parents=True, exist_ok=True)
            with new_file(target, size) as unfinished, unfinished.open("xb") as file:
                file.writelines(_blocks(answer))
                file.flush()
                os.fsync(file.fileno())
                if file.tell() != size:
                    raise ResultsError(f"{target}: {file.tell():,} of {size:,} bytes arrived; fetch it again")
        return open_results(target)

    def cancel(self) -> None:
        """Cancel it; what is computed stays."""
        self.service._post(f"{self._path}/cancel")

    def retry(self) -> None:
        """Queue it again; its sweep goes on where it ended."""
        self.service._post(f"{self._path}/retry")

    def delete(self) -> None:
        """Delete it with its results."""
        self.service._open("DELETE", self._path).close()


class _NoRedirects(urllib.request.HTTPRedirectHandler):
    """A redirect would send the token elsewhere."""

    def redirect_request(self, *_: Any, **__: Any) -> None:
        return None


def _blocks(answer: Any) -> Iterator[bytes]:
    """What arrives of an answer, until it ends or breaks off."""
    try:
        while block := answer.read(1 << 20):
            yield block
    except (OSError, HTTPException):
        return


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
