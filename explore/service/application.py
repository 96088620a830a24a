"""The HTTP application: its routes, its errors in words, and its state."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from fastapi import APIRouter, Depends, FastAPI, HTTPException, Request, Response
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse, PlainTextResponse
from fastapi.staticfiles import StaticFiles

from explore._version import __version__
from explore.base.errors import ConfigError, ExploreError, RequestError
from explore.service import browsing_routes, job_routes, results_routes, starter_routes
from explore.service.access import Access, Right
from explore.service.guard import Head
from explore.service.metrics import metrics_text
from explore.service.queries import check_query
from explore.service.queue import StateError, UnknownJobError
from explore.service.requests import AccessOf, LinkRequest, Login, StationOf
from explore.service.station import Station

_PAGE = Path(__file__).parent / "page"
#: File name and line number at the start of a problem of a study.
_LINE = re.compile(r"[a-z0-9_-]+\.toml:(\d+): ")

router = APIRouter()


def make_application(station: Station, access: Access, is_closing: Callable[[], bool]) -> FastAPI:
    """The application of a service; a `Guard` has to stand before it."""
    # No pages of documentation: they load scripts from elsewhere.
    # No redirects to addresses without a last slash: behind a proxy they would lead from https to http.
    application = FastAPI(
        title="explore",
        version=__version__,
        openapi_url="/api/openapi.json",
        docs_url=None,
        redoc_url=None,
        redirect_slashes=False,
    )
    application.state.station, application.state.access, application.state.is_closing = station, access, is_closing
    application.add_middleware(Head)
    application.include_router(router)
    for part in (job_routes.router, results_routes.router, browsing_routes.router, starter_routes.router):
        application.include_router(part, dependencies=[Depends(check_query)])
    application.mount("/page", StaticFiles(directory=_PAGE))
    application.add_exception_handler(ExploreError, _explain)
    application.add_exception_handler(RequestValidationError, _explain_request)
    application.add_exception_handler(OSError, _explain_system)
    application.add_exception_handler(Exception, _explain_unexpected)
    return application


@router.get("/", include_in_schema=False)
def page() -> Response:
    """The page, which holds no data."""
    return Response((_PAGE / "index.html").read_bytes(), media_type="text/html; charset=utf-8")


@router.post("/api/session", tags=["access"])
def open_session(login: Login, response: Response, access: AccessOf) -> dict[str, str]:
    """Exchange the token of a link, which works once, for a cookie."""
    opened = access.open_session(login.token)
    if opened is None:
        raise HTTPException(
            401, "this link was used already or is too old: each opens one browser, once; ask for another"
        )
    session, right = opened
    response.set_cookie(access.cookie, session, httponly=True, samesite="strict", secure=access.is_secure, path="/")
    return {"right": right.value}


@router.get("/api/session", tags=["access"])
def get_session(request: Request) -> dict[str, str]:
    """What the client may do: "full" or "read"."""
    return {"right": str(request.state.right)}


@router.post("/api/links", status_code=201, tags=["access"])
def make_link(wanted: LinkRequest, access: AccessOf) -> dict[str, str]:
    """Make a link that opens the service in one more browser, once."""
    return {"link": access.make_link(Right(wanted.right), wanted.name)}


@router.get("/healthz", tags=["operation"])
def health(station: StationOf) -> Response:
    """Whether jobs are swept."""
    is_alive = station.runner.is_alive()
    return JSONResponse({"status": "ok" if is_alive else "no job is swept"}, 200 if is_alive else 503)


@router.get("/metrics", response_class=PlainTextResponse, tags=["operation"])
def metrics(station: StationOf) -> Response:
    """Counts for Prometheus."""
    return Response(metrics_text(station), media_type="text/plain; version=0.0.4; charset=utf-8")


def _explain(request: Request, error: Exception) -> Response:
    """An error of explore: its sentence, without the server's path, and the problems of a study each with its line."""
    station: Station = request.app.state.station
    content: dict[str, Any] = {"detail": station.folder.without_path(str(error))}
    if isinstance(error, ConfigError):
        places = [(_LINE.match(problem), problem) for problem in error.problems]
        content["problems"] = [{"line": int(place[1]) if place else None, "text": text} for place, text in places]
    return JSONResponse(content, _status(error))


def _status(error: Exception) -> int:
    for kind, status in ((UnknownJobError, 404), (StateError, 409), (ConfigError, 422), (RequestError, 400)):
        if isinstance(error, kind):
            return status
    return 409  # results that are damaged, locked or not there


def _explain_request(_: Request, error: Exception) -> Response:
    """A request that does not fit the OpenAPI document: the place and the reason, never the value."""
    assert isinstance(error, RequestValidationError)  # noqa: S101 -- registered for these
    reasons = [f"{_place(entry['loc'])}: {entry['msg']}" for entry in error.errors()]
    problems = [{"line": None, "text": reason} for reason in reasons]
    return JSONResponse({"detail": "; ".join(reasons), "problems": problems}, 422)


def _place(location: tuple[Any, ...]) -> str:
    return ".".join(str(part)[:60] for part in location)


def _explain_system(_: Request, error: Exception) -> Response:
    """An error of the system, such as a full disk: without the path on the server."""
    reason = (error.strerror if isinstance(error, OSError) else "") or type(error).__name__
    return JSONResponse({"detail": f"the server cannot read or write its folder: {reason}"}, 507)


def _explain_unexpected(_: Request, error: Exception) -> Response:
    """An error that should not happen; the log has it in full."""
    kind = type(error).__name__
    return JSONResponse({"detail": f"internal error: {kind}; the server's log says more; please report it"}, 500)
