"""Rules for averaging a motion over a stroke or a turn: what they answer, and how many nodes they take for it.

A rule is a frozen dataclass whose fields are its settings. All but `Graded` sample the same closed form, so that their
errors are their own. The crank turns with 1 rad/s; a linkage that does not rock gets NaN and no nodes.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

import numpy as np
import numpy.typing as npt

from explore.comparison.reference import SIGNALS, STATISTICS
from explore.comparison.strokes import closed_form_rows
from explore.evaluation import evaluate_columns
from explore.mechanisms import crank_rocker_kernel as kernel
from explore.mechanisms.crank_rocker import CRANK_ROCKER
from explore.methods.closed_form import ClosedForm
from explore.methods.contract import ROCKER_ACCELERATION, ROCKER_ANGLE, ROCKER_VELOCITY, Task
from explore.request.requests import make_request
from explore.vocabulary import FloatArray, Status

_MEAN, _VARIANCE, _CV, _MIN, _MAX = range(len(STATISTICS))
_ROWS = [ROCKER_ANGLE, ROCKER_VELOCITY, ROCKER_ACCELERATION]


@dataclass(frozen=True, eq=False)
class Averages:
    """What a rule found.

    Attributes
    ----------
    values : (3, 5, n) array
        As of `explore.comparison.reference.exact_statistics`: rad, 1, 1/rad and their squares.
    nodes : (n,) array
        At how many crank angles the motion was solved.
    """

    values: FloatArray
    nodes: npt.NDArray[np.int64]


class Rule(Protocol):
    """A way of averaging: frozen data with one verb."""

    name: ClassVar[str]
    summary: ClassVar[str]

    def average(self, lengths: FloatArray, branch: FloatArray, window: str) -> Averages:
        """Averages over "drive", the slower stroke, or "cycle", for lengths of shape (n, 4) and branch (n,)."""
        ...


@dataclass(frozen=True)
class Published:
    """Differences of equally spaced rocker angles in place of derivatives; variances with n - 1."""

    name: ClassVar[str] = "published"
    summary: ClassVar[str] = "first and second differences of equispaced angles, sample variance: as was published"
    samples: int = 50

    def average(self, lengths: FloatArray, branch: FloatArray, window: str) -> Averages:
        """Sample from end to end of the window, both included."""

        def statistics(signals: FloatArray, length: FloatArray) -> FloatArray:
            angle, step = signals[0], length[:, None] / (self.samples - 1)
            rows = (angle, np.diff(angle) / step, np.diff(angle, 2) / step**2)
            return np.stack([_statistics(row.mean(axis=1), row.var(axis=1, ddof=1), row) for row in rows])

        return _sampled(lengths, branch, window, np.linspace(0.0, 1.0, self.samples), statistics)


@dataclass(frozen=True)
class Trapezoid:
    """The trapezoidal rule: the sum over equally spaced samples.

    Attributes
    ----------
    samples
        In the window; of a stroke the first and the last are its ends and count half.
    start
        Of a full turn: the crank angle of the first sample, in steps.
    """

    name: ClassVar[str] = "trapezoid"
    summary: ClassVar[str] = "equispaced samples of velocity and acceleration"
    samples: int
    start: float = 0.0

    def average(self, lengths: FloatArray, branch: FloatArray, window: str) -> Averages:
        """Sum the samples, and then the squares of their deviations."""
        places, weights = _equispaced(self.samples, self.start, window)
        return _sampled(lengths, branch, window, places, lambda signals, _: _weighted(signals, weights))


@dataclass(frozen=True)
class OnePass:
    """The trapezoidal rule with the variance as mean square less squared mean."""

    name: ClassVar[str] = "one-pass"
    summary: ClassVar[str] = "equispaced samples, variance as mean square less squared mean"
    samples: int

    def average(self, lengths: FloatArray, branch: FloatArray, window: str) -> Averages:
        """Sum samples and squares together."""
        places, weights = _equispaced(self.samples, 0.0, window)

        def statistics(signals: FloatArray, _: FloatArray) -> FloatArray:
            mean = signals @ weights
            return _statistics(mean, (signals * signals) @ weights - mean * mean, signals)

        return _sampled(lengths, branch, window, places, statistics)


@dataclass(frozen=True)
class GaussPieces:
    """Gauss-Legendre in the crank angle on a stroke, or on each quarter of a turn.

    Attributes
    ----------
    nodes
        On each piece.
    """

    name: ClassVar[str] = "gauss"
    summary: ClassVar[str] = "Gauss-Legendre in the crank angle, on the stroke or on quarters of the turn"
    nodes: int

    def average(self, lengths: FloatArray, branch: FloatArray, window: str) -> Averages:
        """Sum over the pieces, and then the squares of the deviations."""
        pieces = 4 if window == "cycle" else 1
        nodes, weights = np.polynomial.legendre.leggauss(self.nodes)
        places = (np.arange(pieces)[:, None] + 0.5 * (nodes + 1.0)).ravel() / pieces
        weights = np.tile(0.5 * weights, pieces) / pieces
        return _sampled(lengths, branch, window, places, lambda signals, _: _weighted(signals, weights))


@dataclass(frozen=True)
class Graded:
    """The package's own rule: panels graded towards the singularities, as many nodes as the tolerance needs.

    `nodes` leaves out the few evaluations that refine each extreme.
    """

    name: ClassVar[str] = "graded"
    summary: ClassVar[str] = "panels graded towards the singularities, nodes by tolerance: what a sweep uses"
    tolerance: float

    def average(self, lengths: FloatArray, branch: FloatArray, window: str) -> Averages:
        """Ask `evaluate_columns`, as a sweep does."""
        asked = {
            (s, k): f"{signal}_{statistic}"
            for s, signal in enumerate(SIGNALS)
            for k, statistic in enumerate(STATISTICS)
            if k != _CV or (signal == "rocker_velocity" and window == "drive")
        }
        request = make_request(CRANK_ROCKER, list(asked.values()), window, "slow", tolerance=self.tolerance)
        parameters = dict(zip(("crank", "coupler", "rocker", "ground"), lengths.T, strict=True))
        columns = evaluate_columns(request, {**parameters, "branch": branch}).columns
        values = np.full((len(SIGNALS), len(STATISTICS), len(lengths)), np.nan)
        for place, name in asked.items():
            values[place] = columns[name]
        values[0] = np.deg2rad(values[0])
        values[0, _VARIANCE] = np.deg2rad(values[0, _VARIANCE])  # of a square
        return Averages(values, columns["nodes"].astype(np.int64))


def _settings(kind: Any, name: str, values: tuple[float, ...], **fixed: float) -> tuple[Rule, ...]:
    """One rule at several settings."""
    return tuple(kind(**{name: value}, **fixed) for value in values)


_COUNTS = (8, 16, 32, 64, 128, 256, 360, 512, 1024, 2048)
#: From coarse to fine settings, by name.
RULES: dict[str, tuple[Rule, ...]] = {
    "published": _settings(Published, "samples", (13, 25, 50, 100, 200, 400, 800, 3200)),
    "trapezoid": _settings(Trapezoid, "samples", _COUNTS),
    "trapezoid-half-step": _settings(Trapezoid, "samples", _COUNTS, start=0.5),
    "one-pass": _settings(OnePass, "samples", _COUNTS),
    "gauss": _settings(GaussPieces, "nodes", (4, 8, 16, 32, 64, 128, 256)),
    "graded": _settings(Graded, "tolerance", (1e-4, 1e-6, 1e-8, 1e-9, 1e-10, 1e-12)),
}


def errors(found: Averages, exact: FloatArray) -> FloatArray:
    """Errors against the exact statistics, shape (3, 5, n) as theirs.

    Variance and cv relative to themselves, the mean to the root mean square since it may be exactly 0, minimum and
    maximum to the larger of both sizes.
    """
    mean, variance, cv, low, high = np.moveaxis(exact, 1, 0)
    largest = np.maximum(np.abs(low), np.abs(high))
    scale = np.stack([np.sqrt(mean * mean + variance), variance, cv, largest, largest], axis=1)
    return np.asarray(np.abs(found.values - exact) / scale)


def _sampled(
    lengths: FloatArray,
    branch: FloatArray,
    window: str,
    places: FloatArray,
    statistics: Callable[[FloatArray, FloatArray], FloatArray],
) -> Averages:
    """Statistics from the closed form at places of the window, from 0 at its first crank angle to 1 at its last.

    ``statistics(signals, length)`` gets shapes (3, m, t) and (m,) and answers (3, 5, m) for the m linkages that rock.
    """
    ends = _ends(lengths, branch, window)
    rocks = np.isfinite(ends[:, 0])
    values = np.full((len(SIGNALS), len(STATISTICS), len(lengths)), np.nan)
    if rocks.any():
        first, length = ends[rocks, :1], np.diff(ends[rocks])
        task = Task(lengths[rocks], branch[rocks], first + length * places)
        values[:, :, rocks] = statistics(ClosedForm().solve(task).signals[_ROWS], length[:, 0])
    # As for all rules: of the angle and of what has the mean 0 it has no meaning.
    values[[0, 2] if window == "drive" else [0, 1, 2], _CV] = np.nan
    return Averages(values, np.where(rocks, len(places), 0))


def _ends(lengths: FloatArray, branch: FloatArray, window: str) -> FloatArray:
    """First and last crank angle of the window (rad), shape (n, 2); NaN for a linkage that does not rock."""
    status, row, _ = closed_form_rows(lengths, branch)
    ends, parts = np.full((len(lengths), 2), np.nan), np.zeros((4, 3))
    for i in np.flatnonzero(status == Status.OK):
        if window == "cycle":
            ends[i] = 0.0, 2.0 * math.pi
        else:
            CRANK_ROCKER.pieces(row[i], kernel.DRIVE, kernel.DRIVES["slow"], 0.0, 0.0, parts)
            ends[i] = parts[0, 0] * math.pi + 2.0 * np.arctan(parts[0, 1:])
    return ends


def _equispaced(samples: int, start: float, window: str) -> tuple[FloatArray, FloatArray]:
    """Places and weights of the trapezoidal rule."""
    if window == "cycle":
        return (np.arange(samples) + start) / samples, np.full(samples, 1.0 / samples)
    weights = np.full(samples, 1.0 / (samples - 1))
    weights[[0, -1]] *= 0.5
    return np.linspace(0.0, 1.0, samples), weights


def _weighted(signals: FloatArray, weights: FloatArray) -> FloatArray:
    """Statistics of samples, shape (3, m, t), with weights of sum 1: two passes, so that nothing cancels."""
    mean = signals @ weights
    return _statistics(mean, (signals - mean[..., None]) ** 2 @ weights, signals)


def _statistics(mean: FloatArray, variance: FloatArray, samples: FloatArray) -> FloatArray:
    """The five statistics on the last axis but one."""
    with np.errstate(divide="ignore", invalid="ignore"):  # a mean of 0, or a variance below it, has no cv
        cv = np.sqrt(variance) / np.abs(mean)
    return np.stack([mean, variance, cv, samples.min(axis=-1), samples.max(axis=-1)], axis=-2)
