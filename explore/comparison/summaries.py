"""What a comparison says in a few lines: who is fastest at an accuracy, and whether the closed form is on the front."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

Row = dict[str, Any]
#: Accuracies at which the fastest is named.
GOALS = (1e-3, 1e-6, 1e-9, 1e-12)
DEFAULT = "closed-form"
#: Errors this small are rounding: which of two methods has the smaller one is luck.
ROUNDING = 1e-13


@dataclass(frozen=True)
class Standing:
    """Where the default method stands on a scene.

    Attributes
    ----------
    error, seconds
        Its own.
    ahead
        CPU time of the cheapest other method that is at least as right, over its own; infinite when there is none.
    rivals
        Settings that are cheaper, or as cheap, and at least as right: none when it is on the front.
    """

    error: float
    seconds: float
    ahead: float
    rivals: tuple[str, ...]


def error_of(row: Row) -> float:
    """The error that ranks a row: of the velocities, or the angles where no more was asked; NaN if it failed."""
    name = "velocity_error_max" if "velocity_error_max" in row else "angle_error_max"
    return math.nan if row["failed"] else float(row[name])


def fastest(rows: Sequence[Row], goal: float) -> list[Row]:
    """The settings of a scene with errors up to the goal, fastest first, each method once."""
    good = sorted((row for row in rows if error_of(row) <= goal), key=lambda row: row["cpu_seconds"])
    names: dict[str, Row] = {}
    for row in good:
        names.setdefault(row["method"], row)
    return list(names.values())


def standing(rows: Sequence[Row]) -> Standing | None:
    """How the default method compares with the others on a scene; None where no motion exists to be right about."""
    own = next(row for row in rows if row["method"] == DEFAULT)
    error, seconds = error_of(own), own["cpu_seconds"]
    if math.isnan(error):
        return None
    as_right = [row for row in rows if row is not own and error_of(row) <= max(error, ROUNDING)]
    rivals = tuple(row["setting"] for row in as_right if row["cpu_seconds"] <= seconds)
    ahead = min((row["cpu_seconds"] / seconds for row in as_right), default=math.inf)
    return Standing(error, seconds, ahead, rivals)
