"""Routes of the results browser: exact counts over whole files, from an index that the service makes once."""

import json
from typing import Annotated, Any

from fastapi import APIRouter, Path, Query, Response

from explore.figures.reporting.design import collect_design, motion_script
from explore.service.browsing_views import (
    Window,
    describe_browsing,
    describe_density,
    describe_histograms,
    list_points,
)
from explore.service.requests import JobName, StationOf
from explore.service.results_views import with_mechanism
from explore.service.turns import Turns

#: Turns of requests that count, each of which keeps the processors busy.
_COUNTS = Turns(at_a_time=2, waiting=8)

_Name = Annotated[str, Query(max_length=200)]
_Where = Annotated[
    list[Annotated[str, Query(max_length=1000)]],
    Query(default_factory=list, max_length=40, description='Such as "swing_angle > 20".'),
]
_End = Annotated[float | None, Query(allow_inf_nan=False, description="End of the window, in the shown unit.")]
_Bins = Annotated[int | None, Query(ge=1, le=512, description="Default: as fits the values.")]

router = APIRouter(prefix="/api/results/{name}", tags=["browser"])


@router.get("/index")
def index(
    name: JobName, station: StationOf, build: Annotated[bool, Query(description="Make it if there is none.")] = False
) -> dict[str, Any]:
    """Whether the results are indexed: "none", "building" with the share that is done, or "ready"."""
    if build:
        station.indexes.build(name)
    state, share = station.indexes.state(name)
    return {"state": state, "share": share, "designs": station.indexes.results(name).n_committed}


@router.get("/browsing")
def browsing(name: JobName, station: StationOf) -> dict[str, Any]:
    """What a page needs to start; ranges of columns are null until the index is ready."""
    state = index(name, station)
    browsed = station.indexes.get(name) if state["state"] == "ready" else None
    return {**describe_browsing(station.indexes.results(name), browsed), "index": state}


@router.get("/histograms", response_class=Response)
def histograms(
    name: JobName,
    station: StationOf,
    columns: Annotated[str, Query(max_length=4000, description="Names, separated by commas.")],
    where: _Where,
    bins: _Bins = None,
) -> Response:
    """Counts of up to 64 columns by bins of equal width; each column leaves out the conditions on itself.

    Without `bins` each bin of a column on a grid holds equally many of its values, `values_per_bin`.
    """
    with station.indexes.reading(name) as browsed, _COUNTS.taken():
        return _json(describe_histograms(browsed, _split(columns), where, bins))


@router.get("/density", response_class=Response)
def density(
    name: JobName,
    station: StationOf,
    x: _Name,
    y: _Name,
    where: _Where,
    bins_x: _Bins = None,
    bins_y: _Bins = None,
    x_low: _End = None,
    x_high: _End = None,
    y_low: _End = None,
    y_high: _End = None,
) -> Response:
    """Counts of two columns together within a window.

    Without its number of bins and its ends, each bin of an axis on a grid holds equally many of its values.
    """
    with station.indexes.reading(name) as browsed, _COUNTS.taken():
        return _json(describe_density(browsed, x, y, where, (bins_x, bins_y), Window(x_low, x_high, y_low, y_high)))


@router.get("/points", response_class=Response)
def points(
    name: JobName,
    station: StationOf,
    x: _Name,
    y: _Name,
    where: _Where,
    x_low: _End = None,
    x_high: _End = None,
    y_low: _End = None,
    y_high: _End = None,
    limit: Annotated[int, Query(ge=1, le=20_000)] = 2000,
) -> Response:
    """The selected designs within a window, if they are few enough."""
    with station.indexes.reading(name) as browsed, _COUNTS.taken():
        return _json(list_points(browsed, x, y, where, Window(x_low, x_high, y_low, y_high), limit))


@router.get("/design/{number}/motion")
def motion(name: JobName, number: Annotated[int, Path(ge=0, lt=2**63)], station: StationOf) -> Response:
    """A design with all that a page needs to draw its motion, as in a report; `motion.js` has the functions."""
    return _json(collect_design(*with_mechanism(station.indexes.results(name)), number))


@router.get("/motion.js", response_class=Response)
def motion_functions(name: JobName, station: StationOf) -> Response:
    """The functions of the mechanism in JavaScript, as in a report; refused where they have none."""
    return Response(
        motion_script(*with_mechanism(station.indexes.results(name))), media_type="text/javascript; charset=utf-8"
    )


def _split(names: str) -> list[str]:
    """The names of a list, once each."""
    return list(dict.fromkeys(names.split(",")))[:64]


def _json(content: dict[str, Any]) -> Response:
    """A response without FastAPI's own conversion, which would take longer than the counts."""
    return Response(json.dumps(content, separators=(",", ":"), allow_nan=False), media_type="application/json")
