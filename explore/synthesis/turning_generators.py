"""Four-bar function generators whose crank turns fully, with free initial angles: least true error of the output.

The numbers are the logarithm of rocker over coupler, the transmission angles with crank and ground in line one way and
the other, which give crank and ground by two triangles, and the initial angle of the crank; that of the rocker follows
from the mean of the errors. So every choice is a linkage whose crank turns, and a bound on the transmission angle over
the turn is one on two numbers.
"""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from explore.base.errors import RequestError
from explore.model.quantities import FloatArray
from explore.synthesis.columns import Columns
from explore.synthesis.functions import FourBarGenerator, wrapped
from explore.synthesis.levenberg_marquardt import Kept, Rows, Stepped, gauss_newton, improve
from explore.synthesis.linkages import distinct

LOG_RATIO, LEAST, LARGEST, START = range(4)
_N_NUMBERS = 4
#: Number of shapes that are tried, by Sobol's sequence.
_N_SHAPES = 1024
#: Number of first crank angles of each shape.
_N_ANGLES = 36
#: Number of values of the function that shapes are compared at.
_N_VALUES = 24
#: Number of starts that are improved of each of the four kinds of linkage, and of their steps.
_COARSE = (32, 15)
#: Number of starts that are improved of all kinds, and of their steps.
_FINE = (40, 200)
#: Step of the differences, rad.
_STEP = 1e-7
#: Angle by which bounds are kept, rad.
_WITHIN = 1e-9
#: Relative gain of a step that counts as little.
_GAIN = 1e-12
#: Mean squared error at which a function is met, rad^2.
_MET = 1e-20
#: Weight of a missed bound on the ratio of links.
_WEIGHT = 100.0
#: Share by which the search stays within the bound on the ratio of links.
_INSIDE = 1e-3
#: Number that keeps quotients finite.
_TINY = 1e-12
#: Difference of numbers up to which linkages are the same.
_SAME = 1e-3


@dataclass(frozen=True)
class FunctionTask:
    """A function between two angles, each counted from an initial angle that is free.

    A table of the angles that crank and rocker turn from there, rad, (n,); the least angle between coupler and rocker,
    or its supplement, over the range, rad; the largest ratio of the longest to the shortest link.
    """

    inputs: FloatArray
    outputs: FloatArray
    transmission_angle_min: float = 0.0
    link_ratio_max: float = np.inf


@dataclass(frozen=True)
class FoundGenerator:
    """A generator, its initial angles from the line of the pivots, and its errors at the pairs of the task, rad."""

    generator: FourBarGenerator
    input_start: float
    output_start: float
    error_rms: float
    error_max: float


@dataclass(frozen=True)
class _Batch(Columns):
    """Linkages: their numbers, shape (n, 4), branches, and whether the ground is longer than the crank, each (n,)."""

    numbers: FloatArray
    branches: FloatArray
    is_ground_longer: npt.NDArray[np.bool_]

    def lengths(self) -> FloatArray:
        """Crank, coupler and rocker with a ground of 1, shape (3, n)."""
        log_ratio, least, largest, _ = self.numbers.T
        ratio = np.exp(log_ratio)
        short, long = (np.sqrt(1.0 + ratio**2 - 2.0 * ratio * np.cos(angle)) for angle in (least, largest))
        larger, smaller = 0.5 * (long + short), 0.5 * np.abs(long - short) + _TINY
        crank, ground = (np.where(self.is_ground_longer == k, smaller, larger) for k in (True, False))
        return np.array([crank / ground, 1.0 / ground, ratio / ground])

    def outputs(self, turned: FloatArray) -> FloatArray:
        """Angles of the rocker, rad, where the crank has turned so far from its first angle, shape (n, k)."""
        crank, coupler, rocker = (each[:, None] for each in self.lengths())
        diagonal = 1.0 - crank * np.exp(1j * (self.numbers[:, START, None] + turned))
        square = np.abs(diagonal) ** 2
        cosine = (rocker**2 + square - coupler**2) / (2.0 * rocker * np.sqrt(square))
        return np.asarray(np.angle(-diagonal) + self.branches[:, None] * np.arccos(np.clip(cosine, -1.0, 1.0)))


def find_turning_generators(task: FunctionTask) -> list[FoundGenerator]:
    """Generators of least mean square error whose crank turns, each a local optimum, best first.

    Raises `RequestError` if none within the bound on the ratio of links was found.
    """
    some = np.unique(np.linspace(0, len(task.inputs) - 1, _N_VALUES).astype(np.int64))
    coarse = replace(task, inputs=task.inputs[some], outputs=task.outputs[some])
    starts = [_starts(coarse, branch, is_longer) for branch in (1.0, -1.0) for is_longer in (True, False)]
    batch = _Batch.joined(starts)
    batch, costs = _fit(coarse, batch, _COARSE[1])
    batch, costs = _fit(task, batch.rows(np.argsort(costs, kind="stable")[: _FINE[0]]), _FINE[1])
    candidates = (_found(task, batch.rows(np.array([row]))) for row in np.argsort(costs, kind="stable"))
    found = distinct((each for each in candidates if each is not None), is_same)
    if not found:
        raise RequestError(f"no four-bar whose crank turns has links within a ratio of {task.link_ratio_max:g}")
    return sorted(found, key=lambda each: each.error_rms)


def _bounds(task: FunctionTask) -> tuple[FloatArray, FloatArray]:
    angle, ratio = task.transmission_angle_min + _WITHIN, np.log(min(task.link_ratio_max, 1e3))
    least = max(angle, 1e-3)
    return np.array([-ratio, least, least, -np.inf]), np.array([ratio, np.pi - least, np.pi - least, np.inf])


def _starts(task: FunctionTask, branch: float, is_longer: bool) -> _Batch:
    """The best of many shapes of a kind, with the best first angle of each."""
    from scipy.stats.qmc import Sobol

    lower, upper = (each[:START] for each in _bounds(task))
    numbers = np.zeros((_N_SHAPES, _N_NUMBERS))
    numbers[:, :START] = lower + (upper - lower) * Sobol(START, seed=0).random(_N_SHAPES)
    numbers[:, [LEAST, LARGEST]] = np.sort(numbers[:, [LEAST, LARGEST]], axis=1)
    batch = _Batch(numbers, np.full(_N_SHAPES, branch), np.full(_N_SHAPES, is_longer))
    batch = batch.rows(_link_ratios(batch) <= task.link_ratio_max)
    errors, firsts = np.full(len(batch.numbers), np.inf), np.zeros(len(batch.numbers))
    for first in np.arange(_N_ANGLES) * (2.0 * np.pi / _N_ANGLES):
        square = np.square(_about_mean(batch.outputs(first + task.inputs) - task.outputs)).sum(axis=1)
        firsts, errors = np.where(square < errors, first, firsts), np.minimum(errors, square)
    batch.numbers[:, START] = firsts
    return batch.rows(np.argsort(errors, kind="stable")[: _COARSE[0]])


def _link_ratios(batch: _Batch) -> FloatArray:
    """The longest link over the shortest, shape (n,)."""
    lengths = np.vstack([batch.lengths(), np.ones(len(batch.numbers))])
    return np.asarray(lengths.max(axis=0) / lengths.min(axis=0))


def _about_mean(angles: FloatArray) -> FloatArray:
    """Angles less their circular mean, within half a turn, shape (n, k)."""
    mean = np.angle(np.exp(1j * angles).sum(axis=1, keepdims=True))
    turned = wrapped(angles - mean)
    return np.asarray(turned - turned.mean(axis=1, keepdims=True))


def _residuals(task: FunctionTask, batch: _Batch) -> FloatArray:
    """Errors of the output, their squares' sum a mean, and by how much the ratio of links is missed, (n, k + 1)."""
    errors = _about_mean(batch.outputs(task.inputs) - task.outputs) / np.sqrt(len(task.inputs))
    missed = np.log(_link_ratios(batch) / (task.link_ratio_max * (1.0 - _INSIDE)))
    return np.column_stack([errors, _WEIGHT * np.maximum(missed, 0.0)])


def _fit(task: FunctionTask, batch: _Batch, most_steps: int) -> tuple[_Batch, FloatArray]:
    """Improve linkages together within the bounds; also the sums of squares."""
    bounds = _bounds(task)

    def residuals(numbers: FloatArray, rows: Rows) -> FloatArray:
        return _residuals(task, replace(batch.rows(rows), numbers=numbers))

    def evaluate(numbers: FloatArray, rows: Rows) -> tuple[FloatArray, Kept]:
        found = residuals(numbers, rows)
        return np.square(found).sum(axis=1), [found]

    def step(numbers: FloatArray, kept: Kept, rows: Rows, damping: FloatArray) -> Stepped:
        slopes = [(residuals(numbers + _STEP * unit, rows) - kept[0]) / _STEP for unit in np.eye(_N_NUMBERS)]
        return gauss_newton(numbers, kept[0], np.stack(slopes, axis=1), damping, bounds)

    numbers, costs = improve(np.clip(batch.numbers, *bounds), evaluate, step, most_steps, _GAIN, _MET)
    return replace(batch, numbers=numbers), costs


def _found(task: FunctionTask, batch: _Batch) -> FoundGenerator | None:
    """The generator of a batch of one; None where its links are not within the bound on their ratio."""
    (numbers,) = batch.numbers
    if numbers[LARGEST] <= numbers[LEAST] or _link_ratios(batch)[0] > task.link_ratio_max:
        return None
    crank, coupler, rocker = batch.lengths()[:, 0].tolist()
    outputs = batch.outputs(task.inputs)[0] - task.outputs
    mean = float(np.angle(np.exp(1j * outputs).sum()))
    output_start = mean + float(wrapped(outputs - mean).mean())
    errors = wrapped(outputs - output_start)
    return FoundGenerator(
        FourBarGenerator(crank, coupler, rocker, int(batch.branches[0])), float(wrapped(numbers[START])),
        float(wrapped(np.array(output_start))), float(np.sqrt(np.mean(errors**2))), float(np.abs(errors).max()),
    )  # fmt: skip


def is_same(first: FoundGenerator, second: FoundGenerator) -> bool:
    """Whether two are one linkage with the same starts."""
    one, other = first.generator, second.generator
    lengths = np.log([one.crank / other.crank, one.coupler / other.coupler, one.rocker / other.rocker])
    starts = wrapped(np.array([first.input_start - second.input_start, first.output_start - second.output_start]))
    return bool(max(np.abs(lengths).max(), np.abs(starts).max()) < _SAME)
