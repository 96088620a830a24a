"""Submit studies, tasks and refinements to a service from Python, and fetch the results."""

from __future__ import annotations

import os
import time
import tomllib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from http.client import HTTPException
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal
from urllib.parse import quote, urlencode

from explore.base.errors import RequestError, ResultsError
from explore.base.files import new_file
from explore.service.requester import Requester, ServiceError, Unreachable

if TYPE_CHECKING:
    from explore.results.store.results import Results
    from explore.studies.config.study import Study
    from explore.synthesis.tasks.task_files import TaskFile

#: Time between two looks at a job, s.
_INTERVAL = 0.3
#: Longest absence of a server while a job is waited for, such as for a restart, s.
_MOST_AWAY = 60.0


@dataclass(frozen=True)
class JobProgress:
    """How far a job is.

    Attributes
    ----------
    state
        "queued", "running", "done", "failed" or "cancelled".
    done, designs
        Designs that are computed, and all; 0 for a task that has not found any yet.
    steps_done, steps
        Those of the search of a task; 0 for others.
    rate, seconds_left
        Designs per second, and an estimate of the time left; None where they are not known.
    reason
        Why it failed, or what it waits for; else empty.
    """

    state: str
    done: int
    designs: int
    steps_done: int
    steps: int
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
        self._requester = Requester(url, token)
        self.url = self._requester.url

    def __repr__(self) -> str:
        return f"Service({self.url!r})"

    def submit(
        self, study: Study | TaskFile | str, *, name: str, keep: Literal["all", "front"] = "all", priority: int = 5
    ) -> JobHandle:
        """Queue a study or a task.

        Parameters
        ----------
        study
            A study, a task from `load_task`, or the text of a file of either. The points of a file that a target
            names are sent with the text; a text must have them.
        name
            Name of the job and of its results: lower-case letters, digits, - and _.
        keep
            Which designs of a study are kept, as `explore.sweep` has it.
        priority
            1 runs first, 9 last.

        Raises
        ------
        ConfigError
            With every problem of the study or task.
        ServiceError
            The service cannot be reached, or refuses; the message says why.
        """
        route, content = _submission(study, name, keep)
        self._requester.post(route, {**content, "priority": priority})
        return self.job(name)

    def refine(
        self,
        job: str,
        *,
        name: str | None = None,
        objectives: Sequence[str] | None = None,
        evaluations: int | None = None,
        seed: int = 0,
        priority: int = 5,
    ) -> JobHandle:
        """Queue the refinement of the results of a job that is done, as `explore.refine` makes it.

        Parameters
        ----------
        job
            Name of the job whose results are refined.
        name
            Name of the new job and of its results; by default JOB-refined.
        objectives, evaluations, seed
            As of `explore.refine`.
        priority
            1 runs first, 9 last.

        Raises
        ------
        ServiceError
            The service cannot be reached, or refuses; the message says why.
        """
        name = name or refined_name(job)
        content = _refinement(job, name, objectives, evaluations, seed)
        self._requester.post("/api/refinements", {**content, "priority": priority})
        return self.job(name)

    def plan(
        self, study: Study | TaskFile | str, *, name: str = "study", keep: Literal["all", "front"] = "all"
    ) -> dict[str, Any]:
        """What a study or task would make and take: designs, bytes, seconds and so on; nothing is queued."""
        route, content = _submission(study, name, keep)
        return dict(self._requester.post(f"{route}?dry_run=true", content))

    def plan_refinement(
        self,
        job: str,
        *,
        name: str | None = None,
        objectives: Sequence[str] | None = None,
        evaluations: int | None = None,
        seed: int = 0,
    ) -> dict[str, Any]:
        """What a refinement would make and take; nothing is queued."""
        content = _refinement(job, name or refined_name(job), objectives, evaluations, seed)
        return dict(self._requester.post("/api/refinements?dry_run=true", content))

    def job(self, name: str) -> JobHandle:
        """A job by name."""
        return JobHandle(self, name)

    def jobs(self) -> list[dict[str, Any]]:
        """All jobs: the running one, those that wait in their order, then the others."""
        return list(self._requester.get("/api/jobs")["jobs"])

    def rank(self, name: str, **options: Any) -> dict[str, Any]:
        """The Pareto set of a job's results, found by the service; `options` as of its route, such as `metric`."""
        query = urlencode(options, doseq=True)
        return dict(self._requester.get(f"/api/results/{quote(name, safe='')}/rank?{query}"))


class JobHandle:
    """A job of a service; `Service.submit` and `Service.job` make it."""

    def __init__(self, service: Service, name: str) -> None:
        self.service, self.name = service, name
        self._requester = service._requester
        self._path = f"/api/jobs/{quote(name, safe='')}"

    def __repr__(self) -> str:
        return f"JobHandle({self.service.url!r}, {self.name!r})"

    def facts(self) -> dict[str, Any]:
        """All that the service tells about it: kind, priority, times, progress and so on."""
        return dict(self._requester.get(self._path))

    def progress(self) -> JobProgress:
        """How far it is now."""
        facts = self.facts()
        return JobProgress(**{name: facts[name] for name in JobProgress.__dataclass_fields__})

    def wait(self, seconds: float | None = None, report: Callable[[JobProgress], None] | None = None) -> JobProgress:
        """Wait until it is done, failed or cancelled, or so many seconds; a restart of the service is waited for.

        Parameters
        ----------
        seconds
            The longest time to wait; None for any.
        report
            Called with the progress, some times a second.
        """
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
            if progress is not None and report is not None:
                report(progress)
            time.sleep(_INTERVAL)

    def results(self, path: Path | str | None = None) -> Results:
        """Fetch the results into a file, results/NAME.h5 by default, and open it.

        Raises
        ------
        ServiceError
            The job is not done.
        """
        from explore.results.store.open_results import open_results

        target = Path("results") / f"{self.name}.h5" if path is None else Path(path)
        with self._requester.open("GET", f"/api/results/{quote(self.name, safe='')}/file") as answer:
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

    def prioritise(self, priority: int) -> None:
        """Give it another priority while it waits: 1 runs first, 9 last."""
        self._requester.post(f"{self._path}/priority", {"priority": priority})

    def cancel(self) -> None:
        """Cancel it; what is computed stays."""
        self._requester.post(f"{self._path}/cancel")

    def retry(self) -> None:
        """Queue it again; it goes on where it ended, and the search of a task begins again."""
        self._requester.post(f"{self._path}/retry")

    def delete(self) -> None:
        """Delete it with its results."""
        self._requester.open("DELETE", self._path).close()


def refined_name(job: str) -> str:
    """The name of the refinement of a job, where none is given."""
    return f"{job[:56]}-refined"


def _submission(study: Study | TaskFile | str, name: str, keep: str) -> tuple[str, dict[str, Any]]:
    """The route and the content that submit a study or a task."""
    if isinstance(study, str):
        text = study
    else:  # of modules that take a second to import
        from explore.service.inlined_points import text_with_points

        text = text_with_points(study)
    if not _is_task(text):
        return "/api/studies", {"name": name, "study": text, "keep": keep}
    if keep != "all":
        raise RequestError('a task keeps all its linkages; write `keep="all"`')
    return "/api/tasks", {"name": name, "task": text}


def _is_task(text: str) -> bool:
    """Whether a text is that of a task; one that is no TOML is a study, whose problems the service tells."""
    try:
        sections = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError):
        return False
    return "task" in sections and "mechanism" not in sections


def _refinement(
    job: str, name: str, objectives: Sequence[str] | None, evaluations: int | None, seed: int
) -> dict[str, Any]:
    """The content that submits a refinement."""
    content = {"name": name, "refine": job, "metric": list(objectives or []), "seed": seed}
    return content if evaluations is None else {**content, "evaluations": evaluations}


def _blocks(answer: Any) -> Iterator[bytes]:
    """The blocks of an answer that arrive, until it ends or breaks off."""
    try:
        while block := answer.read(1 << 20):
            yield block
    except (OSError, HTTPException):
        return
