"""Distances of complex singularities: of functions with known zeros, and of linkages by counts of their zeros."""

import math

import numpy as np
import pytest
from linkage_cases import CASES, columns, evaluate_graph, linkage_of, scattered, trace, trammel, turns

from explore.base.compiling import LANES
from explore.mechanisms.linkages.cells import NODES
from explore.mechanisms.linkages.phases import place_phase, slope_by_phase
from explore.mechanisms.linkages.singularities import WORK_ROWS, _largest_base, locate
from explore.mechanisms.linkages.turning import TURNS
from explore.studies.request.requests import make_request

#: Share of the half-tangent of a distance that is relied on.
RELIED = 0.94


#: Angles of the nodes of a turn.
ANGLES = np.concatenate([half + np.linspace(-0.5, 0.5, NODES) * math.pi for half in (0.0, math.pi)])


def _locate(values, slopes):
    """Half-tangents of the distances that `locate` finds, from functions at `ANGLES`: (angles, functions, LANES)."""
    distances, count = np.empty(LANES), values.shape[1]
    rows = np.concatenate([values, slopes], axis=1)
    locate(rows.ravel(), 0, count, 0, np.full(LANES, TURNS), distances, np.empty(WORK_ROWS * LANES))
    return distances


def _tangents(functions):
    """Half-tangents of the distances that `locate` finds for functions of the angle, one design in all lanes."""
    step = 1e-20
    values = np.array([np.tile(f(ANGLES + 1j * step), (LANES, 1)) for f in functions]).T.swapaxes(1, 2)
    distances = _locate(values.real, values.imag / step)
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
    """At most 2.5 % too far: pairs at one height, two at different ones, double ones, those below which no minimum is.

    Of far double ones fours of coefficients differ by rounding errors, so that they are taken 10 % too near.
    """
    assert 0.89 <= _tangents([_FORMS[form](distance)]) / (RELIED * math.tanh(0.5 * distance)) <= 1.025


def _repeating(theta, repeats, centre, one, two):
    """A function of an angle, with zeros of its own, that nearly repeats in a turn, and its slope."""
    value = np.cos(repeats * theta) - centre * (1.0 + one * np.cos(theta) + two * np.sin(2.0 * theta))
    slope = -repeats * np.sin(repeats * theta) + centre * (one * np.sin(theta) - 2.0 * two * np.cos(2.0 * theta))
    return value, slope


@pytest.mark.parametrize("share", [0.0, 1e-6, 1e-3])
@pytest.mark.parametrize("repeats", [1, 2, 3])
def test_zeros_of_functions_that_repeat_in_a_turn_are_found(repeats, share):
    """None more than 2 % too far: |cos(m theta) - c|^2, and with a share of other harmonics in c; zeros by Newton."""
    rng, found, zeros = np.random.default_rng(8), [], []
    for _ in range(100):
        angle, height = rng.uniform(0.0, 2.0 * math.pi, LANES), rng.uniform(0.1, 2.2, LANES)
        centre, (one, two) = np.cos(angle + 1j * repeats * height), share * rng.uniform(-1.0, 1.0, (2, LANES))
        starts = 2.0 * math.pi * np.arange(repeats)[:, None]
        zero = np.concatenate([sign * (angle + 1j * repeats * height) + starts for sign in (1.0, -1.0)]) / repeats
        for _ in range(20):
            value, slope = _repeating(zero, repeats, centre, one, two)
            zero = zero - value / slope
        assert np.abs(value).max() < 1e-9 * np.abs(centre).max()
        zeros.append(np.abs(zero.imag).min(axis=0))
        value, slope = _repeating(ANGLES[:, None], repeats, centre, one, two)
        found.append(_locate((np.abs(value) ** 2)[:, None], 2.0 * (value * slope.conj()).real[:, None]))
    shares = 2.0 * np.arctanh(np.array(found)) / np.array(zeros)
    assert shares.max() <= 1.02
    assert np.median(shares) >= 0.85


@pytest.mark.parametrize(
    ("zeros", "least"),
    [([0.9 + 0.2j], 0.91), ([1.35], 0.99), ([1.3, -0.5], 0.91), ([-0.5, 0.8 + 0.3j], 0.91),
     ([0.4 + 0.3j, -0.1 + 0.25j], 0.6)],
)  # fmt: skip
def test_zeros_beside_an_interval_are_found(zeros, least):
    """The ellipse about an interval from -0.3 to 1.1 rad through the nearest zero, real or one of a pair, or nearer.

    Two pairs about as near are four poles, too many for coefficients one order apart: they are taken nearer.
    """
    start, length = -0.3, 1.4
    rows, tangents, anchors = np.zeros((2 * NODES, 2, LANES)), np.empty(LANES), np.empty(LANES)
    for j in range(2 * NODES):
        place_phase(start, length, j, tangents, anchors)
        theta = 2.0 * np.arctan(tangents) + math.pi * anchors + 1e-20j
        parts = [(theta - z.real) ** 2 + z.imag**2 if z.imag else theta - z.real for z in map(complex, zeros)]
        value = math.prod(parts)
        rows[j, 0], rows[j, 1] = value.real, value.imag / 1e-20
        slope_by_phase(rows[j].ravel(), 1, length, j)
    (found, *_) = _locate(rows[:, :1], rows[:, 1:])
    places = [np.emath.arccos((zero - start - 0.5 * length) / (0.5 * length)) for zero in zeros]
    nearest = min(abs(np.imag(place)) for place in places)
    assert least <= found / math.tanh(0.5 * nearest) <= 1.0 + 1e-12


def test_functions_without_near_zeros_do_not_count():
    """A constant has none; what is nearly constant has some farther away than the samples tell, which is 2.4."""
    assert _tangents([lambda theta: 3.0 + 0.0 * theta]) == 1.0
    far = _tangents([lambda theta: 1.0 + 1e-8 * np.cos(2.0 * theta)])
    assert far == pytest.approx(RELIED * math.tanh(1.2), rel=1e-12)


def _continued_root(values):
    """The root, continued along the first axis where it is there."""
    root = np.sqrt(values)
    if np.ndim(root):
        root[1:] *= np.cumprod(np.where((root[1:] / root[:-1]).real < 0.0, -1.0, 1.0), axis=0)
    return root


#: Functions of a graph at complex angles, continued from the real ones, the first of the first axis.
COMPLEX = {"number": float, "cos": np.cos, "sin": np.sin, "sqrt": _continued_root}


def _lowest_zero(linkage, parameters, height):
    """Least height below which a function has a zero, by its turns around 0 along a hundred lines up to `height`."""
    equations = trace(linkage)
    functions = [each.terms[0] for each in (*(factor.value for factor in equations.factors), *equations.squares)]
    angles = np.linspace(0.0, 2.0 * math.pi, 240, endpoint=False) + 1j * np.linspace(0.0, height, 101)[:, None]
    heights = [height]
    for values in evaluate_graph(functions, parameters, angles, COMPLEX):
        values = np.broadcast_to(values, angles.shape)
        turned = np.angle(np.roll(values, -1, axis=1) / values).sum(axis=1)
        (above,) = np.nonzero(np.abs(turned) > 1.0)
        heights += [height * above[0] / 100.0] if len(above) else []
    return min(heights)


def _far_shares(linkage, designs, count):
    """Distances that are found of designs that turn, over those of the nearest zero, beyond 0.1, of `count` designs."""
    signal = next(s.name for s in linkage.mechanism.signals if s.name.endswith("_velocity") and not s.is_magnitude)
    kernel = make_request(linkage.mechanism, metrics=[f"{signal}_mean"], window="cycle").kernel
    turning = turns(kernel, designs)
    designs = {name: column[turning] for name, column in designs.items()}
    distances = 2.0 * np.arctanh(kernel.constants(columns(kernel, designs))[kernel.quadrature.row])
    chosen = np.flatnonzero(distances > 0.1)[:count]
    assert len(chosen) == count
    zeros = [_lowest_zero(linkage, {n: c[k] for n, c in designs.items()}, 1.5 * distances[k]) for k in chosen]
    return distances[chosen] / zeros


@pytest.mark.parametrize("name", ["watt-2", "crank-shaper", "whitworth", "klann", "jansen"])
def test_the_nearest_singularity_of_a_design_is_not_taken_too_far(name):
    """At most 2 %, and at most 25 % too near, beyond the 0.1 that equal steps need: by the argument principle."""
    shares = _far_shares(linkage_of(CASES[name]), scattered(CASES[name], 20, np.random.default_rng(3), 0.12), 5)
    assert shares.max() <= 1.02
    assert shares.min() >= 0.75


#: A trammel with two dyads about its middle: all functions repeat after half a turn, and some have four zeros.
TRAMMEL = trammel(
    links={
        "bar": {"P": 0, "Q": "l", "M": ["m", 0]}, "arm": {"M": 0, "E": "a"},
        "rocker": {"O": 0, "E": "b", "F": ["b2", "b3"]}, "second": {"F": 0, "G": "e"}, "third": {"M": 0, "G": "g"},
    },
    branch={"E": "left of M O", "G": "left of F M"},
)  # fmt: skip
#: Least and largest values of its parameters.
BOUNDS = {"l": (80, 120), "m": (20, 60), "a": (60, 160), "b": (60, 160), "b2": (20, 80), "b3": (-50, 50),
          "e": (50, 150), "g": (50, 150)}  # fmt: skip


@pytest.mark.parametrize("count", [20, pytest.param(300, marks=pytest.mark.slow)])
def test_nor_is_that_of_a_linkage_whose_functions_repeat_after_half_a_turn(count):
    """One of the first 20 would be 19 % too far by coefficients one order apart alone."""
    rng = np.random.default_rng(15)
    designs = {name: rng.uniform(low, high, 40 * count) for name, (low, high) in BOUNDS.items()}
    assert _far_shares(TRAMMEL, designs, count).max() <= 1.02


@pytest.mark.parametrize(
    ("shares", "bases"),
    [((3 + 4j, 0), (0.25 + 0.5j, 1.0)), ((1, 2j), (0.6 + 0.2j, -0.3 + 0.1j)), ((1, 2j), (0.1j, 0.5 - 0.25j))],
)
def test_the_base_of_powers_is_that_of_one_or_the_larger_of_two(shares, bases):
    """Of one, whose numbers are exact here, all that two follow from is 0."""
    powers = [sum(share * base**n for share, base in zip(shares, bases, strict=True)) for n in range(4)]
    largest = max(abs(base) ** 2 for share, base in zip(shares, bases, strict=True) if share)
    assert _largest_base(*(part for each in powers for part in (each.real, each.imag))) == pytest.approx(largest)
