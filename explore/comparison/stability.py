"""Accuracy and failures of every method as a linkage approaches its change point."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import groupby
from operator import itemgetter
from typing import Any

import numpy as np

from explore.comparison import reference
from explore.comparison.verdicts import Verdict, judge
from explore.methods.contract import Capability, Level, Method, Task, method_label
from explore.methods.registry import METHODS
from explore.model.quantities import FloatArray

#: Dyadic lengths (mm) with exact sums and margin 0: all links are collinear at crank angle 0.
CRANK, COUPLER, ROCKER, GROUND = 150.0, 1083.5, 541.75, 691.75
#: Crank angles per turn of a task, which are the steps of the methods that go from one to the next.
STEP_COUNTS = (24, 72, 360)
DEFAULT_STEP_COUNT = 72
#: Exponents of the powers of two that are added to the ground (mm), 64 mm to 9e-13 mm in steps of nearly a decade, and
#: subtracted from it, so that the crank is blocked.
_MARGIN_EXPONENTS, _GAP_EXPONENTS = (*range(6, -41, -3),), (2, -8, -20, -32)


@dataclass(frozen=True)
class StabilityGrid:
    """Designs at several distances from the change point on both sides of it.

    Attributes
    ----------
    margin : (n,) array
        Grashof margin over the longest link, descending; negative where the crank is blocked.
    lengths : (n, 4) array
        Crank, coupler, rocker, ground, mm.
    """

    margin: FloatArray
    lengths: FloatArray


def stability_grid() -> StabilityGrid:
    """Designs of the comparison: sixteen whose crank turns, the change point, four whose crank is blocked."""
    margins = np.array([*(2.0**k for k in _MARGIN_EXPONENTS), 0.0, *(-(2.0**k) for k in reversed(_GAP_EXPONENTS))])
    lengths = np.tile([CRANK, COUPLER, ROCKER, GROUND], (len(margins), 1))
    lengths[:, 3] += margins
    return StabilityGrid(margins / lengths.max(axis=1), lengths)


def map_stability(goal: float, progress: Callable[[str], None] | None = None) -> list[dict[str, Any]]:
    """Judge every method at every setting, number of crank angles and margin, a row each.

    Parameters
    ----------
    goal
        Largest error of positions and velocities of an accurate motion, in the norms of
        `explore.comparison.verdicts.Judgement`.
    progress
        Called with the label of each method before it is run.

    Returns
    -------
    list of dict
        Keys method, setting, angles (per turn), margin (over the longest link), verdict, error, evaluations.
    """
    designs = stability_grid()
    branch = np.ones(len(designs.lengths))
    rows: list[dict[str, Any]] = []
    for steps, methods in groupby(stability_runs(), key=itemgetter(0)):
        angles = np.tile(0.5 * np.pi + np.linspace(0.0, 2.0 * np.pi, steps + 1), (len(branch), 1))
        task = Task(designs.lengths, branch, angles, Level.VELOCITIES)
        exact = reference.exact_motion(designs.lengths, branch, angles)
        for _, name, method in methods:
            if progress is not None:
                progress(method_label(method))
            run = {"method": name, "setting": method_label(method), "angles": steps}
            rows += [{**run, **row} for row in _verdict_rows(method, task, exact, designs.margin, goal)]
    return rows


def stability_runs() -> list[tuple[int, str, Method]]:
    """Number of crank angles, name and method of every run.

    Only methods that step by the crank angles of the task are run at all of `STEP_COUNTS`.
    """
    return [
        (steps, name, method)
        for steps in STEP_COUNTS
        for name, settings in METHODS.items()
        for method in settings
        if steps == DEFAULT_STEP_COUNT or Capability.FOLLOWS_ANGLES in method.capabilities
    ]


def _verdict_rows(
    method: Method, task: Task, exact: FloatArray, margin: FloatArray, goal: float
) -> list[dict[str, Any]]:
    """A row for each design of a task."""
    motion = method.solve(task)
    judgement = judge(task, motion, exact, goal)
    return [
        {
            "margin": float(margin[i]),
            "verdict": Verdict(int(verdict)).label,
            "error": float(judgement.max_error[:, i].max()),
            "evaluations": int(motion.evaluations[i]),
        }
        for i, verdict in enumerate(judgement.verdict)
    ]


def safe_margins(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The smallest margin down to which each method is accurate without exception.

    Parameters
    ----------
    rows
        The rows of `map_stability`.

    Returns
    -------
    list of dict
        Keys method, setting, angles, smallest_accurate_margin (NaN if the method is inaccurate at the largest
        margin), verdict_below (at the next smaller margin), worst_verdict.
    """
    runs: dict[tuple[str, str, int], list[dict[str, Any]]] = {}
    for row in rows:
        runs.setdefault((row["method"], row["setting"], row["angles"]), []).append(row)
    margins = []
    for (method, setting, angles), line in runs.items():
        turning = sorted((row for row in line if row["margin"] > 0.0), key=lambda row: -row["margin"])
        accurate = 0
        while accurate < len(turning) and turning[accurate]["verdict"] == Verdict.ACCURATE.label:
            accurate += 1
        margins.append({
            "method": method,
            "setting": setting,
            "angles": angles,
            "smallest_accurate_margin": turning[accurate - 1]["margin"] if accurate else float("nan"),
            "verdict_below": turning[accurate]["verdict"] if accurate < len(turning) else "",
            "worst_verdict": max((row["verdict"] for row in line), key=_severity),
        })  # fmt: skip
    return margins


def _severity(label: str) -> int:
    """Rank of a verdict by its label."""
    return next(verdict.value for verdict in Verdict if verdict.label == label)
