"""Read study files, and the commented starter of each mechanism."""

from __future__ import annotations

import os
import warnings
from importlib.resources import files
from pathlib import Path

from explore.base.errors import ConfigError, DoubtfulInputWarning, Problems, RequestError
from explore.model.mechanism import Mechanism
from explore.model.targets import Target
from explore.studies.config import toml_text
from explore.studies.config.resolution import resolve_study
from explore.studies.config.study import Study, make_study


def load_study(path: str | os.PathLike[str]) -> Study:
    """Read a study file.

    Parameters
    ----------
    path
        A TOML file, UTF-8.

    Returns
    -------
    Study
        All names resolved, all numbers in the units that the mechanism declares.

    Raises
    ------
    ConfigError
        With one line ``file:line: key: reason; suggestion`` for each problem of the file and of its table of designs;
        of each the first twenty and the number of the others.

    Warns
    -----
    DoubtfulInputWarning
        With one such line for each of the study's `remarks`.
    """
    file = os.fspath(path)
    study = parse_study(toml_text.read_text(file), file, Path(file).parent)
    for remark in study.remarks:
        warnings.warn(remark, DoubtfulInputWarning, stacklevel=2)
    return study


def parse_study(text: str, file: str, folder: Path, target: Target | None = None) -> Study:
    """The study of a text; `file` names it in errors, and files that it names are looked for in `folder`.

    A target that is given takes the place of that of the text: results hold the points, which may have been in a file.
    """
    problems: Problems = []
    table_problems: list[str] = []
    sections = toml_text.parse_toml(file, text)
    if "task" in sections and "mechanism" not in sections:
        raise ConfigError([f"{file}: this is a task; run it with `explore synthesize`"])
    if target is not None:
        sections = {**sections, "target": target.to_content()}
    resolved = resolve_study(sections, folder, problems, table_problems)
    if resolved is None:
        own_problems = toml_text.locate_problems(file, text, problems)
        raise ConfigError(toml_text.first_problems(f"{file}: ", own_problems) + table_problems)
    return make_study(resolved, text, toml_text.locate_problems(file, text, list(resolved.remarks)))


def starter(mechanism: Mechanism) -> str:
    """The text of a commented study file of this mechanism, ready to run; a `RequestError` says that it has none."""
    if mechanism.starter:
        return mechanism.starter
    file = files("explore").joinpath(f"data/starter-{mechanism.name}.toml")
    if not file.is_file():
        raise RequestError(
            f"{mechanism.name} declares no starter; `explore mechanisms {mechanism.name}` lists it in full"
        )
    return file.read_text(encoding="utf-8")
