"""What is asked of the candidates of a task, and the study that they become."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from explore.base.errors import Problems
from explore.model.mechanism import Mechanism
from explore.model.points import COORDINATES
from explore.model.quantities import FloatArray, Parameter
from explore.studies.config.resolution import Question, resolve_question
from explore.studies.config.study import Study, make_study
from explore.studies.config.toml_text import format_toml
from explore.studies.designs.spaces import ContinuousAxis, ListedAxis, Sample
from explore.studies.request.names import find_mechanism
from explore.synthesis.candidates import BOOKKEEPING, Candidates
from explore.synthesis.tasks.contract import Task

_Sections = Mapping[str, Mapping[str, Any]]
#: Share of a length, or of what a signed value spans, by which a range exceeds the candidates.
_BEYOND = 0.1
#: Angle by which a range exceeds the candidates, deg.
_DEGREES = 10.0


@dataclass(frozen=True)
class TaskQuestion:
    """Metrics, bounds and objectives of the candidates of a task, among them those that only its solver measures.

    The sections of a study that ask for them, those of the task's file over those of the task, and the same with all
    names resolved.
    """

    task: Task
    sections: _Sections
    question: Question

    @staticmethod
    def read(task: Task, given: _Sections, problems: Problems) -> TaskQuestion:
        """Resolve these sections of a task's file; it is valid only when there are no problems."""
        mechanism = find_mechanism(task.mechanism, task.points, task.target).with_given(task.measured)
        taken = {*task.formulas, *BOOKKEEPING} & {*given.get("metrics", {})}
        reason = "this is the name of a column of the task; choose another"
        problems += [(("metrics", name), reason) for name in sorted(taken)]
        sections, own = _sections(task, mechanism, given), Problems()
        question = resolve_question(mechanism, sections, task.parameters, own)
        named, told = given.get("evaluate", {}).get("metrics"), {reason for key, reason in own if key[0] == "rank"}
        n_named = len(named) if isinstance(named, list) else 0
        for key, reason in own:
            # metrics behind those that the file names are objectives
            is_objective = key[:2] == ("evaluate", "metrics") and bool(key[2:]) and int(key[2]) >= n_named
            if not is_objective:
                problems.append((key, reason))
            elif reason not in told:
                problems.append((("rank", "metrics"), reason))
        return TaskQuestion(task, sections, question)

    def study(self, candidates: Candidates) -> Study:
        """The study of candidates: ranges around them, and what is asked of them.

        Its text is for the commands that make other designs of it: it asks only for what can be computed.
        """
        task = self.task
        axes = axes_around(self.question.request.mechanism, task.fixed, candidates)
        space = Sample(tuple(axes.values()), candidates.count, "sobol")
        entries = {name: axis_entry(axes[name], is_fixed=name in task.fixed) for name in candidates.parameters}
        points = {point: {word: entries.pop(f"{point}_{word}") for word in COORDINATES} for point in task.points}
        sections = {
            "mechanism": task.mechanism,
            "parameters": entries,
            "points": points,
            "target": task.target,
            "sampling": {"method": space.method, "count": space.n_designs, "seed": space.seed},
            **self._computed,
        }
        text = format_toml({name: content for name, content in sections.items() if content})
        return make_study(self.question.of_designs(space, []), text)

    @property
    def _computed(self) -> _Sections:
        """The sections without what only the solver measures."""
        measured = {metric.name for metric in self.task.measured}
        evaluate, constraints, rank = (self.sections[name] for name in ("evaluate", "constraints", "rank"))
        return {
            **self.sections,
            "evaluate": {**evaluate, "metrics": [name for name in evaluate["metrics"] if name not in measured]},
            "constraints": {name: sides for name, sides in constraints.items() if name not in measured},
            "rank": {**rank, "metrics": _computed_objectives(self.task, rank["metrics"])},
        }


def _sections(task: Task, mechanism: Mechanism, given: _Sections) -> _Sections:
    """The sections that ask something: those of a file over those of the task, and all objectives among the metrics."""
    evaluate = {**({"window": task.window} if task.window else {}), **given.get("evaluate", {})}
    rank = {"metrics": list(task.objectives), **given.get("rank", {})}
    formulas = {**task.formulas, **given.get("metrics", {})}
    named = evaluate.get("metrics", [])
    if isinstance(named, list):
        objectives = _computed_objectives(task, rank["metrics"])
        others = {*_names(named), *formulas, *(parameter.name for parameter in mechanism.parameters)}
        needed = dict.fromkeys([*_names(objectives), *task.metrics])
        evaluate["metrics"] = named + [name for name in needed if name not in others]
    return {
        "evaluate": evaluate,
        "metrics": formulas,
        "constraints": {**task.constraints, **given.get("constraints", {})},
        "rank": rank,
        **{name: given[name] for name in ("units", "tolerances") if name in given},
    }


def _computed_objectives(task: Task, entries: object) -> list[Any]:
    """Those of a list of objectives that can be computed, or where none can, those of the task."""
    measured = {metric.name for metric in task.measured}
    given = [text for text in entries if _name(text) not in measured] if isinstance(entries, list) else []
    return given or [text for text in task.objectives if _name(text) not in measured]


def _names(entries: list[Any]) -> list[str]:
    """The names in a list of objectives."""
    return [_name(entry) for entry in entries if isinstance(entry, str)]


def _name(entry: object) -> str:
    """The name of the metric in an objective such as ``"cv:min"``."""
    return str(entry).partition(":")[0].strip()


def axes_around(
    mechanism: Mechanism, fixed: Collection[str], candidates: Candidates
) -> dict[str, ListedAxis | ContinuousAxis]:
    """Axes of the parameters of candidates by name: ranges; lists of choices; one number where they are fixed."""
    columns = candidates.parameters
    size = max(float(np.abs(values).max()) for values in columns.values())
    axes: dict[str, ListedAxis | ContinuousAxis] = {}
    for parameter in mechanism.axis_order:
        name = parameter.name
        if name in fixed:
            axes[name] = ListedAxis(name, (float(columns[name][0]),))
        elif name in columns:
            axes[name] = _axis(parameter, columns[name], size)
    return axes


def axis_entry(axis: ListedAxis | ContinuousAxis, *, is_fixed: bool) -> Any:
    """The entry of an axis in a study file."""
    if isinstance(axis, ContinuousAxis):
        return {"min": axis.low, "max": axis.high}
    return axis.values[0] if is_fixed else list(axis.values)


def _axis(parameter: Parameter, values: FloatArray, size: float) -> ListedAxis | ContinuousAxis:
    low, high = float(values.min()), float(values.max())
    if parameter.choices:
        return ListedAxis(parameter.name, tuple(sorted(set(values.tolist()))))
    if parameter.unit == "deg":
        return ContinuousAxis(parameter.name, low - _DEGREES, high + _DEGREES)
    if parameter.lower >= 0.0:
        return ContinuousAxis(parameter.name, low / (1.0 + _BEYOND), high * (1.0 + _BEYOND))
    beyond = _BEYOND * max(high - low, 0.1 * size)
    return ContinuousAxis(parameter.name, low - beyond, high + beyond)
