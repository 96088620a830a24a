"""A study file becomes a `Study`, or one `ConfigError` with everything that is wrong in it."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from importlib.resources import files
from typing import Any

from explore.config import locate, toml_text
from explore.config.axes import read_axes
from explore.config.schema import Evaluate, Problems, Rank, Sampling, StudyFile, read
from explore.design_space import BLOCK_SIZE, Axis, Continuous, DesignSpace, Listed
from explore.errors import ConfigError, RequestError
from explore.request.requests import Wanted, find_mechanism, make_objective, resolve
from explore.study import Study
from explore.suggest import shown, suggestion
from explore.vocabulary import Mechanism, Objective, Request, Window

METHODS = ("grid", "sobol")
#: Methods of the file format that this version does not have.
LATER_METHODS = ("latin-hypercube", "random", "table")
#: SciPy's Sobol' sequence has 30 bits.
MOST_SOBOL = 2**30
_MOST_DESIGNS = 2**63 - 1


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
        With one line ``file:line: key: reason; suggestion`` for each problem in the file.
    """
    file = os.fspath(path)
    text = toml_text.read_text(file)
    raw, lines = toml_text.parse(file, text)
    problems: Problems = []
    study = _study(raw, text, problems)
    if study is None:
        placed = sorted((locate.line_of(lines, key), toml_text.dotted(key), reason) for key, reason in problems)
        raise ConfigError([f"{file}:{line}: {key}: {reason}" for line, key, reason in dict.fromkeys(placed)])
    return study


def starter(mechanism: Mechanism) -> str:
    """Text of a commented study file of this mechanism that runs as it is."""
    return files("explore").joinpath(f"data/starter-{mechanism.name}.toml").read_text(encoding="utf-8")


def _study(raw: Mapping[str, Any], text: str, problems: Problems) -> Study | None:
    """The study, or None when there are problems."""
    file = read(StudyFile, raw, (), problems) or StudyFile()
    sampling = read(Sampling, file.sampling, ("sampling",), problems)
    evaluate = read(Evaluate, file.evaluate, ("evaluate",), problems) or Evaluate()
    rank = read(Rank, file.rank, ("rank",), problems) or Rank()
    if sampling is not None:
        _check_sampling(sampling, "count" in file.sampling, problems)
    mechanism = _mechanism(file, "mechanism" in raw, problems)
    if mechanism is None:
        return None
    drawn = sampling is None or sampling.method != "grid"
    axes = read_axes(mechanism, file.parameters, drawn, problems)
    request = _request(mechanism, evaluate, file.constraints, problems)
    objectives = _objectives(request, rank, problems)
    if not problems:
        _check_size(axes, drawn, problems)
    if problems or sampling is None:
        return None
    space = _space(axes, sampling)
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


def _check_sampling(sampling: Sampling, counted: bool, problems: Problems) -> None:
    """Whether the method exists and the other keys go with it; `counted` says that a count, if wrong, is written."""
    method, count = sampling.method, sampling.count

    def note(key: str, reason: str) -> None:
        problems.append((("sampling", key), reason))

    if method in LATER_METHODS:
        note("method", f"'{method}' is not available yet; use {' or '.join(METHODS)}")
        return
    if method not in METHODS:
        note("method", f"unknown method {shown(method)}; {suggestion(method, METHODS)}")
        return
    if sampling.file is not None:
        note("file", 'belongs to method = "table", which is not available yet; remove it')
    if method == "grid":
        for key, value in (("count", count), ("seed", sampling.seed)):
            if value is not None:
                note(key, 'a grid takes every combination and draws nothing; remove it or set method = "sobol"')
    elif count is None:
        if not counted:
            note("count", "is missing; say how many designs to draw, such as count = 100000")
    elif count < 1:
        note("count", f"must be at least 1, got {shown(count)}")
    elif count > MOST_SOBOL:
        note("count", f"the Sobol' sequence has 30 bits, which makes at most {MOST_SOBOL} designs; got {shown(count)}")


def _request(mechanism: Mechanism, evaluate: Evaluate, bounds: Mapping[str, Any], problems: Problems) -> Request:
    """The request; only to be used when there are no problems."""
    wanted = Wanted(evaluate.metrics, evaluate.window, evaluate.drive, bounds, evaluate.tolerance)
    request, found = resolve(mechanism, wanted)
    problems += [(key if key[0] == "constraints" else ("evaluate", *key), reason) for key, reason in found]
    return request


def _objectives(request: Request, rank: Rank, problems: Problems) -> tuple[Objective, ...]:
    """The objectives of [rank], else those of the mechanism whose metrics the study computes."""
    columns = {metric.name for metric in request.metrics}
    if rank.metrics is None:
        usual = [text for text in request.mechanism.objectives if text.partition(":")[0] in columns]
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
        if name in {other.metric for other in objectives}:
            problems.append((("rank", "metrics", position), f"{name} is listed twice; remove one"))
        objectives.append(objective)
    return tuple(objectives)


def _check_size(axes: tuple[Axis, ...], drawn: bool, problems: Problems) -> None:
    """Whether the axes make designs that can be drawn or numbered."""
    varied = any(isinstance(axis, Continuous) or len(axis) > 1 for axis in axes)
    if drawn and not varied:
        problems.append((("parameters",), "nothing to draw: every parameter is fixed; give one a list or { min, max }"))
    if not drawn and math.prod(len(axis) for axis in axes if not isinstance(axis, Continuous)) > _MOST_DESIGNS:
        problems.append((("parameters",), "the grid has more than 2^63 designs, too many to number; make it coarser"))


def _space(axes: tuple[Axis, ...], sampling: Sampling) -> DesignSpace:
    if sampling.method == "grid":
        return DesignSpace.grid(tuple(axis for axis in axes if not isinstance(axis, Continuous)))
    return DesignSpace(axes, "sobol", sampling.count or 0, sampling.seed or 0)


def _determines(request: Request, space: DesignSpace) -> str:
    """Everything that the columns depend on, as JSON that is the same for the same study however it is written."""
    sampling: dict[str, object] = {"method": space.method}
    if space.method != "grid":
        sampling |= {"count": space.count, "seed": space.seed}
    content = {
        "mechanism": request.mechanism.name,
        "kernel_version": request.mechanism.kernel_version,
        "parameters": {axis.name: _axis_words(axis) for axis in space.axes},
        "sampling": sampling,
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


def _axis_words(axis: Axis) -> dict[str, object]:
    if isinstance(axis, Listed):
        return {"values": axis.values}
    if isinstance(axis, Continuous):
        return {"min": axis.low, "max": axis.high, "log": axis.log}
    return {"start": axis.start, "stop": axis.stop, "num": axis.num}


def _window_words(window: Window) -> object:
    return {"start": window.start, "stop": window.stop} if window.name == "interval" else window.name
