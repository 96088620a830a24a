"""What a study or a task names as a file, written into its text: a service reads no file by its path."""

import tomllib
from pathlib import Path
from typing import Any

from explore.base.errors import RequestError
from explore.studies.config import key_lines
from explore.studies.config.linkage import curve_files
from explore.studies.config.study import Study
from explore.studies.config.study_file import parse_study
from explore.studies.config.toml_text import format_toml
from explore.synthesis.tasks.task_files import TaskFile, parse_task

#: Key of a target that names a file.
_KEY = ("target", "file")
#: Keys of a path in place of its file.
_PATH = ("points", "crank_angles")
#: Keys of any target in place of its file.
_GIVEN = (*_PATH, "poses", "table")


def with_points(text: str, file: Path) -> str:
    """The text with points and a linkage in place of the names of their files, or as it is if it names none.

    Raises `ConfigError` with every problem of the study or task, that of the file of points among them, and
    `RequestError` if the points cannot be written in place of the name.
    """
    try:
        sections = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError):
        return text  # whose problems the service tells
    if isinstance(sections.get("linkage"), str) or curve_files(sections):
        return text_with_points(parse_study(text, str(file), file.parent))
    if not _names_file(sections):
        return text
    is_task = "task" in sections and "mechanism" not in sections
    given = (parse_task if is_task else parse_study)(text, str(file), file.parent)
    return _written(text, given, f"{file}:")


def text_with_points(given: Study | TaskFile) -> str:
    """The text of a study or task with the points that were read, as `with_points`."""
    text = given.text if isinstance(given, TaskFile) else given.to_toml()
    return _written(text, given, "line ") if _names_file(tomllib.loads(text)) else text


def _names_file(sections: dict[str, Any]) -> bool:
    target = sections.get("target")
    return isinstance(target, dict) and isinstance(target.get("file"), str)


def _written(text: str, given: Study | TaskFile, place: str) -> str:
    """The text with the points that were read; `place` stands before the number of a line in errors."""
    content = _target(given)
    missing = content.keys().isdisjoint(_GIVEN)
    lines = text.replace("\r\n", "\n").split("\n")
    number = key_lines.line_of(key_lines.locate("\n".join(lines)), _KEY) - 1
    if missing or not lines[number].lstrip().startswith("file"):
        raise RequestError(
            f"{place}{number + 1}: target.file: a service reads no file by its name, and this one cannot be sent with "
            "the text; write its rows into the text"
        )
    lines[number] = format_toml({key: content[key] for key in _GIVEN if content.get(key)}).strip()
    return "\n".join(lines)


def _target(given: Study | TaskFile) -> dict[str, Any]:
    """The target of a study; of a task what its own target gives, or the points of its path."""
    if isinstance(given, TaskFile):
        target = given.task.target or {}
        return {**{key: target[key] for key in _PATH if key in target}, **given.task.given}
    asked = given.request.mechanism.target
    return dict(asked.to_content()) if asked else {}
