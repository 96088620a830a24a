"""Constraints of a task file on what the solver of the task measures, which the study of its candidates cannot have."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from explore.base.errors import Problems
from explore.base.suggest import format_value
from explore.synthesis.tasks.contract import Task


def split_constraints(task: Task, section: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """The constraints of a section that the study of the candidates has, and those on what the solver measures."""
    of_solver = {name: sides for name, sides in section.items() if name in task.measured}
    return {name: sides for name, sides in section.items() if name not in of_solver}, of_solver


def note_constraints(task: Task, section: Mapping[str, Any], problems: Problems) -> None:
    """Note what is wrong with the constraints on what the solver measures: numbers in the unit of the column."""
    for name, sides in split_constraints(task, section)[1].items():
        if not isinstance(sides, Mapping) or not sides or not sides.keys() <= {"min", "max"}:
            reason = f"must be a table such as {{ max = 0.5 }}, got {format_value(sides)}"
            problems.append((("constraints", name), reason))
            continue
        for side, bound in sides.items():
            if not isinstance(bound, int | float) or isinstance(bound, bool) or bound != bound:
                problems.append((("constraints", name, side), f"must be a number, got {format_value(bound)}"))
