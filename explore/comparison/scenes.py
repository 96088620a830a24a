"""Scenes: studies whose designs are easy, hard or impossible to solve for a known reason."""

import os
import tomllib
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

import numpy as np

from explore.base.errors import ConfigError, RequestError
from explore.comparison.methods.contract import Level
from explore.comparison.methods.registry import find_loop
from explore.comparison.methods.vector_loop import VectorLoop
from explore.model.quantities import FloatArray
from explore.studies.config.study import Study
from explore.studies.config.study_file import load_study

#: Largest number of designs of a scene: the multiple-precision reference is slow.
MAX_SCENE_DESIGNS = 10_000


@dataclass(frozen=True, eq=False)
class Scene:
    """Designs to compare methods on.

    Its name is the stem of the file's; `about` says why it is included, `question` the design question that it stands
    for, and `model` is the lowest level of the motion that answers it. Parameters, (n, p), are those of the loop, mm;
    branches 1 or -1.
    """

    name: str
    title: str
    about: str
    question: str
    model: Level
    loop: VectorLoop
    parameters: FloatArray
    branch: FloatArray
    study: Study


def load_scene(path: str | os.PathLike[str]) -> Scene:
    """Read a study file with a section [scene]; `ConfigError` if it is invalid, too large, or has no such section."""
    study = load_study(path)
    table = tomllib.loads(study.to_toml()).get("scene")
    if table is None:
        keys = "title, about, model and question"
        raise ConfigError(
            [f"{os.fspath(path)}:1: scene: is missing; a scene is a study with a section [scene]: {keys}"]
        )
    if study.space.n_designs > MAX_SCENE_DESIGNS:
        reason = f"a scene of {study.space.n_designs:,} designs takes too long; {MAX_SCENE_DESIGNS:,} at most"
        raise ConfigError([f"{os.fspath(path)}:1: scene: {reason}"])
    try:
        loop = find_loop(study.request.mechanism.name)
    except RequestError as error:
        raise ConfigError([f"{os.fspath(path)}:1: mechanism: {error}"]) from None
    defaults = {p.name: p.default for p in study.request.mechanism.parameters if p.default is not None}
    designs = {name: np.full(study.space.n_designs, default) for name, default in defaults.items()}
    designs |= study.space.designs(0, study.space.n_designs)
    return Scene(
        name=Path(path).stem,
        title=table["title"],
        about=table["about"],
        question=table["question"],
        model=Level[table["model"].upper()],
        loop=loop,
        parameters=np.column_stack([designs[name] for name in loop.parameters]),
        branch=designs.get("branch", np.ones(study.space.n_designs)),
        study=study,
    )


def bundled_scenes() -> dict[str, Path]:
    """Study files of the bundled scenes, by name."""
    installed = Path(str(files("explore").joinpath("data", "scenes")))
    # A wheel contains them as package data; a checkout has them in configs/.
    folder = installed if installed.is_dir() else Path(__file__).parents[2] / "configs" / "scenes"
    return {path.stem: path for path in sorted(folder.glob("*.toml"))}
