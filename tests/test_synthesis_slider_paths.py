"""The guide-offset method: reference values, and slider-cranks found again from the path that they draw."""

import numpy as np
import pytest
from synthesis_cases import case, spline_path

from explore.synthesis.slider_paths import _guide, closed_spline, find_guide, reach_path

PIVOT = 3.64 + 4.56j


def slider_offsets(followers, rod, beta, direction):
    """Offsets of the slider's pin across the guide from the crank's pivot; beta is between the sides of the coupler."""
    crank, side = followers.crank_angles, followers.side_angles
    return -(followers.crank * np.sin(crank - direction) + rod * np.sin(side - beta - direction))


def test_the_closed_spline():
    _, outputs = case("scpath_spline")
    expected = [complex(float(x), float(y)) for x, y in outputs["mid_segment_points"]]
    assert closed_spline(spline_path(), 2)[1::2] == pytest.approx(expected, rel=1e-15)
    assert (closed_spline(spline_path(), 1) == spline_path()).all()


@pytest.mark.parametrize("per_chord", [1, 5, 10, 20])
def test_offsets_of_the_published_design(per_chord):
    inputs, outputs = case(f"scpath_SE_J{per_chord}")
    followers = reach_path(closed_spline(spline_path(), per_chord), PIVOT, 1)
    offsets = slider_offsets(followers, 5.92, np.radians(15.5), np.radians(25.31))
    assert (followers.crank, followers.side) == pytest.approx((float(outputs["L1"]), float(outputs["L3"])), rel=1e-14)
    expected = (float(outputs["e_max"]), float(outputs["e_min"]))
    assert (offsets.max(), offsets.min()) == pytest.approx(expected, rel=1e-13)
    error = np.ptp(offsets) + abs((offsets.max() + offsets.min()) / 2 - float(inputs["E"]))
    assert error == pytest.approx(float(outputs["SE"]), rel=1e-12)
    turned = np.diff(np.unwrap(np.append(followers.crank_angles, followers.crank_angles[0])))
    assert (turned > 0.0).all() or (turned < 0.0).all(), "the crank turns in one sense"


def test_the_linear_programme_of_the_published_pivot():
    """The best guide on a grid of whole degrees has an error of 0.1284741 at 25 deg; between them it is less."""
    followers = reach_path(closed_spline(spline_path(), 10), PIVOT, 1)
    best = min((_guide(followers, angle, 8.0) for angle in np.radians(np.arange(180))), key=lambda guide: guide.error)
    assert best.error == pytest.approx(0.1284741, abs=5e-8)
    found = [np.degrees(best.direction), best.rod, np.degrees(best.beta), best.offset]
    assert found == pytest.approx([25.0, 5.98132, 16.8021, 2.69671], abs=1e-4)
    improved = find_guide(followers, 8.0)
    assert best.error - 1e-3 < improved.error < best.error
    offsets = slider_offsets(followers, improved.rod, improved.beta, improved.direction)
    assert np.ptp(offsets) == pytest.approx(improved.error, abs=1e-6)  # the tolerance of the programme


def test_the_path_of_a_slider_crank_has_no_error():
    """The guides and lengths of 50 slider-cranks are found again from 720 points of their paths."""
    rng = np.random.default_rng(10)
    done = 0
    while done < 50:
        crank, side, rod = 1.0, rng.uniform(1.5, 3.0), rng.uniform(2.0, 4.0)
        beta, direction, offset = rng.uniform(-1, 1), rng.uniform(0, np.pi), rng.uniform(-0.5, 0.5)
        angles = np.linspace(0, 2 * np.pi, 720, endpoint=False)
        # Slider at offset across the direction: the rod's angle from crank and offset.
        rod_angles = direction + np.arcsin(-(offset + crank * np.sin(angles - direction)) / rod)
        points = crank * np.exp(1j * angles) + side * np.exp(1j * (rod_angles + beta))
        distances = np.abs(points)
        peaks = np.sum((distances > np.roll(distances, 1)) & (distances > np.roll(distances, -1)))
        if peaks != 1 or distances.min() < 0.1:
            continue
        done += 1
        followers = reach_path(points, 0j, 1)
        if np.abs(np.angle(np.exp(1j * (followers.crank_angles - angles)))).max() > 0.2:
            followers = reach_path(points, 0j, -1)
        # The extreme distances are between two points, half a degree apart: second order in that.
        assert (followers.crank, followers.side) == pytest.approx((crank, side), abs=1e-3)
        offsets = slider_offsets(followers, rod, beta, direction)
        assert offsets == pytest.approx(offset, abs=0.05)


def test_a_pivot_inside_the_path_exchanges_crank_and_side():
    points = 2 * np.exp(1j * np.linspace(0, 2 * np.pi, 40, endpoint=False)) + 0.5
    inside = reach_path(points, 0j, 1)
    assert inside.crank > inside.side
    outside = reach_path(points, 5 + 0j, 1)
    assert outside.crank < outside.side
