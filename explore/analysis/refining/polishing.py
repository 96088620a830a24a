"""Polish one design: the best value of one objective that a local search reaches within the constraints."""

from typing import Any

import numpy as np
import numpy.typing as npt

from explore.analysis.refining.bundle import Evaluate, descend
from explore.model.quantities import FloatArray

#: Half the distance of two positions whose difference gives a derivative.
_STEP = 1e-7
#: Ratio of the differences on both sides from which on the metric jumps.
_JUMP = 2.0
#: Slope of what stands for undefined values, over the largest of defined ones: it leads back to the best position.
_WAY_BACK = 5.0
#: Distance up to which a border, beyond which designs have no motion, is beside a position.
_BESIDE = 1e-4
#: Distance below which that of a border is measured from a position as far inside.
_NEAR = 1e-6
#: Number of halvings of that distance, which is then exact to its rounding.
_HALVINGS = 50
#: Number of positions on the way to where a search ended.
_PLACES = 64
# Not more, because a derivative next to a jump would be that of the jump.
#: Number of divisions of that way beside the first infeasible position; the last part is 4e-6 of the way.
_DIVISIONS = 3
#: Distances inside the constraints that the search keeps, of a step of 1: more if less ends outside by rounding.
_INSIDE = (1e-10, 1e-8, 1e-6)
#: Largest number of searches, each from where the one before ended.
_MOST_SEARCHES = 8
#: Number of positions without a better one after which a search ends.
_MOST_FRUITLESS = 60


class _FruitlessError(Exception):
    """A search has found nothing better for long."""


def polish(evaluate: Evaluate, position: FloatArray) -> FloatArray:
    """The best position of local searches from a feasible one; each coordinate is 0 … 1.

    SciPy's sequential quadratic programming leads there, again and again where undefined positions or jumps are in its
    way, then a bundle method along kinks. `evaluate` takes several positions at once.
    """
    best, normals = position, dict[bytes, FloatArray]()
    for inside in _INSIDE:
        for _ in range(_MOST_SEARCHES):
            local = _Local(evaluate, best, inside, normals)
            local.approach(_search(local, best))
            if np.array_equal(local.best, best):
                break
            best = local.best
    return descend(evaluate, best)


class _Local:
    """Value, margins and their derivatives at a `place`, scaled, from its neighbours; the `best` position so far."""

    def __init__(
        self, evaluate: Evaluate, position: FloatArray, inside: float, normals: dict[bytes, FloatArray]
    ) -> None:
        self._evaluate, self._inside, self._normals = evaluate, inside, normals
        self.best, self._least = position, float(evaluate(position[None])[0][0])
        self.place, self._fruitless = np.full_like(position, np.nan), 0
        self.value, self.margins, self.slope = self._least, np.zeros(0), np.zeros(0)
        self.margin_slopes: FloatArray = np.zeros((0, len(position)))
        self._move(position)
        self._scale = max(abs(self.value), float(np.abs(self.slope).max()), np.finfo(float).tiny)
        steepest = np.abs(self.margin_slopes).max(axis=1)
        self._margin_scales = np.where(steepest > 0.0, steepest, 1.0)
        normal = self._border_normal(position)
        size = max(float(np.abs(normal).max()), 1.0)
        if size > 1.0 / _NEAR:  # a distance of a few roundings tells no direction: measure it from farther inside
            position = np.clip(position - _NEAR * normal / size, 0.0, 1.0)
            normal = self._border_normal(position)
            size = max(float(np.abs(normal).max()), 1.0)
        self._start, self._normal, self._distance = position, normal / size, 1.0 / size

    def _border_normal(self, position: FloatArray) -> FloatArray:
        """`_border_normal`, once for each position: searches that differ in what they keep begin at the same one."""
        key = position.tobytes()
        if key not in self._normals:
            self._normals[key] = _border_normal(self._evaluate, position)
        return self._normals[key]

    @property
    def _way_back(self) -> FloatArray:
        """Slope of the distance from the best position where the value is undefined; else 0."""
        step = self.place - self.best
        if np.isfinite(self.value) or not step.any():
            return np.zeros(len(step))
        return np.asarray(_WAY_BACK / np.linalg.norm(step) * step)

    def value_at(self, position: FloatArray) -> float:
        self._move(position)
        value = self.value if np.isfinite(self.value) else self._least
        return value / self._scale + float(self._way_back @ (self.place - self.best))

    def slope_at(self, position: FloatArray) -> FloatArray:
        self._move(position)
        if np.isfinite(self.value):
            return np.asarray(np.nan_to_num(self.slope / self._scale))
        return self._way_back

    def margins_at(self, position: FloatArray) -> FloatArray:
        """The margins, scaled, and the distance from a border that was beside the start, less what the search keeps."""
        self._move(position)
        margins = np.nan_to_num(self.margins / self._margin_scales, nan=-1.0)
        return np.append(margins, self._distance - self._normal @ (position - self._start)) - self._inside

    def margin_slopes_at(self, position: FloatArray) -> FloatArray:
        self._move(position)
        slopes = np.nan_to_num(self.margin_slopes / self._margin_scales[:, None])
        return np.vstack([slopes, -self._normal])

    def _move(self, position: FloatArray) -> None:
        """Evaluate a position and its neighbours, unless they were evaluated last."""
        position = np.clip(position, 0.0, 1.0)
        if np.array_equal(position, self.place):
            return
        self._fruitless += 1
        if self._fruitless > _MOST_FRUITLESS:
            raise _FruitlessError
        self.place, d = position, len(position)
        steps = _STEP * np.eye(d)
        positions = np.concatenate(
            [position[None], np.clip(position + steps, 0.0, 1.0), np.clip(position - steps, 0.0, 1.0)]
        )
        values, margins = self._evaluate(positions)
        self.value, self.margins = float(values[0]), margins[0]
        lengths = np.abs(positions[1:] - position).max(axis=1)
        both = np.column_stack([values, margins])
        slopes = _slopes(both, lengths[:d, None], lengths[d:, None]).T
        self.slope, self.margin_slopes = slopes[0], slopes[1:]
        self._keep(positions, values, margins)

    def approach(self, end: FloatArray) -> None:
        """Look at the way from the best position to where a search ended, closer beside the first infeasible one.

        A search steps across a border beyond which margins or values jump or are undefined, and stays there.
        """
        start, end = self.best, np.clip(end, 0.0, 1.0)
        for _ in range(_DIVISIONS):
            positions = start + np.linspace(0.0, 1.0, _PLACES)[:, None] * (end - start)
            is_feasible = self._keep(positions, *self._evaluate(positions))
            if is_feasible[1:].all():
                return
            first = 1 + int(is_feasible[1:].argmin())
            start, end = positions[first - 1], positions[first]

    def _keep(self, positions: FloatArray, values: FloatArray, margins: FloatArray) -> npt.NDArray[np.bool_]:
        """Keep the best of some positions if it is better than the best so far; which are feasible, (n,)."""
        is_feasible = (margins >= 0.0).all(axis=1) & np.isfinite(values)
        better = np.flatnonzero(is_feasible & (values < self._least))
        if len(better):
            row = better[values[better].argmin()]
            self.best, self._least, self._fruitless = positions[row], float(values[row]), 0
        return np.asarray(is_feasible)


def _border_normal(evaluate: Evaluate, position: FloatArray) -> FloatArray:
    """Normal n of a border beside a position, (d,): steps to positions with values have n · step < 1; 0 without one.

    It follows from the distances of the border in both directions of each coordinate.
    """
    d = len(position)
    directions = np.concatenate([np.eye(d), -np.eye(d)])

    def exists(directions: FloatArray, distances: FloatArray) -> npt.NDArray[np.bool_]:
        values, margins = evaluate(np.clip(position + distances[:, None] * directions, 0.0, 1.0))
        return np.asarray(np.isfinite(values) & np.isfinite(margins).all(axis=1))

    inside, outside = np.zeros(2 * d), np.full(2 * d, _BESIDE)
    has_border = ~exists(directions, outside)
    inside, outside, directions = inside[has_border], outside[has_border], directions[has_border]
    for _ in range(_HALVINGS if len(outside) else 0):
        middle = 0.5 * (inside + outside)
        is_inside = exists(directions, middle)
        inside, outside = np.where(is_inside, middle, inside), np.where(is_inside, outside, middle)
    normal = np.zeros(2 * d)
    normal[has_border] = 1.0 / outside
    return np.asarray(normal[:d] - normal[d:])


def _slopes(values: FloatArray, above: FloatArray, below: FloatArray) -> FloatArray:
    """Derivatives by each coordinate, shape (d, k), from values at a position, above it and below it in each.

    They are central differences; where the values jump next to the position, as at the change of the slower stroke, the
    difference on the side without the jump, which is much the smaller.
    """
    d = len(above)
    with np.errstate(divide="ignore", invalid="ignore"):
        rising, falling = (values[1 : d + 1] - values[0]) / above, (values[0] - values[d + 1 :]) / below
        central = (values[1 : d + 1] - values[d + 1 :]) / (above + below)
    rising, falling = np.where(np.isfinite(rising), rising, falling), np.where(np.isfinite(falling), falling, rising)
    jumps = np.maximum(np.abs(rising), np.abs(falling)) > _JUMP * np.minimum(np.abs(rising), np.abs(falling))
    smaller = np.where(np.abs(rising) < np.abs(falling), rising, falling)
    return np.asarray(np.where(jumps | ~np.isfinite(central), smaller, central))


def _search(local: _Local, start: FloatArray) -> FloatArray:
    """Move `local` from the start to a minimum, and give the position where the search ends."""
    from scipy.optimize import minimize

    constraint: dict[str, Any] = {"type": "ineq", "fun": local.margins_at, "jac": local.margin_slopes_at}
    arguments: dict[str, Any] = {
        "jac": local.slope_at,
        "bounds": [(0.0, 1.0)] * len(start),
        "constraints": [constraint],
        "options": {"ftol": 1e-15, "maxiter": 300},
    }
    try:
        return np.asarray(minimize(local.value_at, start, method="SLSQP", **arguments).x)
    except _FruitlessError:
        return local.place
