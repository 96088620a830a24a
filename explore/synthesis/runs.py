"""Evaluate the candidates of a task, and write them as a results file."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

import numpy as np

from explore.evaluation.constraints import is_satisfied, margin
from explore.evaluation.evaluate import evaluate_columns, margin_column
from explore.model.columns import Arrays, Attribute, Column
from explore.model.quantities import Sense
from explore.model.request import Constraint, Objective
from explore.results.store.all_designs_writer import AllDesignsWriter
from explore.running.collectors import results_columns, study_attributes
from explore.studies.config.study import Study
from explore.studies.designs.spaces import BLOCK_SIZE

#: Version of how candidates are written, raised by every change.
_VERSION = 2


@dataclass(frozen=True)
class Measured:
    """What the solver of a task says of its candidates.

    Attributes
    ----------
    columns
        The columns beside those of a sweep.
    values
        Their values by name, as they are stored.
    senses
        The better side of those that can be objectives.
    objectives
        The objectives of the results, among which these and those of the study are.
    sentences
        What labels of the columns mean.
    constraints
        Bounds on columns, which the study does not have.
    """

    columns: tuple[Column, ...]
    values: Arrays
    senses: Mapping[str, Sense]
    objectives: tuple[Objective, ...]
    sentences: Mapping[str, str]
    constraints: tuple[Constraint, ...] = ()


@dataclass(frozen=True)
class CandidateRows:
    """The candidates of a task, evaluated: the rows of a results file.

    Attributes
    ----------
    study
        The study whose designs they are.
    measured
        What the solver says of them.
    columns
        The columns of the results file.
    arrays
        Their values by name, without the number of the design.
    task
        The text of the task.
    tried
        What was searched, and what comes nearest where nothing meets the bounds.
    """

    study: Study
    measured: Measured
    columns: tuple[Column, ...]
    arrays: Arrays
    task: str
    tried: tuple[str, ...]

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
        objectives = [f"{objective.metric}:{objective.sense}" for objective in self.measured.objectives]
        content = json.loads(self.study.identity)
        content |= {
            "objectives": objectives,
            "constraints": content.get("constraints", {}) | self._measured_constraints(),
            "sampling": {"method": "synthesis", "version": _VERSION, "sha256": values.hexdigest()},
        }
        identity = json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)
        attributes = study_attributes(self.study)
        senses = json.loads(str(attributes["senses"])) | dict(self.measured.senses)
        return attributes | {
            "request_sha256": sha256(identity.encode()).hexdigest(),
            "determines": identity,
            "sampler": "synthesis",
            "objectives": json.dumps(objectives),
            "senses": json.dumps(senses),
            "label_sentences": json.dumps(self.measured.sentences),
            "task": self.task,
            "tried": json.dumps(self.tried),
        }

    def _measured_constraints(self) -> dict[str, dict[str, float | None]]:
        return {each.metric.name: {"min": each.minimum, "max": each.maximum} for each in self.measured.constraints}


def evaluate_candidates(
    study: Study, parameters: Arrays, measured: Measured, task: str, tried: Sequence[str]
) -> CandidateRows:
    """Evaluate candidates by the ordinary request of their study, which has ranges around them."""
    names = [axis.name for axis in study.space.axes]
    evaluation = evaluate_columns(study.request, {name: parameters[name] for name in names})
    columns = [*results_columns(study), *measured.columns]
    arrays = evaluation.columns | measured.values
    for each in measured.constraints:
        columns.append(margin_column(each.metric))
        margins = margin(each, measured.values[each.metric.name].astype(np.float64))
        arrays |= {columns[-1].name: margins, "feasible": arrays["feasible"] * is_satisfied(margins)}
    stored = {c.name: np.ascontiguousarray(arrays[c.name], dtype=c.dtype) for c in columns[1:]}
    return CandidateRows(study, measured, tuple(columns), stored, task, tuple(tried))
