"""What a type of task is, and what a task of it has."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from explore.base.errors import Problems
from explore.model.progress import ReportProgress
from explore.model.quantities import GivenMetric
from explore.synthesis.candidates import Candidates
from explore.synthesis.tasks.sections import SectionReader

#: Largest number of candidates that a task may ask for.
MOST_CANDIDATES = 10_000


@dataclass(frozen=True)
class Task:
    """What a linkage shall do, resolved: the solver, and what the study of its candidates computes.

    Attributes
    ----------
    mechanism
        Name of the mechanism of the candidates.
    find
        Finds the candidates; called with what reports its progress, or None.
    parameters
        Names of the parameters that the candidates have.
    fixed
        Those that the task gives, which a refinement keeps.
    objectives
        As in ``[rank] metrics``: how well the task is met first.
    measured
        Metrics that the solver measures, because evaluation cannot compute them; their columns are among those that
        the candidates add.
    metrics
        Names of metrics that are computed besides the objectives.
    constraints
        As in a study.
    formulas
        As ``[metrics]`` in a study.
    points
        Names of the points of the floating link, whose coordinates are among the parameters.
    target
        The section ``[target]`` of the study; None for a task without.
    given
        Keys of the task's own ``[target]`` that hold its points, poses or table, from a file too.
    window
        Name of the window of the study, unless the file names one; empty for the mechanism's own.
    remarks
        What may not be meant, with its key.
    """

    mechanism: str
    find: Callable[[ReportProgress | None], Candidates]
    parameters: tuple[str, ...]
    fixed: tuple[str, ...] = ()
    objectives: tuple[str, ...] = ()
    measured: tuple[GivenMetric, ...] = ()
    metrics: tuple[str, ...] = ()
    constraints: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    formulas: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    points: tuple[str, ...] = ()
    target: Mapping[str, Any] | None = None
    given: Mapping[str, Any] = field(default_factory=dict)
    window: str = ""
    remarks: Problems = field(default_factory=list)


@dataclass(frozen=True)
class TaskSections:
    """The sections of a task file that its type reads, and the folder that names of files are relative to."""

    target: SectionReader
    bounds: SectionReader
    search: SectionReader
    folder: Path


@dataclass(frozen=True)
class TaskType:
    """A type of task: the word after ``task =``, and what its linkages do, for the list of types.

    `read` makes a task of the sections, or returns None after it noted what is wrong with them.
    """

    name: str
    summary: str
    read: Callable[[TaskSections, Problems], Task | None]
