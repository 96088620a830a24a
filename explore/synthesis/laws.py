"""Functions that linkages shall generate: a formula of x or a table, scaled to the angles of input and output."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from explore.base.errors import RequestError
from explore.evaluation.propagation import Bounded, propagate
from explore.model.expressions import FUNCTIONS, Expression
from explore.model.quantities import FloatArray
from explore.studies.request.formula_text import ANGULAR, parse_formula

#: Number of values of x at which a function is tested before it is used.
_N_TESTED = 401
#: Number of rounds that look for an extreme, each in 200 times finer steps.
_N_ROUNDS = 5
#: Factor by which an extreme among ever finer steps is at least above samples of a pole; 200 a round.
_POLE = 1e6
#: Range of an angle below which its sine is nearly a straight line, so that it may be meant in rad, deg.
_NARROW = 10.0


def chebyshev_points(first: float, last: float, count: int) -> FloatArray:
    """Precision points by Chebyshev's spacing, ascending from first to last, shape (count,).

    The zeros of the polynomial that deviates least from 0 (F. Freudenstein, Trans. ASME 77 (1955) 853-861).
    """
    angles = (2.0 * np.arange(count) + 1.0) * np.pi / (2.0 * count)
    return np.asarray((first + last) / 2.0 - (last - first) / 2.0 * np.cos(angles))


@dataclass(frozen=True)
class Law:
    """A function y of x, shape (n,), between two values of x, from the first of which the input turns to the last."""

    first: float
    last: float
    values: Callable[[FloatArray], FloatArray]

    def inputs(self, x: FloatArray, turn: float) -> FloatArray:
        """Angles that the input has turned at x, where it turns by `turn` in all, shape (n,)."""
        return np.asarray(turn * (x - self.first) / (self.last - self.first))

    def outputs(self, x: FloatArray, turn: float) -> FloatArray:
        """Angles that the output has turned at x, where it turns by `turn` from least to greatest value, (n,)."""
        return np.asarray(turn * (self.values(x) - self.values(self.even(_N_TESTED))[0]) / self.height)

    @property
    def height(self) -> float:
        """Distance of the greatest value from the least."""
        return self._extreme(1.0) - self._extreme(-1.0)

    def _extreme(self, sign: float) -> float:
        """The value that is greatest with a sign, of even steps and ever finer ones about the best of them."""
        x = self.even(_N_TESTED)
        for _ in range(_N_ROUNDS):
            best = int(np.nanargmax(sign * self.values(x)))
            x = np.linspace(x[max(best - 1, 0)], x[min(best + 1, len(x) - 1)], _N_TESTED)
        return float(sign * np.nanmax(sign * self.values(x)))

    def even(self, count: int) -> FloatArray:
        """Values of x at even steps, the ends included, shape (count,)."""
        return np.linspace(self.first, self.last, count)


def formula_law(text: str, first: float, last: float) -> Law:
    """The law of a formula of x; angles of sines and the like are in degrees, as in all formulas.

    Raises `RequestError` if it is no formula of x, or has no finite value, or but one, in the range.
    """
    formula = parse_formula(text)
    others = [name for name in formula.names if name != "x"]
    if others:
        raise RequestError(f"is a formula of x alone, got the name '{others[0]}'")
    if not formula.names:
        raise RequestError("does not depend on x")

    def values(x: FloatArray) -> FloatArray:
        return propagate(formula.expression, [Bounded.exact(np.asarray(x, dtype=np.float64))]).value

    return _tested(Law(first, last, values))


def remarks_on_angles(text: str | None, law: Law) -> list[str]:
    """Remark on a sine, cosine or tangent whose argument of a few degrees may be meant in radians."""
    steps = parse_formula(text).expression.steps if text is not None else ()
    remarks = []
    for position, (name, _) in enumerate(steps):
        argument = _argument(steps[:position])
        if name not in ANGULAR or not any(operation == "input" for operation, _ in argument):
            continue
        span = np.ptp(propagate(Expression("", argument), [Bounded.exact(law.even(_N_TESTED))]).value)
        if span < _NARROW:
            remarks.append(
                f"{name} takes degrees, and its argument has a range of {span:.4g} deg only from x = {law.first:g} to "
                f"{law.last:g}; for radians multiply it by 180 / pi, such as {name}(x * 180 / pi)"
            )
    return remarks


def _argument(steps: Sequence[tuple[str, float]]) -> tuple[tuple[str, float], ...]:
    """The last of these steps that make one value."""
    start, missing = len(steps), 1
    while missing and start:
        start -= 1
        operation = steps[start][0]
        takes_one = operation == "negate" or FUNCTIONS.get(operation, (2, 2))[1] == 1
        missing += -1 if operation in ("number", "input") else 0 if takes_one else 1
    return tuple(steps[start:])


def table_law(x: Sequence[float], y: Sequence[float]) -> Law:
    """The law through pairs, by the monotone cubic interpolation of Fritsch and Butland between them.

    Raises `RequestError` for fewer than three pairs, x that does not ascend or descend, or equal y.
    """
    from scipy.interpolate import PchipInterpolator

    places, values = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
    if len(places) < 3:
        raise RequestError(f"has {len(places)} pairs, but a function needs three or more")
    steps = np.diff(places)
    if not ((steps > 0.0).all() or (steps < 0.0).all()):
        raise RequestError("the values of x must ascend, or descend, from pair to pair")
    order = np.argsort(places)
    return _tested(Law(float(places[0]), float(places[-1]), PchipInterpolator(places[order], values[order])))


def _tested(law: Law) -> Law:
    """The law, if it has finite values that differ."""
    x = law.even(_N_TESTED)
    values = law.values(x)
    if not np.isfinite(values).all():
        raise RequestError(f"has no value at x = {x[~np.isfinite(values)][0]:g}; change the range")
    if np.ptp(values) <= 1e-12 * np.abs(values).max():
        raise RequestError("has one value over the whole range")
    if not law.height <= _POLE * np.ptp(values):
        raise RequestError("has a pole within the range; change the range")
    return law
