"""Read study files, and the commented starter of each mechanism."""

from __future__ import annotations

import os
from importlib.resources import files

from explore.config.study import Study
from explore.model.mechanism import Mechanism


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
    """
    return Study.from_toml(path)


def starter(mechanism: Mechanism) -> str:
    """The text of a commented study file of this mechanism, ready to run."""
    return files("explore").joinpath(f"data/starter-{mechanism.name}.toml").read_text(encoding="utf-8")
