"""Find linkages for a task."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from explore.model.progress import ReportProgress
from explore.model.quantities import Metric
from explore.model.request import Constraint
from explore.store.open_results import open_results
from explore.store.results import Results
from explore.sweeping.synthesis_runs import CandidateRows, Measured, evaluate_candidates
from explore.synthesis.tasks.task_files import TaskFile, load_task

if TYPE_CHECKING:
    from explore.synthesis.candidates import Candidates


def synthesize(
    task: TaskFile | Path | str,
    path: Path | str,
    *,
    restart: bool = False,
    report_progress: ReportProgress | None = None,
) -> Results:
    """Find linkages for a task, simulate each, and write them as a results file.

    `rank`, `refine`, `export` and all else work on it as on the results of a sweep.

    Parameters
    ----------
    task
        From `load_task`, or the path of a task file.
    path
        The results file. One that has the same candidates already is left as it is.
    restart
        Rename an existing file and start over.
    report_progress
        Called with the numbers of steps of the search that are done and that are to be done.

    Returns
    -------
    Results
        The candidates: parameters, how well each meets the task, margins of the bounds, and the number of the
        ``solution`` that each is. Where none meets the bounds they are those that come nearest, not feasible.

    Raises
    ------
    ConfigError
        If the task file is wrong.
    RequestError
        If the task has no linkage at all; the message says what was tried.
    ResultsError
        If the file cannot be created or holds other results.
    """
    loaded = task if isinstance(task, TaskFile) else load_task(task)
    rows_of(loaded, loaded.find(report_progress)).write(Path(path), restart=restart)
    return open_results(path)


def rows_of(task: TaskFile, candidates: Candidates) -> CandidateRows:
    """The candidates of a task, evaluated."""
    study, columns = task.study(candidates), {column.name: column for column in candidates.added}
    constraints = tuple(
        Constraint(Metric(name, columns[name].unit, columns[name].long_name), sides.get("min"), sides.get("max"))
        for name, sides in task.measured_constraints.items()
    )
    measured = Measured(
        candidates.added, candidates.stored(), task.task.measured, task.objectives(study), candidates.sentences,
        constraints,
    )  # fmt: skip
    return evaluate_candidates(study, candidates.parameters, measured, task.text, candidates.tried)
