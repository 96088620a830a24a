"""What requests hold, and the parts of the service that their routes use."""

from typing import Annotated, Literal

from fastapi import Depends, Path, Request
from pydantic import BaseModel, ConfigDict, Field, StrictInt, StrictStr

from explore.analysis.refining.plan import EVALUATIONS
from explore.service.access import Access
from explore.service.folder import NAME
from explore.service.job_files import MOST_FILE_BYTES, Refinement
from explore.service.station import Station


class _Body(BaseModel):
    model_config = ConfigDict(extra="forbid")


class StudySubmission(_Body):
    """A study to queue."""

    name: StrictStr = Field(max_length=100, description="Name of the job and of its results.")
    study: StrictStr = Field(max_length=MOST_FILE_BYTES, description="The text of the study file, TOML.")
    keep: Literal["all", "front"] = Field("all", description="Keep every design, or only the Pareto set.")
    priority: StrictInt = Field(5, ge=1, le=9, description="1 runs first, 9 last.")


class TaskSubmission(_Body):
    """A task to queue."""

    name: StrictStr = Field(max_length=100, description="Name of the job and of its results.")
    task: StrictStr = Field(max_length=MOST_FILE_BYTES, description="The text of the task file, TOML.")
    priority: StrictInt = Field(5, ge=1, le=9, description="1 runs first, 9 last.")


class RefinementSubmission(_Body):
    """A refinement to queue."""

    name: StrictStr = Field(max_length=100, description="Name of the job and of its results.")
    refine: StrictStr = Field(max_length=100, description="Name of the job whose results are refined.")
    metric: list[Annotated[StrictStr, Field(max_length=1000)]] = Field(
        [], max_length=20, description="NAME, NAME:min or NAME:max, two or more: objectives in place of the study's."
    )
    evaluations: StrictInt = Field(EVALUATIONS, ge=1, lt=2**63, description="Number of designs to evaluate.")
    seed: StrictInt = Field(0, ge=0, lt=2**63, description="Seed of the random steps.")
    priority: StrictInt = Field(5, ge=1, le=9, description="1 runs first, 9 last.")

    @property
    def text(self) -> str:
        """The text of its file."""
        return Refinement(self.refine, tuple(self.metric), self.evaluations, self.seed).to_toml()


class Priority(_Body):
    """The new priority of a job that waits."""

    priority: StrictInt = Field(ge=1, le=9)


class Login(_Body):
    """The token of a link."""

    token: StrictStr = Field(max_length=200)


class LinkRequest(_Body):
    """A link to make: with full rights, or only to look."""

    right: Literal["full", "read"] = "read"
    name: StrictStr = Field("", max_length=60, description="Who will use it: the owner of the jobs they submit.")


def _station(request: Request) -> Station:
    station: Station = request.app.state.station
    return station


def _access(request: Request) -> Access:
    access: Access = request.app.state.access
    return access


def _owner(request: Request) -> str:
    """The name that the session's link was made for; empty for others."""
    access = _access(request)
    return access.name_of(request.cookies.get(access.cookie))


OwnerOf = Annotated[str, Depends(_owner)]
StationOf = Annotated[Station, Depends(_station)]
AccessOf = Annotated[Access, Depends(_access)]
JobName = Annotated[str, Path(max_length=64, pattern=f"^{NAME.pattern}$", description="Name of a job.")]
