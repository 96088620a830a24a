"""The shape of a study file: its sections and keys, and what is wrong with one, in words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field, StrictBool, StrictInt, StrictStr, ValidationError

from explore.suggest import closest, shown, suggestion

Path = tuple[str | int, ...]
Problems = list[tuple[Path, str]]
#: An entry that is looked at later, when the mechanism is known.
Later = Any


class Section(BaseModel):
    """A table of the file: keys that it does not know are errors."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class StudyFile(Section):
    """The whole file."""

    mechanism: StrictStr | None = None
    parameters: dict[str, Any] = {}
    sampling: dict[str, Any] = {}
    evaluate: dict[str, Any] = {}
    constraints: dict[str, Any] = {}
    rank: dict[str, Any] = {}
    scene: dict[str, Any] | None = None


class Sampling(Section):
    """How designs are drawn from the parameters."""

    method: StrictStr = "grid"
    count: StrictInt | None = None
    seed: Annotated[StrictInt, Field(ge=0, le=2**63 - 1)] | None = None
    file: StrictStr | None = None


class Evaluate(Section):
    """What is computed of each design."""

    window: Later = None
    drive: StrictStr | None = None
    metrics: list[Later] | None = None
    tolerance: Later = 1e-9


class Rank(Section):
    """What makes a design better than another."""

    metrics: list[Later] | None = None


class SceneTable(Section):
    """Why a study is worth comparing methods on; it changes nothing that the study computes."""

    title: StrictStr
    about: StrictStr
    model: Literal["geometry", "positions", "velocities", "accelerations"]
    question: StrictStr


class SpacedTable(Section):
    """Evenly spaced values of a parameter."""

    start: Later
    stop: Later
    num: StrictInt


class RangeTable(Section):
    """A range of a parameter to draw values from."""

    min: Later
    max: Later
    log: StrictBool = False


class SolveTable(Section):
    """A length to solve for, such that a metric has a value."""

    solve: StrictStr
    value: Later
    min: Later = None
    max: Later = None


Model = TypeVar("Model", bound=Section)

_WANTED = {
    "dict_type": "must be a table of keys and values",
    "list_type": 'must be a list, such as ["cv"]',
    "int_type": "must be a whole number without quotes",
    "string_type": "must be a text in quotes",
    "bool_type": "must be true or false",
}


def read(model: type[Model], raw: Mapping[str, Any], path: Path, problems: Problems) -> Model | None:
    """The section, without its wrong keys, and a problem for each of these; None when required keys are missing.

    Parameters
    ----------
    model
        The section's shape.
    raw
        Its content in the file.
    path
        Its place in the file.
    problems
        Gets what is wrong, with the path of its key.
    """
    try:
        return model.model_validate(raw)
    except ValidationError as error:
        errors = error.errors(include_url=False)
    known = list(model.model_fields)
    # A required key that is merely misspelt is not missing as well.
    meant = {closest(str(e["loc"][0]), known) for e in errors if e["type"] == "extra_forbidden"}
    for entry in errors:
        kind, key = entry["type"], entry["loc"]
        if kind == "missing":
            if key[0] not in meant:
                problems.append((path, f"the key '{key[0]}' is missing; a complete table has {', '.join(known)}"))
        elif kind == "extra_forbidden":
            problems.append(((*path, *key), f"unknown key; {suggestion(str(key[0]), known)}"))
        else:
            reason = _WANTED.get(kind, entry["msg"].replace("Input should be", "must be"))
            problems.append(((*path, *key), f"{reason}, got {shown(entry['input'])}"))
    wrong = {entry["loc"][0] for entry in errors}
    try:
        return model.model_validate({key: value for key, value in raw.items() if key not in wrong})
    except ValidationError:
        return None
