"""Routes of results: the words of `explore show` and `explore rank`, and the file itself."""

from enum import StrEnum
from pathlib import Path as FilePath
from typing import Annotated, Any

from fastapi import APIRouter, Path, Query, Response
from fastapi.responses import FileResponse

from explore.results.store.results import Results
from explore.service.folder import State
from explore.service.queue import StateError
from explore.service.requests import JobName, StationOf
from explore.service.results_views import export_design, list_columns, open_shown, rank_results, show_design
from explore.service.results_views import show as show_results
from explore.service.station import Station
from explore.service.turns import Turns

#: Turns of rankings and exports, each of which keeps a processor busy and reads a file.
_RANKINGS = Turns(at_a_time=2, waiting=8)


class Exported(StrEnum):
    """Formats of a design, by the endings of names."""

    toml = "toml"
    csv = "csv"
    dxf = "dxf"
    svg = "svg"
    gif = "gif"


_MEDIA = {
    Exported.toml: "application/toml",
    Exported.csv: "text/csv; charset=utf-8",
    Exported.dxf: "image/vnd.dxf",
    Exported.svg: "image/svg+xml",
    Exported.gif: "image/gif",
}
_Text = Annotated[str, Query(max_length=1000)]

router = APIRouter(prefix="/api/results", tags=["results"])


@router.get("/{name}")
def show(name: JobName, station: StationOf) -> dict[str, Any]:
    """What `explore show --json` prints."""
    return show_results(_open(station, name))


@router.get("/{name}/columns")
def columns(name: JobName, station: StationOf) -> dict[str, Any]:
    """The columns with their units and meanings."""
    return {"columns": list_columns(_open(station, name))}


@router.get("/{name}/design/{number}")
def design(name: JobName, number: Annotated[int, Path(ge=0, lt=2**63)], station: StationOf) -> dict[str, Any]:
    """What `explore show --design NUMBER --json` prints."""
    return show_design(_open(station, name), number)


@router.get("/{name}/design/{number}/export/{kind}", response_class=Response)
def export(name: JobName, number: Annotated[int, Path(ge=0, lt=2**63)], kind: Exported, station: StationOf) -> Response:
    """A design as a file, as `explore export` writes it: its study, motion, drawing, or the mechanism moving."""
    path = _path(station, name)
    with _RANKINGS.taken():
        content: bytes = station.calls.call("the export", export_design, path, number, kind.value)
    head = {"Content-Disposition": f'attachment; filename="{name}-{number}.{kind}"'}
    return Response(content, media_type=_MEDIA[kind], headers=head)


@router.get("/{name}/rank")
def rank(
    name: JobName,
    station: StationOf,
    metric: Annotated[
        list[_Text],
        Query(default_factory=list, max_length=20, description="Once: order by it. Several times: the objectives."),
    ],
    limit: Annotated[
        list[_Text],
        Query(default_factory=list, max_length=50, description="METRIC=VALUE, METRIC>=VALUE, METRIC<=VALUE."),
    ],
    where: Annotated[str | None, Query(max_length=2000, description='Such as "swing_angle > 20".')] = None,
    fronts: Annotated[int, Query(ge=1, le=100)] = 1,
    quality: Annotated[bool, Query(description="Also knee, crowding distance, share of the hypervolume.")] = False,
    top: Annotated[int, Query(ge=1, le=10_000, description="Designs to list.")] = 100,
) -> dict[str, Any]:
    """The Pareto-optimal designs, best first, as `explore rank --json` prints them."""
    path = _path(station, name)
    with _RANKINGS.taken():
        options = (metric, where, limit, fronts, quality, top)
        return dict(station.calls.call("the ranking", rank_results, path, *options))


@router.get("/{name}/file", response_class=FileResponse)
def file(name: JobName, station: StationOf) -> FileResponse:
    """The results file; ranges of bytes may be asked for."""
    job = station.jobs.get(name)
    if job.state != State.done:
        raise StateError(f"{name} is {job.state}; its file can be fetched when it is done")
    path = station.folder.results_path(name)
    if not path.is_file():
        raise StateError(f"the results of {name} were removed from the folder")
    return FileResponse(path, media_type="application/x-hdf5", filename=f"{name}.h5")


def _open(station: Station, name: str) -> Results:
    """The results of a job, finished or not."""
    return open_shown(_path(station, name))


def _path(station: Station, name: str) -> FilePath:
    """The file of the results of a job, finished or not."""
    job, path = station.jobs.get(name), station.folder.results_path(name)
    if not path.exists():
        raise StateError(f"{name} is {job.state} and has no results yet")
    return path
