"""The exact motion of loops in multiple precision (mpmath): Newton's iteration on all their equations at once.

It begins at the rounded closed form, from which it takes nothing but the assembly: a root of the equations is as exact
as the digits that it is computed with, and the sign of the determinant tells one assembly from the next where these are
as near to each other as the rounding.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

import numpy as np

from explore.comparison.methods.closed_form import ClosedForm, geometric_outcome
from explore.comparison.methods.contract import Level, Outcome, Task
from explore.comparison.methods.elimination import solve
from explore.comparison.methods.loop import Loop, whole_motion
from explore.mechanisms.linkages.coordinate import Coordinate
from explore.model.expressions import run
from explore.model.quantities import FloatArray

#: Number of digits, of which 30 cancel close to a change point.
_DIGITS = 70
#: Size of a correction after which positions have twice as many digits, rad or over the longest link.
_LAST_CORRECTION = 1e-30
#: Number of crank angles among which the largest determinant is looked for.
_ANGLES = 24
#: Largest number of corrections; beside a change point the first ones halve the distance only.
_MAX_CORRECTIONS = 60


@cache
def multiple_precision() -> Any:
    """A private mpmath context, so that the caller's precision does not change."""
    import mpmath  # imported here because it takes a tenth of a second and only a comparison needs it

    context = mpmath.MPContext()
    context.dps = _DIGITS
    return context


def exact_motion(task: Task) -> FloatArray:
    """The unknowns and both derivatives, (3 m, n, t), rounded once; NaN for a design without its whole motion.

    Parameters and crank angles are taken as exact.
    """
    signals = np.full((3 * task.loop.count, *task.crank_angle.shape), np.nan)
    for i in np.flatnonzero(geometric_outcome(task) == Outcome.OK):
        design = ExactDesign(task.loop, task.parameters[i])
        for j, values in enumerate(design.motions(task.crank_angle[i])):
            signals[:, i, j] = [float(value) for value in values]
    return signals


@dataclass(frozen=True)
class ExactDesign:
    """A design in numbers of multiple precision."""

    loop: Loop
    parameters: FloatArray

    @cached_property
    def _columns(self) -> Mapping[str, Any]:
        return self.loop.columns([multiple_precision().mpf(float(value)) for value in self.parameters])

    @cached_property
    def _numbers(self) -> list[list[Any]]:
        return self.loop.numbers(self._columns, _evaluate)

    @cached_property
    def _size(self) -> float:
        return float(self.loop.size(self.loop.columns(self.parameters)))

    def motions(self, angles: Sequence[Any]) -> list[list[Any]]:
        """The unknowns and both derivatives at crank angles."""
        rounded = np.array([[float(angle) for angle in angles]])
        task = Task(self.loop, self.parameters[None], rounded, Level.POSITIONS)
        starts = ClosedForm().solve(task).signals[:, 0].T
        return [
            self._motion(multiple_precision().mpf(angle), start) for angle, start in zip(angles, starts, strict=True)
        ]

    def motion(self, angle: Any) -> list[Any]:
        """The unknowns and both derivatives at a crank angle."""
        return self.motions([angle])[0]

    @cached_property
    def _sign(self) -> int:
        """Sign of the determinant where it is largest, over `Loop.side` there."""
        first, span = whole_motion(self.loop)
        angles = first + span * np.linspace(0.0, 1.0, _ANGLES)
        task = Task(self.loop, self.parameters[None], angles[None], Level.POSITIONS)
        about = self.loop.about(task.upright, task.crank_angle, ClosedForm().solve(task).signals)
        determinants = (solve(about.columns, about.gap)[1] + np.zeros((1, _ANGLES)))[0]
        largest = int(np.nanargmax(np.abs(determinants)))
        return int(np.sign(determinants[largest])) * self._side(multiple_precision().mpf(float(angles[largest])))

    def _side(self, angle: Any) -> int:
        return 1 if self.loop.side is None else int(self.loop.side(self._columns, angle, multiple_precision()))

    def _motion(self, angle: Any, start: FloatArray) -> list[Any]:
        mp, loop = multiple_precision(), self.loop
        given = loop.given(self._columns, angle, mp, _evaluate)
        unknowns, about = self._solve(angle, [mp.mpf(float(value)) for value in start], given)
        if solve(about.columns, about.gap)[1] * self._sign * self._side(angle) < 0:
            # beside a singular position the rounded start may be nearer to the other assembly
            unknowns, about = self._solve(angle, self._across(angle, unknowns, given), given)
        rates, _ = solve(about.columns, about.rate_terms(given))
        return [*unknowns, *rates, *solve(about.columns, about.acceleration_terms(rates, given))[0]]

    def _solve(self, angle: Any, unknowns: list[Any], given: Any) -> tuple[list[Any], Any]:
        """The unknowns by Newton's iteration, and the loops about them."""
        last = [_LAST_CORRECTION] * self.loop.n_angles + [_LAST_CORRECTION * self._size] * self.loop.n_lengths
        for _ in range(_MAX_CORRECTIONS):
            about = self._about(angle, unknowns, given)
            step, _ = solve(about.columns, about.gap)
            unknowns = [value - change for value, change in zip(unknowns, step, strict=True)]
            if not any(abs(change) > most for change, most in zip(step, last, strict=True)):  # small, or NaN
                return unknowns, self._about(angle, unknowns, given)
        return [multiple_precision().nan] * self.loop.count, about

    def _about(self, angle: Any, unknowns: list[Any], given: Any) -> Any:
        return self.loop.linearise(self._numbers, angle, unknowns, given, multiple_precision().expj)

    def _across(self, angle: Any, unknowns: list[Any], given: Any) -> list[Any]:
        """A start beside the other assembly: twice as far as where the determinant vanishes."""
        about = self._about(angle, unknowns, given)
        direction, determinant = solve(about.columns, [1] * len(about.gap))
        small = _LAST_CORRECTION * min(1, 1 / max(map(abs, direction)))

        def moved(by: Any) -> list[Any]:
            return [value + by * part for value, part in zip(unknowns, direction, strict=True)]

        beside = self._about(angle, moved(small), given)
        slope = (solve(beside.columns, beside.gap)[1] - determinant) / small
        return moved(-2 * determinant / slope)


def _evaluate(coordinate: Coordinate, columns: Mapping[str, Any]) -> Any:
    """A coordinate of a table in multiple precision."""
    mp = multiple_precision()
    degree = mp.pi / 180
    functions = {
        "negate": lambda x: -x, "sqrt": mp.sqrt, "abs": abs, "log": mp.log, "exp": mp.exp,
        "sin": lambda x: mp.sinpi(x / 180), "cos": lambda x: mp.cospi(x / 180), "tan": lambda x: mp.tan(x * degree),
        "+": lambda x, y: x + y, "-": lambda x, y: x - y, "*": lambda x, y: x * y, "/": lambda x, y: x / y,
        "**": mp.power, "min": min, "max": max, "hypot": mp.hypot, "atan2": lambda x, y: mp.atan2(x, y) / degree,
    }  # fmt: skip
    return run(
        coordinate.steps, mp.mpf, lambda place: columns[coordinate.names[place]],
        lambda operation, *values: functions[operation](*values),
    )  # fmt: skip
