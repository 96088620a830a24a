"""The reference cases of synthesis, by name."""

import json
from functools import cache
from pathlib import Path

import numpy as np

from explore.synthesis.nine_points.four_bars import linkages_of

_FILE = Path(__file__).parent / "reference" / "synthesis.json"
#: The benchmarks of paths by name.
PROBLEMS = json.loads(_FILE.with_name("path_benchmarks.json").read_text(encoding="utf-8"))
_FREE = np.random.default_rng(5).normal(size=(4, 2)) @ [1, 1j]
#: Nine points with an axis of symmetry, through which some linkages are singular solutions.
SYMMETRIC = np.concatenate([_FREE, _FREE.conj(), [0.3]])
_ACROSS = np.linspace(-1.3, 1.4, 9) + 0.05 * np.random.default_rng(2).normal(size=9)
#: Nine points of a parabola, where many paths end at infinity.
PARABOLA = _ACROSS + 1j * _ACROSS**2


@cache
def _cases():
    return {case["id"]: case for case in json.loads(_FILE.read_text(encoding="utf-8"))["cases"]}


def case(name):
    """The inputs and outputs of a case."""
    found = _cases()[name]
    return found["inputs"], found["outputs"]


def plane(pair):
    """A point of the plane from two decimal texts."""
    return complex(float(pair[0]), float(pair[1]))


def points_of(name):
    """The points of a benchmark."""
    return np.array([complex(*pair) for pair in PROBLEMS[name]["points"]])


def spline_path():
    """The points of the published slider-crank."""
    inputs, _ = case("scpath_spline")
    return np.array([complex(float(x), float(y)) for x, y in zip(inputs["X"], inputs["Y"], strict=True)])


def slope_of(function, h=1e-3):
    """The slope of a function at 0 by differences of fourth order."""
    return (8 * (function(h) - function(-h)) - (function(2 * h) - function(-2 * h))) / (12 * h)


def pressure_angle_max(linkage):
    """The largest angle between rod and guide of a slider-crank whose crank turns."""
    assert linkage.crank + abs(linkage.offset) < linkage.rod
    return np.arcsin((linkage.crank + abs(linkage.offset)) / linkage.rod)


def real_linkages(found, points):
    """The linkages of all real solutions through nine points, each with its cognates."""
    return [each for row in found.real for each in linkages_of(found.solutions[row], complex(points[0]), found.size)]


def are_proved(certificates):
    """Whether all solutions are proved, distinct, and known to be real or not."""
    known = certificates.is_real | certificates.is_not_real
    return bool((certificates.is_proved & certificates.is_distinct & known).all())


def parameters_of(points):
    """The parameters of the equations of nine points."""
    vectors = points[1:] - points[0]
    return np.concatenate([vectors, vectors.conj()]) / np.abs(vectors).mean()


def least_ordered(squares):
    """The least sum over all orders of the columns in both senses, by brute force."""
    count = squares.shape[1]
    turns = (np.arange(count)[:, None] + np.arange(count + 1)) % count  # from each start, a turn
    least = np.inf
    for order in (squares, squares[::-1]):
        sums = np.repeat(order[0][:, None], count + 1, axis=1)
        for row in order[1:]:
            sums = np.minimum.accumulate(sums + row[turns], axis=1)
        least = min(least, sums[:, -1].min())
    return least
