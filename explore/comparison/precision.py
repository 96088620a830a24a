"""What each way of solving the motion, and of averaging it, costs against how wrong it is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from explore.comparison import reference
from explore.comparison.scenes import Scene
from explore.comparison.strokes import coefficient_of_variation, stroke_nodes
from explore.comparison.timing import cpu_seconds
from explore.comparison.verdicts import SILENTLY_WRONG, Verdict, judge
from explore.methods.contract import ROCKER_VELOCITY, Capability, Level, Method, Outcome, Task, label
from explore.methods.driver import solve
from explore.methods.geometry import geometric_outcome
from explore.methods.registry import METHODS
from explore.vocabulary import FloatArray

#: Crank angles of the motion that is compared: a full turn from 90 deg, as in the published simulation.
ANGLES = 73
#: Designs of the block in which methods that solve many together are timed, and at most of the others.
BLOCK, SERIAL = 64, 8
#: A motion that is not this good, in the norms of `Judgement`, is no inexact answer but none; silently, if it says ok.
WORTHLESS = 0.1
_LEVELS = ("angle", "velocity", "acceleration")


@dataclass(frozen=True)
class _Case:
    """A scene with its exact answers; `stroke` is None where the question is not about velocities."""

    turn: Task
    exact: FloatArray
    stroke: Task | None
    weights: FloatArray
    cv: FloatArray


def compare_methods(scene: Scene, progress: Callable[[str], None] | None = None) -> list[dict[str, Any]]:
    """Error, cost and work of every method at every setting on a scene, a row each.

    Parameters
    ----------
    scene
        Its model decides how much of the motion is solved and compared.
    progress
        Told the label of each method as its turn comes.
    """
    case = _case(scene)
    rows = []
    for name, settings in METHODS.items():
        for method in settings:
            if progress is not None:
                progress(label(method))
            rows.append({"scene": scene.name, "method": name, "setting": label(method), **_row(method, case)})
    return rows


def _case(scene: Scene) -> _Case:
    lengths, branch = scene.lengths, scene.branch
    angles = np.tile(0.5 * np.pi + np.linspace(0.0, 2.0 * np.pi, ANGLES), (len(lengths), 1))
    turn = Task(lengths, branch, angles, max(scene.model, Level.POSITIONS))
    exact = reference.exact_motion(lengths, branch, angles)
    if scene.model < Level.VELOCITIES or not (geometric_outcome(lengths) == Outcome.OK).any():
        return _Case(turn, exact, None, np.empty(0), np.empty(0))
    nodes, weights = stroke_nodes(lengths, branch)
    velocity = reference.exact_motion(lengths, branch, nodes)[ROCKER_VELOCITY]
    stroke = Task(lengths, branch, nodes, Level.VELOCITIES)
    return _Case(turn, exact, stroke, weights, coefficient_of_variation(velocity, weights))


def _row(method: Method, case: _Case) -> dict[str, Any]:
    chosen = _chosen(method, case.turn)
    task = case.turn.part(chosen)
    motion = method.solve(task)
    judgement = judge(task, motion, case.exact[:, chosen], WORTHLESS)
    verdict = judgement.verdict
    sound = verdict == Verdict.RIGHT
    row: dict[str, Any] = {
        "designs": len(task),
        "failed": int(np.count_nonzero(~sound & (verdict != Verdict.REFUSED))),
        "silently_wrong": int(np.isin(verdict, (*SILENTLY_WRONG, Verdict.INACCURATE)).sum()),
        "verdict": Verdict(int(verdict.max())).label,
        "outcomes": ", ".join(sorted({Outcome(int(code)).label for code in motion.outcome})),
        "evaluations": float(motion.evaluations.mean()),
        "iterations": float(motion.iterations.mean()),
        "cpu_seconds": _seconds_per_design(method, task),
    }
    for level, name in enumerate(_LEVELS[: case.turn.level]):
        row[f"{name}_error_max"] = _largest(judgement.largest[level][sound])
        row[f"{name}_error_rms"] = _largest(judgement.rms[level][sound])
    if case.stroke is not None:
        stroke = case.stroke.part(chosen)
        along = solve(method, stroke)
        found = coefficient_of_variation(along.signals[ROCKER_VELOCITY], case.weights[chosen])
        row["cv_error"] = _largest((np.abs(found / case.cv[chosen] - 1.0))[sound])
        row["cv_evaluations"] = float(along.evaluations.mean())
        row["cv_cpu_seconds"] = _seconds_per_design(method, stroke)
    return row


def _chosen(method: Method, task: Task) -> npt.NDArray[np.intp]:
    """All designs, but only a few, those that cannot turn among them, for a method that takes one after the other."""
    if Capability.BATCHED in method.capabilities:
        return np.arange(len(task))
    bad_first = np.argsort(geometric_outcome(task.lengths) == Outcome.OK, kind="stable")
    return np.sort(bad_first[:SERIAL])


def _seconds_per_design(method: Method, task: Task) -> float:
    if Capability.BATCHED in method.capabilities and len(task) < BLOCK:
        task = task.part(np.arange(BLOCK) % len(task))
    return cpu_seconds(lambda: method.solve(task)) / len(task)


def _largest(errors: FloatArray) -> float:
    return float(errors.max()) if len(errors) and not np.isnan(errors).all() else np.nan
