"""Four-bars through three points at given crank angles: the reference, and the linkage that made the points."""

import numpy as np
import pytest
from synthesis_cases import case, plane

from explore.base.errors import RequestError
from explore.synthesis.linkages import FourBar
from explore.synthesis.timed_points import find_chains, find_four_bars


def test_reference():
    inputs, outputs = case("path3pt_1")
    points, angles = np.array([plane(pair) for pair in inputs["P"]]), np.array([float(a) for a in inputs["phi_rad"]])
    alpha, beta, side = (float(inputs[name]) for name in ("alpha_rad", "beta_rad", "theta1_rad"))
    cranks = {round(chain.first, 6): chain for chain in find_chains(points, angles, alpha)}
    found = find_four_bars(points, angles, alpha, beta, side)
    assert (len(cranks), len(found)) == (2, 4)
    for solution in outputs["solutions"]:
        chain = cranks[round(float(solution["r2"]), 6)]
        # The three equations have a condition of 2e3.
        lengths = [abs(chain.pivot), chain.first, chain.second]
        assert lengths == pytest.approx([float(solution[name]) for name in ("r1", "r2", "r3")], rel=1e-11)
        for second in solution["second"]:
            pivot, rocker = float(second["r4"]), float(second["r5"])
            near = [link for link in found if abs(abs(link.rocker_pivot) - pivot) < 1e-9 * pivot]
            assert any(link.rocker == pytest.approx(rocker, rel=1e-11) for link in near)


def test_every_solution_is_at_the_first_point_and_the_source_at_all():
    inputs, _ = case("path3pt_1")
    points, angles = np.array([plane(pair) for pair in inputs["P"]]), np.array([float(a) for a in inputs["phi_rad"]])
    found = find_four_bars(points, angles, *(float(inputs[name]) for name in ("alpha_rad", "beta_rad", "theta1_rad")))
    errors = np.array([np.abs(linkage.points(angles) - points) for linkage in found])
    assert errors[:, 0].max() < 1e-11
    # One of the four changes its branch between the points.
    assert sorted(errors.max(axis=1) < 1e-11) == [False, True, True, True]


def test_random_linkages_are_found_again():
    """1,000 linkages from their points, crank angles, directions of pivots and angle of the coupler's side."""
    rng = np.random.default_rng(9)
    for _ in range(1000):
        while True:
            point = complex(*rng.normal(size=2))
            pivots = rng.normal(size=(2, 2)) @ [2, 2j] + 3
            linkage = FourBar(*pivots.tolist(), *rng.uniform(0.3, 3, 3).tolist(), point)
            angles = rng.uniform(0, 2 * np.pi) + np.cumsum(rng.uniform(0.4, 1.2, 3))
            points, ends = linkage.points(angles), linkage.rocker_pins(angles)
            if np.isfinite(points).all():
                break
        side = np.angle(points[0] - ends[0])
        try:
            found = find_four_bars(points, angles, np.angle(pivots[0]), np.angle(pivots[1]), side)
        except RequestError:
            continue
        near = [abs(each.rocker_pivot - linkage.rocker_pivot) + abs(each.point - point) for each in found]
        assert min(near) < 1e-5


def test_points_that_are_not_independent():
    with pytest.raises(RequestError, match="not independent"):
        find_chains(np.array([1j, 1j, 2j]), np.array([0.5, 0.5, 1.0]), 0.3)
