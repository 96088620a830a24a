"""What requests hold, and the parts of the service that their routes use."""

from __future__ import annotations

from typing import Annotated, Literal

from fastapi import Depends, Path, Request
from pydantic import BaseModel, ConfigDict, Field, StrictInt, StrictStr

from explore.serving.access import Access
from explore.serving.folder import NAME
from explore.serving.plans import MOST_STUDY_BYTES
from explore.serving.station import Station


class _Body(BaseModel):
    model_config = ConfigDict(extra="forbid")


class Submission(_Body):
    """A study to queue."""

    name: StrictStr = Field(max_length=100, description="Name of the job and of its results.")
    study: StrictStr = Field(max_length=MOST_STUDY_BYTES, description="The text of the study file, TOML.")
    keep: Literal["all", "front"] = Field("all", description="Keep every design, or only the Pareto set.")
    priority: StrictInt = Field(5, ge=1, le=9, description="1 is swept first, 9 last.")


class Priority(_Body):
    """The new priority of a job that waits."""

    priority: StrictInt = Field(ge=1, le=9)


class Login(_Body):
    """The token of a link."""

    token: StrictStr = Field(max_length=200)


class LinkRequest(_Body):
    """A link to make: with full rights, or only to look."""

    right: Literal["full", "read"] = "read"


def _station(request: Request) -> Station:
    station: Station = request.app.state.station
    return station


def _access(request: Request) -> Access:
    access: Access = request.app.state.access
    return access


StationOf = Annotated[Station, Depends(_station)]
AccessOf = Annotated[Access, Depends(_access)]
JobName = Annotated[str, Path(max_length=64, pattern=f"^{NAME.pattern}$", description="Name of a job.")]
