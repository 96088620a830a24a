"""Dyads for three, four and five poses: reference values, and the linkage that made the poses."""

import numpy as np
import pytest
from synthesis_cases import case, plane

from explore.base.errors import RequestError
from explore.synthesis.linkages import FourBar
from explore.synthesis.poses import Dyad, Poses, burmester_curves, find_dyads, fixed_pivots


def length(dyad):
    return abs(dyad.moving - dyad.fixed)


def largest_residual(poses, dyad):
    """The largest change of the distance of the pivots over the poses, relative to the distance."""
    rotations, shifts = poses.displacements()
    distances = np.abs(rotations * dyad.moving + shifts - dyad.fixed)
    return np.abs(distances - length(dyad)).max() / length(dyad)


def reference(count=5):
    inputs, outputs = case("guidance_1")
    points = np.array([plane(pose["P"]) for pose in inputs["poses"][:count]])
    return Poses(points, np.array([float(pose["angle_rad"]) for pose in inputs["poses"][:count]])), outputs


def test_all_dyads_of_five_poses():
    poses, outputs = reference()
    found = {round(length(dyad), 6): dyad for dyad in find_dyads(poses)}
    expected = outputs["real_dyads_5pos"]
    assert len(found) == len(expected) == 4
    for row in expected:
        dyad = found[round(float(row["length"]), 6)]
        # The pivots far away are ill-conditioned.
        assert dyad.moving == pytest.approx(plane(row["moving"]), rel=1e-11, abs=1e-13)
        assert dyad.fixed == pytest.approx(plane(row["fixed"]), rel=1e-11, abs=1e-13)
        assert largest_residual(poses, dyad) < 1e-13


def test_fixed_pivots_of_three_poses():
    poses, outputs = reference(3)
    found = fixed_pivots(poses, np.array([1 + 0.5j, 3 + 2j]))
    expected = [outputs[f"fixed_pivot_3pos_for_moving_{name}"] for name in ("1_0p5", "3_2")]
    assert found == pytest.approx([plane(pair) for pair in expected], rel=1e-13)


def test_fixed_pivots_of_points_on_a_line_do_not_exist():
    poses = Poses(np.array([0, 1, 3 + 0j]), np.zeros(3))
    assert np.isnan(fixed_pivots(poses, np.array([5j]))[0])


def random_motion(rng, count):
    """A linkage of any kind with poses of its coupler on one branch, and the pins in the first pose."""
    while True:
        pivot, point = complex(*(3 * rng.normal(size=2))), complex(*rng.normal(size=2))
        linkage = FourBar(complex(*rng.normal(size=2)), pivot, *rng.uniform(0.3, 4, 3).tolist(), point)
        angles = rng.uniform(0, 2 * np.pi) + np.cumsum(rng.uniform(0.1, 0.8, count))
        pins, ends = linkage.crank_pins(angles), linkage.rocker_pins(angles)
        if np.isfinite(ends).all() and linkage.ground > 0.1:
            return linkage, Poses(linkage.points(angles), np.angle(ends - pins)), pins[0], ends[0], angles


def distance(dyad, fixed, moving):
    return abs(dyad.fixed - fixed) + abs(dyad.moving - moving)


def test_five_poses_of_random_linkages():
    """Both links of all 1,000 linkages are among the dyads, of which there are four or two, never more."""
    rng = np.random.default_rng(7)
    for _ in range(1000):
        linkage, poses, pin, end, _ = random_motion(rng, 5)
        dyads = find_dyads(poses)
        assert len(dyads) in (2, 4)
        for fixed, moving in ((linkage.crank_pivot, pin), (linkage.rocker_pivot, end)):
            # Neighbouring poses are ill-conditioned: steps of 0.1 rad, to the fourth power.
            assert min(distance(dyad, fixed, moving) for dyad in dyads) < 1e-6
        assert max(largest_residual(poses, dyad) for dyad in dyads) < 1e-9


def test_four_poses_of_random_linkages():
    """With the angle that the crank turned, one of the two dyads is the crank, for 1,000 linkages."""
    rng = np.random.default_rng(8)
    for _ in range(1000):
        linkage, poses, pin, _, angles = random_motion(rng, 4)
        fixed, moving = burmester_curves(poses, np.array([angles[1] - angles[0]]))
        dyads = [Dyad(*pair) for pair in zip(fixed[:, 0].tolist(), moving[:, 0].tolist(), strict=True)]
        assert min(distance(dyad, linkage.crank_pivot, pin) for dyad in dyads) < 1e-7


def test_the_burmester_curve_meets_the_dyads_of_five_poses():
    """The curves of the first four poses pass through the dyads that also meet the fifth."""
    poses, _ = reference()
    four = Poses(poses.points[:4], poses.angles[:4])
    rotations, shifts = four.displacements()
    for dyad in find_dyads(poses):
        second = rotations[0] * dyad.moving + shifts[0]
        angle = np.angle((second - dyad.fixed) / (dyad.moving - dyad.fixed))
        fixed, moving = burmester_curves(four, np.array([angle]))
        near = [distance(Dyad(f, m), dyad.fixed, dyad.moving) for f, m in zip(fixed[:, 0], moving[:, 0], strict=True)]
        assert min(near) < 1e-9 * max(1.0, length(dyad))


def test_all_points_of_a_burmester_curve_are_dyads():
    poses, _ = reference(4)
    fixed, moving = burmester_curves(poses, np.linspace(0.01, 6.27, 500))
    pairs = [Dyad(f, m) for f, m in zip(fixed.ravel(), moving.ravel(), strict=True) if np.isfinite(f)]
    assert len(pairs) > 500
    assert max(largest_residual(poses, pair) for pair in pairs) < 1e-9


def test_poses_that_determine_no_dyads():
    points = np.array([0, 1, 2 + 1j, 3, 4 - 1j])
    with pytest.raises(RequestError, match="five poses"):
        find_dyads(Poses(points[:4], np.zeros(4)))
    # Translations move all points alike, so that none is singled out.
    with pytest.raises(RequestError, match="the same angle"):
        find_dyads(Poses(points, np.zeros(5)))
    with pytest.raises(RequestError, match="poses 2 and 5 are alike"):
        find_dyads(Poses(np.array([0, 1, 2 + 1j, 3, 1]), np.array([0.0, 0.3, 0.4, 0.1, 0.3])))
