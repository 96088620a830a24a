"""Scenes: studies whose designs are easy, hard or impossible to solve for a known reason."""

import os
import tomllib
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

import numpy as np
import numpy.typing as npt

from explore.base.errors import ConfigError, RequestError
from explore.comparison.methods.contract import Level
from explore.comparison.methods.loops import find_loop
from explore.comparison.strokes import Designs
from explore.studies.config.study import Study
from explore.studies.config.study_file import load_study

#: Largest number of designs of a scene: the multiple-precision reference is slow.
MAX_SCENE_DESIGNS = 10_000
#: Number of designs, evenly spread, of a study that is no scene.
SAMPLED_DESIGNS = 8


@dataclass(frozen=True, eq=False)
class Scene:
    """Designs to compare methods on.

    Its name is the stem of the file's; `about` says why it is included, `question` the design question that it stands
    for, and `model` is the lowest level of the motion that answers it.
    """

    name: str
    title: str
    about: str
    question: str
    model: Level
    designs: Designs


def load_scene(path: str | os.PathLike[str]) -> Scene:
    """Read a study file: with a section [scene] all of its designs, else a few; `ConfigError` if it is invalid."""
    study = load_study(path)
    count, name = study.space.n_designs, Path(path).stem
    table = tomllib.loads(study.to_toml()).get("scene")
    if table is not None and count > MAX_SCENE_DESIGNS:
        reason = f"a scene of {count:,} designs takes too long; {MAX_SCENE_DESIGNS:,} at most"
        raise ConfigError([f"{os.fspath(path)}:1: scene: {reason}"])
    chosen = np.arange(count)
    if table is None:
        chosen = np.unique(np.linspace(0, count - 1, SAMPLED_DESIGNS).astype(np.int64))
        about = f"{len(chosen)} of {count:,} designs"
        table = {"title": name, "about": about, "model": "accelerations", "question": about}
    return Scene(name, table["title"], table["about"], table["question"], Level[table["model"].upper()],
                 designs_of(study, path, chosen))  # fmt: skip


def designs_of(study: Study, path: str | os.PathLike[str], chosen: npt.NDArray[np.int64]) -> Designs:
    """Some of the designs of a study; `ConfigError` if only the closed form solves its mechanism."""
    mechanism = study.request.mechanism.for_signals((), needs_stroke=True)
    try:
        loop = find_loop(mechanism)
    except RequestError as error:
        raise ConfigError([f"{os.fspath(path)}:1: mechanism: {error}"]) from None
    columns = {p.name: np.full(len(chosen), p.default) for p in mechanism.parameters if p.default is not None}
    parts = [study.space.designs(number, number + 1) for number in chosen.tolist()]
    if len(chosen) == study.space.n_designs:
        parts = [study.space.designs(0, len(chosen))]
    columns |= {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    return Designs(mechanism, loop, columns)


def bundled_scenes() -> dict[str, Path]:
    """Study files of the bundled scenes, by name."""
    installed = Path(str(files("explore").joinpath("data", "scenes")))
    # A wheel contains them as package data; a checkout has them in configs/.
    folder = installed if installed.is_dir() else Path(__file__).parents[2] / "configs" / "scenes"
    return {path.stem: path for path in sorted(folder.glob("*.toml"))}
