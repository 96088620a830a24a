"""Routes of jobs: submit, list, change, watch."""

import asyncio
import time
from collections.abc import AsyncIterator, Callable
from dataclasses import asdict
from typing import Annotated, Any

from fastapi import APIRouter, Header, HTTPException, Query, Request, Response
from fastapi.responses import PlainTextResponse, StreamingResponse

from explore.service.queue import UnknownJobError
from explore.service.requests import (
    JobName,
    OwnerOf,
    Priority,
    RefinementSubmission,
    StationOf,
    StudySubmission,
    Submission,
    TaskSubmission,
)
from explore.service.station import Station
from explore.service.turns import Turns

#: Largest number of clients that watch at a time.
MOST_WATCHERS = 200
#: Time without an event after which a comment is sent, so that proxies do not close the connection, s.
_HEARTBEAT = 15.0
#: Longest stream, s; its client comes back for the rest, unless its right has ended.
_STREAM_SECONDS = 3600.0

_LastEventId = Annotated[str | None, Header(max_length=100)]

#: Turns of requests that read the file of a job: a large one takes seconds, and its estimate a process.
_PLANS = Turns(at_a_time=2, waiting=8)

router = APIRouter(prefix="/api", tags=["jobs"])


_DryRun = Annotated[bool, Query(description="Say what the job would make and take; queue nothing.")]


@router.post("/studies", status_code=201)
def submit_study(
    submission: StudySubmission, station: StationOf, owner: OwnerOf, response: Response, dry_run: _DryRun = False
) -> dict[str, Any]:
    """Queue a study, as for `explore sweep`; all its problems come at once, with line and key."""
    return _submit(station, submission, submission.study, owner, response, submission.keep, dry_run=dry_run)


@router.post("/tasks", status_code=201)
def submit_task(
    submission: TaskSubmission, station: StationOf, owner: OwnerOf, response: Response, dry_run: _DryRun = False
) -> dict[str, Any]:
    """Queue a task, as for `explore synthesize`; all its problems come at once, with line and key."""
    return _submit(station, submission, submission.task, owner, response, dry_run=dry_run)


@router.post("/refinements", status_code=201)
def submit_refinement(
    submission: RefinementSubmission, station: StationOf, owner: OwnerOf, response: Response, dry_run: _DryRun = False
) -> dict[str, Any]:
    """Queue the refinement of the results of a job that is done, as `explore refine` makes it."""
    return _submit(station, submission, submission.text, owner, response, dry_run=dry_run)


def _submit(
    station: Station, submission: Submission, text: str, owner: str, response: Response, keep: str = "all",
    *, dry_run: bool,
) -> dict[str, Any]:  # fmt: skip
    content = text.encode("utf-8", "surrogatepass")  # a lone surrogate is then refused as no UTF-8
    name, kind, jobs = submission.name, submission.kind, station.jobs
    with _PLANS.taken():
        if dry_run:
            response.status_code = 200
            plan = jobs.plan(name, content, kind=kind, keep=keep)
            seconds, note = station.estimates.seconds(content, plan)
            return {**asdict(plan), "seconds": seconds, "note": station.folder.without_path(note)}
        return jobs.submit(name, content, kind=kind, keep=keep, priority=submission.priority, owner=owner).to_json()


@router.get("/jobs")
def list_jobs(station: StationOf) -> dict[str, Any]:
    """All jobs: the running one, those that wait in their order, then the others, the last to end first."""
    return {"jobs": [job.to_json() for job in station.jobs.in_order()]}


@router.get("/jobs/{name}")
def get_job(name: JobName, station: StationOf) -> dict[str, Any]:
    """A job, with its progress."""
    return station.jobs.get(name).to_json()


@router.get("/jobs/{name}/study", response_class=PlainTextResponse)
def get_study(name: JobName, station: StationOf) -> Response:
    """The study, task or refinement of a job, as it was submitted."""
    return Response(station.jobs.study(name), media_type="text/plain; charset=utf-8")


@router.post("/jobs/{name}/cancel")
def cancel(name: JobName, station: StationOf) -> dict[str, Any]:
    """Cancel a job that waits or runs; what is computed stays."""
    return station.runner.cancel(name).to_json()


@router.post("/jobs/{name}/retry")
def retry(name: JobName, station: StationOf) -> dict[str, Any]:
    """Queue a job again that failed or was cancelled; its sweep goes on where it ended."""
    return station.jobs.retry(name).to_json()


@router.post("/jobs/{name}/priority")
def prioritise(name: JobName, body: Priority, station: StationOf) -> dict[str, Any]:
    """Give a job that waits another priority."""
    return station.jobs.prioritise(name, body.priority).to_json()


@router.delete("/jobs/{name}", status_code=204)
def delete(name: JobName, station: StationOf) -> None:
    """Delete a job that does not run, with its results."""
    station.indexes.forget(name)
    station.jobs.delete(name)


@router.get("/events")
async def watch(request: Request, station: StationOf, last_event_id: _LastEventId = None) -> StreamingResponse:
    """Events of all jobs, as server-sent events, until the client leaves.

    The first event, ``jobs``, lists all jobs; then each change is a ``job`` or ``deleted``. A client that comes back
    with the header Last-Event-ID gets what it missed, or the list again where that is not kept any more.
    """
    return _watched(request, station, last_event_id)


@router.get("/jobs/{name}/events")
async def watch_job(
    name: JobName, request: Request, station: StationOf, last_event_id: _LastEventId = None
) -> StreamingResponse:
    """Events of a job, as server-sent events, until it is deleted or the client leaves.

    The first event, ``job``, is the job as it is; then each change is a ``job``, and the last event is ``deleted``. A
    client that comes back with the header Last-Event-ID gets what it missed, or the job again where that is not kept
    any more.
    """
    station.jobs.get(name)
    return _watched(request, station, last_event_id, name)


def _watched(request: Request, station: Station, last_event_id: str | None, name: str = "") -> StreamingResponse:
    if station.events.n_watchers >= MOST_WATCHERS:
        raise HTTPException(503, f"{MOST_WATCHERS} clients watch already; try again later")
    stream = _stream(station, last_event_id or "", name, request.app.state.is_closing)
    return StreamingResponse(stream, media_type="text/event-stream", headers={"X-Accel-Buffering": "no"})


async def _stream(
    station: Station, last_event_id: str, name: str, is_closing: Callable[[], bool]
) -> AsyncIterator[bytes]:
    """The events of a job, or of all if no name is given, after the one with an id."""
    events, loop = station.events, asyncio.get_running_loop()
    news, end = asyncio.Event(), time.monotonic() + _STREAM_SECONDS
    epoch, _, number = last_event_id.partition("-")
    position = int(number) if epoch == events.epoch and number.isascii() and number.isdigit() else -1
    with events.watched(lambda: loop.call_soon_threadsafe(news.set)):
        yield b"retry: 1000\n\n"
        while not is_closing() and time.monotonic() < end:
            news.clear()
            missed = events.after(position)
            if missed is None:
                position = events.last  # before the jobs, so that a change is sent twice rather than not
                kind, data = _present(station, name)
                yield events.text(position, kind, data)
                if kind == "deleted":
                    return
                continue
            for event in missed:
                position = event.number
                if name in ("", event.name):
                    yield event.text
                    if name and event.is_deleted:
                        return
            if position < events.last:
                continue
            try:
                async with asyncio.timeout(_HEARTBEAT):
                    await news.wait()
            except TimeoutError:
                yield b": nothing new\n\n"


def _present(station: Station, name: str) -> tuple[str, dict[str, Any]]:
    """The first event: the job of a name, or all jobs if no name is given."""
    if not name:
        return "jobs", {"jobs": [job.to_json() for job in station.jobs.in_order()]}
    try:
        return "job", station.jobs.get(name).to_json()
    except UnknownJobError:  # deleted since the client asked
        return "deleted", {"name": name}
