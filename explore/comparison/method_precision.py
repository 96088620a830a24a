"""Error and cost of every method on a scene, what they sum up to, and the cost of each level of the model."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from explore.comparison.methods.closed_form import ClosedForm, geometric_outcome, solve_screened
from explore.comparison.methods.contract import Capability, Level, Method, Outcome, Task, method_label
from explore.comparison.methods.loop import whole_motion
from explore.comparison.methods.registry import methods_for
from explore.comparison.reference import exact_motion
from explore.comparison.scenes import Scene
from explore.comparison.strokes import coefficient_of_variation, stroke_nodes
from explore.comparison.timing import measure_cpu_seconds
from explore.comparison.verdicts import SILENTLY_WRONG, Verdict, judge
from explore.model.quantities import FloatArray

Row = dict[str, Any]

#: Number of crank angles of the whole motion, of a full turn from 90 deg, as in the published simulation.
ANGLE_COUNT = 73
#: Number of designs timed by batched methods.
BATCH_SIZE = 64
#: Largest number of designs timed one by one.
SERIAL_DESIGNS = 8
#: Error above which a motion counts as failed, in the norms of `Judgement`; silently, if it is reported as OK.
FAILURE_ERROR = 0.1
#: Names of the levels in columns of errors.
_LEVELS = ("position", "velocity", "acceleration")
#: Accuracies at which the fastest method is listed.
ACCURACIES = (1e-3, 1e-6, 1e-9, 1e-12)
#: Name of the method that the others are compared with.
CLOSED_FORM = "closed-form"
#: Largest error that is rounding; errors up to it are equal in a comparison.
ROUNDING_ERROR = 1e-13


@dataclass(frozen=True)
class _Case:
    """Tasks of a scene with their exact results; `stroke` is None unless it needs velocities over strokes."""

    turn: Task
    exact: FloatArray
    stroke: Task | None
    weights: FloatArray
    cv: FloatArray
    row: int


def compare_methods(scene: Scene, progress: Callable[[str], None] | None = None) -> list[dict[str, Any]]:
    """Measure error, cost and work of every method at every setting on a scene, a row each.

    Keys scene, method, setting, designs, failed and silently_wrong (numbers of designs), verdict (the worst), outcomes,
    evaluations, iterations and cpu_seconds (per design), and, as far as the scene's model goes, the largest errors of
    `Judgement` over the accurate designs and error, evaluations and cost of the cv over the stroke.
    """
    case = _exact_case(scene)
    rows = []
    for name, settings in methods_for(scene.designs.loop).items():
        for method in settings:
            if progress is not None:
                progress(method_label(method))
            rows.append(
                {"scene": scene.name, "method": name, "setting": method_label(method), **_measure(method, case)}
            )
    return rows


def _exact_case(scene: Scene) -> _Case:
    designs = scene.designs
    first, span = whole_motion(designs.loop)
    angles = np.tile(first + np.linspace(0.0, span, ANGLE_COUNT), (len(designs), 1))
    turn = designs.task(angles, max(scene.model, Level.POSITIONS))
    exact = exact_motion(turn)
    nodes = stroke_nodes(designs) if designs.output and scene.model >= Level.VELOCITIES else None
    if nodes is None:
        return _Case(turn, exact, None, np.empty(0), np.empty(0), 0)
    stroke, row = designs.task(nodes[0], Level.VELOCITIES), designs.loop.count + designs.row
    return _Case(turn, exact, stroke, nodes[1], coefficient_of_variation(exact_motion(stroke)[row], nodes[1]), row)


def _measure(method: Method, case: _Case) -> dict[str, Any]:
    chosen = _choose_designs(method, case.turn)
    task = case.turn.part(chosen)
    motion = method.solve(task)
    judgement = judge(task, motion, case.exact[:, chosen], FAILURE_ERROR)
    verdict = judgement.verdict
    accurate = verdict == Verdict.ACCURATE
    row: dict[str, Any] = {
        "designs": len(task),
        "failed": int(np.count_nonzero(~accurate & (verdict != Verdict.REJECTED))),
        "silently_wrong": int(np.isin(verdict, (*SILENTLY_WRONG, Verdict.INACCURATE)).sum()),
        "verdict": Verdict(int(verdict.max())).label,
        "outcomes": ", ".join(sorted({Outcome(int(code)).label for code in motion.outcome})),
        "evaluations": float(motion.evaluations.mean()),
        "iterations": float(motion.iterations.mean()),
        "cpu_seconds": _seconds_per_design(method, task),
    }
    for level, name in enumerate(_LEVELS[: case.turn.level]):
        row[f"{name}_error_max"] = _largest(judgement.max_error[level][accurate])
        row[f"{name}_error_rms"] = _largest(judgement.rms_error[level][accurate])
    if case.stroke is not None:
        stroke = case.stroke.part(chosen)
        motion = solve_screened(method, stroke)
        cv = coefficient_of_variation(motion.signals[case.row], case.weights[chosen])
        row["cv_error"] = _largest((np.abs(cv / case.cv[chosen] - 1.0))[accurate])
        row["cv_evaluations"] = float(motion.evaluations.mean())
        row["cv_cpu_seconds"] = _seconds_per_design(method, stroke)
    return row


def _choose_designs(method: Method, task: Task) -> npt.NDArray[np.intp]:
    """Indices of all designs, or of a few for a method that is not batched, ones that cannot turn first."""
    if Capability.BATCHED in method.capabilities:
        return np.arange(len(task))
    bad_first = np.argsort(geometric_outcome(task) == Outcome.OK, kind="stable")
    return np.sort(bad_first[:SERIAL_DESIGNS])


def _seconds_per_design(method: Method, task: Task) -> float:
    if Capability.BATCHED in method.capabilities and len(task) < BATCH_SIZE:
        task = task.part(np.arange(BATCH_SIZE) % len(task))
    return measure_cpu_seconds(lambda: method.solve(task)) / len(task)


def _largest(errors: FloatArray) -> float:
    return float(errors.max()) if len(errors) and not np.isnan(errors).all() else np.nan


def measure_level_costs(scene: Scene) -> dict[str, Any]:
    """Measure the CPU time per design of each level by the closed form.

    Keys scene, needs (the level that the question of the scene needs), the names of the levels (s), and
    full_cost_ratio: the cost of the highest level over that of the needed one.
    """
    designs = scene.designs.part(np.arange(max(BATCH_SIZE, len(scene.designs))) % len(scene.designs))
    first, span = whole_motion(designs.loop)
    angles = np.tile(first + np.linspace(0.0, span, ANGLE_COUNT), (len(designs), 1))
    close = partial(designs.loop.closed.close, designs.loop.columns(designs.parameters.T))
    seconds = {Level.GEOMETRY: measure_cpu_seconds(close) / len(designs)}
    for level in (Level.POSITIONS, Level.VELOCITIES, Level.ACCELERATIONS):
        run = partial(ClosedForm().solve, designs.task(angles, level))
        seconds[level] = measure_cpu_seconds(run) / len(designs)
    row: dict[str, Any] = {"scene": scene.name, "needs": scene.model.name.lower()}
    row |= {level.name.lower(): value for level, value in seconds.items()}
    row["full_cost_ratio"] = seconds[Level.ACCELERATIONS] / seconds[scene.model]
    return row


@dataclass(frozen=True)
class Standing:
    """Error and time of the closed form on a scene, against all other settings.

    `next_cost_ratio` is the time of the cheapest other setting that is at least as accurate over that of the closed
    form, infinite if there is none; `cheaper_settings` are at least as accurate and cost no more.
    """

    error: float
    seconds: float
    next_cost_ratio: float
    cheaper_settings: tuple[str, ...]


def ranking_error(row: Row) -> float:
    """Largest error of the velocities, or of the angles where the scene needs no more; NaN if the method failed."""
    name = "velocity_error_max" if "velocity_error_max" in row else "position_error_max"
    return math.nan if row["failed"] else float(row[name])


def fastest_settings(rows: Sequence[Row], goal: float) -> list[Row]:
    """The fastest setting of each method with an error up to the goal, fastest first, from the rows of a scene."""
    accurate = sorted((row for row in rows if ranking_error(row) <= goal), key=lambda row: row["cpu_seconds"])
    by_method: dict[str, Row] = {}
    for row in accurate:
        by_method.setdefault(row["method"], row)
    return list(by_method.values())


def closed_form_standing(rows: Sequence[Row]) -> Standing | None:
    """Compare the closed form with all other settings on a scene; None if no linkage of the scene has a motion."""
    own = next(row for row in rows if row["method"] == CLOSED_FORM)
    error, seconds = ranking_error(own), own["cpu_seconds"]
    if math.isnan(error):
        return None
    as_accurate = [row for row in rows if row is not own and ranking_error(row) <= max(error, ROUNDING_ERROR)]
    cheaper = tuple(row["setting"] for row in as_accurate if row["cpu_seconds"] <= seconds)
    cost_ratio = min((row["cpu_seconds"] / seconds for row in as_accurate), default=math.inf)
    return Standing(error, seconds, cost_ratio, cheaper)
