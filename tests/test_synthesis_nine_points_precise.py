"""Paths to solutions far larger than the points, which double precision loses."""

import numpy as np
import pytest
from synthesis_cases import PARABOLA, SYMMETRIC, are_proved, parameters_of, real_linkages

from explore.synthesis.linkages import FourBar
from explore.synthesis.nine_points import homotopy, precise_tracking
from explore.synthesis.nine_points.certificates import certify
from explore.synthesis.nine_points.classes import N_CLASSES, distinct
from explore.synthesis.nine_points.endgame import DEGENERATE, LOST
from explore.synthesis.nine_points.homotopy import follow, solve, start_system
from explore.synthesis.nine_points.precise_tracking import follow_precisely
from explore.synthesis.nine_points.report import find_linkages
from explore.synthesis.nine_points.solving import find_all

NEAR = 0.05


def crank_rocker(rng):
    """A crank-rocker and nine points of its path, anywhere over the turn of the crank."""
    while True:
        crank, coupler, rocker, ground = rng.uniform(0.3, 3, 4)
        lengths = sorted((crank, coupler, rocker, ground))
        if lengths[0] != crank or lengths[0] + lengths[3] >= lengths[1] + lengths[2]:
            continue
        pivot = rng.normal(size=2) @ [1, 1j]
        other = pivot + ground * np.exp(1j * rng.uniform(0, 2 * np.pi))
        linkage = FourBar(complex(pivot), complex(other), crank, coupler, rocker, complex(*rng.normal(size=2)))
        return linkage, linkage.points(np.sort(rng.uniform(0, 2 * np.pi, 9)))


def has(linkages, source):
    """Whether a linkage is among others, its dyads in either order."""
    pivots = {source.crank_pivot, source.rocker_pivot}
    return any(
        all(min(abs(pivot - own) for own in (each.crank_pivot, each.rocker_pivot)) < 1e-4 for pivot in pivots)
        for each in linkages
    )


@pytest.fixture(scope="module")
def hard():
    rng = np.random.default_rng(7)
    return [crank_rocker(rng) for _ in range(12)][11]


def test_what_double_precision_loses_is_found_and_proved(hard):
    source, points = hard
    found = find_all(points)
    assert found.is_complete
    assert len(found.solutions) == N_CLASSES
    assert has(real_linkages(found, points), source)
    assert np.abs(found.solutions).max() > 1e4
    # Krawczyk's test knows nothing of how the solutions were found.
    assert are_proved(certify(found.solutions, points, found.size))


def test_without_the_package_for_more_digits_the_paths_are_said_to_be_lost(hard, monkeypatch):
    monkeypatch.setattr(homotopy, "_PATIENT_ATTEMPTS", ())
    monkeypatch.setattr(homotopy, "find_spec", lambda name: None)
    found = find_linkages(hard[1])
    solutions = found.solutions
    assert not found.is_complete
    assert solutions.n_lost + solutions.n_singular + len(solutions.solutions) == N_CLASSES
    assert "are lost, so that linkages may be missing (with the package's extra certify" in found.sentence


def near_solutions(parameters, rows):
    """Solutions on the way from the first start system, and the parameters and rates of what is left of it."""
    solutions, start = start_system(0)
    rates = parameters - start
    near, _ = follow(solutions[rows], start, (1 - NEAR) * rates, 1e-7, 20_000, 1e-14)
    return near, parameters - NEAR * rates, NEAR * rates


def test_more_digits_lead_where_double_precision_does():
    parameters = parameters_of(np.random.default_rng(3).normal(size=(9, 2)) @ [1, 1j])
    near, start, rates = near_solutions(parameters, np.arange(0, 60, 10))
    ends, _ = follow(near, start, rates, 1e-7, 20_000, 1e-14)
    precise = np.array([follow_precisely(place, start, rates).solution for place in near])
    # the condition of the solutions, times the rounding of double precision
    assert np.abs(precise - ends).max() < 1e-10 * np.abs(ends).max()


def test_what_more_digits_lead_to_may_have_a_link_that_is_a_point(monkeypatch):
    solution = np.array([1 + 2j, 1 - 2j, 3, 3, 1 + 2j, 1 - 2j, 4j, -4j])
    monkeypatch.setattr(precise_tracking, "follow_precisely", lambda *_: precise_tracking.PreciseEnd(solution))
    ends = homotopy.Ends(np.full((2, 8), np.nan, complex), np.full(2, LOST), np.zeros(2, dtype=np.int64))
    homotopy._follow_far(np.ones((2, 8), complex), np.array([1]), solution, solution, ends, None)
    assert ends.fates.tolist() == [LOST, DEGENERATE]


def test_singular_limits_stay_singular():
    parameters = parameters_of(SYMMETRIC)
    near, start, rates = near_solutions(parameters, np.array([25]))
    end = follow_precisely(near[0], start, rates)
    assert end.solution is None
    assert not end.is_infinite


@pytest.mark.slow
def test_points_anywhere_on_the_paths_of_crank_rockers_are_complete():
    rng = np.random.default_rng(8)
    for _ in range(100):
        source, points = crank_rocker(rng)
        ends = find_all(points)
        assert ends.is_complete
        assert has(real_linkages(ends, points), source)


@pytest.mark.slow
def test_points_of_a_parabola_are_complete_from_both_start_systems():
    # Of 143 paths some meet others on circles down to a radius that double precision does not reach.
    parameters = parameters_of(PARABOLA)
    one, other = (solve(parameters, number) for number in (0, 1))
    assert one.count(LOST) == other.count(LOST) == 0
    assert len(one.regular) == len(other.regular) == len(distinct(np.concatenate([one.regular, other.regular]), 1e-5))


def test_a_path_to_infinity_is_told_from_one_to_a_far_solution(monkeypatch):
    steps, correct = [], precise_tracking._Path.correct
    monkeypatch.setattr(precise_tracking._Path, "correct", lambda *a: (steps.append(a[2]), correct(*a))[1])
    near, start, rates = near_solutions(parameters_of(PARABOLA), np.array([115, 149]))
    infinite, regular = (follow_precisely(place, start, rates) for place in near)
    assert infinite.is_infinite
    assert len(steps) < 600  # 983 with a polynomial of the time
    assert infinite.solution is None
    assert not regular.is_infinite
    assert regular.solution is not None
