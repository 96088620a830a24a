"""What each level of the model costs: why a scene names the least that its question needs."""

from __future__ import annotations

from typing import Any

import numpy as np

from explore.comparison.precision import ANGLES, BLOCK
from explore.comparison.scenes import Scene
from explore.comparison.timing import cpu_seconds
from explore.mechanisms.crank_rocker import CRANK_ROCKER
from explore.methods.closed_form import ClosedForm
from explore.methods.contract import Level, Task


def level_costs(scene: Scene) -> dict[str, Any]:
    """CPU time per design of each level, by the closed form, and how many times the needed one the highest costs."""
    tile = np.arange(max(BLOCK, len(scene.lengths))) % len(scene.lengths)
    lengths, branch = scene.lengths[tile], scene.branch[tile]
    angles = np.tile(np.linspace(0.0, 2.0 * np.pi, ANGLES), (len(tile), 1))
    seconds = {Level.GEOMETRY: cpu_seconds(lambda: _geometry(lengths, branch)) / len(tile)}
    for level in (Level.POSITIONS, Level.VELOCITIES, Level.ACCELERATIONS):
        task = Task(lengths, branch, angles, level)
        seconds[level] = cpu_seconds(lambda task=task: ClosedForm().solve(task)) / len(tile)  # type: ignore[misc]
    row: dict[str, Any] = {"scene": scene.name, "needs": scene.model.name.lower()}
    row |= {level.name.lower(): value for level, value in seconds.items()}
    row["spared"] = seconds[Level.ACCELERATIONS] / seconds[scene.model]
    return row


def _geometry(lengths: np.ndarray, branch: np.ndarray) -> None:
    n = len(lengths)
    parameters = np.column_stack([lengths, np.ones(n), branch])
    CRANK_ROCKER.closed_form(
        parameters, np.empty((len(CRANK_ROCKER.metrics), n)), np.zeros(n, np.int8),
        np.zeros((n, CRANK_ROCKER.kernel_size)), np.ones((n, 3)), np.ones(n),
    )  # fmt: skip
