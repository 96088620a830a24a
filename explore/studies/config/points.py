"""Read the section [points]: the names of points of a floating link, and their coordinates as parameters."""

from collections.abc import Mapping
from typing import Any

from explore.base.entries import note_unknown
from explore.base.errors import KeyPath, Problems
from explore.base.suggest import format_value
from explore.model.mechanism import Mechanism
from explore.model.points import COORDINATES
from explore.studies.request.points import reason_against_point, reason_against_points

_EXAMPLE = "{ along = 120, across = 40 }"


def read_points(
    mechanism: Mechanism, points: Mapping[str, Any], parameters: Mapping[str, Any], method: str, problems: Problems
) -> tuple[Mechanism, dict[str, Any]]:
    """The mechanism with the points of a study, and the entries of all its parameters.

    `points` and `parameters` are the sections of these names. A table may have the coordinates as columns, so their
    keys may be left out with that method.
    """
    reason = reason_against_points(mechanism, len(points))
    if reason:
        problems.append((("points",), reason))
        return mechanism, dict(parameters)
    names: list[str] = []
    entries: dict[str, Any] = {}
    for name, entry in points.items():
        reason = reason_against_point(mechanism, name, names)
        if reason:
            problems.append((("points", name), reason))
            continue
        names.append(name)
        coordinates = _coordinates(name, entry, method, problems)
        for coordinate, value in coordinates.items():
            parameter = f"{name}_{coordinate}"
            if parameter in parameters:
                advice = f"write it in [points] as {coordinate} of {name}"
                problems.append((("parameters", parameter), f"is a coordinate of a point; {advice}"))
            entries[parameter] = value
    return mechanism.with_points(tuple(names)), {**parameters, **entries}


def _coordinates(name: str, entry: object, method: str, problems: Problems) -> dict[str, Any]:
    """The entries of a point's coordinates; 0 stands for one with a mistake, so that it has no second problem."""
    key: KeyPath = ("points", name)
    anywhere = dict.fromkeys(COORDINATES, 0.0)
    if not isinstance(entry, Mapping):
        problems.append((key, f"must be a table such as {_EXAMPLE}, got {format_value(entry)}"))
        return anywhere
    unknown = note_unknown(entry, COORDINATES, problems, key)
    given = {word: entry[word] for word in COORDINATES if word in entry}
    if unknown or method == "table":
        return anywhere | given if unknown else given
    for word in COORDINATES:
        if word not in entry:
            problems.append((key, f"the key '{word}' is missing; a complete table is {_EXAMPLE}"))
    return anywhere | given


def key_of_coordinate(mechanism: Mechanism, key: KeyPath) -> KeyPath:
    """The key of a parameter in a study file: that of a coordinate is in [points]."""
    if key[0] == "parameters" and len(key) > 1:
        for point in mechanism.points:
            for coordinate in COORDINATES:
                if key[1] == f"{point}_{coordinate}":
                    return ("points", point, coordinate, *key[2:])
    return key
