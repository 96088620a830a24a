"""Slider points of three and four poses: reference values, and the slider-crank that made the poses."""

import numpy as np
import pytest
from synthesis_cases import case, plane

from explore.base.errors import RequestError
from explore.synthesis.poses import Poses
from explore.synthesis.slider_cranks import SliderCrank
from explore.synthesis.slider_dyads import find_slider_dyad, largest_offset, point_circle, pole_of


def reference(rows):
    inputs, _ = case("guidance_1")
    poses = [inputs["poses"][row] for row in rows]
    points = np.array([plane(pose["P"]) for pose in poses])
    return Poses(points, np.array([float(pose["angle_rad"]) for pose in poses]))


@pytest.mark.parametrize(
    ("rows", "centre", "radius"),
    [
        ((0, 1, 2), -11.903758 - 1.948924j, 16.237982),
        ((0, 1, 3), -23.235110 - 9.376389j, 29.460727),
    ],
)
def test_the_circles_of_the_reference_poses(rows, centre, radius):
    poses = reference(rows)
    circle = point_circle(poses)
    assert circle.centre == pytest.approx(centre, abs=5e-7)
    assert circle.radius == pytest.approx(radius, abs=5e-7)
    rotations, shifts = poses.displacements()
    for point in circle.points(np.linspace(0, 6, 9)):
        first, second = rotations * point + shifts - point
        assert (first.conjugate() * second).imag == pytest.approx(0, abs=1e-11)


def test_the_slider_point_of_the_reference_poses():
    poses = reference(range(4))
    dyad = find_slider_dyad(poses)
    assert dyad.moving == pytest.approx(-1.5274678265 + 10.5412584885j, abs=5e-10)
    assert np.degrees(dyad.direction) == pytest.approx(29.059429, abs=5e-7)
    assert largest_offset(poses, dyad) < 1e-12
    # The pole is on both circles, but no slider point.
    assert pole_of(poses) == pytest.approx(3.6889739581 + 2.5830473737j, abs=5e-10)


def missed(count, seed):
    """How many slider points of random slider-cranks are not those of four poses of their rods."""
    rng = np.random.default_rng(seed)
    misses = 0
    for _ in range(count):
        rod = rng.uniform(1.5, 6)
        crank = rng.uniform(0.2, 0.9) * rod
        offset = rng.uniform(-1, 1) * (rod - crank)
        linkage = SliderCrank(complex(*rng.normal(size=2)), crank, rod, offset, rng.uniform(0, np.pi), 0.3 + 0.4j)
        angles = rng.uniform(0, 2 * np.pi) + np.cumsum(rng.uniform(0.3, 1.2, 4))
        pins, sliders = linkage.crank_pins(angles), linkage.sliders(angles)
        poses = Poses(linkage.points(angles), np.angle(sliders - pins))
        dyad = find_slider_dyad(poses)
        apart = abs(np.angle(np.exp(2j * (dyad.direction - linkage.direction)))) / 2
        misses += abs(dyad.moving - sliders[0]) > 1e-6 * rod or apart > 1e-6 or largest_offset(poses, dyad) > 1e-6
    return misses


def test_the_sliders_of_1000_slider_cranks_are_found_again():
    """But for a few of which two poses have nearly the same angle, or the slider nearly is the pole."""
    assert missed(1000, 21) <= 3


@pytest.mark.parametrize(
    ("points", "angles", "message"),
    [
        ([0, 1, 2j], [0.0, 0.3, 0.6], "four poses"),
        ([0, 1, 2j, 3], [0.0, 0.0, 0.6, 0.7], "poses 1 and 2 have the same angle"),
        ([0, 1, 2j, 3], [0.0, 0.4, 0.4, 0.7], "two of the three poses have the same angle"),
        ([0, 1, 2j, 2j + 1e-12], [0.0, 0.4, 0.6, 0.6], "every point of a circle"),
        ([0, 0, 0, 0], [0.0, 0.4, 0.6, 0.8], "single out no slider point|no slider point but the pole"),
    ],
)
def test_poses_without_a_slider_point(points, angles, message):
    with pytest.raises(RequestError, match=message):
        find_slider_dyad(Poses(np.array(points, dtype=complex), np.array(angles)))


def test_three_poses_are_needed_for_a_circle():
    with pytest.raises(RequestError, match="three poses"):
        point_circle(Poses(np.array([0, 1j]), np.array([0.0, 1.0])))
