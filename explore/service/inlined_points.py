"""The points of a file that a study or a task names, written into its text: a service reads no file by its path."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from explore.base.errors import RequestError
from explore.studies.config import key_lines
from explore.studies.config.study_file import parse_study
from explore.studies.config.toml_text import format_toml
from explore.synthesis.tasks.task_files import parse_task

#: The key of a target that names a file, and what a target has in its place.
_KEY, _GIVEN = ("target", "file"), ("points", "crank_angles")


def with_points(text: str, file: Path) -> str:
    """The text with the points in place of the name of their file, or as it is if it names none.

    Raises
    ------
    ConfigError
        With every problem of the study or task, that of the file of points among them.
    RequestError
        The points cannot be written in place of the name.
    """
    try:
        sections = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError):
        return text  # whose problems the service tells
    target = sections.get("target")
    if not isinstance(target, dict) or not isinstance(target.get("file"), str):
        return text
    content = _target(text, file, is_task="task" in sections and "mechanism" not in sections)
    missing = "points" not in content or ("timed_error_rms" in content and "crank_angles" not in content)
    lines = text.replace("\r\n", "\n").split("\n")
    number = key_lines.line_of(key_lines.locate("\n".join(lines)), _KEY) - 1
    if missing or not lines[number].lstrip().startswith("file"):
        raise RequestError(
            f"{file}:{number + 1}: target.file: a service reads no file by its name, and this one cannot be sent with "
            "the text; write its rows into the text"
        )
    lines[number] = format_toml({key: content[key] for key in _GIVEN if content.get(key)}).strip()
    return "\n".join(lines)


def _target(text: str, file: Path, *, is_task: bool) -> dict[str, Any]:
    """The target of a study or a task, with the names of what its solver measures."""
    if is_task:
        task = parse_task(text, str(file), file.parent).task
        return {**dict.fromkeys(task.measured, True), **(task.target or {})}
    target = parse_study(text, str(file), file.parent).request.mechanism.target
    return dict(target.to_content()) if target else {}
