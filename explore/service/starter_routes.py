"""Routes of starters: the commented studies and tasks that `explore init` writes."""

from typing import Annotated, Any

from fastapi import APIRouter, BackgroundTasks, Path
from fastapi.responses import PlainTextResponse

from explore.base.errors import RequestError
from explore.mechanisms.registry import MECHANISMS
from explore.model.mechanism import Mechanism
from explore.model.quantities import STATISTICS, Formula, Metric, Signal
from explore.service.requests import StationOf
from explore.studies.config.study_file import linkage_starter, linkage_starters, starter
from explore.studies.request.names import find_mechanism
from explore.synthesis.tasks.registry import TASK_TYPES
from explore.synthesis.tasks.task_files import task_starter

_Mechanism = Annotated[str, Path(max_length=100, description="Name of a mechanism.")]
_Linkage = Annotated[str, Path(max_length=100, description="Name of a classic linkage.")]
_Task = Annotated[str, Path(max_length=100, description="Type of a task.")]

router = APIRouter(prefix="/api/starters", tags=["starters"])


@router.get("")
def list_starters(station: StationOf, later: BackgroundTasks) -> dict[str, Any]:
    """The mechanisms that have a study to start from, classic linkages and types of tasks, with what they are."""
    later.add_task(station.estimates.warm)  # who asks for these makes a dry run next
    mechanisms, _ = MECHANISMS.load_all()
    return {
        "studies": [_entry(name, mechanism.summary) for name, mechanism in mechanisms.items() if _has_one(mechanism)],
        "linkages": [_entry(name, summary) for name, summary in linkage_starters().items()],
        "tasks": [_entry(name, task.summary) for name, task in TASK_TYPES.items()],
    }


@router.get("/studies/{mechanism}", response_class=PlainTextResponse)
def study_starter(mechanism: _Mechanism) -> str:
    """The text of `explore init --mechanism`."""
    return starter(find_mechanism(mechanism))


@router.get("/studies/{mechanism}/metrics")
def metrics_of(mechanism: _Mechanism) -> dict[str, Any]:
    """The metrics of a mechanism, and the signals whose statistics are metrics, with units and meanings."""
    found = find_mechanism(mechanism)
    metrics: list[Metric | Formula] = [*found.metrics, *found.formulas]
    return {
        "metrics": [_quantity(each) for each in metrics],
        "signals": [_quantity(each) for each in found.signals],
        "statistics": list(STATISTICS),
    }


@router.get("/linkages/{linkage}", response_class=PlainTextResponse)
def starter_of_linkage(linkage: _Linkage) -> str:
    """The text of `explore init --linkage`."""
    return linkage_starter(linkage)


@router.get("/tasks/{task}", response_class=PlainTextResponse)
def starter_of_task(task: _Task) -> str:
    """The text of `explore init --task`."""
    return task_starter(task)


def _quantity(each: Metric | Formula | Signal) -> dict[str, str]:
    return {"name": each.name, "unit": "" if each.unit == "1" else each.unit, "meaning": each.long_name}


def _entry(name: str, summary: str) -> dict[str, str]:
    return {"name": name, "summary": summary}


def _has_one(mechanism: Mechanism) -> bool:
    try:
        starter(mechanism)
    except RequestError:  # a mechanism of another package may declare none
        return False
    return True
