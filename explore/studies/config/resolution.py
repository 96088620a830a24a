"""Resolve the sections of a study to its request, designs and objectives, or report all problems."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from explore.base.errors import KeyPath, Problems, RequestError
from explore.base.suggest import format_value
from explore.base.units.shown import ShownUnits, explain_entry
from explore.evaluation.derived import unavailable_metrics
from explore.mechanisms.entry_points import DEFAULT_MECHANISM
from explore.model.mechanism import Mechanism
from explore.model.request import Objective, Request
from explore.studies.config.designs import check_sampling, read_space, space_content
from explore.studies.config.linkage import Linkage, read_linkage
from explore.studies.config.points import key_of_coordinate, read_points
from explore.studies.config.remarks import study_remarks
from explore.studies.config.schema import Evaluate, Rank, Sampling, SceneTable, StudyFile, read
from explore.studies.designs.solved_lengths import SolvedSpace
from explore.studies.designs.spaces import BLOCK_SIZE, DesignSpace
from explore.studies.request.names import find_mechanism
from explore.studies.request.requests import RequestArguments, make_objective, resolve_request
from explore.studies.request.targets import read_target
from explore.studies.request.tolerances import resolve_tolerances

#: The parameters that designs have by name, and whether any is not 0; None where they are wrong.
_Axes = Mapping[str, bool] | None
#: The mechanism of a study whose section [linkage] describes it.
_BY_TABLE = "linkage"


@dataclass(frozen=True)
class ResolvedStudy:
    """A study with all names resolved: the attributes of `explore.studies.config.study.Study` without its text.

    The remarks have their keys.
    """

    request: Request
    space: DesignSpace
    objectives: tuple[Objective, ...]
    identity: str
    units: ShownUnits
    remarks: tuple[tuple[KeyPath, str], ...]
    linkage: Linkage | None = None


@dataclass(frozen=True)
class Question:
    """What a study asks of each of its designs, whichever these are; as of `explore.studies.config.study.Study`."""

    request: Request
    objectives: tuple[Objective, ...]
    units: ShownUnits

    def of_designs(self, space: DesignSpace, remarks: Problems, linkage: Linkage | None = None) -> ResolvedStudy:
        """The study of these designs, of a linkage or of a mechanism that has a name."""
        identity = _identity(self.request, space, linkage)
        return ResolvedStudy(self.request, space, self.objectives, identity, self.units, tuple(remarks), linkage)


@dataclass(frozen=True)
class _Entries:
    """The entries of a study that ask something of its designs."""

    study: StudyFile
    evaluate: Evaluate
    rank: Rank

    @staticmethod
    def read(sections: Mapping[str, Any], problems: Problems) -> _Entries:
        study = read(StudyFile, sections, (), problems) or StudyFile()
        evaluate = read(Evaluate, study.evaluate, ("evaluate",), problems) or Evaluate()
        return _Entries(study, evaluate, read(Rank, study.rank, ("rank",), problems) or Rank())


def resolve_question(
    mechanism: Mechanism, sections: Mapping[str, Any], parameters: Iterable[str], problems: Problems
) -> Question:
    """What sections of a study ask of designs that are not known yet; valid only when there are no problems.

    `mechanism` has their points and their target, and `parameters` are the names of those that they will have.
    """
    return _question(mechanism, _Entries.read(sections, problems), dict.fromkeys(parameters, True), "", problems)


def resolve_study(
    sections: Mapping[str, Any], folder: Path, problems: Problems, table_problems: list[str]
) -> ResolvedStudy | None:
    """Resolve all names and numbers of a study; return None if there is any problem of it or of its table of designs.

    The name of the table is relative to `folder`.
    """
    entries = _Entries.read(sections, problems)
    study = entries.study
    sampling = read(Sampling, study.sampling, ("sampling",), problems)
    if study.scene is not None:
        read(SceneTable, study.scene, ("scene",), problems)
    if sampling is not None:
        check_sampling(sampling, study.sampling, problems)
    linkage = _linkage(study, folder, problems, table_problems)
    mechanism = _mechanism(study, linkage, has_key="mechanism" in sections, problems=problems)
    if mechanism is None:
        return None
    method = sampling.method if sampling else ""
    noted = {key for key, _ in problems if key[0] == "parameters" and len(key) > 1}  # with the linkage
    mechanism, parameters = read_points(mechanism, study.points, study.parameters, method, problems)
    mechanism = add_target_section(mechanism, study.target, folder, problems)
    n_before = len(problems)
    asked = _arguments(entries.evaluate, study)
    space = read_space(mechanism, parameters, sampling, folder, problems, table_problems, asked)
    found = [(key, reason) for key, reason in problems[n_before:] if key[:2] not in noted]
    problems[n_before:] = [(key_of_coordinate(mechanism, key), reason) for key, reason in found]
    has_nonzero = {axis.name: axis.has_nonzero for axis in space.axes} if space is not None else None
    prescribed = space.solved_length.metric.name if isinstance(space, SolvedSpace) else ""
    question = _question(mechanism, entries, has_nonzero, prescribed, problems)
    if problems or table_problems or space is None:
        return None
    return question.of_designs(space, study_remarks(study, question.request, question.units), linkage)


def _question(mechanism: Mechanism, entries: _Entries, axes: _Axes, prescribed: str, problems: Problems) -> Question:
    """What entries ask of designs with these axes; one metric may be prescribed to solve for a length."""
    study = entries.study
    units = _units(study, problems)
    request = _request(mechanism, entries.evaluate, study, problems)
    objectives = _objectives(request, entries.rank, axes, prescribed, problems)
    _, tolerance_problems = resolve_tolerances(mechanism, study.tolerances)
    problems += [(("tolerances", *key), reason) for key, reason in tolerance_problems]
    if axes is not None:
        problems += _unavailable(request, axes)
    return Question(request, objectives, units)


def _units(study: StudyFile, problems: Problems) -> ShownUnits:
    """The units to show values in; they determine no column, so they are no part of the identity."""
    reasons = {name: explain_entry(name, unit) for name, unit in study.units.items()}
    problems += [(("units", name), reason) for name, reason in reasons.items() if reason]
    return ShownUnits({name: str(unit) for name, unit in study.units.items() if not reasons[name]})


def _linkage(study: StudyFile, folder: Path, problems: Problems, file_problems: list[str]) -> Linkage | None:
    """The linkage that the study describes, valid only without problems; None for another mechanism."""
    if study.mechanism == _BY_TABLE:
        return read_linkage(study.linkage, study.parameters, folder, problems, file_problems)
    if study.linkage is not None and study.mechanism is not None:
        problems.append((("linkage",), f'needs mechanism = "{_BY_TABLE}", not {format_value(study.mechanism)}'))
    return None


def _mechanism(study: StudyFile, linkage: Linkage | None, *, has_key: bool, problems: Problems) -> Mechanism | None:
    if study.mechanism is None:
        if not has_key:
            name = DEFAULT_MECHANISM if study.linkage is None else _BY_TABLE
            problems.append((("mechanism",), f'is missing; begin the file with mechanism = "{name}"'))
        return None
    if study.mechanism == _BY_TABLE and linkage is None:
        return None
    try:
        return find_mechanism(linkage or study.mechanism)
    except RequestError as error:
        problems.append((("mechanism",), str(error)))
        return None


def _arguments(evaluate: Evaluate, study: StudyFile) -> RequestArguments:
    return RequestArguments(
        evaluate.metrics, evaluate.window, evaluate.drive, study.constraints, evaluate.tolerance, study.metrics
    )


def _request(mechanism: Mechanism, evaluate: Evaluate, study: StudyFile, problems: Problems) -> Request:
    """The request, valid only when there are no problems."""
    request, request_problems = resolve_request(mechanism, _arguments(evaluate, study))
    problems += [(_key(key), reason) for key, reason in request_problems]
    return request


def _key(key: KeyPath) -> KeyPath:
    """The key in a study file of an argument of a request."""
    if key[0] == "formulas":
        return ("metrics", *key[1:])
    return key if key[0] == "constraints" else ("evaluate", *key)


def _unavailable(request: Request, axes: Mapping[str, bool]) -> Problems:
    """Problems of metrics that need a parameter which is 0 or missing in every design."""
    defaults = {parameter.name: parameter.default for parameter in request.mechanism.parameters}
    columns = [metric.name for metric in request.metrics]
    keys: dict[str, KeyPath] = {name: ("evaluate", "metrics", columns.index(name)) for name in columns}
    keys |= {formula.name: ("metrics", formula.name) for formula in request.formulas}
    return [
        (keys.get(name, ("constraints", name)), reason)
        for name, reason in unavailable_metrics(request, lambda name: axes.get(name, bool(defaults[name])))
    ]


def _objectives(
    request: Request, rank: Rank, axes: _Axes, prescribed: str, problems: Problems
) -> tuple[Objective, ...]:
    """The objectives of [rank], or those of the mechanism whose metrics the study computes."""
    if rank.metrics is None:
        # The prescribed metric is the same in all designs: only rounding errors would rank them.
        columns = {metric.name for metric in request.metrics} - {prescribed}
        defaults = [name for name in request.mechanism.objectives if name.partition(":")[0] in columns]
        return tuple(make_objective(request, text) for text in defaults)
    if not rank.metrics:
        problems.append((("rank", "metrics"), "the list is empty; leave it out to use the default objectives"))
    metrics_are_valid = not any(key[:2] == ("evaluate", "metrics") for key, _ in problems)
    objectives: list[Objective] = []
    for position, text in enumerate(rank.metrics):
        key = ("rank", "metrics", position)
        if not isinstance(text, str):
            problems.append((key, f"must be a string in quotes, got {format_value(text)}"))
            continue
        try:
            objective = make_objective(request, text)
        except RequestError as error:
            problems.append((key, str(error)))
            continue
        name = objective.metric
        if metrics_are_valid and (reason := _reason_not_in_results(name, request, axes)):
            problems.append((key, reason))
        if name == prescribed:
            problems.append((key, f"{name} is prescribed, so it is the same in all designs; leave it out"))
        if name in {other.metric for other in objectives}:
            problems.append((key, f"{name} is listed twice; remove one"))
        objectives.append(objective)
    return tuple(objectives)


def _reason_not_in_results(name: str, request: Request, axes: _Axes) -> str:
    """Why the results have no column of that name that varies; empty when they have one."""
    if name in {parameter.name for parameter in request.mechanism.parameters}:
        return (
            ""
            if axes is None or name in axes
            else f"{name} is not among the parameters, so it is the same in all designs; leave it out"
        )
    columns = {metric.name for metric in (*request.metrics, *request.mechanism.given)}
    return "" if name in columns else f'{name} is not computed; add "{name}" to the metrics'


def _identity(request: Request, space: DesignSpace, linkage: Linkage | None) -> str:
    """Everything that determines the columns, as JSON; equal for equal studies, however they are written."""
    window = request.window
    ends = {"from": float(window.start), "to": float(window.stop)}
    content = {
        "mechanism": request.mechanism.name,
        "kernel_version": request.mechanism.kernel_version,
        **space_content(space),
        "evaluate": {
            "window": ends if window.name == "interval" else window.name,
            "drive": request.drive or "none",
            "metrics": [metric.name for metric in request.metrics],
            "tolerance": request.tolerance,
        },
        "constraints": {c.metric.name: {"min": c.minimum, "max": c.maximum} for c in request.constraints},
        "block_size": BLOCK_SIZE,
    }
    if linkage:
        content["linkage"] = linkage.content
    if request.mechanism.points:
        content["points"] = list(request.mechanism.points)
    if request.mechanism.target:
        content["target"] = request.mechanism.target.to_content()
    if request.formulas:
        content["formulas"] = {f.name: {"formula": f.long_name, "unit": f.unit} for f in request.formulas}
    return json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)


def add_target_section(
    mechanism: Mechanism, section: Mapping[str, Any] | None, folder: Path, problems: Problems
) -> Mechanism:
    """The mechanism with the target of a study, a file of points in `folder`; each problem is appended with its key."""
    if section is None:
        return mechanism
    own: Problems = []
    target = read_target(mechanism, section, own, folder)
    problems += [(("target", *key), reason) for key, reason in own]
    return mechanism.with_target(target)
