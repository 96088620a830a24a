"""Slider-cranks whose coupler point passes points: the distances to the simulated path are minimised themselves.

The guide-offset method of `explore.synthesis.slider_paths` minimises a surrogate, which is not least where the path is
met best. Here the crank's angles at the points are unknown too, in the order of the points, and many starts are
improved. For given angles of crank and rod the point is linear in the pivot, the crank and the rod's point, as complex
numbers, so that a start needs only the range of the rod's angle and a first crank angle.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from explore.base.errors import RequestError
from explore.model.quantities import FloatArray
from explore.synthesis.linkages import ComplexArray, distinct
from explore.synthesis.slider_cranks import SliderCrank
from explore.synthesis.slider_path_fitting import (
    ACROSS,
    ALONG,
    LARGEST,
    LEAST,
    LOG_ROD,
    N_NUMBERS,
    PIVOT_X,
    PIVOT_Y,
    Fits,
    IntArray,
    Problem,
    fit,
)

#: Ranges of the rod's angle of starts, as shares of the largest pressure angle.
_RANGES = tuple((a, b) for a in (-0.95, -0.6, -0.2, 0.2, 0.6) for b in (-0.2, 0.2, 0.6, 0.95) if b - a > 0.3)
#: Number of first crank angles of starts.
_N_PHASES = 24
#: Amplitudes of how unevenly the crank turns along the path.
_AMPLITUDES = (0.0, 0.6)
#: Number of places where the crank turns fastest.
_N_PLACES = 4
#: Angles that the crank turns over an open path, rad.
_SPANS = tuple(np.radians([45.0, 90.0, 150.0, 240.0]).tolist())
#: Number of starts that are improved, the best of all.
_N_STARTS = 3000
#: Steps of each stage, and how many starts go on to the next.
_STAGES = ((6, 360), (25, 60), (200, 24), (1000, 12))
#: Number of steps from which on a stage is fine.
_FINE = 200
#: Number of points of the path that starts are fitted to.
_N_START_POINTS = 48
#: Relative difference of pivots and lengths up to which linkages are the same.
_SAME = 1e-3
#: Distance from the points up to which the pivot lies by default, in sizes of the path.
_BOX = 2.0
#: Least number of points of a path.
_LEAST_POINTS = 5
#: Largest number of points of a path.
_MOST_POINTS = 2000


@dataclass(frozen=True)
class SliderPathTask:
    """Points that the rod's point of a slider-crank shall pass, in order.

    Attributes
    ----------
    points
        Shape (n,), complex.
    is_closed
        Whether the path returns from the last point to the first.
    pressure_angle_max
        Of rod and guide, at most, rad.
    length_ratio_max
        The longest rod, and the farthest rod's point along and across the rod, over the size of the path, the larger
        side of its box.
    pivot_box
        Corners, lower left and upper right, of the box of the crank's pivot; None for the box of the points and twice
        their size around it. Optima often lie on its edge: solutions mean little without it.
    weights
        Of the squared distances, shape (n,); None for 1.
    """

    points: ComplexArray
    is_closed: bool = True
    pressure_angle_max: float = float(np.radians(50.0))
    length_ratio_max: float = 10.0
    pivot_box: tuple[complex, complex] | None = None
    weights: FloatArray | None = None

    @property
    def size(self) -> float:
        """The larger side of the box of the points."""
        return float(max(np.ptp(self.points.real), np.ptp(self.points.imag)))

    @property
    def box(self) -> tuple[complex, complex]:
        """The box of the crank's pivot."""
        if self.pivot_box is not None:
            return self.pivot_box
        x, y, margin = self.points.real, self.points.imag, _BOX * self.size
        return complex(x.min() - margin, y.min() - margin), complex(x.max() + margin, y.max() + margin)

    def check(self) -> None:
        """Raise `RequestError` if the points are too few, too many or at one place, or the box is empty."""
        n = len(self.points)
        if not _LEAST_POINTS <= n <= _MOST_POINTS:
            raise RequestError(f"a path for a slider-crank has from {_LEAST_POINTS} to {_MOST_POINTS} points, not {n}")
        if not np.isfinite(self.points).all():
            raise RequestError("the points of the path must be finite")
        if self.size == 0.0:
            raise RequestError("all points of the path are at one place")
        low, high = self.box
        if not (low.real <= high.real and low.imag <= high.imag):
            raise RequestError(f"the box of the pivot is empty: {low:g} to {high:g}")


@dataclass(frozen=True)
class SliderPath:
    """A slider-crank for a path.

    Its crank's angles in the plane at the points, rad, in one sense of rotation; weighted root mean square, and
    largest, distance of the points to where the rod's point is at these; the box of the crank's pivot, and whether the
    pivot lies on its edge: a larger box may hold a better solution.
    """

    linkage: SliderCrank
    angles: FloatArray
    error_rms: float
    error_max: float
    box: tuple[complex, complex]
    is_on_edge: bool


def find_slider_paths(task: SliderPathTask) -> list[SliderPath]:
    """Slider-cranks with the least root mean square distances that were found, each a local optimum, best first.

    Raises `RequestError` if the points are too few, too many or at one place, or the box of the pivot is empty.
    """
    task.check()
    middle = complex(np.mean(task.points))
    points = (task.points - middle) / task.size
    weights = np.ones(len(points)) if task.weights is None else np.asarray(task.weights, dtype=np.float64)
    found: list[SliderPath] = []
    for sense in (1, -1):
        # Against the sense of the crank: the mirror image, whose crank turns the other way.
        image = points if sense == 1 else points.conj()
        starts = _starts(image, task)
        lower, upper = _bounds(task, middle, sense)
        shape = len(starts.errors), 1
        problem = Problem(np.tile(image, shape), weights, np.tile(lower, shape), np.tile(upper, shape))
        found += [_solution(task, middle, sense, *row) for row in _improve(problem, starts)]
    return distinct_paths(found)


def _bounds(task: SliderPathTask, middle: complex, sense: int) -> tuple[FloatArray, FloatArray]:
    """Bounds of the numbers in units of the path's size about its middle."""
    low, high = ((corner - middle) / task.size for corner in task.box)
    if sense == -1:
        low, high = complex(low.real, -high.imag), complex(high.real, -low.imag)
    lower, upper = np.full(N_NUMBERS, -np.inf), np.full(N_NUMBERS, np.inf)
    lower[PIVOT_X], lower[PIVOT_Y], upper[PIVOT_X], upper[PIVOT_Y] = low.real, low.imag, high.real, high.imag
    lower[LOG_ROD], upper[LOG_ROD] = -np.log(1e3), np.log(task.length_ratio_max)
    lower[[LEAST, LARGEST]], upper[[LEAST, LARGEST]] = -task.pressure_angle_max, task.pressure_angle_max
    lower[[ALONG, ACROSS]], upper[[ALONG, ACROSS]] = -task.length_ratio_max, task.length_ratio_max
    return lower, upper


def _starts(points: ComplexArray, task: SliderPathTask) -> Fits:
    """Starts with the crank angles of the points by the length of the path, evenly and not."""
    places = _places(points, is_closed=task.is_closed)
    phases = np.arange(_N_PHASES) * (2.0 * np.pi / _N_PHASES)
    shapes = []
    for span in (2.0 * np.pi,) if task.is_closed else _SPANS:
        for amplitude in _AMPLITUDES:
            for at in np.arange(_N_PLACES if amplitude else 1) * (2.0 * np.pi / _N_PLACES):
                turn = span * places
                shapes.append(turn + amplitude * (np.sin(turn - at) + np.sin(at)))
    angles = (np.array(shapes)[:, None] + phases[:, None]).reshape(-1, len(points))
    some = np.unique(np.linspace(0, len(points) - 1, _N_START_POINTS).astype(np.int64))
    pieces = [_fitted(points, angles, some, *task.pressure_angle_max * np.array(ends)) for ends in _RANGES]
    found = Fits.joined(pieces)
    return found.rows(np.argsort(found.errors, kind="stable")[:_N_STARTS])


def _places(points: ComplexArray, *, is_closed: bool) -> FloatArray:
    """Places of the points along their polygon, as shares of its length."""
    chords = np.abs(np.diff(np.append(points, points[0])))
    lengths = np.concatenate([[0.0], np.cumsum(chords)])
    return np.asarray(lengths[:-1] / lengths[-1 if is_closed else -2])


def _fitted(points: ComplexArray, angles: FloatArray, some: IntArray, least: float, largest: float) -> Fits:
    """The slider-cranks with a range of the rod's angle that fit best at given crank angles: linear least squares."""
    offset, crank = 0.5 * (np.sin(largest) + np.sin(least)), 0.5 * (np.sin(largest) - np.sin(least))
    own = angles[:, some]
    sine = offset - crank * np.sin(own)
    matrix = np.stack([np.ones_like(own, dtype=np.complex128), np.exp(1j * own), np.exp(1j * np.arcsin(sine))], axis=2)
    solved = np.linalg.pinv(matrix, rcond=1e-6) @ points[some]
    errors = (np.abs((matrix @ solved[:, :, None])[..., 0] - points[some]) ** 2).mean(axis=1)
    pivot, arm, point = solved.T
    direction = np.angle(arm)
    point = point * np.exp(-1j * direction)
    ones = np.ones_like(direction)
    with np.errstate(divide="ignore"):
        rod = np.log(np.abs(arm) / crank)
    numbers = [pivot.real, pivot.imag, direction, rod, least * ones, largest * ones, point.real, point.imag]
    return Fits(np.column_stack(numbers), angles, errors)


def _improve(problem: Problem, starts: Fits) -> list[tuple[FloatArray, FloatArray]]:
    """Numbers and angles of starts, improved in stages; the best of each go on to the next."""
    found = starts
    for most_steps, count in _STAGES:
        found = fit(problem, found, most_steps, 1e-7 if most_steps < _FINE else 1e-11)
        best = np.argsort(found.errors, kind="stable")[:count]
        found, problem = found.rows(best), problem.rows(best)
    return list(zip(found.numbers, found.angles, strict=True))


def _solution(task: SliderPathTask, middle: complex, sense: int, numbers: FloatArray, angles: FloatArray) -> SliderPath:
    """The slider-crank of numbers in units of the path about its middle, and its errors."""
    low, high = task.box
    x, y, direction, log_rod, least, largest, along, across = numbers.tolist()
    rod = math.exp(log_rod)
    high_sine, low_sine, size = math.sin(largest), math.sin(least), task.size
    offset, crank = 0.5 * (high_sine + low_sine) * rod, 0.5 * (high_sine - low_sine) * rod
    linkage = SliderCrank(
        complex(x, y) * size, crank * size, rod * size, offset * size, direction, complex(along, across) / rod
    )
    turned = angles + direction
    if sense == -1:
        linkage, turned = linkage.mirrored(), -turned
    pivot = linkage.crank_pivot + middle
    linkage = replace(linkage, crank_pivot=pivot, direction=math.remainder(linkage.direction, 2.0 * math.pi))
    distances = np.abs(linkage.points(turned) - task.points)
    weights = np.ones(len(distances)) if task.weights is None else task.weights
    rms = float(np.sqrt((weights * distances**2).sum() / weights.sum()))
    edges = (pivot.real - low.real, high.real - pivot.real, pivot.imag - low.imag, high.imag - pivot.imag)
    return SliderPath(linkage, turned, rms, float(distances.max()), task.box, min(edges) <= 1e-9 * size)


def distinct_paths(found: Sequence[SliderPath]) -> list[SliderPath]:
    """Solutions that differ, best first."""

    def are_same(first: SliderPath, second: SliderPath) -> bool:
        one, other = first.linkage, second.linkage
        apart = max(abs(one.crank_pivot - other.crank_pivot), abs(one.crank - other.crank), abs(one.rod - other.rod))
        return apart <= _SAME * (one.crank + one.rod)

    return distinct(sorted(found, key=lambda each: each.error_rms), are_same)
