"""Where methods break: distance to the change point against setting, for each method."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import groupby
from operator import itemgetter
from typing import Any

import numpy as np

from explore.comparison import reference
from explore.comparison.verdicts import Verdict, judge
from explore.methods.contract import Capability, Level, Method, Task, label
from explore.methods.registry import METHODS
from explore.vocabulary import FloatArray

#: Dyadic lengths whose sums are exact: with no margin all links fall into one line at the crank angle 0.
CRANK, COUPLER, ROCKER, GROUND = 150.0, 1083.5, 541.75, 691.75
#: Crank angles a turn at which the motion is asked for: what methods that go from one to the next step by.
STEPS = (24, 72, 360)
USUAL_STEPS = 72
#: Exponents of two of the margins (mm), nearly decades: 64 mm to 9e-13 mm; and of the gaps of blocked cranks.
_MARGINS, _GAPS = (*range(6, -41, -3),), (2, -8, -20, -32)


@dataclass(frozen=True)
class Grid:
    """Designs by their distance from the change point: ground longer by the margin, shorter by a gap.

    Attributes
    ----------
    margin : (n,) array
        Grashof margin over the longest link, descending; negative where the crank is blocked.
    lengths : (n, 4) array
    """

    margin: FloatArray
    lengths: FloatArray


def grid() -> Grid:
    """Sixteen designs whose crank turns, the change point, and four whose crank is blocked."""
    margins = np.array([*(2.0**k for k in _MARGINS), 0.0, *(-(2.0**k) for k in reversed(_GAPS))])
    lengths = np.tile([CRANK, COUPLER, ROCKER, GROUND], (len(margins), 1))
    lengths[:, 3] += margins
    return Grid(margins / lengths.max(axis=1), lengths)


def map_stability(goal: float, progress: Callable[[str], None] | None = None) -> list[dict[str, Any]]:
    """The verdict on every method at every setting, number of angles and margin, a row each.

    Parameters
    ----------
    goal
        Errors of positions and velocities up to this are right, in the norms of `explore.comparison.verdicts`.
    progress
        Told the label of each method as its turn comes.
    """
    designs = grid()
    branch = np.ones(len(designs.lengths))
    rows: list[dict[str, Any]] = []
    for steps, methods in groupby(runs(), key=itemgetter(0)):
        angles = np.tile(0.5 * np.pi + np.linspace(0.0, 2.0 * np.pi, steps + 1), (len(branch), 1))
        task = Task(designs.lengths, branch, angles, Level.VELOCITIES)
        exact = reference.exact_motion(designs.lengths, branch, angles)
        for _, name, method in methods:
            if progress is not None:
                progress(label(method))
            found = {"method": name, "setting": label(method), "angles": steps}
            rows += [{**found, **row} for row in _judged(method, task, exact, designs.margin, goal)]
    return rows


def runs() -> list[tuple[int, str, Method]]:
    """Number of angles, name and method of every run: those that step from angle to angle at all numbers of them."""
    return [
        (steps, name, method)
        for steps in STEPS
        for name, settings in METHODS.items()
        for method in settings
        if steps == USUAL_STEPS or Capability.FOLLOWS_ANGLES in method.capabilities
    ]


def _judged(method: Method, task: Task, exact: FloatArray, margin: FloatArray, goal: float) -> list[dict[str, Any]]:
    motion = method.solve(task)
    judgement = judge(task, motion, exact, goal)
    return [
        {
            "margin": float(margin[i]),
            "verdict": Verdict(int(verdict)).label,
            "error": float(judgement.largest[:, i].max()),
            "evaluations": int(motion.evaluations[i]),
        }
        for i, verdict in enumerate(judgement.verdict)
    ]


def safe_margins(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """How near to the change point each method may be trusted: the smallest margin down to which all is right.

    NaN where it is not right even far away; `then` is the first verdict below.
    """
    table: dict[tuple[str, str, int], list[dict[str, Any]]] = {}
    for row in rows:
        table.setdefault((row["method"], row["setting"], row["angles"]), []).append(row)
    found = []
    for (method, setting, angles), line in table.items():
        turning = sorted((row for row in line if row["margin"] > 0.0), key=lambda row: -row["margin"])
        right = 0
        while right < len(turning) and turning[right]["verdict"] == Verdict.RIGHT.label:
            right += 1
        found.append({
            "method": method,
            "setting": setting,
            "angles": angles,
            "safe_down_to": turning[right - 1]["margin"] if right else float("nan"),
            "then": turning[right]["verdict"] if right < len(turning) else "",
            "worst": max((row["verdict"] for row in line), key=_severity),
        })  # fmt: skip
    return found


def _severity(words: str) -> int:
    return next(verdict.value for verdict in Verdict if verdict.label == words)
