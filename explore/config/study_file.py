"""A study file becomes a `Study`, or one `ConfigError` with everything that is wrong in it."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any

from explore.config import locate, toml_text
from explore.config.designs import check_sampling, read_space, space_words
from explore.config.schema import Evaluate, Problems, Rank, Sampling, SceneTable, StudyFile, read
from explore.derived_metrics import missing
from explore.design_space import BLOCK_SIZE, DesignSpace
from explore.errors import ConfigError, RequestError
from explore.request.requests import Wanted, find_mechanism, make_objective, resolve
from explore.solving import SolvedSpace
from explore.study import Study
from explore.suggest import shown
from explore.vocabulary import Mechanism, Objective, Request, Window


def load_study(path: str | os.PathLike[str]) -> Study:
    """Read a study file.

    Parameters
    ----------
    path
        A TOML file, UTF-8.

    Returns
    -------
    Study
        All names resolved, all numbers in the units that the mechanism declares.

    Raises
    ------
    ConfigError
        With one line ``file:line: key: reason; suggestion`` for each problem in the file, and in its table of designs.
    """
    file = os.fspath(path)
    text = toml_text.read_text(file)
    raw, lines = toml_text.parse(file, text)
    problems: Problems = []
    problems_of_table: list[str] = []
    study = _study(raw, text, Path(file).parent, problems, problems_of_table)
    if study is None:
        placed = sorted((locate.line_of(lines, key), toml_text.dotted(key), reason) for key, reason in problems)
        own = [f"{file}:{line}: {key}: {reason}" for line, key, reason in dict.fromkeys(placed)]
        raise ConfigError(own + problems_of_table)
    return study


def starter(mechanism: Mechanism) -> str:
    """Text of a commented study file of this mechanism that runs as it is."""
    return files("explore").joinpath(f"data/starter-{mechanism.name}.toml").read_text(encoding="utf-8")


def _study(
    raw: Mapping[str, Any], text: str, folder: Path, problems: Problems, problems_of_table: list[str]
) -> Study | None:
    """The study, or None when there are problems in its file, or in the file of its table."""
    file = read(StudyFile, raw, (), problems) or StudyFile()
    sampling = read(Sampling, file.sampling, ("sampling",), problems)
    evaluate = read(Evaluate, file.evaluate, ("evaluate",), problems) or Evaluate()
    rank = read(Rank, file.rank, ("rank",), problems) or Rank()
    if file.scene is not None:
        read(SceneTable, file.scene, ("scene",), problems)
    if sampling is not None:
        check_sampling(sampling, file.sampling, problems)
    mechanism = _mechanism(file, "mechanism" in raw, problems)
    if mechanism is None:
        return None
    space = read_space(mechanism, file.parameters, sampling, folder, problems, problems_of_table)
    request = _request(mechanism, evaluate, file.constraints, problems)
    objectives = _objectives(request, rank, _solved_metric(space), problems)
    if space is not None:
        problems += _missing(request, space)
    if problems or problems_of_table or space is None:
        return None
    return Study(request, space, objectives, text, _determines(request, space))


def _mechanism(file: StudyFile, named: bool, problems: Problems) -> Mechanism | None:
    if file.mechanism is None:
        if not named:
            problems.append((("mechanism",), 'is missing; begin the file with mechanism = "crank-rocker"'))
        return None
    try:
        return find_mechanism(file.mechanism)
    except RequestError as error:
        problems.append((("mechanism",), str(error)))
        return None


def _request(mechanism: Mechanism, evaluate: Evaluate, bounds: Mapping[str, Any], problems: Problems) -> Request:
    """The request; only to be used when there are no problems."""
    wanted = Wanted(evaluate.metrics, evaluate.window, evaluate.drive, bounds, evaluate.tolerance)
    request, found = resolve(mechanism, wanted)
    problems += [(key if key[0] == "constraints" else ("evaluate", *key), reason) for key, reason in found]
    return request


def _missing(request: Request, space: DesignSpace) -> Problems:
    """Metrics that need a parameter which no design of the space gives."""
    defaults = {parameter.name: parameter.default for parameter in request.mechanism.parameters}
    given = {axis.name: axis.gives for axis in space.axes}
    columns = [metric.name for metric in request.metrics]
    return [
        (("evaluate", "metrics", columns.index(name)) if name in columns else ("constraints", name), reason)
        for name, reason in missing(request, lambda name: given.get(name, bool(defaults[name])))
    ]


def _solved_metric(space: DesignSpace | None) -> str:
    """Name of the metric that a length is solved for; empty when none is."""
    return space.solved.metric.name if isinstance(space, SolvedSpace) else ""


def _objectives(request: Request, rank: Rank, solved: str, problems: Problems) -> tuple[Objective, ...]:
    """The objectives of [rank], else those of the mechanism whose metrics the study computes."""
    columns = {metric.name for metric in request.metrics}
    if rank.metrics is None:
        # In the metric that is solved for all designs are equal, and only its last bits would choose.
        usual = [name for name in request.mechanism.objectives if name.partition(":")[0] in columns - {solved}]
        return tuple(make_objective(request, text) for text in usual)
    if not rank.metrics:
        problems.append(
            (("rank", "metrics"), "an empty list ranks nothing; leave the key out for the usual objectives")
        )
    sure = not any(key[:2] == ("evaluate", "metrics") for key, _ in problems)
    objectives: list[Objective] = []
    for position, text in enumerate(rank.metrics):
        if not isinstance(text, str):
            problems.append((("rank", "metrics", position), f"must be a text in quotes, got {shown(text)}"))
            continue
        try:
            objective = make_objective(request, text)
        except RequestError as error:
            problems.append((("rank", "metrics", position), str(error)))
            continue
        name = objective.metric
        if sure and name not in columns:
            problems.append(
                (("rank", "metrics", position), f'{name} is not computed; add "{name}" to evaluate.metrics')
            )
        if name == solved:
            reason = f"{name} is what is solved for, so all designs have the same; leave it out"
            problems.append((("rank", "metrics", position), reason))
        if name in {other.metric for other in objectives}:
            problems.append((("rank", "metrics", position), f"{name} is listed twice; remove one"))
        objectives.append(objective)
    return tuple(objectives)


def _determines(request: Request, space: DesignSpace) -> str:
    """Everything that the columns depend on, as JSON that is the same for the same study however it is written."""
    content = {
        "mechanism": request.mechanism.name,
        "kernel_version": request.mechanism.kernel_version,
        **space_words(space),
        "evaluate": {
            "window": _window_words(request.window),
            "drive": request.drive,
            "metrics": [metric.name for metric in request.metrics],
            "tolerance": request.tolerance,
        },
        "constraints": {c.metric.name: {"min": c.minimum, "max": c.maximum} for c in request.constraints},
        "block_size": BLOCK_SIZE,
    }
    return json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)


def _window_words(window: Window) -> object:
    return {"start": window.start, "stop": window.stop} if window.name == "interval" else window.name
