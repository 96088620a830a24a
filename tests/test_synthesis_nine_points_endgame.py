"""All four-bars through nine points in special position: where the paths go that lead to no regular solution."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from explore.synthesis.nine_points.classes import N_CLASSES, cognate, distinct, keys
from explore.synthesis.nine_points.endgame import (
    DEGENERATE,
    INFINITE,
    LOST,
    REGULAR,
    SHRINKAGES,
    SINGULAR,
    find_limits,
)
from explore.synthesis.nine_points.homotopy import follow, solve, start_system
from explore.synthesis.nine_points.regularity import is_regular
from explore.synthesis.nine_points.solving import find_all
from explore.synthesis.nine_points.tracking import ARRIVED, FATE

ANGLES = np.arange(9) * 2 * np.pi / 9 + 0.1 * np.random.default_rng(1).normal(size=9)
FREE = np.random.default_rng(5).normal(size=(4, 2)) @ [1, 1j]
ELLIPSE = np.cos(ANGLES) + 2j * np.sin(ANGLES)
SYMMETRIC = np.concatenate([FREE, FREE.conj(), [0.3]])


def parameters_of(points):
    vectors = points[1:] - points[0]
    return np.concatenate([vectors, vectors.conj()]) / np.abs(vectors).mean()


def counts(points):
    found = find_all(points)
    assert found.is_complete
    others = (found.n_singular, found.n_degenerate, found.n_infinite)
    assert len(found.solutions) + sum(others) == N_CLASSES
    return len(found.solutions), len(found.real), *others


@pytest.mark.slow
def test_points_of_an_ellipse():
    assert counts(ELLIPSE) == (1338, 83, 0, 0, 104)


@pytest.mark.slow
def test_points_of_a_circle_are_passed_by_degenerate_linkages_only():
    # A circle meets an irreducible tricircular sextic in at most six finite points, so it would have to be a part of
    # the coupler curve.
    n_regular, n_real, n_singular, n_degenerate, _ = counts(np.exp(1j * ANGLES))
    assert (n_regular, n_real, n_singular) == (0, 0, 0)
    assert n_degenerate > 1000


@pytest.mark.slow
def test_points_of_a_line_are_passed_by_linkages_at_infinity_only():
    # A line meets an irreducible sextic in at most six points.
    assert counts(ANGLES * (1 + 0.3j)) == (0, 0, 0, 0, N_CLASSES)


def test_points_with_an_axis_of_symmetry():
    # One of the nine lies on the axis. Linkages with a pivot at that point are singular: there the coupler may be
    # turned two ways.
    found = find_all(SYMMETRIC)
    assert found.is_complete
    assert (len(found.solutions), len(found.real)) == (1358, 52)
    assert found.n_singular > len(found.singular) > 0
    pivots = np.stack([member[:, 2] for member in (found.singular, cognate(found.singular))])
    on_axis = (0.3 - SYMMETRIC[0]) / np.abs(SYMMETRIC[1:] - SYMMETRIC[0]).mean()
    assert (np.abs(pivots - on_axis).min(axis=0) < 1e-6).any()
    # A reflection takes the nine points to themselves, so it takes solutions to solutions.
    mirrored = reflected(found.solutions, SYMMETRIC)
    assert cKDTree(keys(found.solutions)).query(keys(mirrored))[0].max() < 1e-5


def reflected(solutions, points):
    """Solutions after a reflection at the real axis, which moves the first point."""
    scale = np.abs(points[1:] - points[0]).mean()
    origin = points[0] / scale
    x, xh, a, ah, y, yh, b, bh = solutions.T
    # The first point's mirror image is another of the nine: turn the coupler there.
    row = int(np.argmin(np.abs(points - points[0].conj()))) - 1
    d = (points[row + 1] - points[0]) / scale
    dh = d.conj()
    a1, b1, c1 = (ah - dh) * x, (a - d) * xh, d * (ah - xh) + dh * (a - x) - d * dh
    a2, b2, c2 = (bh - dh) * y, (b - d) * yh, d * (bh - yh) + dh * (b - y) - d * dh
    e = a1 * b2 - a2 * b1
    turn, back = 1 + (b1 * c2 - b2 * c1) / e, 1 + (c1 * a2 - c2 * a1) / e
    moved = [x * turn, xh * back, a - d, ah - dh, y * turn, yh * back, b - d, bh - dh]
    plain, hatted = moved[0::2], moved[1::2]
    assert abs(origin.conj() - points[row + 1] / scale) < 1e-12
    return np.stack([value for pair in zip(hatted, plain, strict=True) for value in pair], axis=1)


def test_points_with_a_centre_of_symmetry():
    # A start system that loses paths makes the search incomplete, whatever the other one finds.
    found = find_all(np.concatenate([FREE, -FREE, [0]]))
    others = found.n_singular + found.n_degenerate + found.n_infinite
    assert (len(found.solutions), len(found.real)) == (1416, 18)
    assert found.is_complete == (others == N_CLASSES - 1416 == 26)


@pytest.mark.slow
def test_both_start_systems_lead_to_the_same_solutions():
    parameters = parameters_of(SYMMETRIC)
    one, other = (solve(parameters, number) for number in (0, 1))
    both = np.concatenate([one.regular, other.regular])
    assert len(one.regular) == len(other.regular) == len(distinct(both, 1e-5)) == 1358


def test_regular_paths_have_limits_too():
    # The endgame, of paths that need none: it must find where they arrive.
    solutions, start = start_system(0)
    parameters = parameters_of(np.random.default_rng(0).normal(size=(9, 2)) @ [1, 1j])
    last = 0.05 * (parameters - start)
    near, _ = follow(solutions[:40], start, parameters - last - start, 1e-6, 5000, 1e-12)
    ends, facts = follow(near, parameters - last, last, 1e-6, 5000, 1e-12)
    arrived = (facts[:, FATE] == ARRIVED) & is_regular(ends, parameters)
    assert arrived.sum() > 35

    def go_on(places, start, rates):
        ends, facts = follow(places, start, rates, 1e-6, 2000, 1e-6)
        return ends, facts[:, FATE] == ARRIVED

    limits = find_limits(near[arrived], parameters, last, go_on, SHRINKAGES[0])
    is_found = limits.fates == REGULAR
    assert is_found.sum() >= arrived.sum() - 1
    assert (limits.windings[is_found] == 1).all()
    assert not np.isin(limits.fates, [SINGULAR, DEGENERATE, INFINITE]).any()
    assert ((limits.fates == LOST) | is_found).all()
    error = np.abs(keys(limits.solutions[is_found]) - keys(ends[arrived][is_found]))
    assert error.max() < 1e-5


def share_of_complete_sets(count, seed):
    rng, n_complete = np.random.default_rng(seed), 0
    for _ in range(count):
        found = find_all(rng.normal(size=(9, 2)) @ [1, 1j])
        # A path that is lost is said to be.
        assert len(found.solutions) + found.n_lost == N_CLASSES
        n_complete += found.is_complete
    return n_complete / count


def test_random_sets_are_complete():
    assert share_of_complete_sets(2, 21) == 1


@pytest.mark.slow
def test_two_hundred_random_sets_are_complete():
    # One of these loses a path to a solution beyond 1e5, for which doubles have too few digits.
    assert share_of_complete_sets(200, 22) >= 0.99
