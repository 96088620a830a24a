"""Accuracy and failures of every method as designs approach a singular position, and over a turn."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import groupby
from operator import itemgetter
from typing import Any

import numpy as np

from explore.base.errors import RequestError
from explore.base.suggest import suggestion
from explore.comparison.methods.contract import Capability, Level, Method, Task, method_label
from explore.comparison.methods.four_bar_loop import FOUR_BAR
from explore.comparison.methods.registry import methods_for
from explore.comparison.methods.slider_crank_loop import SLIDER_CRANK
from explore.comparison.methods.variable_crank_loop import VARIABLE_CRANK, regular_position
from explore.comparison.methods.vector_loop import VectorLoop
from explore.comparison.slider_reference import exact_motion_of
from explore.comparison.verdicts import Verdict, judge, signal_errors
from explore.model.quantities import FloatArray

#: Exponents of the powers of two that are added to a link, 64 mm to 9e-13 mm in steps of nearly a decade.
_MARGIN_EXPONENTS = (*range(6, -41, -3),)
#: Exponents of the powers of two that are subtracted from a link, mm, so that the crank is blocked.
_GAP_EXPONENTS = (2, -8, -20, -32)
#: Crank, coupler, rocker and ground, mm, that add up exactly: all links are collinear at crank angle 0.
_CHANGE_POINT = (150.0, 1083.5, 541.75, 691.75)
#: Crank, rod and offset, mm, that add up exactly: both are perpendicular to the guide at 270 deg.
_SLIDER_CHANGE_POINT = (150.0, 200.0, 50.0)
#: Slicer: rod, mm; slider's speed, mm/s; 100 revolutions per minute, rad/s; reversal time, s; blend order.
_SLICER = (500.0, 800.0, 100.0 * np.pi / 30.0, 0.1, 2.0)
#: Distances of a crank angle from the singular one, deg.
_DISTANCES = (0.5, *(10.0**-k for k in range(1, 14)), 0.0)
#: Numbers of crank angles per turn, which are the steps of methods that go from one to the next.
STEP_COUNTS = (24, 72, 360)
#: Number of crank angles per turn for methods whose steps are their own.
DEFAULT_STEP_COUNT = 72
#: Number of the design of a case whose turn is traced: neither far from the singular position nor next to it.
TRACED_DESIGN = 4


@dataclass(frozen=True, eq=False)
class StabilityCase:
    """Designs at several distances from a singular position, and on the other side of it where no full turn exists.

    The margin descends, 0 or negative beyond the singular position; `distance` says what it is, `beyond` what is at 0
    and less. The anchor of each design is a crank angle, rad, of every task, and a turn begins before it at `first` at
    the earliest. The singular angles, rad, are of the design at margin 0.
    """

    loop: VectorLoop
    distance: str
    beyond: str
    margin: FloatArray
    parameters: FloatArray
    anchor: FloatArray
    first: float
    singular_angles: tuple[float, ...]
    has_orders: bool = False

    def task(self, steps: int, designs: slice = slice(None)) -> Task:
        """A turn of some of the designs in so many steps, to velocities."""
        step = 2.0 * np.pi / steps
        anchor = self.anchor[designs, None]
        before = np.floor((anchor - self.first) / step + 1e-9)
        angles = anchor + (np.arange(steps + 1) - before) * step
        return Task(self.parameters[designs], np.ones(len(angles)), angles, Level.VELOCITIES, loop=self.loop)


def _with_margins(
    loop: VectorLoop, lengths: tuple[float, ...], link: int, distance: str, toggle: float, *, has_orders: bool
) -> StabilityCase:
    """A case of links whose margin is added to one of them; the turn begins a quarter after a dead centre."""
    margins = np.array([*(2.0**k for k in _MARGIN_EXPONENTS), 0.0, *(-(2.0**k) for k in reversed(_GAP_EXPONENTS))])
    parameters = np.tile(lengths, (len(margins), 1))
    parameters[:, link] += margins
    quarter = 0.5 * np.pi
    return StabilityCase(
        loop, distance, "no full turn exists", margins / loop.size(parameters.T), parameters,
        np.full(len(margins), quarter), quarter, (toggle,), has_orders,
    )  # fmt: skip


def _four_bar() -> StabilityCase:
    distance = "Grashof margin over the longest link"
    return _with_margins(FOUR_BAR, _CHANGE_POINT, 3, distance, 2.0 * np.pi, has_orders=True)


def _slider_crank() -> StabilityCase:
    distance = "length of the rod beyond crank plus offset, over the rod"
    return _with_margins(SLIDER_CRANK, _SLIDER_CHANGE_POINT, 1, distance, 1.5 * np.pi, has_orders=False)


def _variable_crank() -> StabilityCase:
    parameters = np.tile(_SLICER, (len(_DISTANCES), 1))
    regular, _, _ = regular_position(parameters.T)
    return StabilityCase(
        VARIABLE_CRANK, "distance of a crank angle from the singular one, deg", "it is the singular angle",
        np.array(_DISTANCES), parameters, regular + np.deg2rad(_DISTANCES), 0.0,
        (float(regular[0]), float(2.0 * np.pi - regular[0])),
    )  # fmt: skip


_CASES: dict[str, Callable[[], StabilityCase]] = {
    "crank-rocker": _four_bar,
    "slider-crank": _slider_crank,
    "variable-crank": _variable_crank,
}


def stability_case(mechanism: str) -> StabilityCase:
    """The case of a mechanism; `RequestError` if there is none."""
    if mechanism not in _CASES:
        raise RequestError(f"no stability map of {mechanism!r}; {suggestion(mechanism, [*_CASES, 'gears'])}")
    return _CASES[mechanism]()


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
