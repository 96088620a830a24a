"""Accuracy and failures of every method as a design approaches a singular position, and over its turn."""

from __future__ import annotations

from collections.abc import Callable
from itertools import groupby
from operator import itemgetter
from typing import Any

import numpy as np

from explore.comparison.methods.contract import Capability, Method, Task, method_label
from explore.comparison.methods.registry import methods_for
from explore.comparison.slider_reference import exact_motion_of
from explore.comparison.stability_cases import StabilityCase
from explore.comparison.verdicts import Verdict, judge, signal_errors
from explore.model.quantities import FloatArray

#: Numbers of crank angles per turn, which are the steps of methods that go from one to the next.
STEP_COUNTS = (24, 72, 360)
#: Number of crank angles per turn for methods whose steps are their own.
DEFAULT_STEP_COUNT = 72
#: Number of the design of a case whose turn is traced: neither far from the singular position nor next to it.
TRACED_DESIGN = 4


def map_stability(
    case: StabilityCase, goal: float, progress: Callable[[str], None] | None = None
) -> list[dict[str, Any]]:
    """Judge every method at every setting, number of crank angles and margin, a row each.

    The goal is the largest error of positions and velocities of an accurate motion, in the norms of `Judgement`. Keys
    method, setting, angles (per turn), margin, verdict, error, evaluations.
    """
    rows: list[dict[str, Any]] = []
    for steps, methods in groupby(stability_runs(case), key=itemgetter(0)):
        task = case.task(steps)
        exact = exact_motion_of(task)
        for _, name, method in methods:
            if progress is not None:
                progress(method_label(method))
            run = {"method": name, "setting": method_label(method), "angles": steps}
            rows += [{**run, **row} for row in _verdict_rows(method, task, exact, case.margin, goal)]
    return rows


def stability_runs(case: StabilityCase) -> list[tuple[int, str, Method]]:
    """Number of crank angles, name and method of every run.

    Only methods that step by the crank angles of the task are run at all of `STEP_COUNTS`.
    """
    return [
        (steps, name, method)
        for steps in STEP_COUNTS
        for name, settings in methods_for(case.loop).items()
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


def trace_turn(case: StabilityCase) -> list[dict[str, Any]]:
    """The error of every method at its finest setting over a turn, at each degree.

    Keys method, setting, crank_angle (deg), error: that of positions and velocities, the larger, in the norms of
    `Judgement`, NaN where the method has no solution.
    """
    task = case.task(360, slice(TRACED_DESIGN, TRACED_DESIGN + 1))
    exact, angles = exact_motion_of(task), np.rad2deg(task.crank_angle[0])
    rows: list[dict[str, Any]] = []
    for name, settings in methods_for(case.loop).items():
        for method in settings[-1:]:
            errors = signal_errors(task, method.solve(task).signals, exact)[:, 0].max(axis=0)
            rows += [
                {"method": name, "setting": method_label(method), "crank_angle": float(angle), "error": float(error)}
                for angle, error in zip(angles, errors, strict=True)
            ]
    return rows


def safe_margins(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The smallest margin down to which each method is accurate without exception, from the rows of `map_stability`.

    Keys method, setting, angles, smallest_accurate_margin (NaN if the method is inaccurate at the largest margin),
    verdict_below (at the next smaller margin), worst_verdict.
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
