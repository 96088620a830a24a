"""Statistics of a motion by dense sampling, which knows nothing of the mechanism but its signals at input angles.

A window is cut into panels of equal length in the input angle. Each has 32 Gauss-Legendre nodes, and is halved until
the Legendre series of every signal on it ends in rounding. All panels are then halved once more: the change of a
statistic estimates its error.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from numpy.polynomial import legendre

from explore.model.quantities import FloatArray

#: Function that gives the signals at input angles in degrees, shape (s, t).
Motion = Callable[[FloatArray], FloatArray]

_NODES = 32
_FIRST_PANELS = 8
#: Largest number of halvings of a panel: beside a jump, 360 deg / (8 * 2^42) is as good as none.
_MOST_HALVINGS = 42
#: Largest number of panels, of which a motion that is smooth nowhere would need any number.
_MOST_PANELS = 2_000
#: Largest tail of a resolved series, relative to the signal.
_RESOLVED = 1e-14
#: Number of the last coefficients whose sum is the tail of a series.
_TAIL = 4
#: Tail below which it is rounding if halving does not lower it.
_ROUNDING_TAIL = 1e-8
#: Tail above which it belongs to a jump, beside which a series overshoots.
_JUMP = 1e-6
#: Nodes of a panel, from -1 to 1.
_X: FloatArray = np.asarray(legendre.leggauss(_NODES)[0], dtype=np.float64)
#: Matrix from samples to coefficients; the weights that NumPy gives with the nodes err by 1e-13 at the ends.
_TRANSFORM = np.linalg.inv(legendre.legvander(_X, _NODES - 1))
#: Weights of the nodes in a mean over their panel: the coefficient of order 0.
_WEIGHTS = _TRANSFORM[0]
#: Points of a panel at which extremes are looked for, both ends among them.
_GRID = -np.cos(np.linspace(0.0, np.pi, 4 * _NODES + 1))
#: Polynomials at the points of the grid.
_ON_GRID = legendre.legvander(_GRID, _NODES - 1)
#: Matrix from coefficients to coefficients of the derivative, by the row.
_SLOPE = np.array([np.append(legendre.legder(row), 0.0) for row in np.eye(_NODES)])
#: Matrix from coefficients to the integral from -1 to each node, by the row.
_INTEGRAL = np.array([legendre.legval(_X, legendre.legint(row, lbnd=-1)) for row in np.eye(_NODES)])
#: Number of the best panels in which an extreme is refined.
_REFINED = 3
#: Factor from the change of a statistic in the last halving to the bound of its error.
_SAFETY = 4.0
#: Rounding of a statistic, relative to the size of its terms: of their sum, and of the samples themselves.
_ROUNDING = 4e-15


@dataclass(frozen=True)
class Panels:
    """Samples of a motion over a window.

    Attributes
    ----------
    edges : (p + 1,) array
        Input angles between the panels, deg, ascending.
    values : (s, p, n) array
        Signals at the Gauss-Legendre nodes of each panel.
    ends : (s, p, 2) array
        Signals at both ends of each panel.
    """

    edges: FloatArray
    values: FloatArray
    ends: FloatArray

    @property
    def weights(self) -> FloatArray:
        """Weights of the nodes in a mean over the window, shape (p, n)."""
        lengths = np.diff(self.edges)
        return np.outer(lengths / lengths.sum(), _WEIGHTS)


@dataclass(frozen=True)
class Statistics:
    """Statistics of signals over one window, or bounds of their errors, each of shape (s,)."""

    mean: FloatArray
    variance: FloatArray
    min: FloatArray
    max: FloatArray
    power_mean: FloatArray
    fluctuation: FloatArray

    @property
    def rms(self) -> FloatArray:
        """Roots of the mean squares."""
        return np.asarray(np.sqrt(self.mean**2 + self.variance))

    @property
    def magnitude(self) -> FloatArray:
        """Largest absolute values."""
        return np.maximum(np.abs(self.min), np.abs(self.max))

    def of(self, signal: int) -> Statistics:
        """The statistics of one signal, each of shape ()."""
        return Statistics(**{name: values[signal] for name, values in vars(self).items()})


def sample(motion: Motion, start: float, stop: float) -> Panels:
    """Sample a motion between two input angles, deg, densely enough for all signals."""
    edges = np.linspace(start, stop, _FIRST_PANELS + 1)
    lows, highs = edges[:-1], edges[1:]
    values, ends = _at_nodes(motion, lows, highs)
    # The size of a signal is that on the panel or its rms: a narrow peak hides no errors of what is beside it.
    level = np.sqrt((values**2).mean(axis=(1, 2)))[:, None]
    previous = np.full(values.shape[:2], np.inf)
    finished: list[tuple[FloatArray, FloatArray, FloatArray]] = []
    for halving in range(_MOST_HALVINGS + 1):
        coefficients = values @ _TRANSFORM.T
        tails = np.abs(coefficients[:, :, -_TAIL:]).sum(axis=2)
        scale = np.maximum(np.abs(values).max(axis=2), level)
        resolved = tails <= _RESOLVED * scale
        resolved |= (tails <= _ROUNDING_TAIL * scale) & (tails > 0.25 * previous)
        # a jump between the last node and the end
        resolved &= np.abs(coefficients @ _ON_GRID[[0, -1]].T - ends).max(axis=2) <= _JUMP * scale
        done = resolved.all(axis=0)
        if halving == _MOST_HALVINGS or len(lows) > _MOST_PANELS:
            done[:] = True
        finished.append((lows[done], values[:, done], ends[:, done]))
        if done.all():
            break
        lows, highs, previous = lows[~done], highs[~done], np.repeat(tails[:, ~done], 2, axis=1)
        middles = 0.5 * (lows + highs)
        lows = np.column_stack([lows, middles]).ravel()
        highs = np.column_stack([middles, highs]).ravel()
        values, ends = _at_nodes(motion, lows, highs)
    starts = np.concatenate([lows for lows, _, _ in finished])
    order = np.argsort(starts)
    values, ends = (np.concatenate([panels[k] for panels in finished], axis=1)[:, order] for k in (1, 2))
    return Panels(np.append(starts[order], stop), values, ends)


def _at_nodes(motion: Motion, lows: FloatArray, highs: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The signals at the nodes of panels, shape (s, p, n), and at their ends, shape (s, p, 2)."""
    angles = (0.5 * (lows + highs))[:, None] + (0.5 * (highs - lows))[:, None] * _X
    values = motion(np.column_stack([lows, angles, highs]).ravel()).reshape(-1, len(lows), _NODES + 2)
    return values[:, :, 1:-1], values[:, :, [0, -1]]


def measure(motion: Motion, panels: Panels) -> tuple[Statistics, Statistics]:
    """Statistics of the signals over a window, and bounds of their errors."""
    # The ends move inwards by a rounding of an input angle, so that changes include what that rounding does.
    edges: FloatArray = np.sort(np.concatenate([panels.edges, 0.5 * (panels.edges[:-1] + panels.edges[1:])]))
    edges[[0, -1]] += np.spacing(360.0) * np.array([1.0, -1.0])
    halves = Panels(edges, *_at_nodes(motion, edges[:-1], edges[1:]))
    coarse, fine = _statistics(panels), _statistics(halves)
    # a few roundings of the samples
    rounding = dict.fromkeys(vars(fine), fine.rms)
    rounding |= {"variance": fine.rms**2, "min": fine.magnitude, "max": fine.magnitude}
    rounding["fluctuation"] = fine.rms * np.radians(np.ptp(panels.edges))
    at_ends = _change_beside_jumps(panels) + _error_at_ends(halves)
    missed = {
        "min": at_ends + _above(-halves.values, -fine.min),
        "max": at_ends + _above(halves.values, fine.max),
    }
    errors = {
        name: _SAFETY * (np.abs(value - getattr(coarse, name)) + missed.get(name, 0.0)) + _ROUNDING * rounding[name]
        for name, value in vars(fine).items()
    }
    return fine, Statistics(**errors)


def _above(values: FloatArray, largest: FloatArray) -> FloatArray:
    """How far the signals may exceed their largest values by what follows their series, as beside corners, (s,).

    Beside a corner the coefficients fall with the square of their order, and so does what follows the last ones.
    """
    coefficients = values @ _TRANSFORM.T
    follows = _NODES / _TAIL * np.abs(coefficients[:, :, -_TAIL:]).sum(axis=2)
    is_candidate = (_upper_bounds(coefficients) + follows > largest[:, None]) & ~_has_jump(values, coefficients)
    highest = _highest_on_grid(coefficients, is_candidate) + follows
    return np.asarray(np.maximum(highest.max(axis=1) - largest, 0.0))


def _upper_bounds(coefficients: FloatArray) -> FloatArray:
    """Numbers that no series exceeds on its panel, shape (s, p): no Legendre polynomial exceeds 1."""
    return np.asarray(coefficients[:, :, 0] + np.abs(coefficients[:, :, 1:]).sum(axis=2))


def _highest_on_grid(coefficients: FloatArray, is_candidate: npt.NDArray[np.bool_]) -> FloatArray:
    """Largest values of series at the points of the grid, shape (s, p); -inf on panels that are no candidates."""
    highest = np.full(is_candidate.shape, -np.inf)
    highest[is_candidate] = (coefficients[is_candidate] @ _ON_GRID.T).max(axis=1)
    return highest


def _change_beside_jumps(panels: Panels) -> FloatArray:
    """Largest changes of the signals on panels with jumps, up to the jumps, by their slopes beside them, shape (s,).

    On a panel with a jump no extreme is looked for.
    """
    jumps, lengths = _has_jump(panels.values, panels.values @ _TRANSFORM.T), np.diff(panels.edges)
    slopes = np.abs(panels.values[:, :, -1] - panels.values[:, :, 0]) / lengths
    slopes[jumps] = 0.0
    beside = np.pad(slopes, ((0, 0), (1, 1)))
    changes = lengths * np.maximum(beside[:, :-2], beside[:, 2:])
    return np.asarray(np.where(jumps, changes, 0.0).max(axis=1))


def _error_at_ends(panels: Panels) -> FloatArray:
    """Largest errors of the series at ends of panels, as of corners beyond the last node, unless of jumps, shape (s,).

    A jump at an end is one at a mark, on whose other side another law holds.
    """
    coefficients = panels.values @ _TRANSFORM.T
    errors = np.abs(coefficients @ _ON_GRID[[0, -1]].T - panels.ends).max(axis=2)
    errors[errors > _JUMP * np.abs(panels.values).max(axis=(1, 2))[:, None]] = 0.0
    return np.asarray(errors.max(axis=1))


def _has_jump(values: FloatArray, coefficients: FloatArray) -> npt.NDArray[np.bool_]:
    """Whether each signal has a jump on each panel, shape (s, p)."""
    tails = np.abs(coefficients[:, :, -_TAIL:]).sum(axis=2)
    return np.asarray(tails > _JUMP * np.abs(values).max(axis=(1, 2))[:, None])


def _statistics(panels: Panels) -> Statistics:
    values, weights = panels.values, panels.weights
    mean = (weights * values).sum(axis=(1, 2))
    variance = (weights * (values - mean[:, None, None]) ** 2).sum(axis=(1, 2))
    power_mean = (weights * np.abs(values) ** (10.0 / 3.0)).sum(axis=(1, 2)) ** 0.3
    jumps = _has_jump(values, values @ _TRANSFORM.T)
    fluctuation = _fluctuation(panels, mean)
    return Statistics(mean, variance, -_largest(-values, jumps), _largest(values, jumps), power_mean, fluctuation)


def _fluctuation(panels: Panels, mean: FloatArray) -> FloatArray:
    """Ranges of the integrals of the signals less their means, shape (s,); an integral has no jumps."""
    coefficients = (panels.values - mean[:, None, None]) @ _TRANSFORM.T
    halves = 0.5 * np.radians(np.diff(panels.edges))
    over_panels = 2.0 * halves * coefficients[:, :, 0]
    before = np.cumsum(over_panels, axis=1) - over_panels
    integrals = before[:, :, None] + halves[:, None] * (coefficients @ _INTEGRAL)
    no_jumps = np.zeros(integrals.shape[:2], dtype=np.bool_)
    return _largest(integrals, no_jumps) + _largest(-integrals, no_jumps)


def _largest(values: FloatArray, jumps: npt.NDArray[np.bool_]) -> FloatArray:
    """Largest values of the signals from their series on the panels without jumps, shape (s,)."""
    coefficients = values @ _TRANSFORM.T
    at_nodes = np.where(jumps[:, :, None], -np.inf, values).max(axis=(1, 2))
    highest = _highest_on_grid(coefficients, (_upper_bounds(coefficients) >= at_nodes[:, None]) & ~jumps)
    best = np.argsort(highest, axis=1)[:, -_REFINED:]
    series = np.take_along_axis(coefficients, best[:, :, None], axis=1)
    x = _GRID[(series @ _ON_GRID.T).argmax(axis=2)]
    # Newton's method for a root of the slope, where the signal bends down.
    for _ in range(4):
        polynomials = legendre.legvander(x, _NODES - 1)
        slope, bend = ((polynomials * (series @ matrix)).sum(axis=2) for matrix in (_SLOPE, _SLOPE @ _SLOPE))
        x = np.clip(x - np.where(bend < 0.0, slope / np.where(bend < 0.0, bend, 1.0), 0.0), -1.0, 1.0)
    refined = (legendre.legvander(x, _NODES - 1) * series).sum(axis=2)
    refined[np.take_along_axis(jumps, best, axis=1)] = -np.inf
    return np.asarray(np.maximum(np.maximum(refined.max(axis=1), highest.max(axis=1)), at_nodes))
