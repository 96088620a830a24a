"""Accuracy and failures of every method as designs approach a singular position, and over a turn."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np

from explore.base.errors import RequestError
from explore.base.suggest import suggestion
from explore.comparison import random_starts
from explore.comparison.limits import designs_towards, find_limit
from explore.comparison.methods.closed_form import ClosedForm, geometric_outcome
from explore.comparison.methods.contract import Capability, Level, Method, Outcome, Task, method_label
from explore.comparison.methods.elimination import solve
from explore.comparison.methods.loop import Loop, whole_motion
from explore.comparison.methods.loops import find_loop
from explore.comparison.methods.registry import methods_for
from explore.comparison.reference import exact_motion
from explore.comparison.scenes import load_scene
from explore.comparison.verdicts import Verdict, judge, signal_errors
from explore.mechanisms.loops import LoopDeclaration
from explore.mechanisms.registry import MECHANISMS
from explore.model.mechanism import Mechanism
from explore.model.quantities import FloatArray

#: Distances of a crank angle from the singular one, deg.
_DISTANCES = (0.5, *(10.0**-k for k in range(1, 14)), 0.0)
#: Numbers of crank angles per turn, which are the steps of methods that go from one to the next.
STEP_COUNTS = (24, 72, 360)
#: Number of crank angles per turn for methods whose steps are their own.
DEFAULT_STEP_COUNT = 72
#: Number of searches for the singular angle, each over four steps of the one before.
_ZOOMS = 12
#: Number of crank angles of each.
_ZOOM_ANGLES = 361
#: Number of the design of a case whose turn is traced: neither far from the singular position nor next to it.
TRACED_DESIGN = 4


@dataclass(frozen=True, eq=False)
class StabilityCase:
    """Designs at several distances from a singular position, and on the other side of it where no motion exists.

    The margin descends, 0 or negative beyond the singular position; `distance` says what it is, `beyond` what is at 0
    and less. The anchor of each design is a crank angle, rad, of every task, which reaches from `first` at the earliest
    over `span`. The singular angles, rad, are of the design at margin 0. Orders of convergence are measured on
    `smooth`.
    """

    loop: Loop
    distance: str
    beyond: str
    margin: FloatArray
    parameters: FloatArray
    anchor: FloatArray
    first: float
    span: float
    singular_angles: tuple[float, ...]
    smooth: FloatArray | None = None

    def task(self, steps: int, designs: slice = slice(None)) -> Task:
        """The motion of some of the designs in so many steps per turn, to velocities."""
        count = max(round(steps * self.span / (2.0 * np.pi)), 2)
        anchor, step = self.anchor[designs, None], self.span / count
        before = np.floor((anchor - self.first) / step + 1e-9)
        angles = anchor + (np.arange(count + 1) - before) / count * self.span
        return Task(self.loop, self.parameters[designs], angles, Level.VELOCITIES)

    @cached_property
    def finest(self) -> FloatArray:
        """The exact motion of the task of most steps."""
        return exact_motion(self.task(STEP_COUNTS[-1]))

    def exact(self, steps: int) -> FloatArray:
        """The exact motion of the task of so many steps, which may be among the most."""
        angles, finest = self.task(steps).crank_angle, self.task(STEP_COUNTS[-1]).crank_angle
        every = (finest.shape[1] - 1) // (angles.shape[1] - 1)
        if finest[:, ::every].shape == angles.shape and np.array_equal(finest[:, ::every], angles):
            return self.finest[:, :, ::every]
        return exact_motion(self.task(steps))


def declared_case(name: str) -> StabilityCase:
    """The case of a mechanism of this name; `RequestError` if there is none."""
    declared = [each.name for each in MECHANISMS.load_all()[0].values() if each.loop is not None]
    if name not in declared:
        hint = suggestion(name, [*declared, random_starts.MECHANISM])
        raise RequestError(f"no stability map of {name!r}; a study of a linkage is a .toml file; {hint}")
    return stability_case(MECHANISMS[name])


def study_case(path: Path) -> StabilityCase:
    """The case of a study's mechanism, about the first of a few of its designs that has a motion."""
    designs = load_scene(path).designs
    moves = geometric_outcome(designs.task(np.zeros((len(designs), 1)))) == Outcome.OK
    if not moves.any():
        raise RequestError(f"{path}: none of {len(designs)} designs has a full motion; change the ranges of parameters")
    first = designs.part(np.flatnonzero(moves)[:1])
    return stability_case(designs.mechanism, dict(zip(designs.loop.parameters, first.parameters[0], strict=True)))


def stability_case(mechanism: Mechanism, design: dict[str, float] | None = None) -> StabilityCase:
    """The case of a mechanism about a design, by default the declared one; `RequestError` if there is none."""
    loop, declared = find_loop(mechanism), mechanism.loop
    if declared is not None and declared.singular_angle is not None:
        return _angle_case(loop, declared, design or declared.design)
    if design is None:
        design = {**dict.fromkeys(loop.parameters, 1.0), **declared.design}
    limited = declared.limited if declared is not None else ""
    limit = find_limit(loop, np.array([design[name] for name in loop.parameters]), limited)
    unit = mechanism.parameter(limit.name).unit
    margin, parameters = designs_towards(loop, limit, is_length=unit == "mm")
    first, span = whole_motion(loop)
    singular = _singular_angle(loop, parameters[margin > 0.0][-1], first, span)
    if loop.table.limits is None:
        first = singular - 1.5 * np.pi  # the motion begins a quarter after the singular angle
    smooth = None
    if declared is not None and declared.smooth:
        smooth = np.array([declared.smooth.get(name, 1.0) for name in loop.parameters])
    value = f"{limit.value:g} {'' if unit == '1' else unit}".rstrip()
    return StabilityCase(
        loop, f"distance of {limit.name} from {value}, over {'the longest link' if unit == 'mm' else 'that value'}",
        "no full motion exists", margin, parameters, np.full(len(margin), first), first, span, (singular,), smooth,
    )  # fmt: skip


def _singular_angle(loop: Loop, parameters: FloatArray, first: float, span: float) -> float:
    """The crank angle of the least determinant, found in ever smaller steps."""
    centre, width = first + 0.5 * span, span
    for _ in range(_ZOOMS):
        angles = centre + width * np.linspace(-0.5, 0.5, _ZOOM_ANGLES)
        if loop.table.limits is not None:
            angles = np.clip(angles, first, first + span)
        task = Task(loop, parameters[None], angles[None], Level.POSITIONS)
        about = loop.about(task.upright, task.crank_angle, ClosedForm().solve(task).signals)
        centre = float(angles[np.nanargmin(np.abs(solve(about.columns, about.gap)[1])[0])])
        width *= 4.0 / _ZOOM_ANGLES
    return centre


def _angle_case(loop: Loop, declared: LoopDeclaration, design: Any) -> StabilityCase:
    """The case of a singular position that is passed in each turn: crank angles ever nearer to it."""
    singular = float(declared.singular_angle(design, np))  # type: ignore[misc]  # it is there
    distances = np.array(_DISTANCES)
    parameters = np.tile([design[name] for name in loop.parameters], (len(distances), 1))
    return StabilityCase(
        loop, "distance of a crank angle from the singular one, deg", "it is the singular angle", distances, parameters,
        singular + np.deg2rad(distances), 0.0, 2.0 * np.pi, (singular, 2.0 * np.pi - singular),
    )  # fmt: skip


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
        exact = case.exact(steps)
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
    task = case.task(STEP_COUNTS[-1], slice(TRACED_DESIGN, TRACED_DESIGN + 1))
    exact, angles = exact_motion(task), np.rad2deg(task.crank_angle[0])
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
            "worst_verdict": max((row["verdict"] for row in line), key=[each.label for each in Verdict].index),
        })  # fmt: skip
    return margins
