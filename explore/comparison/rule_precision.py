"""Error and cost of every averaging rule on a scene."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from explore.comparison.averaging_rules import AVERAGING_RULES, relative_errors
from explore.comparison.methods.contract import Level, method_label
from explore.comparison.reference_statistics import exact_statistics
from explore.comparison.scenes import Scene
from explore.comparison.strokes import WINDOWS
from explore.comparison.timing import measure_cpu_seconds
from explore.model.quantities import FloatArray

#: Largest number of designs of a scene, over the square of its chains, but at least 1: exact statistics take seconds.
MAX_RULE_DESIGNS = 8
#: Statistics whose errors are measured; extremes stand for the larger error of both.
_STATISTICS = ("mean", "variance", "cv", "extremes")
#: Words for the three signals of an output in names of columns.
_SIGNALS = ("position", "velocity", "acceleration")


def compare_rules(scene: Scene, progress: Callable[[str], None] | None = None) -> list[dict[str, Any]]:
    """Measure the errors and the cost of every averaging rule at every setting, a row for each window.

    Signals above the level of the scene's model are left out; a scene whose output has no strokes, or is no unknown of
    the loops, has no rows. Keys scene, window, rule, setting, designs, nodes (mean),
    cpu_seconds (per design), and ``<signal>_<statistic>_error``, the largest over the designs.
    """
    designs = scene.designs
    if designs.output is None:
        return []
    count = max(1, MAX_RULE_DESIGNS // len(designs.loop.chains) ** 2)
    designs = designs.part(np.flatnonzero(designs.has_strokes)[:count])
    windows = WINDOWS if len(designs) else ()
    exact = {window: exact_statistics(designs, window) for window in windows}
    rows: list[dict[str, Any]] = []
    for name, settings in AVERAGING_RULES.items():
        for rule in settings:
            if progress is not None:
                progress(method_label(rule))
            for window in windows:
                averages = rule.average(designs, window)
                seconds = measure_cpu_seconds(partial(rule.average, designs, window))
                rows.append({
                    "scene": scene.name, "window": window, "rule": name, "setting": method_label(rule),
                    "designs": len(designs), "nodes": float(averages.nodes.mean()),
                    "cpu_seconds": seconds / len(designs),
                    **_error_columns(relative_errors(averages, exact[window]), scene.model),
                })  # fmt: skip
    return rows


def _error_columns(errors: FloatArray, model: Level) -> dict[str, float]:
    """Largest error over the designs by signal and statistic, minimum and maximum taken together as extremes."""
    columns = {}
    for signal, statistics in zip(_SIGNALS[: max(model, Level.POSITIONS)], errors, strict=False):
        for k, statistic in enumerate(_STATISTICS):
            values = statistics[k : k + 1] if statistic != "extremes" else statistics[k : k + 2]
            is_defined = np.isfinite(values).any(axis=0)
            columns[f"{signal}_{statistic}_error"] = float(values[:, is_defined].max()) if is_defined.any() else np.nan
    return columns
