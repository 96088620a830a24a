"""Proofs of solutions through nine points: enclosures against more digits, and what is and is not proved."""

import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from flint import acb, arb, ctx
from synthesis_cases import are_proved

from explore.synthesis.nine_points import certificates
from explore.synthesis.nine_points.ball_certificates import certify_in_balls
from explore.synthesis.nine_points.certificates import certify
from explore.synthesis.nine_points.classes import cognate, exchange
from explore.synthesis.nine_points.discs import Discs, exact, product
from explore.synthesis.nine_points.regularity import evaluate
from explore.synthesis.nine_points.solving import find_all

PROBLEMS = json.loads((Path(__file__).parent / "reference" / "path_benchmarks.json").read_text(encoding="utf-8"))


def points_of(name):
    return np.array([complex(*pair) for pair in PROBLEMS[name]["points"]])


@cache
def solved(name):
    return find_all(points_of(name))


def size_of(points):
    return float(np.abs(points[1:] - points[0]).mean())


def random(rng, *shape):
    return (rng.normal(size=shape) + 1j * rng.normal(size=shape)) * 10 ** rng.uniform(-3, 3, shape)


def is_inside(disc, value):
    """Whether a ball of many digits lies in a disc."""
    return (acb(complex(disc.centre)) - value).abs_upper() <= arb(float(disc.radius))


def test_discs_hold_the_exact_values():
    rng = np.random.default_rng(3)
    z, points = random(rng, 50, 8), random(rng, 50, 2)
    spread = 1e-6 * np.abs(z)
    box = Discs(z, spread)
    found = evaluate([box[:, k] for k in range(8)], exact(points[:, 0]), exact(points[:, 1]))
    plain = evaluate([exact(z[:, k]) for k in range(8)], exact(points[:, 0]), exact(points[:, 1]))
    # A point of each disc, at its edge.
    moved = z + 0.999 * spread * np.exp(1j * rng.uniform(0, 2 * np.pi, z.shape))
    ctx.prec = 300
    for row in range(50):
        d, dh = (acb(complex(value)) for value in points[row])
        for which, discs in ((z, plain), (moved, found), (z, found)):
            value, slopes, determinant = evaluate([acb(complex(number)) for number in which[row]], d, dh)
            assert is_inside(discs[0][row], value)
            assert is_inside(discs[2][row], determinant)
            assert all(is_inside(disc[row], slope) for disc, slope in zip(discs[1], slopes, strict=True))
    ctx.prec = 53
    # Radii are of the size of rounding errors, not only bounds.
    assert np.median(plain[0].radius / np.abs(plain[0].centre)) < 1e-12


def test_reciprocals_and_products_hold_the_exact_values():
    rng = np.random.default_rng(4)
    numbers, spread = random(rng, 200), rng.uniform(0, 0.9, 200)
    box = Discs(numbers, spread * np.abs(numbers))
    edge = numbers + 0.999 * box.radius * np.exp(1j * rng.uniform(0, 2 * np.pi, 200))
    matrices, vectors = random(rng, 20, 8, 8), random(rng, 20, 8, 1)
    found = product(matrices, exact(vectors))
    ctx.prec = 300
    for disc, value in ((box.reciprocal()[k], acb(complex(edge[k]))) for k in range(200)):
        assert is_inside(disc, 1 / value)
    for n in range(20):
        for i in range(8):
            terms = [acb(complex(matrices[n, i, k])) * acb(complex(vectors[n, k, 0])) for k in range(8)]
            assert is_inside(found[n, i, 0], sum(terms[1:], terms[0]))
    ctx.prec = 53
    holding_zero = Discs(np.array([1 + 0j]), np.array([1.0]))
    assert np.isinf(holding_zero.reciprocal().radius).all()


@pytest.mark.parametrize(
    ("name", "n_real"), [pytest.param("nine_wampler", 21, marks=pytest.mark.slow), ("nine_oval", 45)]
)
def test_all_solutions_of_public_problems_are_proved(name, n_real):
    points = points_of(name)
    found = solved(name)
    proof = certify(found.solutions, points, size_of(points))
    assert are_proved(proof)
    assert proof.is_real.sum() == n_real
    assert set(np.flatnonzero(proof.is_real)) == set(found.real)
    assert not (proof.is_real & proof.is_not_real).any()
    assert (np.abs(proof.centres - found.solutions) < 1e-5 * np.abs(found.solutions).max(axis=1)[:, None]).all()


def test_proofs_without_flint_and_in_balls_agree(monkeypatch):
    points = points_of("nine_oval")
    solutions = solved("nine_oval").solutions
    monkeypatch.setattr(certificates, "find_spec", lambda name: None)
    proof = certify(solutions, points, size_of(points))
    assert 0.9 < proof.is_proved.mean() < 1
    assert not are_proved(proof)
    for row in (*np.flatnonzero(proof.is_real)[:5], *np.flatnonzero(proof.is_not_real)[:5]):
        centre, radii, is_real = certify_in_balls(solutions[row], points, size_of(points))
        # Both hold the same solution, so they meet.
        assert (np.abs(centre - proof.centres[row]) <= radii + proof.radii[row]).all()
        assert is_real == proof.is_real[row]


def test_what_is_not_proved():
    points = points_of("nine_oval")
    found = solved("nine_oval")
    rows = found.real[:3]
    size = size_of(points)
    # Members of one class are not distinct; another class is.
    members = np.concatenate([found.solutions[rows], cognate(exchange(found.solutions[rows[:1]]))])
    proof = certify(members, points, size)
    assert proof.is_proved.all()
    assert proof.is_distinct.tolist() == [False, True, True, False]
    # No numbers, and numbers that Newton's method does not improve to a solution.
    random_numbers = np.full((1, 8), np.nan, dtype=complex)
    assert not certify(random_numbers, points, size).is_proved.any()
    zero_link = found.solutions[rows[:1]].copy()
    zero_link[:, [0, 1]] = 0.0
    assert not certify(zero_link, points, size).is_proved.any()
