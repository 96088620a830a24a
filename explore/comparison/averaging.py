"""What each rule of averaging costs against how wrong its statistics are."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from explore.comparison.averages import RULES, errors
from explore.comparison.reference import SIGNALS, WINDOWS, exact_statistics
from explore.comparison.scenes import Scene
from explore.comparison.timing import cpu_seconds
from explore.methods.contract import Level, Outcome, label
from explore.methods.geometry import geometric_outcome
from explore.vocabulary import FloatArray

#: Designs of a scene at most: the exact statistics of each take half a second.
DESIGNS = 8
_STATISTICS = ("mean", "variance", "cv", "extremes")
_LEVELS = {"rocker_angle": Level.POSITIONS, "rocker_velocity": Level.VELOCITIES}


def compare_rules(scene: Scene, progress: Callable[[str], None] | None = None) -> list[dict[str, Any]]:
    """Errors of the statistics, nodes and cost of every rule at every setting on a scene, a row for each window.

    Parameters
    ----------
    scene
        Statistics of signals that its model does not know are left out.
    progress
        Told the label of each rule as its turn comes.
    """
    rocks = np.flatnonzero(
        (geometric_outcome(scene.lengths) == Outcome.OK) & (scene.lengths[:, 0] < scene.lengths[:, 3])
    )
    chosen = rocks[:DESIGNS]
    lengths, branch = scene.lengths[chosen], scene.branch[chosen]
    exact = {window: exact_statistics(lengths, branch, window) for window in WINDOWS}
    rows: list[dict[str, Any]] = []
    for name, settings in RULES.items():
        for rule in settings:
            if progress is not None:
                progress(label(rule))
            if not len(chosen):
                continue
            for window in WINDOWS:
                found = rule.average(lengths, branch, window)
                seconds = cpu_seconds(lambda r=rule, w=window: r.average(lengths, branch, w))  # type: ignore[misc]
                rows.append({
                    "scene": scene.name, "window": window, "rule": name, "setting": label(rule),
                    "designs": len(chosen), "nodes": float(found.nodes.mean()), "cpu_seconds": seconds / len(chosen),
                    **_errors(errors(found, exact[window]), scene.model),
                })  # fmt: skip
    return rows


def _errors(found: FloatArray, model: Level) -> dict[str, float]:
    """Worst error over the designs by signal and statistic, minimum and maximum taken together."""
    columns = {}
    for signal, statistics in zip(SIGNALS, found, strict=True):
        if _LEVELS.get(signal, Level.ACCELERATIONS) > max(model, Level.POSITIONS):
            continue
        for k, statistic in enumerate(_STATISTICS):
            values = statistics[k : k + 1] if statistic != "extremes" else statistics[k : k + 2]
            # NaN where the exact value is none; what a rule could not tell is an error without bound
            known = np.isfinite(values).any(axis=0)
            columns[f"{signal}_{statistic}_error"] = float(values[:, known].max()) if known.any() else np.nan
    return columns
