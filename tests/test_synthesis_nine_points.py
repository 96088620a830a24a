"""All four-bars through nine points: derivatives, start systems, public problems, planted linkages, and proofs."""

from functools import cache

import numpy as np
import pytest
from flint import acb, arb, ctx
from synthesis_cases import are_proved, case, plane, points_of, real_linkages

from explore.base.errors import RequestError
from explore.synthesis.linkages import FourBar
from explore.synthesis.nine_points import certificates
from explore.synthesis.nine_points.ball_certificates import certify_in_balls
from explore.synthesis.nine_points.certificates import certify
from explore.synthesis.nine_points.classes import N_CLASSES, cognate, distinct, exchange, keys, members, residuals
from explore.synthesis.nine_points.discs import Discs, exact, product
from explore.synthesis.nine_points.endgame import REGULAR
from explore.synthesis.nine_points.equations import linearise
from explore.synthesis.nine_points.homotopy import solve, start_system
from explore.synthesis.nine_points.regularity import evaluate
from explore.synthesis.nine_points.solving import find_all


def test_derivatives_against_complex_differences():
    rng = np.random.default_rng(16)

    def random(count):
        return rng.normal(size=count) + 1j * rng.normal(size=count)

    z, parameters, rates = random(8), random(16), random(16)
    jacobian, values, by_time = np.empty((8, 8), complex), np.empty(8, complex), np.empty(8, complex)
    linearise(z, parameters, rates, jacobian, values, by_time)

    def relative_values(z, parameters):
        """Equations that are not divided by their derivatives, by the terms of Cramer's rule."""
        d, dh = parameters[:8], parameters[8:]
        x, xh, a, ah, y, yh, b, bh = z
        a1, b1, c1 = (ah - dh) * x, (a - d) * xh, d * (ah - xh) + dh * (a - x) - d * dh
        a2, b2, c2 = (bh - dh) * y, (b - d) * yh, d * (bh - yh) + dh * (b - y) - d * dh
        e, g, h = a1 * b2 - a2 * b1, b1 * c2 - b2 * c1, c1 * a2 - c2 * a1
        return g * h + e * (g + h)

    plain = relative_values(z, parameters)
    scale = values / plain
    assert np.abs(np.abs(scale.imag) / np.abs(scale)).max() < 1e-13
    step = 1e-6
    for k in range(8):
        moved = [relative_values(z + sign * step * (np.arange(8) == k), parameters) for sign in (1, -1)]
        expected = scale * (moved[0] - moved[1]) / (2 * step)
        assert jacobian[:, k] == pytest.approx(expected, rel=1e-7, abs=1e-8)
    moved = [relative_values(z, parameters + sign * step * rates) for sign in (1, -1)]
    assert by_time == pytest.approx(scale * (moved[0] - moved[1]) / (2 * step), rel=1e-7, abs=1e-8)


def test_equations_in_plain_arithmetic_are_those_in_compiled_code():
    """Certificates evaluate them in balls, which compiled code does not take; only the order of sums differs."""
    rng = np.random.default_rng(17)
    z, parameters = (rng.normal(size=(2, count)).T @ [1.0, 1.0j] for count in (8, 16))
    jacobian, values, by_time = np.empty((8, 8), complex), np.empty(8, complex), np.empty(8, complex)
    linearise(z, parameters, np.zeros(16, complex), jacobian, values, by_time)
    for j in range(8):
        value, row, _ = evaluate(z, parameters[j], parameters[8 + j])
        scale = max(abs(slope.real) + abs(slope.imag) for slope in row)
        # The largest derivative is 1: a few roundings of terms of its size.
        assert values[j] == pytest.approx(value / scale, rel=0.0, abs=1e-13)
        assert jacobian[j] == pytest.approx(np.array(row) / scale, rel=0.0, abs=1e-14)


@pytest.mark.parametrize("number", [0, 1])
def test_a_start_system_has_all_classes(number):
    solutions, parameters = start_system(number)
    assert len(distinct(solutions)) == len(solutions) == N_CLASSES
    assert residuals(solutions, parameters).max() < 1e-9
    # The six members of a class solve the same problem and have the same key.
    for others in np.split(members(solutions), 6)[1:]:
        assert np.quantile(residuals(others, parameters), 0.99) < 1e-9
        assert np.quantile(np.abs(keys(others) - keys(solutions)).max(axis=1), 0.99) < 1e-9
    third = cognate(cognate(cognate(solutions)))
    assert np.quantile(np.abs(third - solutions).max(axis=1), 0.99) < 1e-9


def test_one_start_system_leads_to_all_solutions_of_the_other():
    solutions, parameters = start_system(1)
    found = solve(parameters, 0)
    assert found.count(REGULAR) == N_CLASSES
    both = np.concatenate([found.regular, solutions])
    assert len(distinct(both)) == N_CLASSES


@pytest.mark.parametrize(("name", "n_real"), [("nine_wampler", 21), ("nine_oval", 45)])
def test_public_problems(name, n_real):
    points = points_of(name)
    found = find_all(points)
    assert found.is_complete
    linkages = real_linkages(found, points)
    assert (len(found.real), len(linkages)) == (n_real, 3 * n_real)
    for linkage in linkages:
        assert distances(linkage, points).max() < 1e-7


def test_the_reference_case():
    inputs, outputs = case("path9pt_1")
    expected = {name: float(value) for name, value in outputs["one_solution"].items()}
    points = np.array([plane(pair) for pair in inputs["points"]])
    found = find_all(points)
    assert found.is_complete
    pivot = complex(expected["xA"], expected["yA"])
    near = [each for each in real_linkages(found, points) if abs(each.crank_pivot - pivot) < 1e-9 and each.crank < 1.01]
    (linkage,) = [each for each in near if abs(each.ground - expected["d"]) < 1e-9]
    assert (linkage.crank, linkage.rocker) == pytest.approx((expected["a"], expected["c"]), rel=1e-10)
    side, other = abs(linkage.point) * linkage.coupler, abs(1 - linkage.point) * linkage.coupler
    assert (side, other) == pytest.approx((expected["e"], expected["f"]), rel=1e-10)


def distances(linkage, points):
    """How far a pin is from its circle where the coupler point is at each point, with the coupler's other pin on its
    own.

    Nothing here is shared with the equations that were solved: circles around the point and the crank's pivot meet
    where the crank's pin is, in two places, and the rocker's pin follows from the coupler's shape.
    """
    arm = abs(linkage.point) * linkage.coupler
    errors = []
    for point in points:
        diagonal = point - linkage.crank_pivot
        length = abs(diagonal)
        along = (length**2 + linkage.crank**2 - arm**2) / (2 * length)
        across = np.sqrt(complex(linkage.crank**2 - along**2)).real
        pins = [linkage.crank_pivot + diagonal / length * (along + 1j * sign * across) for sign in (1, -1)]
        ends = [pin + (point - pin) / linkage.point for pin in pins]
        errors.append(min(abs(abs(end - linkage.rocker_pivot) - linkage.rocker) for end in ends))
    return np.array(errors) / linkage.rocker


def planted(rng):
    while True:
        pivots, point = rng.normal(size=(2, 2)) @ [1, 1j], complex(*rng.normal(size=2))
        linkage = FourBar(*(2 * pivots).tolist(), *rng.uniform(0.5, 3, 3).tolist(), point)
        angles = rng.uniform(0, 2 * np.pi) + np.arange(9) * rng.uniform(0.2, 0.7)
        points = linkage.points(angles)
        if np.isfinite(points).all():
            return linkage, points


def misses(count, seed):
    rng, number = np.random.default_rng(seed), 0
    for _ in range(count):
        linkage, points = planted(rng)
        found = find_all(points)
        number += not any(
            abs(other.crank_pivot - linkage.crank_pivot) + abs(other.rocker_pivot - linkage.rocker_pivot) < 1e-4
            or abs(other.rocker_pivot - linkage.crank_pivot) + abs(other.crank_pivot - linkage.rocker_pivot) < 1e-4
            for other in real_linkages(found, points)
        )
    return number


@pytest.mark.parametrize(("count", "seed"), [(1, 17), pytest.param(200, 18, marks=pytest.mark.slow)])
def test_planted_linkages_are_found(count, seed):
    assert misses(count, seed) == 0


def test_points_that_determine_no_set():
    points = points_of("nine_oval")
    with pytest.raises(RequestError, match="nine points determine"):
        find_all(points[:8])
    with pytest.raises(RequestError, match="points 3 and 8 are equal"):
        find_all(np.concatenate([points[:7], points[[2]], points[8:]]))


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
