"""Summaries of a comparison: the fastest methods at an accuracy, and the closed form against all others."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

Row = dict[str, Any]
#: Accuracies at which the fastest method is listed.
ACCURACIES = (1e-3, 1e-6, 1e-9, 1e-12)
#: Name of the method that the others are compared with.
CLOSED_FORM = "closed-form"
#: Largest error that is rounding; errors up to it are equal in a comparison.
ROUNDING_ERROR = 1e-13


@dataclass(frozen=True)
class Standing:
    """Error and time of the closed form on a scene, against all other settings.

    `next_cost_ratio` is the time of the cheapest other setting that is at least as accurate over that of the closed
    form, infinite if there is none; `cheaper_settings` are at least as accurate and cost no more.
    """

    error: float
    seconds: float
    next_cost_ratio: float
    cheaper_settings: tuple[str, ...]


def ranking_error(row: Row) -> float:
    """Largest error of the velocities, or of the angles where the scene needs no more; NaN if the method failed."""
    name = "velocity_error_max" if "velocity_error_max" in row else "position_error_max"
    return math.nan if row["failed"] else float(row[name])


def fastest_settings(rows: Sequence[Row], goal: float) -> list[Row]:
    """The fastest setting of each method with an error up to the goal, fastest first, from the rows of a scene."""
    accurate = sorted((row for row in rows if ranking_error(row) <= goal), key=lambda row: row["cpu_seconds"])
    by_method: dict[str, Row] = {}
    for row in accurate:
        by_method.setdefault(row["method"], row)
    return list(by_method.values())


def closed_form_standing(rows: Sequence[Row]) -> Standing | None:
    """Compare the closed form with all other settings on a scene; None if no linkage of the scene has a motion."""
    own = next(row for row in rows if row["method"] == CLOSED_FORM)
    error, seconds = ranking_error(own), own["cpu_seconds"]
    if math.isnan(error):
        return None
    as_accurate = [row for row in rows if row is not own and ranking_error(row) <= max(error, ROUNDING_ERROR)]
    cheaper = tuple(row["setting"] for row in as_accurate if row["cpu_seconds"] <= seconds)
    cost_ratio = min((row["cpu_seconds"] / seconds for row in as_accurate), default=math.inf)
    return Standing(error, seconds, cost_ratio, cheaper)
