"""What requests hold, and the parts of the service that their routes use."""

from typing import Annotated, ClassVar, Literal

from fastapi import Depends, Path, Request
from pydantic import BaseModel, ConfigDict, Field, StrictInt, StrictStr

from explore.analysis.refining.plan import EVALUATIONS
from explore.service.access import Access
from explore.service.folder import NAME
from explore.service.job_files import MOST_FILE_BYTES, Kind, Refinement
from explore.service.station import Station


class _Body(BaseModel):
    model_config = ConfigDict(extra="forbid")


class Submission(_Body):
    """What every job to queue has."""

    kind: ClassVar[Kind]
    name: StrictStr = Field(max_length=100, description="Name of the job and of its results.")
    priority: StrictInt = Field(5, ge=1, le=9, description="1 runs first, 9 last.")


class StudySubmission(Submission):
    """A study to queue."""

    kind = Kind.study
    study: StrictStr = Field(max_length=MOST_FILE_BYTES, description="The text of the study file, TOML.")
    keep: Literal["all", "front"] = Field("all", description="Keep every design, or only the Pareto set.")


class TaskSubmission(Submission):
    """A task to queue."""

    kind = Kind.task
    task: StrictStr = Field(max_length=MOST_FILE_BYTES, description="The text of the task file, TOML.")


class RefinementSubmission(Submission):
    """A refinement to queue."""

    kind = Kind.refinement
    refine: StrictStr = Field(max_length=100, description="Name of the job whose results are refined.")
    metric: list[Annotated[StrictStr, Field(max_length=1000)]] = Field(
        [], max_length=20, description="NAME, NAME:min or NAME:max, two or more: objectives in place of the study's."
    )
    evaluations: StrictInt = Field(EVALUATIONS, ge=1, lt=2**63, description="Number of designs to evaluate.")
    seed: StrictInt = Field(0, ge=0, lt=2**63, description="Seed of the random steps.")

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
