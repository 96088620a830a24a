"""Cost of each level of the model, from geometry to accelerations."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from explore.comparison.method_precision import ANGLE_COUNT, BATCH_SIZE
from explore.comparison.methods.closed_form import ClosedForm
from explore.comparison.methods.contract import Level, Task
from explore.comparison.scenes import Scene
from explore.comparison.timing import measure_cpu_seconds


def measure_level_costs(scene: Scene) -> dict[str, Any]:
    """Measure the CPU time per design of each level by the closed form.

    Keys scene, needs (the level that the question of the scene needs), the names of the levels (s), and
    full_cost_ratio: the cost of the highest level over that of the needed one.
    """
    designs = np.arange(max(BATCH_SIZE, len(scene.parameters))) % len(scene.parameters)
    parameters, branch = scene.parameters[designs], scene.branch[designs]
    angles = np.tile(np.linspace(0.0, 2.0 * np.pi, ANGLE_COUNT), (len(designs), 1))
    columns = {**dict(zip(scene.loop.parameters, parameters.T, strict=True)), "branch": branch}
    mechanism = scene.loop.mechanism
    inputs = np.stack([columns.get(p.name, np.full(len(designs), p.default)) for p in mechanism.kernel_parameters])
    geometry = partial(mechanism.evaluate_closed_form, inputs)
    seconds = {Level.GEOMETRY: measure_cpu_seconds(geometry) / len(designs)}
    for level in (Level.POSITIONS, Level.VELOCITIES, Level.ACCELERATIONS):
        task = Task(parameters, branch, angles, level, loop=scene.loop)
        seconds[level] = measure_cpu_seconds(partial(ClosedForm().solve, task)) / len(designs)
    row: dict[str, Any] = {"scene": scene.name, "needs": scene.model.name.lower()}
    row |= {level.name.lower(): value for level, value in seconds.items()}
    row["full_cost_ratio"] = seconds[Level.ACCELERATIONS] / seconds[scene.model]
    return row
