"""First derivatives of metrics by parameters, from central differences of order sixteen, each with its error.

The kernels are compiled for doubles and take neither dual nor complex numbers. A polynomial through sixteen Chebyshev
nodes around the design converges geometrically in the distance to the nearest singularity over the step, so that steps
of a few hundredths of a length leave rounding errors only. Steps from half of the parameter down by factors of two
compete; where three in a row agree best, the first is taken, and their differences are its error, with a margin.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from explore.analysis.tolerancing.outcomes import TolerancedRequest
from explore.model.mechanism import Mechanism
from explore.model.quantities import FloatArray

#: Number of nodes on each side of the design.
_N_SIDE = 8
#: Number of steps, each half as long as the one before.
_N_STEPS = 26
#: Distance of 1 from the next double.
_EPSILON = 2.0**-52
#: Number of steps in a row, a range of sixteen, over which the jump of the slope must agree to be a fold.
_N_EQUAL = 5
#: Factor to which the jumps of the slope agree at a fold, as rounding and smooth metrics do not.
_EQUAL = 1.2
#: Least size of the jumps of the slope at a fold, over the rounding of the values.
_CERTAIN = 1e2

#: Largest change of a metric that does not depend on a parameter, relative: a few dozen roundings.
_CONSTANT = 2.0**-46
#: Number of the largest steps of which one must show that: down to a 128th of the parameter.
_N_WIDE = 7

#: Factor on estimates of errors: of 12,000 derivatives, most beside change points, errors were up to 1.1 of them.
_SAFETY = 10.0
#: Largest error of a derivative, relative to it and to metric over parameter; beyond it the metric jumps.
_LARGEST = 0.1


@dataclass(frozen=True)
class Derivatives:
    """Derivatives of metrics by the toleranced parameters, each (d,), and estimates of their absolute errors.

    NaN where the metric has no derivative: the design does not move, is where motion ends, or the metric has a fold
    there.
    """

    slopes: Mapping[str, FloatArray]
    errors: Mapping[str, FloatArray]


def differentiate(request: TolerancedRequest, nominal: Mapping[str, float]) -> Derivatives:
    """Differentiate all metrics of a design."""
    exact, nodes = request.exact, _rule()[0]
    d, mechanism, powers = len(exact.tolerances), request.request.mechanism, np.ldexp(1.0, -np.arange(1, _N_STEPS + 1))
    steps = [parameter_scale(mechanism, nominal, tolerance.parameter) * powers for tolerance in exact.tolerances]
    deviations = np.zeros((d, d, _N_STEPS, 2, _N_SIDE))
    for k in range(d):
        deviations[k, k, :, 0] = steps[k][:, None] * nodes
        deviations[k, k, :, 1] = -deviations[k, k, :, 0]
    values = exact.outcomes(nominal, deviations.reshape(d, -1)).metrics
    centre = exact.outcomes(nominal, np.zeros((d, 1))).metrics
    found = {
        name: [_best(column.reshape(d, _N_STEPS, 2, _N_SIDE)[k], float(centre[name][0]), steps[k]) for k in range(d)]
        for name, column in values.items()
    }
    parts = {name: np.array(pairs).reshape(d, 2).T for name, pairs in found.items()}
    return Derivatives({name: p[0] for name, p in parts.items()}, {name: p[1] for name, p in parts.items()})


def _rule() -> tuple[FloatArray, FloatArray]:
    """The positive nodes for unit step, and the weight of the difference of the values at plus and minus each."""
    nodes = np.cos((2 * np.arange(_N_SIDE) + 1) * np.pi / (4 * _N_SIDE))
    squares = nodes**2
    weights = np.empty(_N_SIDE)
    for j, node in enumerate(nodes):
        others = np.delete(squares, j)
        weights[j] = np.prod(others / (others - squares[j])) / (2.0 * node)
    return nodes, weights


def parameter_scale(mechanism: Mechanism, nominal: Mapping[str, float], name: str) -> float:
    """Magnitude of a parameter; where it is 0, the largest of those with its unit, or 1."""
    if nominal[name]:
        return abs(nominal[name])
    unit = mechanism.parameter(name).unit
    return max((abs(v) for n, v in nominal.items() if mechanism.parameter(n).unit == unit), default=0.0) or 1.0


def _best(values: FloatArray, centre: float, steps: FloatArray) -> tuple[float, float]:
    """The derivative and its error from values at plus and minus the nodes, (steps, 2, nodes)."""
    _, weights = _rule()
    with np.errstate(invalid="ignore"):
        slopes = (values[:, 0] - values[:, 1]) @ weights / steps
        # Of the values, and of the parameter at the nodes, which moves them by its slope; steps[0] is half of it.
        sizes = 2.0 * (np.abs(values).max(axis=(1, 2)) + np.abs(slopes) * steps[0])
        rounding = _EPSILON * sizes * np.abs(weights).sum() / steps
        neighbours = np.array([slopes[2:], slopes[1:-1], slopes[:-2]])
        errors = _SAFETY * (neighbours.max(axis=0) - neighbours.min(axis=0) + rounding[:-2])
    if np.isnan(errors[:-2]).all() or np.isnan(centre):
        return np.nan, np.nan
    if _is_fold(values, centre, steps):
        return np.nan, np.nan
    if _is_constant(values, centre):
        return 0.0, float(np.nanmin(_SAFETY * np.abs(values - centre).max(axis=(1, 2)) / steps))
    best = int(np.nanargmin(errors[:-2]))
    if not errors[best] < _LARGEST * max(abs(slopes[best]), np.nanmax(np.abs(values[best])) / (2.0 * steps[0])):
        return np.nan, np.nan
    return float(slopes[best]), float(errors[best])


def _is_constant(values: FloatArray, centre: float) -> bool:
    """Whether a metric is the same to its rounding at all steps at which it exists, one of the largest among them."""
    changes = np.abs(values - centre).max(axis=(1, 2))
    return bool(np.isfinite(changes[:_N_WIDE]).any() and np.nanmax(changes) <= _CONSTANT * abs(centre))


def _is_fold(values: FloatArray, centre: float, steps: FloatArray) -> bool:
    """Whether the slopes on both sides differ: their difference is then the same for small steps, not proportional."""
    with np.errstate(invalid="ignore"):
        jumps = np.abs(values[:, 0, 0] + values[:, 1, 0] - 2.0 * centre) / steps
        rounding = _EPSILON * np.abs(values[:, :, 0]).max(axis=1) / steps
        rows = np.lib.stride_tricks.sliding_window_view(jumps, _N_EQUAL)
        is_equal = rows.max(axis=1) < _EQUAL * rows.min(axis=1)
        return bool((is_equal & (rows[:, -1] > _CERTAIN * rounding[_N_EQUAL - 1 :])).any())


def contributions(derivatives: FloatArray, stds: Sequence[float]) -> FloatArray:
    """Share of each parameter in the variance of a metric to first order, (d,); NaN where nothing varies."""
    parts = (np.asarray(derivatives) * np.asarray(stds)) ** 2
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(parts / parts.sum())
