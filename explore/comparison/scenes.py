"""Scenes: studies whose linkages are easy, hard or impossible for a known reason, and the question asked of each."""

from __future__ import annotations

import os
import tomllib
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

import numpy as np

from explore.config.study_file import load_study
from explore.errors import ConfigError
from explore.methods.contract import Level
from explore.study import Study
from explore.vocabulary import FloatArray

_LENGTHS = ("crank", "coupler", "rocker", "ground")


@dataclass(frozen=True, eq=False)
class Scene:
    """Linkages to compare methods on, and why.

    Attributes
    ----------
    name
        Of the file, without its ending.
    title, about, question
        For people: a name, why the scene is there, what a designer asks of it.
    model
        The least of the motion that answers the question.
    lengths : (n, 4) array
        Crank, coupler, rocker, ground (mm).
    branch : (n,) array
        1 or -1.
    study
        The same linkages as an ordinary study.
    """

    name: str
    title: str
    about: str
    question: str
    model: Level
    lengths: FloatArray
    branch: FloatArray
    study: Study


def load_scene(path: str | os.PathLike[str]) -> Scene:
    """Read a study file that has a section [scene].

    Raises
    ------
    ConfigError
        As `load_study` does, and where there is no such section.
    """
    study = load_study(path)
    table = tomllib.loads(study.text).get("scene")
    if table is None:
        keys = "title, about, model and question"
        raise ConfigError(
            [f"{os.fspath(path)}:1: scene: is missing; a scene is a study with a section [scene]: {keys}"]
        )
    designs = study.space.designs(0, study.space.count)
    return Scene(
        name=Path(path).stem,
        title=table["title"],
        about=table["about"],
        question=table["question"],
        model=Level[table["model"].upper()],
        lengths=np.column_stack([designs[name] for name in _LENGTHS]),
        branch=designs.get("branch", np.ones(study.space.count)),
        study=study,
    )


def bundled_scenes() -> dict[str, Path]:
    """The study files of the scenes that come with the package, by name."""
    installed = Path(str(files("explore").joinpath("data", "scenes")))
    # The wheel copies them there; a checkout has them among the other study files.
    folder = installed if installed.is_dir() else Path(__file__).parents[2] / "configs" / "scenes"
    return {path.stem: path for path in sorted(folder.glob("*.toml"))}
