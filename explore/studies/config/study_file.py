"""Read study files; the commented starter of each mechanism, and the study of an atlas."""

import os
import re
import warnings
from importlib.resources import files
from pathlib import Path

from explore.base.errors import ConfigError, DoubtfulInputWarning, Problems, RequestError
from explore.base.suggest import closest_name, format_value
from explore.model.mechanism import Mechanism
from explore.model.targets import Target
from explore.studies.config import toml_text
from explore.studies.config.resolution import resolve_study
from explore.studies.config.study import Study, make_study

#: Folder of the studies of classic linkages.
_LINKAGES = files("explore").joinpath("data/linkages")
#: Line of the study with the number of curves.
_COUNT = "count = 65536"


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


def linkage_starters() -> dict[str, str]:
    """What each classic linkage does that a table describes, by its name: the first sentence of its study."""
    found = {file.name.removesuffix(".toml"): file.read_text(encoding="utf-8") for file in _LINKAGES.iterdir()}
    return {name: _first_sentence(found[name]) for name in sorted(found)}


def linkage_starter(name: str) -> str:
    """The text of a commented study of a classic linkage, ready to run; `RequestError` if there is none."""
    names = list(linkage_starters())
    if name not in names:
        known = f"available: {', '.join(names)}"
        match = closest_name(name, names)
        hint = f"did you mean '{match}'? {known}" if match else known
        raise RequestError(f"unknown linkage {format_value(name)}; {hint}")
    return _LINKAGES.joinpath(f"{name}.toml").read_text(encoding="utf-8")


def _first_sentence(text: str) -> str:
    """The first sentence of the comment at the top of a study."""
    lines = [line[2:] for line in text.split("\n#\n")[0].split("\n")]
    return re.split(r"[.;](?:\s|$)", " ".join(lines), maxsplit=1)[0]


def atlas_text(count: int) -> str:
    """The study of an atlas of so many linkages."""
    text = files("explore").joinpath("data/atlas.toml").read_text(encoding="utf-8")
    return text.replace(_COUNT, f"count = {count}")
