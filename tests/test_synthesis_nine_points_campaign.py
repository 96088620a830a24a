"""Searches through nine points are never called complete with a wrong count: random points and degenerate ones."""

import dataclasses
from functools import cache

import numpy as np
import pytest

from explore.synthesis.nine_points import homotopy
from explore.synthesis.nine_points.certificates import certify
from explore.synthesis.nine_points.classes import N_CLASSES, SAME, distinct, has_point, is_degenerate, keys, residuals
from explore.synthesis.nine_points.endgame import DEGENERATE as DEGENERATE_FATE
from explore.synthesis.nine_points.endgame import INFINITE, LOST, REGULAR
from explore.synthesis.nine_points.four_bars import distance_from_real
from explore.synthesis.nine_points.regularity import is_regular
from explore.synthesis.nine_points.solving import find_all, merge, with_short_links


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


def hyperbola(rng):
    """On both branches."""
    x = rng.uniform(0.3, 3.0, 9) * rng.choice((-1.0, 1.0), 9)
    return x + 1j / x


def ellipse(rng):
    points = turns(rng)
    return points.real + 1j * rng.uniform(0.2, 0.9) * points.imag


#: Kinds of degenerate points with the number of their sets; those that cost most have the fewest.
DEGENERATE = {
    "circle": (turns, 25),
    "line": (lambda rng: rng.permutation(np.sort(rng.uniform(-1, 1, 9))) + 0j, 12),
    "ellipse": (ellipse, 30),
    "parabola": (parabola, 8),
    "hyperbola": (hyperbola, 20),
    "grid": (grid, 40),
    "mirrored": (mirrored, 35),
    "centred": (centred, 35),
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
        ends = homotopy.solve(np.concatenate([parameters, parameters.conj()]), 2).solutions
    proofs = certify(ends[np.isfinite(ends).all(axis=1)], points, found.size)
    both = np.concatenate([found.solutions, proofs.centres[proofs.is_proved & ~has_point(proofs.centres)]])
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


@pytest.fixture(scope="module")
def both_systems():
    """Points with a centre, and where the paths of both start systems lead: 1,416 to regular solutions."""
    points = centred(np.random.default_rng(26))
    vectors = points[1:] - points[0]
    size = float(np.abs(vectors).mean())
    parameters = np.concatenate([vectors, vectors.conj()]) / size
    return points, size, [homotopy.solve(parameters, number) for number in (0, 1)]


def damaged(ends, fate, key):
    """A start system of which the path to the solution of a key is lost, goes elsewhere, or ends at its neighbour's."""
    rows = np.flatnonzero(ends.fates == REGULAR)
    row = rows[np.abs(keys(ends.solutions[rows]) - key).max(axis=1).argmin()]
    solutions, fates = ends.solutions.copy(), ends.fates.copy()
    if fate == REGULAR:
        solutions[row] = solutions[rows[rows != row][0]]
    fates[row] = fate
    return dataclasses.replace(ends, solutions=solutions, fates=fates)


@pytest.mark.parametrize(
    ("first", "second", "n_proved", "is_complete"),
    [
        ((), (), 1416, True),
        (((LOST, 0),), ((LOST, 1),), 1416, True),  # each finds what the other loses
        (((LOST, 0),), ((LOST, 0),), 1415, False),
        (((INFINITE, 0),), (), 1416, False),
        (((INFINITE, 0),), ((LOST, 0),), 1415, False),
        (((INFINITE, 0),), ((REGULAR, 0),), 1415, False),
    ],
)
def test_systems_with_lost_and_wrong_ends_are_not_complete(both_systems, first, second, n_proved, is_complete):
    """Of 1,416 solutions; where both take the same path elsewhere, nothing tells."""
    points, size, systems = both_systems
    known = keys(systems[0].regular[:2])
    for number, damages in enumerate((first, second)):
        for fate, k in damages:
            systems = [damaged(each, fate, known[k]) if n == number else each for n, each in enumerate(systems)]
    found = merge(systems, points, size)
    assert (found.certificates.n_proved, found.is_complete) == (n_proved, is_complete)


def test_a_link_without_proof_is_no_point_unless_it_is_short(both_systems):
    """Ends with a link of 1e-7 and of 1e-9 of the points' size, at which there is no linkage."""
    points, size, systems = both_systems
    ends = systems[0]
    rows = np.flatnonzero(ends.fates == INFINITE)[:2]
    solutions, fates = ends.solutions.copy(), ends.fates.copy()
    solutions[rows], fates[rows] = plane(np.random.default_rng(28), 8), DEGENERATE_FATE
    solutions[rows, 4] = solutions[rows, 0] + [1e-7, 1e-9]
    told = with_short_links(dataclasses.replace(ends, solutions=solutions, fates=fates), points, size)
    assert told.fates[rows].tolist() == [LOST, DEGENERATE_FATE]


@pytest.mark.parametrize("count", [1, pytest.param(1000, marks=pytest.mark.slow)])
def test_random_points_are_never_complete_with_a_wrong_count(count, monkeypatch):
    rng = np.random.default_rng(25)
    for _ in range(count):
        assert not is_wrong(plane(rng, 9), monkeypatch)


@pytest.mark.slow
@pytest.mark.parametrize("kind", DEGENERATE)
def test_degenerate_points_are_never_complete_with_a_wrong_count(kind, monkeypatch):
    """205 sets. Of CPU, most take 3 to 8 s, a circle, a line and a hyperbola 12 to 25 s, a parabola 40 s."""
    rng, (draw, count) = np.random.default_rng(26), DEGENERATE[kind]
    for _ in range(count):
        assert not is_wrong(draw(rng), monkeypatch)


def test_a_short_link_is_told_from_a_point():
    """One path of these points ends at a linkage whose shortest link has 1e-13 of its size, as x conjugate x says."""
    rng = np.random.default_rng(25)
    *_, points = (plane(rng, 9) for _ in range(241))
    found = find_all(points)
    assert (found.certificates.n_proved, found.n_degenerate, found.is_complete) == (N_CLASSES, 0, True)
