"""Rules for averaging a motion over a stroke or a turn.

A rule is a frozen dataclass whose fields are its settings. All but `GradedRule` sample the same closed form, so their
errors are those of the quadrature alone. The crank turns at 1 rad/s; a design without strokes has NaN and no nodes.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar, Protocol

import numpy as np
import numpy.typing as npt

from explore.comparison.methods.closed_form import ClosedForm
from explore.comparison.reference_statistics import STATISTICS
from explore.comparison.strokes import Designs
from explore.evaluation.evaluate import evaluate_columns
from explore.model.quantities import FloatArray
from explore.studies.request.requests import make_request

_MEAN, _VARIANCE, _CV, _MIN, _MAX = range(len(STATISTICS))


@dataclass(frozen=True, eq=False)
class Averages:
    """Statistics, (3, 5, n) as of `exact_statistics`, and the number of crank angles that are solved."""

    values: FloatArray
    nodes: npt.NDArray[np.int64]


class AveragingRule(Protocol):
    """A quadrature rule for the statistics of a motion."""

    name: ClassVar[str]

    def average(self, designs: Designs, window: str) -> Averages:
        """Average over the window "drive", the slower stroke, or "cycle", of designs."""
        ...


@dataclass(frozen=True)
class PublishedRule:
    """The rule of the published study: differences of positions as derivatives, variances with n - 1."""

    name: ClassVar[str] = "published"
    samples: int = 50

    def average(self, designs: Designs, window: str) -> Averages:
        """Average over samples from one end of the window to the other, both included."""

        def statistics(signals: FloatArray, length: FloatArray) -> FloatArray:
            angle, step = signals[0], length[:, None] / (self.samples - 1)
            rows = (angle, np.diff(angle) / step, np.diff(angle, 2) / step**2)
            return np.stack([_stack_statistics(row.mean(axis=1), row.var(axis=1, ddof=1), row) for row in rows])

        return _sampled_averages(designs, window, np.linspace(0.0, 1.0, self.samples), statistics)


@dataclass(frozen=True)
class TrapezoidalRule:
    """The trapezoidal rule on so many equispaced samples of the window.

    On a stroke the first and the last lie at its ends and have half the weight; on a turn the first is `start` steps
    from 0.
    """

    name: ClassVar[str] = "trapezoid"
    samples: int
    start: float = 0.0

    def average(self, designs: Designs, window: str) -> Averages:
        """Average the samples, then the squared deviations from the mean."""
        fractions, weights = _equispaced(self.samples, self.start, window)
        return _sampled_averages(designs, window, fractions, lambda signals, _: _weighted_statistics(signals, weights))


@dataclass(frozen=True)
class OnePassRule:
    """The trapezoidal rule with the variance as mean square minus squared mean."""

    name: ClassVar[str] = "one-pass"
    samples: int

    def average(self, designs: Designs, window: str) -> Averages:
        """Average samples and squares in one pass."""
        fractions, weights = _equispaced(self.samples, 0.0, window)

        def statistics(signals: FloatArray, _: FloatArray) -> FloatArray:
            mean = signals @ weights
            return _stack_statistics(mean, (signals * signals) @ weights - mean * mean, signals)

        return _sampled_averages(designs, window, fractions, statistics)


@dataclass(frozen=True)
class GaussRule:
    """Gauss-Legendre quadrature in the crank angle, with so many nodes on a stroke or on each quarter of a turn."""

    name: ClassVar[str] = "gauss"
    nodes: int

    def average(self, designs: Designs, window: str) -> Averages:
        """Average over all pieces, then the squared deviations from the mean."""
        pieces = 4 if window == "cycle" else 1
        nodes, weights = np.polynomial.legendre.leggauss(self.nodes)
        fractions = (np.arange(pieces)[:, None] + 0.5 * (nodes + 1.0)).ravel() / pieces
        weights = np.tile(0.5 * weights, pieces) / pieces
        return _sampled_averages(designs, window, fractions, lambda signals, _: _weighted_statistics(signals, weights))


@dataclass(frozen=True)
class GradedRule:
    """The rule of a sweep: panels graded towards the singularities, with as many nodes as the tolerance needs.

    `Averages.nodes` excludes the few evaluations that refine each extreme.
    """

    name: ClassVar[str] = "graded"
    tolerance: float

    def average(self, designs: Designs, window: str) -> Averages:
        """Average by `evaluate_columns`."""
        names, mechanism = designs.output or ("", "", ""), designs.mechanism
        metrics = {
            (s, k): f"{signal}_{statistic}"
            for s, signal in enumerate(names)
            for k, statistic in enumerate(STATISTICS)
            if k != _CV or (s == 1 and window == "drive")
        }
        request = make_request(
            mechanism, metrics=list(metrics.values()), window=window, drive="slow", tolerance=self.tolerance
        )
        unit_speed = {mechanism.speed.name: np.ones(len(designs))} if mechanism.speed else {}
        columns = evaluate_columns(request, {**designs.columns, **unit_speed}).columns
        values = np.full((len(names), len(STATISTICS), len(designs)), np.nan)
        for index, name in metrics.items():
            values[index] = columns[name]
        if mechanism.signal(names[0]).unit == "deg":
            values[0] = np.deg2rad(values[0])
            values[0, _VARIANCE] = np.deg2rad(values[0, _VARIANCE])  # deg^2
        return Averages(values, columns["nodes"].astype(np.int64))


_SAMPLE_COUNTS = (8, 16, 32, 64, 128, 256, 360, 512, 1024, 2048)
#: Settings of every rule from coarse to fine, by name.
AVERAGING_RULES: dict[str, tuple[AveragingRule, ...]] = {
    "published": tuple(map(PublishedRule, (13, 25, 50, 100, 200, 400, 800, 3200))),
    "trapezoid": tuple(map(TrapezoidalRule, _SAMPLE_COUNTS)),
    "trapezoid-half-step": tuple(TrapezoidalRule(samples, start=0.5) for samples in _SAMPLE_COUNTS),
    "one-pass": tuple(map(OnePassRule, _SAMPLE_COUNTS)),
    "gauss": tuple(map(GaussRule, (4, 8, 16, 32, 64, 128, 256))),
    "graded": tuple(map(GradedRule, (1e-4, 1e-6, 1e-8, 1e-9, 1e-10, 1e-12))),
}


def relative_errors(averages: Averages, exact: FloatArray) -> FloatArray:
    """Errors against the exact statistics, shape (3, 5, n).

    Errors of variance and cv are relative to these, of the mean to the root mean square, since the mean may be 0, and
    of minimum and maximum to the larger absolute value of both.
    """
    mean, variance, cv, low, high = np.moveaxis(exact, 1, 0)
    largest = np.maximum(np.abs(low), np.abs(high))
    scale = np.stack([np.sqrt(mean * mean + variance), variance, cv, largest, largest], axis=1)
    return np.asarray(np.abs(averages.values - exact) / scale)


def _sampled_averages(
    designs: Designs,
    window: str,
    fractions: FloatArray,
    statistics: Callable[[FloatArray, FloatArray], FloatArray],
) -> Averages:
    """Statistics from samples of the closed form at fractions of the window: 0 at its first angle, 1 at its last.

    `statistics` maps signals, (3, m, t), and window lengths, rad, of m designs with strokes to statistics, (3, 5, m).
    """
    ends, rocks = designs.ends(window), designs.has_strokes
    values = np.full((3, len(STATISTICS), len(designs)), np.nan)
    if rocks.any():
        first, length = ends[rocks, :1], np.diff(ends[rocks])
        task = designs.part(rocks).task(first + length * fractions)
        signals = ClosedForm().solve(task).signals[designs.row :: task.loop.count]
        if designs.row < task.loop.n_angles:
            signals[0] = np.unwrap(signals[0])
        values[:, :, rocks] = statistics(signals, length[:, 0])
    # the cv is defined only for the velocity over a stroke: other means are 0 or depend on the datum of the angle
    values[[0, 2] if window == "drive" else [0, 1, 2], _CV] = np.nan
    return Averages(values, np.where(rocks, len(fractions), 0))


def _equispaced(samples: int, start: float, window: str) -> tuple[FloatArray, FloatArray]:
    """Fractions of the window and weights of the trapezoidal rule."""
    if window == "cycle":
        return (np.arange(samples) + start) / samples, np.full(samples, 1.0 / samples)
    weights = np.full(samples, 1.0 / (samples - 1))
    weights[[0, -1]] *= 0.5
    return np.linspace(0.0, 1.0, samples), weights


def _weighted_statistics(signals: FloatArray, weights: FloatArray) -> FloatArray:
    """Statistics of samples, shape (3, m, t), with weights of sum 1, in two passes to avoid cancellation."""
    mean = signals @ weights
    return _stack_statistics(mean, (signals - mean[..., None]) ** 2 @ weights, signals)


def _stack_statistics(mean: FloatArray, variance: FloatArray, samples: FloatArray) -> FloatArray:
    """Stack the five statistics along a new second-to-last axis."""
    with np.errstate(divide="ignore", invalid="ignore"):  # mean 0, or a negative variance by cancellation
        cv = np.sqrt(variance) / np.abs(mean)
    return np.stack([mean, variance, cv, samples.min(axis=-1), samples.max(axis=-1)], axis=-2)
