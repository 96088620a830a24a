"""All four-bars through points with given pivots: counts, planted linkages, and bad input."""

import dataclasses

import numpy as np
import pytest

from explore.base.errors import RequestError
from explore.synthesis.defects import PASSES
from explore.synthesis.linkages import FourBar
from explore.synthesis.nine_points.equations import linearise
from explore.synthesis.nine_points.pivots import _solve, _start_system, distinct_rows, find_with_pivots

#: Points less the first, and solutions: 36 by Morgan and Wampler (1990).
COUNTS = [(4, 36), (6, 486)]


@pytest.mark.parametrize(("n_vectors", "n_solutions"), COUNTS)
def test_start_systems(n_vectors, n_solutions):
    for number in (0, 1):
        solutions, parameters = _start_system(n_vectors + 1, number)
        assert len(solutions) == len(distinct_rows(solutions)) == n_solutions
        jacobian, values, rates = np.empty((8, 8), complex), np.empty(8, complex), np.zeros(16, complex)
        for z in solutions:
            linearise(z, parameters, rates, n_vectors, jacobian, values, np.empty(8, complex))
            step = np.linalg.solve(jacobian, values)
            assert np.abs(step).max() < 1e-8 * np.abs(z).max()
    # One leads to all solutions of the other.
    found, n_paths = _solve(parameters, n_vectors, 0)
    assert len(found) == n_paths == n_solutions
    assert len(distinct_rows(np.concatenate([found, solutions]))) == n_solutions


def test_derivatives_of_prescribed_pivots():
    rng = np.random.default_rng(2)
    z, parameters, rates = (rng.normal(size=n) + 1j * rng.normal(size=n) for n in (8, 16, 16))
    empty = [np.empty((8, 8), complex), np.empty(8, complex), np.empty(8, complex)]
    for n_vectors, pivots in ((6, {6: 2}), (4, {4: 6, 6: 2})):
        jacobian, values, by_time = (each.copy() for each in empty)
        linearise(z, parameters, rates, n_vectors, jacobian, values, by_time)
        for place, pivot in pivots.items():
            for hat in (0, 1):
                assert jacobian[place + hat].tolist() == np.eye(8)[pivot + hat].tolist()
                assert values[place + hat] == z[pivot + hat] - parameters[place + 8 * hat]
                assert by_time[place + hat] == -rates[place + 8 * hat]


def planted(rng, n_points):
    while True:
        pivots, point = 2 * (rng.normal(size=(2, 2)) @ [1, 1j]), complex(*rng.normal(size=2))
        linkage = FourBar(*pivots.tolist(), *rng.uniform(0.5, 3, 3).tolist(), point)
        angles = rng.uniform(0, 2 * np.pi) + np.arange(n_points) * rng.uniform(0.2, 5.5 / n_points)
        points = linkage.points(angles)
        if np.isfinite(points).all():
            return linkage, points


def is_same(one, other):
    """Whether two linkages are one, perhaps with crank and rocker exchanged."""
    lengths = np.abs(np.subtract(one.lengths, other.lengths))
    swapped = np.abs(np.subtract(one.lengths, np.array(other.lengths)[[2, 1, 0, 3]]))
    here = abs(one.crank_pivot - other.crank_pivot) + lengths.max()
    there = abs(one.crank_pivot - other.rocker_pivot) + swapped.max()
    return min(here, there) < 1e-5


def check_planted(n_points, count, seed):
    rng = np.random.default_rng(seed)
    for _ in range(count):
        linkage, points = planted(rng, n_points)
        pivots = [linkage.crank_pivot, linkage.rocker_pivot][: 1 if n_points == 7 else 2]
        report = find_with_pivots(points, pivots)
        (source,) = [each for each in report.linkages if is_same(each.linkage, linkage)]
        assert source.passage.fate == PASSES
        for each in report.linkages:
            ends = [each.linkage.crank_pivot, each.linkage.rocker_pivot]
            assert all(min(abs(end - pivot) for end in ends) < 1e-9 for pivot in pivots)
        for each in [each for each in report.linkages if each.passage.fate == PASSES]:
            drawn = [dataclasses.replace(each.linkage, branch=s).points(each.passage.angles) for s in (1, -1)]
            assert min(np.nanmax(np.abs(path - points)) for path in drawn) < 1e-5
        if not report.is_complete:
            assert "linkages may be missing" in report.sentence
        yield report


@pytest.mark.parametrize(("n_points", "count"), [(5, 20), (7, 3)])
def test_planted_linkages_are_found(n_points, count):
    reports = list(check_planted(n_points, count, 23))
    assert np.mean([report.is_complete for report in reports]) > 0.9


@pytest.mark.slow
@pytest.mark.parametrize("n_points", [5, 7])
def test_many_planted_linkages_are_found(n_points):
    reports = list(check_planted(n_points, 1000 if n_points == 5 else 200, 24))
    assert np.mean([report.is_complete for report in reports]) > 0.9


def test_bad_input():
    points = planted(np.random.default_rng(1), 7)[1]
    with pytest.raises(RequestError, match="with one given pivot, 7 points determine all linkages, not 5"):
        find_with_pivots(points[:5], [0])
    with pytest.raises(RequestError, match="with two given pivots, 5 points determine all linkages, not 7"):
        find_with_pivots(points, [0, 1])
    with pytest.raises(RequestError, match="give one pivot or both, not 3"):
        find_with_pivots(points, [0, 1, 2])
    with pytest.raises(RequestError, match="pivots 1 and 2 are equal"):
        find_with_pivots(points[:5], [1, 1])
    with pytest.raises(RequestError, match="points 2 and 4 are equal"):
        find_with_pivots(points[[0, 1, 2, 1, 4, 5, 6]], [1])
