"""Find linkages for a task."""

from __future__ import annotations

import json
import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from explore.evaluation.evaluate import evaluate_columns
from explore.model.columns import Arrays, Attribute, Column
from explore.model.progress import ReportProgress
from explore.results.ranking.pareto import objectives_to_minimise
from explore.results.ranking.spreading import spread_rows
from explore.results.store.open_results import open_results, refuse_other_content
from explore.results.store.results import Results
from explore.running.collectors import digest_of, identity_attributes, results_columns, study_attributes, write_at_once
from explore.studies.config.study import Study
from explore.synthesis.candidates import SOLUTION, Candidates
from explore.synthesis.tasks.task_files import TaskFile, load_task

#: Version of how candidates are written, raised by every change.
_VERSION = 2


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
    refuse_other_task(loaded, Path(path), restart=restart)
    candidates = loaded.find(report_progress)
    rows_of(loaded, candidates).write(Path(path), restart=restart)
    if candidates.is_interrupted:
        raise KeyboardInterrupt
    return open_results(path)


def refuse_other_task(task: TaskFile, path: Path, *, restart: bool) -> None:
    """Raise `ResultsError` before the search where it would refuse to write: the file has results of another task."""
    if path.exists() and not restart:
        refuse_other_content(path, "task", tomllib.loads(task.text))


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


@dataclass(frozen=True)
class CandidateRows:
    """The candidates of a task, evaluated: the rows of a results file.

    The study whose designs they are; the candidates as the solver found them; the columns of the file, and their values
    by name, without the number of the design; the text of the task.
    """

    study: Study
    candidates: Candidates
    columns: tuple[Column, ...]
    arrays: Arrays
    task: str

    @property
    def count(self) -> int:
        """Number of candidates."""
        return len(self.arrays["status"])

    def write(self, path: Path, *, restart: bool = False) -> None:
        """Write the results file; one that has these candidates already is left as it is."""
        write_at_once(path, self.columns, self.arrays, self._attributes(), restart=restart)

    def _attributes(self) -> dict[str, Attribute]:
        """Attributes of the results file."""
        objectives = [f"{objective.metric}:{objective.sense}" for objective in self.study.objectives]
        content = json.loads(self.study.identity)
        content |= {
            "objectives": objectives,
            "sampling": {"method": "synthesis", "version": _VERSION, "sha256": digest_of(self.arrays)},
        }
        return (
            study_attributes(self.study)
            | identity_attributes(content)
            | {
                "sampler": "synthesis",
                "label_sentences": json.dumps(self.candidates.sentences),
                "task": self.task,
                "tried": json.dumps(self.candidates.tried),
            }
        )


def evaluate_candidates(study: Study, candidates: Candidates, task: str) -> CandidateRows:
    """Evaluate candidates by the ordinary request of their study, which has ranges around them."""
    mechanism, stored = study.request.mechanism, candidates.stored()
    given = {metric.name: stored[metric.name] for metric in mechanism.given}
    evaluation = evaluate_columns(study.request, candidates.parameters | given)
    computed = results_columns(study)
    names = {column.name for column in computed}  # with metrics that are given, where the file names them
    columns = [*computed, *(column for column in candidates.added if column.name not in names)]
    # their margins are the last, as in files that were written before: these are still those of the same task
    last = [f"{name}_margin" for name in given]
    columns.sort(key=lambda column: last.index(column.name) + 1 if column.name in last else 0)
    arrays = evaluation.columns | stored
    own = {column.name: np.ascontiguousarray(arrays[column.name], dtype=column.dtype) for column in columns[1:]}
    return CandidateRows(study, candidates, tuple(columns), own, task)
