"""Error and cost of every averaging rule on a scene."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from explore.comparison.averaging_rules import AVERAGING_RULES, relative_errors
from explore.comparison.methods.contract import Level, Outcome, method_label
from explore.comparison.methods.four_bar_loop import FOUR_BAR
from explore.comparison.methods.geometry import geometric_outcome
from explore.comparison.reference import REFERENCE_SIGNALS, REFERENCE_WINDOWS, exact_statistics
from explore.comparison.scenes import Scene
from explore.comparison.timing import measure_cpu_seconds
from explore.model.quantities import FloatArray

#: Largest number of designs of a scene: the exact statistics of one take half a second.
MAX_RULE_DESIGNS = 8
#: Statistics whose errors are measured; extremes stand for the larger error of both.
_STATISTICS = ("mean", "variance", "cv", "extremes")
#: Levels that signals need; other signals need accelerations.
_LEVELS = {"rocker_angle": Level.POSITIONS, "rocker_velocity": Level.VELOCITIES}


def compare_rules(scene: Scene, progress: Callable[[str], None] | None = None) -> list[dict[str, Any]]:
    """Measure the errors and the cost of every averaging rule at every setting, a row for each window.

    Signals above the level of the scene's model are left out; a scene of another mechanism than the crank-rocker has no
    rows, because the exact averages are of that. Keys scene, window, rule, setting, designs, nodes (mean), cpu_seconds
    (per design), and ``<signal>_<statistic>_error``, the largest over the designs.
    """
    chosen = _rocking_designs(scene)[:MAX_RULE_DESIGNS]
    lengths, branch = scene.parameters[chosen], scene.branch[chosen]
    windows = REFERENCE_WINDOWS if len(chosen) else ()
    exact = {window: exact_statistics(lengths, branch, window) for window in windows}
    rows: list[dict[str, Any]] = []
    for name, settings in AVERAGING_RULES.items():
        for rule in settings:
            if progress is not None:
                progress(method_label(rule))
            for window in windows:
                averages = rule.average(lengths, branch, window)
                seconds = measure_cpu_seconds(partial(rule.average, lengths, branch, window))
                rows.append({
                    "scene": scene.name, "window": window, "rule": name, "setting": method_label(rule),
                    "designs": len(chosen), "nodes": float(averages.nodes.mean()), "cpu_seconds": seconds / len(chosen),
                    **_error_columns(relative_errors(averages, exact[window]), scene.model),
                })  # fmt: skip
    return rows


def _rocking_designs(scene: Scene) -> npt.NDArray[np.intp]:
    """Numbers of the crank-rockers of a scene."""
    if scene.loop is not FOUR_BAR:
        return np.empty(0, dtype=np.intp)
    lengths = scene.parameters
    return np.flatnonzero((geometric_outcome(lengths) == Outcome.OK) & (lengths[:, 0] < lengths[:, 3]))


def _error_columns(errors: FloatArray, model: Level) -> dict[str, float]:
    """Largest error over the designs by signal and statistic, minimum and maximum taken together as extremes."""
    columns = {}
    for signal, statistics in zip(REFERENCE_SIGNALS, errors, strict=True):
        if _LEVELS.get(signal, Level.ACCELERATIONS) > max(model, Level.POSITIONS):
            continue
        for k, statistic in enumerate(_STATISTICS):
            values = statistics[k : k + 1] if statistic != "extremes" else statistics[k : k + 2]
            is_defined = np.isfinite(values).any(axis=0)
            columns[f"{signal}_{statistic}_error"] = float(values[:, is_defined].max()) if is_defined.any() else np.nan
    return columns
