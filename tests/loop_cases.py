"""Loops of mechanisms and of tables, and tasks on them."""

from functools import cache
from importlib.resources import files

import numpy as np

from explore.comparison.methods.contract import Level, Task
from explore.comparison.methods.loops import find_loop
from explore.comparison.scenes import designs_of
from explore.comparison.strokes import Designs
from explore.mechanisms.registry import MECHANISMS
from explore.studies.config.study_file import load_study

FOUR_BAR, SLIDER_CRANK, VARIABLE_CRANK = (
    find_loop(MECHANISMS[name]) for name in ("crank-rocker", "slider-crank", "variable-crank")
)


def four_bars(lengths, branch, crank_angle, level=Level.ACCELERATIONS, start=None):
    """A task of four-bars of lengths (n, 4) on a branch."""
    parameters = np.column_stack([lengths, np.broadcast_to(branch, len(lengths))])
    return Task(FOUR_BAR, parameters, crank_angle, level, start)


def rockers(lengths, branch=1.0):
    """Crank-rockers of lengths (n, 4) on a branch, with all other parameters at their defaults."""
    lengths, mechanism = np.asarray(lengths, dtype=float), MECHANISMS["crank-rocker"]
    columns = {p.name: np.full(len(lengths), p.default) for p in mechanism.parameters if p.default is not None}
    columns |= dict(zip(("crank", "coupler", "rocker", "ground"), lengths.T, strict=True))
    return Designs(mechanism, FOUR_BAR, {**columns, "branch": np.full(len(lengths), branch)})


def largest_gap(task, signals):
    """The largest gap of a chain at each crank angle, shape (n, t)."""
    about = task.loop.about(task.upright, task.crank_angle, signals[: task.loop.count])
    return np.abs(np.stack(about.gap)).max(axis=0)


@cache
def designs_of_linkage(name, count=3):
    """The first designs of a classic linkage, of those that `explore init --linkage` writes."""
    path = files("explore").joinpath("data", "linkages", f"{name}.toml")
    return designs_of(load_study(str(path)), str(path), np.arange(count))
