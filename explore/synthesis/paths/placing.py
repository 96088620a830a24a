"""Starts of a search whose pivots have bounds, or whose points are poses: drawn four-bars in windows of crank angles.

A window is a first crank angle, an angle that the crank turns, and its sense; within it the crank turns as evenly as
the path or the body goes. For given crank angles points are linear in the crank pivot, the frame with its size, and the
arm of the coupler point, as complex numbers: where both pivots are drawn only the arm is free.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from explore.model.quantities import FloatArray
from explore.synthesis.columns import Columns
from explore.synthesis.linkages import ComplexArray
from explore.synthesis.paths.alignment import coupler_places

#: Number of four-bars drawn of each kind and branch.
_N_DRAWN = 1024
#: Number of samples of a turn.
_N_SAMPLES = 192
#: Number of first crank angles.
_N_FIRSTS = 24
#: Number of points that are compared.
_N_POINTS = 16
#: Angles that the crank turns over an open path, rad.
_SPANS = tuple(np.radians([25.0, 45.0, 75.0, 120.0, 180.0, 250.0, 330.0]).tolist())
#: Largest absolute logarithm of rocker over coupler that is drawn.
_LARGEST_RATIO = np.log(6.0)
#: Largest logarithm of one link over another that is drawn.
_LARGEST_LINKS = np.log(30.0)
#: Number of four-bars whose windows are compared together.
_CHUNK = 256
#: Number that keeps quotients finite.
_TINY = 1e-300


class Goal(NamedTuple):
    """What windows are compared with.

    Points and weights, (n,); directions and lever as of `problems.Task`; whether the crank turns once and returns, else
    how far it turns at least, rad; the angles of the crank from its first, where given, rad, (n,), and whether they
    count from any angle.
    """

    points: ComplexArray
    weights: FloatArray
    directions: ComplexArray
    lever: float
    is_closed: bool
    least_span: float
    turned: FloatArray | None = None
    is_shift_free: bool = True

    def windows(self) -> FloatArray:
        """Crank angles of windows at the points, rad, shape (w, n)."""
        firsts = np.arange(_N_FIRSTS) * (2.0 * np.pi / _N_FIRSTS)
        if self.turned is not None:
            return (firsts if self.is_shift_free else np.zeros(1))[:, None] + self.turned
        ends = np.append(self.points, self.points[0]) if self.is_closed else self.points
        steps = np.abs(np.diff(ends)) ** 2
        if self.lever > 0.0:
            steps[: len(self.points) - 1] += np.abs(self.lever * np.diff(self.directions)) ** 2
        along = np.concatenate([[0.0], np.cumsum(np.sqrt(steps))]) / np.sqrt(steps).sum()
        spans = [2.0 * np.pi] if self.is_closed else [span for span in _SPANS if span >= self.least_span]
        shares = along[: len(self.points)]
        turns = [sense * span * shares for span in spans or [self.least_span] for sense in (1.0, -1.0)]
        return np.asarray(firsts[:, None] + np.array(turns)[:, None]).reshape(-1, len(shares))

    def rows(self, rows: np.ndarray) -> Goal:
        """The goal with some of its points."""
        directions = self.directions[rows] if self.lever > 0.0 else self.directions
        turned = None if self.turned is None else self.turned[rows]
        return self._replace(points=self.points[rows], weights=self.weights[rows], directions=directions, turned=turned)


@dataclass(frozen=True)
class Drawn(Columns):
    """Four-bars with the longest link of 1.

    Crank, coupler, rocker and ground, (n, 4); transmission angles with the crank along and against the frame, rad, (n,
    2); pivots of crank and rocker, (n, 2), NaN where free; branches, 1.0 or -1.0.
    """

    lengths: FloatArray
    angles: FloatArray
    pivots: ComplexArray
    branches: FloatArray


@dataclass(frozen=True)
class Laid(Columns):
    """Four-bars laid over the points: their windows, and what fits best, each (m,).

    Crank's pivot, vector of the frame over the ground, and of the coupler point over it, complex; angles of the body
    from the coupler, rad; weighted sums of squares.
    """

    windows: np.ndarray
    pivots: ComplexArray
    frames: ComplexArray
    arms: ComplexArray
    bodies: FloatArray
    errors: FloatArray


def draw_four_bars(
    lower: FloatArray, upper: FloatArray, least_angle: float, *, is_ground_longer: bool, is_placed: bool
) -> Drawn:
    """Four-bars with transmission angles above the least, and pivots between corners, (4,), if they are placed."""
    from scipy.stats import qmc

    drawn = qmc.Sobol(7, seed=0).random(_N_DRAWN)
    ratio = np.exp(_LARGEST_RATIO * (2.0 * drawn[:, 0] - 1.0))
    angles = np.sort(least_angle + (np.pi - 2.0 * least_angle) * drawn[:, 1:3], axis=1)
    short, long = np.sqrt(1.0 + ratio[:, None] ** 2 - 2.0 * ratio[:, None] * np.cos(angles)).T
    larger, smaller = 0.5 * (long + short), 0.5 * (long - short)
    crank, ground = (smaller, larger) if is_ground_longer else (larger, smaller)
    lengths = np.column_stack([crank, np.ones_like(ratio), ratio, ground])
    lengths /= lengths.max(axis=1, keepdims=True)
    pivots = np.full((len(ratio), 2), np.nan + 0j)
    if is_placed:
        x, y, other_x, other_y = (lower + (upper - lower) * drawn[:, 3:]).T
        pivots = np.column_stack([x + 1j * y, other_x + 1j * other_y])
    good = np.flatnonzero(lengths.min(axis=1) > np.exp(-_LARGEST_LINKS))
    twice = np.concatenate([good, good])
    return Drawn(lengths[twice], angles[twice], pivots[twice], np.repeat([1.0, -1.0], len(good)))


def lay(goal: Goal, drawn: Drawn, windows: FloatArray) -> Laid:
    """The best window of each four-bar."""
    some = np.unique(np.linspace(0, len(goal.points) - 1, _N_POINTS).astype(np.int64))
    goal, samples = goal.rows(some), np.round(windows[:, some] / (2.0 * np.pi) * _N_SAMPLES).astype(np.int64)
    parts = [
        _lay(goal, drawn.rows(slice(k, k + _CHUNK)), samples % _N_SAMPLES)
        for k in range(0, len(drawn.branches), _CHUNK)
    ]
    return Laid.joined(parts)


def _lay(goal: Goal, drawn: Drawn, samples: np.ndarray) -> Laid:
    rays = np.exp(2j * np.pi * np.arange(_N_SAMPLES) / _N_SAMPLES)
    pins, couplers = coupler_places(drawn.lengths, drawn.branches, rays)
    pins, couplers = pins[:, samples], couplers[:, samples]  # [four-bar, window, point]
    is_placed = bool(np.isfinite(drawn.pivots).all())
    if is_placed:
        pivots = np.broadcast_to(drawn.pivots[:, :1], pins.shape[:2])
        vectors = (drawn.pivots[:, 1:] - drawn.pivots[:, :1]) / (drawn.lengths[:, 3:] + _TINY)
        frames = np.broadcast_to(vectors, pins.shape[:2])
        rest = goal.points - pivots[..., None] - frames[..., None] * pins
        arms = (couplers.conj() * rest) @ (goal.weights / goal.weights.sum())
    else:
        columns = np.stack([np.ones_like(pins), pins, couplers], axis=-1)
        weighted = (columns.conj() * goal.weights[:, None]).swapaxes(-1, -2)
        matrix = weighted @ columns
        matrix += 1e-12 * goal.weights.sum() * np.eye(3)
        solved = np.linalg.solve(matrix, (weighted @ goal.points)[..., None])[..., 0]
        pivots, frames, arms = np.moveaxis(np.asarray(solved, dtype=np.complex128), -1, 0)
    places = pivots[..., None] + frames[..., None] * pins + arms[..., None] * couplers
    errors = np.abs(places - goal.points) ** 2 @ goal.weights
    bodies = np.zeros(errors.shape)
    if goal.lever > 0.0:
        turns = goal.directions * (couplers * frames[..., None]).conj()
        bodies = np.angle(turns @ goal.weights.astype(complex))
        errors += goal.lever**2 * (np.angle(turns * np.exp(-1j * bodies[..., None])) ** 2 @ goal.weights)
    best = np.nan_to_num(errors, nan=np.inf).argmin(axis=1)
    every = np.arange(len(best))
    chosen = (column[every, best] for column in (pivots, frames, arms, bodies, errors))
    return Laid(best, *chosen)
