"""The objectives of candidates, some of which the solver of their task measures and their study cannot compute."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from explore.base.errors import Problems, RequestError
from explore.base.suggest import closest_name, format_value
from explore.model.quantities import Sense
from explore.model.request import Objective
from explore.results.ranking.objectives import read_objective
from explore.synthesis.tasks.contract import Task


def name_of(entry: object) -> str:
    """The name of the metric in an objective such as ``"cv:min"``."""
    return str(entry).partition(":")[0].strip()


def split_objectives(task: Task, rank: Mapping[str, Any]) -> tuple[dict[str, Any], list[int]]:
    """The section ``[rank]`` for the study of the candidates, and the places that its metrics have in the given one.

    The study has the objectives that it can compute; those of the task where the given section has none of these.
    """
    entries = rank.get("metrics", list(task.objectives))
    if not isinstance(entries, list):
        return dict(rank), []
    places = [k for k, entry in enumerate(entries) if name_of(entry) not in task.measured]
    metrics = [entries[k] for k in places]
    if entries and not metrics:
        metrics = [text for text in task.objectives if name_of(text) not in task.measured]
    return {**rank, "metrics": metrics}, places


def note_measured(task: Task, rank: Mapping[str, Any], problems: Problems) -> None:
    """Note what is wrong with the objectives that the solver measures."""
    entries, known = rank.get("metrics", []), set[str]()
    for place, entry in enumerate(entries if isinstance(entries, list) else []):
        name = name_of(entry)
        if name not in task.measured or not isinstance(entry, str):
            continue
        try:
            _measured_objective(task, entry)
        except RequestError as error:
            problems.append((("rank", "metrics", place), str(error)))
        if name in known:
            problems.append((("rank", "metrics", place), f"{name} is listed twice; remove one"))
        known.add(name)


def with_suggestion(task: Task, rank: Mapping[str, Any], key: tuple[str | int, ...], reason: str) -> str:
    """The reason against an objective of the study; one with an unknown name may mean what the solver measures."""
    if key[:2] != ("rank", "metrics") or not key[2:] or not reason.startswith("unknown metric"):
        return reason
    name = name_of(rank["metrics"][int(key[2])])
    meant = closest_name(name, task.measured)
    return reason if meant is None else f"unknown metric {format_value(name)}; did you mean '{meant}'?"


def objectives_of(task: Task, rank: Mapping[str, Any], computed: Sequence[Objective]) -> tuple[Objective, ...]:
    """The objectives of the candidates in their order; `computed` are those of their study."""
    by_name = {objective.metric: objective for objective in computed}
    entries = rank.get("metrics", task.objectives)
    return tuple(
        _measured_objective(task, entry) if name_of(entry) in task.measured else by_name[name_of(entry)]
        for entry in entries
    )


def _measured_objective(task: Task, text: str) -> Objective:
    def better_side(name: str) -> Sense | None:
        return task.measured[name]

    return read_objective(text, better_side)
