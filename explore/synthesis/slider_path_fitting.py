"""Least squares of slider-cranks to points, with free crank angles in the order of the points, many starts at once.

The eight numbers of a slider-crank are the crank's pivot, the direction of the guide, the logarithm of the rod, the
least and the largest angle of the rod from the guide, and the rod's point, along and across the rod. With the sines of
both angles, the crank is half their difference and the offset of the guide half their sum, in rods. So every choice
with -90 deg < least < largest < 90 deg is a slider-crank whose crank turns, and a bound of the pressure angle is a
bound of two numbers.

Levenberg and Marquardt's method, as in `explore.synthesis.paths.fitting`: the angle of each point is eliminated, steps
out of order are pooled (adjacent violators), and points that share an angle move together until their errors part them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from explore.model.quantities import FloatArray
from explore.synthesis.columns import Columns
from explore.synthesis.levenberg_marquardt import Kept, Rows, Stepped, damped_step, improve
from explore.synthesis.linkages import ComplexArray
from explore.synthesis.pooling import bring_in_order

PIVOT_X, PIVOT_Y, DIRECTION, LOG_ROD, LEAST, LARGEST, ALONG, ACROSS = range(8)
N_NUMBERS = 8
#: Least difference of the two angles of the rod, rad.
_LEAST_GAP = 1e-3
#: Largest change of an angle in one step, rad.
_LARGEST_TURN = 0.5
#: Largest change of a number that is an angle or a logarithm in one step.
_LARGEST_CHANGE = 1.0
#: Mean squared distance at which points are met, in units of the path.
_MET = 1e-20
#: Number that keeps quotients finite.
_TINY = 1e-300

BoolArray = npt.NDArray[np.bool_]
IntArray = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Fits(Columns):
    """Starts, or what became of them.

    Numbers, (b, 8); angles of the crank from the guide at the points, rad, nondecreasing, (b, n); sums of the weighted
    squared distances.
    """

    numbers: FloatArray
    angles: FloatArray
    errors: FloatArray


class Problem(NamedTuple):
    """What is fitted.

    The points of each start, (b, n), which may be mirrored; weights of the squared distances, (n,); bounds of the
    numbers, (b, 8).
    """

    points: ComplexArray
    weights: FloatArray
    lower: FloatArray
    upper: FloatArray

    def rows(self, chosen: IntArray) -> Problem:
        """The problems of some of the starts."""
        return Problem(self.points[chosen], self.weights, self.lower[chosen], self.upper[chosen])


def points_and_slopes(numbers: FloatArray, angles: FloatArray) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """The rod's points (b, n), their derivatives by the numbers (b, n, 8), and by the crank's angle (b, n)."""
    x, y, direction, log_rod, least, largest, along, across = (numbers[:, j, None] for j in range(N_NUMBERS))
    turn, rod, arm = np.exp(1j * direction), np.exp(log_rod), along + 1j * across
    offset, crank = 0.5 * (np.sin(largest) + np.sin(least)), 0.5 * (np.sin(largest) - np.sin(least))  # in rods
    ray = np.exp(1j * angles)
    sine = offset - crank * ray.imag
    cosine = np.sqrt(np.maximum((1.0 - sine) * (1.0 + sine), 1e-12))
    rod_ray = cosine + 1j * sine
    local = crank * rod * ray + arm * rod_ray
    lever = turn * arm * 1j * rod_ray / cosine  # change of the point by the sine of the rod's angle
    by_crank = turn * rod * ray - lever * ray.imag
    slopes = np.empty((*angles.shape, N_NUMBERS), dtype=np.complex128)
    slopes[..., PIVOT_X], slopes[..., PIVOT_Y] = 1.0, 1j
    slopes[..., DIRECTION] = 1j * turn * local
    slopes[..., LOG_ROD] = turn * crank * rod * ray
    slopes[..., LEAST] = 0.5 * np.cos(least) * (lever - by_crank)
    slopes[..., LARGEST] = 0.5 * np.cos(largest) * (lever + by_crank)
    slopes[..., ALONG], slopes[..., ACROSS] = turn * rod_ray, 1j * turn * rod_ray
    by_angle = turn * 1j * crank * rod * ray - lever * crank * ray.real
    return x + 1j * y + turn * local, slopes, by_angle


def fit(problem: Problem, starts: Fits, most_steps: int, tolerance: float) -> Fits:
    """Improve starts by at most so many steps each; one ends after three steps in a row of little relative gain."""
    weights = np.broadcast_to(problem.weights, starts.angles.shape)
    values = np.hstack([_bounded(starts.numbers, problem), _ordered(starts.angles, weights)])

    def evaluate(values: FloatArray, rows: Rows) -> tuple[FloatArray, Kept]:
        places, slopes, tangents = points_and_slopes(values[:, :N_NUMBERS], values[:, N_NUMBERS:])
        errors = places - problem.points[rows]
        return (problem.weights * np.abs(errors) ** 2).sum(axis=1), (errors, slopes, tangents)

    def step(values: FloatArray, kept: Kept, rows: Rows, damping: FloatArray) -> Stepped:
        return _step(problem.rows(rows), values, kept, damping)

    values, errors = improve(values, evaluate, step, most_steps, tolerance, _MET * len(problem.weights))
    return Fits(values[:, :N_NUMBERS], values[:, N_NUMBERS:], errors)


def _step(problem: Problem, values: FloatArray, kept: Kept, damping: FloatArray) -> Stepped:
    """Numbers and angles after a step of each start, and whether it was not shortened."""
    numbers, angles = values[:, :N_NUMBERS], values[:, N_NUMBERS:]
    errors, slopes, tangents = kept
    b, n = angles.shape
    pulls = problem.weights * np.abs(tangents) ** 2 + _TINY
    # Of each point: its own second derivative, gradient, and mixed derivatives, by its angle.
    terms = np.empty((b, n, 2 + N_NUMBERS))
    terms[..., 0] = pulls
    terms[..., 1] = problem.weights * (tangents.conj() * errors).real
    terms[..., 2:] = problem.weights[:, None] * (tangents.conj()[..., None] * slopes).real
    block_of, block_sums, first_rows = _blocks(angles, terms)
    shares = block_sums[:, 2:]
    weighted = np.sqrt(problem.weights)[:, None]
    jacobian = np.concatenate([slopes.real * weighted, slopes.imag * weighted], axis=1)
    residual = np.concatenate([errors.real, errors.imag], axis=1) * np.tile(weighted[:, 0], 2)
    matrix = jacobian.transpose(0, 2, 1) @ jacobian
    right = (jacobian * residual[..., None]).sum(axis=1)
    scaled = shares / block_sums[:, :1]
    matrix -= np.add.reduceat(shares[:, :, None] * scaled[:, None, :], first_rows, axis=0)
    right -= np.add.reduceat(scaled * block_sums[:, 1:2], first_rows, axis=0)
    step = damped_step(matrix, right, damping, numbers, (problem.lower, problem.upper))
    change = np.abs(step[:, DIRECTION : LARGEST + 1]).max(axis=1)
    scale = np.where(change > _LARGEST_CHANGE, _LARGEST_CHANGE / (change + _TINY), 1.0)
    step = np.nan_to_num(step * scale[:, None])
    rows = np.repeat(np.arange(b), np.diff(np.append(first_rows, len(block_sums))))
    turns = -(block_sums[:, 1] * scale[rows] + (shares * step[rows]).sum(axis=1)) / block_sums[:, 0]
    turned = angles + np.clip(turns, -_LARGEST_TURN, _LARGEST_TURN)[block_of].reshape(b, n)
    return np.hstack([_bounded(numbers + step, problem), _ordered(turned, pulls)]), scale == 1.0


def _blocks(angles: FloatArray, terms: FloatArray) -> tuple[IntArray, FloatArray, IntArray]:
    """The block of each point, flat; the sums of the terms of each block; and the first block of each start.

    Points that share an angle are a block; it is parted where the errors pull its points apart.
    """
    wanted = -terms[..., 1] / terms[..., 0]
    is_new = np.ones(angles.shape, dtype=np.bool_)
    is_new[:, 1:] = (angles[:, 1:] != angles[:, :-1]) | (wanted[:, 1:] >= wanted[:, :-1])
    flat = is_new.ravel()
    sums = np.add.reduceat(terms.reshape(-1, terms.shape[-1]), np.flatnonzero(flat), axis=0)
    block_of = np.cumsum(flat) - 1
    return block_of, sums, block_of.reshape(angles.shape)[:, 0]


def _ordered(angles: FloatArray, weights: FloatArray) -> FloatArray:
    """The nearest nondecreasing angles in weighted least squares; at most one turn from the first to the last."""
    found = np.array(angles, order="C")
    bring_in_order(found, np.ascontiguousarray(weights))
    return found


def _bounded(numbers: FloatArray, problem: Problem) -> FloatArray:
    """Numbers within their bounds, the angles of the rod apart."""
    found = np.clip(numbers, problem.lower, problem.upper)
    found[:, LEAST] = np.minimum(found[:, LEAST], problem.upper[:, LARGEST] - _LEAST_GAP)
    found[:, LARGEST] = np.maximum(found[:, LARGEST], found[:, LEAST] + _LEAST_GAP)
    return found
