"""All four-bars through nine points in special position: where the paths go that lead to no regular solution."""

import numpy as np
import pytest
from scipy.spatial import cKDTree
from synthesis_cases import PARABOLA, SYMMETRIC, are_proved, parameters_of

from explore.synthesis.nine_points import endgame, homotopy
from explore.synthesis.nine_points.certificates import certify
from explore.synthesis.nine_points.classes import N_CLASSES, cognate, distinct, keys, members
from explore.synthesis.nine_points.endgame import (
    DEGENERATE,
    INFINITE,
    LOST,
    REGULAR,
    SHRINKAGES,
    SINGULAR,
    Limits,
    find_limits,
)
from explore.synthesis.nine_points.homotopy import follow, solve, start_system
from explore.synthesis.nine_points.regularity import is_regular
from explore.synthesis.nine_points.solving import find_all
from explore.synthesis.nine_points.tracking import N_SIDES

ANGLES = np.arange(9) * 2 * np.pi / 9 + 0.1 * np.random.default_rng(1).normal(size=9)
ELLIPSE = np.cos(ANGLES) + 2j * np.sin(ANGLES)


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
    assert not certify(found.singular, SYMMETRIC, found.size).is_proved.any()
    assert are_proved(certify(found.solutions, SYMMETRIC, found.size))
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


def test_limits_that_solve_no_equation_are_lost(monkeypatch):
    def anywhere(solutions, *_):
        count = len(solutions)
        return Limits(np.full(count, REGULAR), np.ones(count, dtype=np.int64), solutions)

    monkeypatch.setattr(homotopy, "find_limits", anywhere)
    monkeypatch.setattr(homotopy, "_MOST_PRECISE", 0)
    ends = solve(parameters_of(SYMMETRIC), 0)
    assert (ends.count(REGULAR), ends.count(LOST)) == (1358, N_CLASSES - 1358)


@pytest.mark.slow
def test_both_start_systems_lead_to_the_same_solutions():
    parameters = parameters_of(SYMMETRIC)
    one, other = (solve(parameters, number) for number in (0, 1))
    both = np.concatenate([one.regular, other.regular])
    assert len(one.regular) == len(other.regular) == len(distinct(both, 1e-5)) == 1358


def go_on(places, start, rates):
    return follow(places, start, rates, 1e-6, 2000, 1e-6)


def test_regular_paths_have_limits_too():
    # The endgame, of paths that need none: it must find where they arrive.
    solutions, start = start_system(0)
    parameters = parameters_of(np.random.default_rng(0).normal(size=(9, 2)) @ [1, 1j])
    last = 0.05 * (parameters - start)
    near, _ = follow(solutions[:40], start, parameters - last - start, 1e-6, 5000, 1e-12)
    ends, arrived = follow(near, parameters - last, last, 1e-6, 5000, 1e-12)
    arrived &= is_regular(ends, parameters)
    assert arrived.sum() > 35
    limits = find_limits(near[arrived], parameters, last, go_on, SHRINKAGES[0])
    is_found = limits.fates == REGULAR
    assert is_found.sum() >= arrived.sum() - 1
    assert (limits.windings[is_found] == 1).all()
    assert not np.isin(limits.fates, [SINGULAR, DEGENERATE, INFINITE]).any()
    assert ((limits.fates == LOST) | is_found).all()
    error = np.abs(keys(limits.solutions[is_found]) - keys(ends[arrived][is_found]))
    assert error.max() < 1e-5


def test_paths_that_meet_at_infinity_have_one_limit():
    # Cycles of a parabola's paths, of which some have their first turn at another one's other order of dyads, and one
    # of a path alone, lost to its partners. The last two meet others on circles down to a radius of 1e-6.
    parameters = parameters_of(PARABOLA)
    solutions, start = start_system(0)
    last = 0.05 * (parameters - start)
    rows = np.array([190, 1181, 486, 462, 1401, 101, 134, 1299])
    near, _ = follow(solutions[rows], start, parameters - last - start, 1e-7, 20_000, 1e-14)
    limits = find_limits(near, parameters, last, go_on, SHRINKAGES[0])
    assert limits.fates.tolist() == [INFINITE] * 5 + [LOST] + [INFINITE] * 2
    assert limits.windings.tolist() == [6, 6, 6, 4, 4, 0, 4, 4]


def test_turns_of_other_paths_and_members_lead_on(monkeypatch):
    """Three branches of a cube root, of which two are known as other members of their classes, and two other paths."""
    rng = np.random.default_rng(4)
    centre, reach, alone, lost, elsewhere = rng.normal(size=(5, 8, 2)) @ [1, 1j]
    angles = 2 * np.pi * np.linspace(0, 1, N_SIDES + 1)[:, None]
    branches = [centre + reach * np.exp(1j * (angles + 2 * np.pi * k) / 3) for k in range(3)]
    turns = np.array([
        branches[0], members(branches[1])[4 * (N_SIDES + 1) :][: N_SIDES + 1],
        alone + 0 * angles, members(branches[2])[N_SIDES + 1 :][: N_SIDES + 1],
        lost + (elsewhere - lost) * angles,
    ])  # fmt: skip
    monkeypatch.setattr(endgame, "_lead", lambda *_: (turns, np.ones(5, dtype=bool)))
    (three, samples), (one, own) = endgame._cycles(turns[:, 0], None, None)
    assert (three.tolist(), one.tolist()) == ([0, 1, 3], [2])
    assert samples == pytest.approx(np.concatenate([branch[:-1] for branch in branches]), rel=1e-9)
    assert (own == alone).all()
    # Where two paths have become one, nobody knows whose turn it is.
    doubled = np.concatenate([turns, turns[:1]])
    monkeypatch.setattr(endgame, "_lead", lambda *_: (doubled, np.ones(6, dtype=bool)))
    assert [rows.tolist() for rows, _ in endgame._cycles(doubled[:, 0], None, None)] == [[2]]


def test_a_cognate_goes_where_a_path_is_lost():
    solutions = np.random.default_rng(4).normal(size=(3, 8, 2)) @ [1, 1j]
    passable = [solutions[0], cognate(solutions[1]), cognate(cognate(solutions[2]))]

    def way(some, start, rates):
        return some + start, np.array([any(np.allclose(one, each) for each in passable) for one in some], dtype=bool)

    found, arrived = endgame._lead(way, solutions, 0.0, 0.0)
    assert arrived.all()
    assert found == pytest.approx(solutions, rel=1e-12)


@pytest.mark.parametrize(("count", "seed"), [(2, 21), pytest.param(200, 22, marks=pytest.mark.slow)])
def test_random_sets_are_complete(count, seed):
    rng, n_complete = np.random.default_rng(seed), 0
    for _ in range(count):
        found = find_all(rng.normal(size=(9, 2)) @ [1, 1j])
        # A path that is lost is said to be.
        assert len(found.solutions) + found.n_lost == N_CLASSES
        n_complete += found.is_complete
    # One of 200 loses a path to a solution beyond 1e5, for which doubles have too few digits.
    assert n_complete >= count - count // 100
