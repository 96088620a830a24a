"""The sections and keys of a study file, and messages about invalid ones."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field, StrictBool, StrictInt, StrictStr, ValidationError

from explore.base.errors import KeyPath, Problems
from explore.base.suggest import closest_name, format_value, suggestion

#: Largest number of problems reported for one file: more are usually one mistake made many times.
MOST_PROBLEMS = 20
#: Entry that is checked later, with the mechanism.
Unchecked = Any
#: Largest number of entries of a section: more parameters, metrics or constraints than any mechanism has.
_MOST = 1000

Entries = Annotated[dict[str, Any], Field(max_length=_MOST)]
Names = Annotated[list[Unchecked] | None, Field(max_length=_MOST)]


class Section(BaseModel):
    """A section of the file; unknown keys are errors."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class StudyFile(Section):
    """The whole file."""

    mechanism: StrictStr | None = None
    linkage: Unchecked = None
    parameters: Entries = {}
    points: Entries = {}
    target: dict[str, Any] | None = None
    sampling: dict[str, Any] = {}
    evaluate: dict[str, Any] = {}
    metrics: Entries = {}
    constraints: Entries = {}
    rank: dict[str, Any] = {}
    units: Entries = {}
    tolerances: Entries = {}
    scene: dict[str, Any] | None = None


class Sampling(Section):
    """How designs are made from the parameters."""

    method: StrictStr = "grid"
    count: StrictInt | None = None
    seed: Annotated[StrictInt, Field(ge=0, le=2**63 - 1)] | None = None
    file: StrictStr | None = None


class Evaluate(Section):
    """What is computed for each design."""

    window: Unchecked = None
    drive: StrictStr | None = None
    metrics: Names = None
    tolerance: Unchecked = 1e-9


class Rank(Section):
    """The objectives."""

    metrics: Names = None


class SceneTable(Section):
    """Texts and model of a comparison of methods on this study; no effect on what the study computes."""

    title: StrictStr
    about: StrictStr
    model: Literal["geometry", "positions", "velocities", "accelerations"]
    question: StrictStr


class SpacedTable(Section):
    """Evenly spaced values of a parameter."""

    start: Unchecked
    stop: Unchecked
    num: StrictInt


class RangeTable(Section):
    """A range of a parameter to draw values from."""

    min: Unchecked
    max: Unchecked
    log: StrictBool = False


class SolveTable(Section):
    """A length to solve for, so that a metric has a prescribed value."""

    solve: StrictStr
    value: Unchecked
    min: Unchecked = None
    max: Unchecked = None


Model = TypeVar("Model", bound=Section)

_REASONS = {
    "dict_type": "must be a table of keys and values",
    "list_type": 'must be a list, such as ["cv"]',
    "int_type": "must be a whole number without quotes",
    "string_type": "must be a string in quotes",
    "bool_type": "must be true or false",
    "too_long": f"must have at most {_MOST:,} entries",
}


def read(model: type[Model], entries: Mapping[str, Any], path: KeyPath, problems: Problems) -> Model | None:
    """Validate the section of this key; return it without its invalid keys, or None when required keys are missing."""
    try:
        return model.model_validate(entries)
    except ValidationError as error:
        errors = error.errors(include_url=False)
    keys = list(model.model_fields)
    unknown = [str(entry["loc"][0]) for entry in errors if entry["type"] == "extra_forbidden"]
    # A misspelt required key is not reported as missing too. Problems beyond the limit need no suggestion.
    corrections = {key: closest_name(key, keys) for key in unknown[:MOST_PROBLEMS]}
    for entry in errors:
        kind, key = entry["type"], entry["loc"]
        if kind == "missing":
            if key[0] not in corrections.values():
                problems.append((path, f"the key '{key[0]}' is missing; a complete table has {', '.join(keys)}"))
        elif kind == "extra_forbidden":
            hint = f"; {suggestion(str(key[0]), keys)}" if key[0] in corrections else ""
            problems.append(((*path, *key), f"unknown key{hint}"))
        else:
            reason = _REASONS.get(kind, entry["msg"].replace("Input should be", "must be"))
            problems.append(((*path, *key), f"{reason}, got {format_value(entry['input'])}"))
    invalid = {entry["loc"][0] for entry in errors}
    try:
        return model.model_validate({key: value for key, value in entries.items() if key not in invalid})
    except ValidationError:
        return None
