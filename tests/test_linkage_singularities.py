"""Distances of complex singularities: of functions with known zeros, and of linkages by counts of their zeros."""

import math

import numpy as np
import pytest
from linkage_cases import CASES, columns, linkage_of, scattered, trace, turns

from explore.base.compiling import LANES
from explore.mechanisms.linkages.cells import NODES
from explore.mechanisms.linkages.graph import operands
from explore.mechanisms.linkages.singularities import WORK_ROWS, locate
from explore.studies.request.requests import make_request

#: Share of the half-tangent of a distance that is relied on.
RELIED = 0.94


def _tangents(functions):
    """Half-tangents of the distances that `locate` finds for functions of the angle, one design in all lanes."""
    angles = np.concatenate([half + np.linspace(-0.5, 0.5, NODES) * math.pi for half in (0.0, math.pi)])
    step, count = 1e-20, len(functions)
    rows = np.zeros((2 * NODES, 2 * count, LANES))
    for s, function in enumerate(functions):
        values = function(angles + 1j * step)
        rows[:, s], rows[:, count + s] = values.real[:, None], values.imag[:, None] / step
    distances = np.empty(LANES)
    locate(rows.ravel(), 0, count, distances, np.empty(WORK_ROWS * LANES))
    assert (distances == distances[0]).all()
    return distances[0]


def _harmonic(distance, angle):
    return lambda theta: np.cosh(distance) - np.cos(theta - angle)


@pytest.mark.parametrize("distance", [0.01, 0.3, 1.0, 2.5, 6.0])
def test_the_zero_of_a_first_harmonic_is_exact(distance):
    """To rounding: that of a/b - 1 is some 1e-16, that of its root over the distance more where this is small."""
    expected = math.tanh(0.5 * distance)
    assert _tangents([_harmonic(distance, 0.7)]) == pytest.approx(expected, rel=1e-15 + 1e-16 / distance**2)
    assert _tangents([_harmonic(distance + 0.1, 0.0), _harmonic(distance, 0.7)]) == pytest.approx(expected, rel=1e-11)


_FORMS = {
    "a pair": lambda d: lambda theta: _harmonic(d, 0.7)(theta) * _harmonic(d, 2.1)(theta),
    "two": lambda d: lambda theta: _harmonic(d, 0.7)(theta) * _harmonic(1.3 * d, 1.2)(theta),
    "double": lambda d: lambda theta: _harmonic(d, 0.7)(theta) ** 2,
    "without a minimum": lambda d: lambda theta: _harmonic(d, 0.7)(theta) * np.exp(2.0 * np.sin(theta - 0.7)),
    "below a branch point": lambda d: lambda theta: 2.0 - 1.0 / np.sqrt(0.25 + _harmonic(d, 0.7)(theta)),
}


@pytest.mark.parametrize("distance", [0.3, 0.4, 0.9, 1.5])
@pytest.mark.parametrize("form", _FORMS)
def test_zeros_of_other_functions_are_found(form, distance):
    """To 2.5 %: pairs at one height, two at different ones, double ones, and those below which no minimum is."""
    assert _tangents([_FORMS[form](distance)]) == pytest.approx(RELIED * math.tanh(0.5 * distance), rel=0.025)


def test_functions_without_near_zeros_do_not_count():
    """A constant has none; what is nearly constant has some farther away than the samples tell, which is 2.4."""
    assert _tangents([lambda theta: 3.0 + 0.0 * theta]) == 1.0
    far = _tangents([lambda theta: 1.0 + 1e-8 * np.cos(2.0 * theta)])
    assert far == pytest.approx(RELIED * math.tanh(1.2), rel=1e-12)


def _values(numbers, parameters, angles):
    """Numbers of a graph at complex angles, continued from the real ones, the first of the first axis."""
    graph = numbers[0].graph
    cosine, sine = np.cos(angles), np.sin(angles)
    inputs = {"@cos": cosine, "@sin": sine, "@versine1": 1 - sine, "@versine3": 1 + sine}
    inputs |= {"@versine0": 2 * np.sin(0.5 * angles) ** 2, "@versine2": 2 * np.cos(0.5 * angles) ** 2}
    done = {}
    for k in graph.needed(numbers):
        operation, *rest = graph.nodes[k]
        values = [done[each] for each in operands(graph.nodes[k])]
        match operation:
            case "constant":
                done[k] = rest[0]
            case "input":
                done[k] = inputs[rest[0]] if rest[0] in inputs else parameters[rest[0]]
            case "add" | "exact_sum":
                done[k] = sum(values)
            case "sub":
                done[k] = values[0] - values[1]
            case "mul":
                done[k] = values[0] * values[1]
            case "div":
                done[k] = values[0] / values[1]
            case "neg":
                done[k] = -values[0]
            case "sqrt":
                root = np.sqrt(values[0])
                if np.ndim(root):
                    flips = np.where((root[1:] / root[:-1]).real < 0.0, -1.0, 1.0)
                    root[1:] *= np.cumprod(flips, axis=0)
                done[k] = root
            case "abs" if not np.ndim(values[0]):
                done[k] = abs(values[0])
            case _:
                raise NotImplementedError(operation)
    return [np.broadcast_to(done[number.index], angles.shape) for number in numbers]


def _lowest_zero(linkage, parameters, height):
    """Least height below which a function has a zero, by its turns around 0 along a hundred lines up to `height`."""
    equations = trace(linkage)
    functions = [each.terms[0] for each in (*(factor.value for factor in equations.factors), *equations.squares)]
    angles = np.linspace(0.0, 2.0 * math.pi, 240, endpoint=False) + 1j * np.linspace(0.0, height, 101)[:, None]
    heights = [height]
    for values in _values(functions, parameters, angles):
        turned = np.angle(np.roll(values, -1, axis=1) / values).sum(axis=1)
        (above,) = np.nonzero(np.abs(turned) > 1.0)
        heights += [height * above[0] / 100.0] if len(above) else []
    return min(heights)


@pytest.mark.parametrize("name", ["watt-2", "crank-shaper", "whitworth", "klann", "jansen"])
def test_the_nearest_singularity_of_a_design_is_not_taken_too_far(name):
    """At most 2 %, and at most 15 % too near, beyond the 0.1 that equal steps need: by the argument principle."""
    linkage, case = linkage_of(CASES[name]), CASES[name]
    signal = next(s.name for s in linkage.mechanism.signals if s.name.endswith("_velocity") and not s.is_magnitude)
    kernel = make_request(linkage.mechanism, metrics=[f"{signal}_mean"], window="cycle").kernel
    designs = scattered(case, 20, np.random.default_rng(3), 0.12)
    distances = 2.0 * np.arctanh(kernel.constants(columns(kernel, designs))[kernel.quadrature.row])
    chosen = np.flatnonzero(turns(kernel, designs) & (distances > 0.1))[:5]
    for k in chosen:
        zero = _lowest_zero(linkage, {key: column[k] for key, column in designs.items()}, 1.5 * distances[k])
        assert 0.85 * zero <= distances[k] <= 1.02 * zero
    assert len(chosen) == 5
