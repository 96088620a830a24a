"""Read task files."""

import os
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, replace
from importlib.resources import files
from pathlib import Path
from typing import Any

from explore.base.entries import note_unknown
from explore.base.errors import ConfigError, DoubtfulInputWarning, Problems, RequestError
from explore.base.suggest import format_value
from explore.model.targets import MOST_TARGET_POINTS
from explore.studies.config import toml_text
from explore.studies.config.remarks import remark_on_units, target_entries
from explore.synthesis.candidates import Candidates
from explore.synthesis.tasks.contract import Task, TaskSections, TaskType
from explore.synthesis.tasks.questions import TaskQuestion
from explore.synthesis.tasks.registry import TASK_TYPES, task_type
from explore.synthesis.tasks.sections import SectionReader

#: Advice when a task file is too large.
_SHORTEN = f"thin the points: a path has at most {MOST_TARGET_POINTS}"
#: Sections that a task's type reads.
_OWN = ("target", "bounds", "search")
#: Sections that the study of the candidates takes as they are.
_GIVEN = ("evaluate", "metrics", "constraints", "rank", "units", "tolerances")


@dataclass(frozen=True)
class TaskFile:
    """A task, checked, with the text of its file, the name of its type, and what is asked of its candidates.

    The remarks say what may not be meant, such as points of a path in a wrong order; a line with its key for each.
    """

    kind: str
    task: Task
    asked: TaskQuestion
    text: str
    remarks: tuple[str, ...] = ()

    def find(self, report: Any = None) -> Candidates:
        """Find the candidates; `report` is called with the numbers of steps done and to be done."""
        return self.task.find(report)


def load_task(path: str | os.PathLike[str]) -> TaskFile:
    """Read a task file: what a linkage shall do, from which `synthesize` finds linkages.

    Parameters
    ----------
    path
        A TOML file, UTF-8, that begins with ``task = "path"`` or another type of task.

    Returns
    -------
    TaskFile
        The task, all names resolved.

    Raises
    ------
    ConfigError
        With one line ``file:line: key: reason; suggestion`` for each problem: the first twenty, and the number of the
        others.

    Warns
    -----
    DoubtfulInputWarning
        With one such line for each of the task's `remarks`.
    """
    file = os.fspath(path)
    task = parse_task(toml_text.read_text(file, _SHORTEN), file, Path(file).parent)
    for remark in task.remarks:
        warnings.warn(remark, DoubtfulInputWarning, stacklevel=2)
    return task


def parse_task(text: str, file: str, folder: Path | None = None) -> TaskFile:
    """The task of a text; `file` names it in errors, and a table of points is looked for in `folder`."""
    problems: Problems = []
    found = _resolve(toml_text.parse_toml(file, text), text, folder or Path(), problems)
    if found is None or problems:
        raise ConfigError(toml_text.first_problems(f"{file}: ", toml_text.locate_problems(file, text, problems)))
    return replace(found, remarks=tuple(toml_text.locate_problems(file, text, found.task.remarks)))


def task_starter(name: str) -> str:
    """The text of a commented task file of a type, ready to run; `RequestError` if there is no such type."""
    file = f"data/starter-task-{task_type(name).name}.toml"
    return files("explore").joinpath(file).read_text(encoding="utf-8")


def _resolve(sections: dict[str, Any], text: str, folder: Path, problems: Problems) -> TaskFile | None:
    """Resolve the sections of a file; None where its type is not known or its own sections are wrong."""
    if "mechanism" in sections and "task" not in sections:
        problems.append((("mechanism",), "this is a study; run it with `explore sweep`"))
        return None
    known = ("task", *_OWN, *_GIVEN)
    note_unknown(sections, known, problems)
    kind = _type(sections, problems)
    if kind is None:
        return None
    own: Problems = []
    readers = {name: SectionReader(name, sections.get(name, {}), own) for name in _OWN}
    task = kind.read(TaskSections(**readers, folder=folder), own)
    for reader in readers.values():
        reader.finish()
    problems += own
    if task is None:
        return None
    given = _given_sections(sections, problems)
    entries = [*target_entries(sections.get("target", {})), *(n for reader in readers.values() for n in reader.numbers)]
    asked = TaskQuestion.read(task, given, problems)
    task = replace(task, remarks=[*task.remarks, *remark_on_units(entries, asked.question.units)])
    return TaskFile(kind.name, task, asked, text)


def _given_sections(sections: Mapping[str, Any], problems: Problems) -> dict[str, Mapping[str, Any]]:
    """The sections that the study takes as they are; one that is no table is noted and left out."""
    given = {name: sections[name] for name in _GIVEN if name in sections}
    wrong = [name for name, content in given.items() if not isinstance(content, Mapping)]
    problems += [
        ((name,), f"must be a table of keys and values, got {format_value(given.pop(name))}") for name in wrong
    ]
    return given


def _type(sections: Mapping[str, Any], problems: Problems) -> TaskType | None:
    """The type of task of a file."""
    if "task" not in sections:
        problems.append((("task",), f'is missing; begin the file with task = "{next(iter(TASK_TYPES))}"'))
        return None
    try:
        return task_type(sections["task"])
    except RequestError as error:
        problems.append((("task",), str(error)))
        return None
