"""Which method to take: the cheapest that was measured to meet a tolerance so near to the change point."""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

from explore.errors import RequestError
from explore.methods.closed_form import ClosedForm
from explore.methods.contract import Method, label
from explore.methods.registry import METHODS
from explore.suggest import suggestion

DEFAULT = "closed-form"


@dataclass(frozen=True)
class Guidance:
    """What a method was measured to be like, next to a margin: see ``benchmarks/guidance.py``.

    Attributes
    ----------
    setting
        Label of the method.
    margin
        Grashof margin over the longest link, at which it was measured.
    error
        Largest error of angles (rad), velocities and accelerations (relative to their peaks); infinite if it failed.
    cost
        CPU time per turn over that of the closed form.
    """

    setting: str
    margin: float
    error: float
    cost: float


@cache
def measured() -> tuple[Guidance, ...]:
    """All that was measured."""
    with files("explore").joinpath("data/guidance.csv").open(encoding="utf-8") as lines:
        return tuple(
            Guidance(row["setting"], float(row["margin"]), float(row["error"]), float(row["cost"]))
            for row in csv.DictReader(lines)
        )


def cheapest(margin: float, tolerance: float) -> tuple[Method, str]:
    """The cheapest method that meets a tolerance at a relative Grashof margin, and why it was chosen.

    What was measured at the next smaller margin counts, where every method is worse; the closed form where none was.
    """
    below = max((row.margin for row in measured() if row.margin <= margin), default=math.nan)
    good = sorted(
        (row for row in measured() if row.margin == below and row.error <= tolerance), key=lambda row: row.cost
    )
    if not good:
        nothing = "nothing was measured" if math.isnan(below) else f"no method was measured to meet {tolerance:g}"
        return ClosedForm(), f"{DEFAULT}: {nothing} at a relative margin of {margin:.2g}"
    first, others = good[0], good[1:]
    why = f"{first.setting}: measured error {first.error:.1e} at a relative margin of {below:.1g}"
    if others:
        why += f"; the next that meets it, {others[0].setting}, costs {others[0].cost / first.cost:.2g} times as much"
    return by_label(first.setting), why


def by_label(name: str) -> Method:
    """A method by its name, at its finest setting, or by name and setting as in ``rk45(rtol=0.001)``."""
    if METHODS.get(name):
        return METHODS[name][-1]
    if name in METHODS:
        raise RequestError(f"method {name!r} is not installed; pip install 'linkage-explore[peers]'")
    known = {label(method): method for settings in METHODS.values() for method in settings}
    if name not in known:
        raise RequestError(f"unknown method {name!r}; {suggestion(name, [*METHODS, *known])}")
    return known[name]
