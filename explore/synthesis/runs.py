"""Evaluate the candidates of a task, and write them as a results file."""

from __future__ import annotations

import json
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

import numpy as np

from explore.evaluation.evaluate import evaluate_columns
from explore.model.columns import Arrays, Attribute, Column
from explore.results.store.all_designs_writer import AllDesignsWriter
from explore.running.collectors import results_columns, study_attributes
from explore.studies.config.study import Study
from explore.studies.designs.spaces import BLOCK_SIZE
from explore.synthesis.candidates import Candidates

#: Version of how candidates are written, raised by every change.
_VERSION = 2


@dataclass(frozen=True)
class CandidateRows:
    """The candidates of a task, evaluated: the rows of a results file.

    Attributes
    ----------
    study
        The study whose designs they are.
    candidates
        The candidates, as the solver found them.
    columns
        The columns of the results file.
    arrays
        Their values by name, without the number of the design.
    task
        The text of the task.
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
        with AllDesignsWriter(
            path, self.columns, self.count, BLOCK_SIZE, self._attributes(), restart=restart
        ) as writer:
            for number in writer.pending:
                rows = slice(number * BLOCK_SIZE, (number + 1) * BLOCK_SIZE)
                writer.commit(number, {name: values[rows] for name, values in self.arrays.items()})

    def _attributes(self) -> dict[str, Attribute]:
        """Attributes of the results file."""
        values = sha256()
        for name in sorted(self.arrays):
            values.update(self.arrays[name].tobytes())
        objectives = [f"{objective.metric}:{objective.sense}" for objective in self.study.objectives]
        content = json.loads(self.study.identity)
        content |= {
            "objectives": objectives,
            "sampling": {"method": "synthesis", "version": _VERSION, "sha256": values.hexdigest()},
        }
        identity = json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)
        return study_attributes(self.study) | {
            "request_sha256": sha256(identity.encode()).hexdigest(),
            "determines": identity,
            "sampler": "synthesis",
            "label_sentences": json.dumps(self.candidates.sentences),
            "task": self.task,
            "tried": json.dumps(self.candidates.tried),
        }


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
