"""Find linkages for a task."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

from explore.model.progress import ReportProgress
from explore.results.ranking.pareto import objectives_to_minimise
from explore.results.ranking.spreading import spread_rows
from explore.results.store.open_results import open_results
from explore.results.store.results import Results
from explore.synthesis.candidates import SOLUTION, Candidates
from explore.synthesis.runs import CandidateRows, evaluate_candidates
from explore.synthesis.tasks.task_files import TaskFile, load_task


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
    KeyboardInterrupt
        If the search was interrupted, after what it had found is written.
    """
    loaded = task if isinstance(task, TaskFile) else load_task(task)
    candidates = loaded.find(report_progress)
    rows_of(loaded, candidates).write(Path(path), restart=restart)
    if candidates.is_interrupted:
        raise KeyboardInterrupt
    return open_results(path)


def rows_of(task: TaskFile, candidates: Candidates) -> CandidateRows:
    """The candidates of a task, evaluated; the objectives choose where there are more than are kept."""
    rows = _evaluated(task, candidates)
    kept = _kept(rows, candidates)
    return rows if len(kept) == rows.count else _evaluated(task, candidates.rows(kept))


def _kept(rows: CandidateRows, candidates: Candidates) -> npt.NDArray[np.int64]:
    """Rows of the solutions to keep: evenly along the Pareto set, then what is next; then those outside the bounds."""
    solutions, always = candidates.values[SOLUTION.name], list(candidates.always)
    n_solutions = len(np.setdiff1d(solutions, solutions[always]))
    if candidates.most is None or n_solutions <= candidates.most:
        return np.arange(candidates.count)
    columns = {name: np.asarray(values, dtype=np.float64) for name, values in rows.arrays.items()}
    values = objectives_to_minimise(columns, rows.study.objectives)
    good = np.flatnonzero((columns["feasible"] == 1.0) & np.isfinite(values).all(axis=1))
    good = good[~np.isin(solutions[good], solutions[always])]
    traits = None if candidates.traits is None else candidates.traits[good]
    # Each solution may have several rows.
    n_wanted = candidates.most * int(np.unique(solutions, return_counts=True)[1].max())
    order = good[spread_rows(values[good], n_wanted, traits)]
    if not len(good):
        order = np.setdiff1d(np.arange(candidates.count), always)
    chosen = list(dict.fromkeys(solutions[order].tolist()))[: candidates.most]
    return np.flatnonzero(np.isin(solutions, [*solutions[always], *chosen]))


def _evaluated(task: TaskFile, candidates: Candidates) -> CandidateRows:
    return evaluate_candidates(task.asked.study(candidates), candidates, task.text)
