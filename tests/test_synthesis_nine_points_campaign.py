"""Searches through nine points are never called complete with a wrong count: random points and degenerate ones."""

from functools import cache

import numpy as np
import pytest

from explore.synthesis.nine_points import homotopy
from explore.synthesis.nine_points.certificates import certify
from explore.synthesis.nine_points.classes import N_CLASSES, SAME, distinct, is_degenerate, keys, residuals
from explore.synthesis.nine_points.four_bars import distance_from_real
from explore.synthesis.nine_points.regularity import is_regular
from explore.synthesis.nine_points.solving import find_all


def plane(rng, count, spread=1.0):
    return rng.normal(scale=spread, size=(count, 2)) @ [1, 1j]


def turns(rng):
    return np.exp(1j * np.sort(rng.uniform(0, 2 * np.pi, 9)))


def mirrored(rng):
    free = plane(rng, 4)
    return np.concatenate([free, free.conj(), [rng.normal() + 0j]])


def centred(rng):
    free = plane(rng, 4)
    return np.concatenate([free, -free, [0j]])


def grid(rng):
    rows, columns = np.divmod(rng.permutation(25)[:9], 5)
    return rows + 1j * columns


def parabola(rng):
    x = rng.uniform(-1, 1, 9)
    return x + 1j * x**2


def ellipse(rng):
    points = turns(rng)
    return points.real + 1j * rng.uniform(0.2, 0.9) * points.imag


DEGENERATE = {
    "circle": turns,
    "line": lambda rng: rng.permutation(np.sort(rng.uniform(-1, 1, 9))) + 0j,
    "ellipse": ellipse,
    "parabola": parabola,
    "grid": grid,
    "mirrored": mirrored,
    "centred": centred,
}


@cache
def third_system():
    """All solutions of another generic problem: with them the paths of the same points are other ones."""
    parameters = np.random.default_rng(3).normal(size=(16, 2)) @ [1, 1j]
    ends = homotopy.solve(parameters, 0)
    assert len(distinct(ends.regular)) == N_CLASSES
    return ends.regular, parameters


def is_wrong(points, monkeypatch):
    """Whether a search is called complete though a third start system finds a proved solution that it has not."""
    found = find_all(points)
    if not found.is_complete or found.certificates.n_proved == N_CLASSES:
        return False
    system = third_system()
    parameters = (points[1:] - points[0]) / found.size
    with monkeypatch.context() as patch:
        patch.setattr(homotopy, "start_system", lambda _: system)
        regular = homotopy.solve(np.concatenate([parameters, parameters.conj()]), 2).regular
    proofs = certify(regular, points, found.size)
    both = np.concatenate([found.solutions, proofs.centres[proofs.is_proved]])
    return len(distinct(both, SAME)) > len(found.solutions)


def test_lost_solutions_give_no_warning():
    """Points on circles lead paths to solutions that are not finite; warnings are errors of these tests."""
    rng = np.random.default_rng(27)
    solutions = plane(rng, 40).reshape(5, 8)
    solutions[1, 2], solutions[2, :] = np.nan, 1e300
    solutions[3, 4] = solutions[3, 0]
    solutions[4, 0] = complex(np.inf, np.nan)
    parameters = plane(rng, 16)
    assert np.isfinite(keys(solutions)).all(axis=1).tolist() == [True, False, False, False, False]
    assert is_degenerate(solutions, 1e-11).tolist()[1:] == [True, True, True, True]
    assert residuals(solutions, parameters).shape == (5,)
    assert not (distance_from_real(solutions)[[1, 4]] < 1e-6).any()
    assert not is_regular(solutions, parameters)[[1, 4]].any()


@pytest.mark.parametrize("count", [1, pytest.param(1000, marks=pytest.mark.slow)])
def test_random_points_are_never_complete_with_a_wrong_count(count, monkeypatch):
    rng = np.random.default_rng(25)
    for _ in range(count):
        assert not is_wrong(plane(rng, 9), monkeypatch)


@pytest.mark.slow
@pytest.mark.parametrize("kind", DEGENERATE)
def test_degenerate_points_are_never_complete_with_a_wrong_count(kind, monkeypatch):
    """Seven kinds, 29 sets of each: 203. An ellipse takes a minute or more of CPU, a grid 15 s."""
    rng = np.random.default_rng(26)
    for _ in range(29):
        assert not is_wrong(DEGENERATE[kind](rng), monkeypatch)
