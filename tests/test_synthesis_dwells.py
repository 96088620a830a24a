"""Slider dwells: fits against brute force, the example of the specification, and the search."""

import numpy as np
import pytest

from explore.errors import RequestError
from explore.synthesis.dwells import (
    DwellTask,
    find_dwell,
    fit_circles,
    measure,
    narrowest_ring,
    slider_positions,
)
from explore.synthesis.linkages import FourBar

#: The example that a search found in place of the published one, whose lengths are lost: a dwell over 90 deg.
EXAMPLE = FourBar(0j, 5.757224 + 0j, 1.0, 1.726122, 5.270351, 0.242602 + 0.085111j)
START, DIRECTION = 2.026156, 2.849028


def arc(count):
    return EXAMPLE.points(START + np.linspace(0, np.pi / 2, count))


def test_exact_circles():
    rng = np.random.default_rng(11)
    centres, radii = rng.normal(size=(20, 2)) @ [1, 1j], rng.uniform(0.1, 50, 20)
    angles = rng.uniform(0, 6) + np.linspace(0, 0.7, 15)
    found = fit_circles(centres[:, None] + radii[:, None] * np.exp(1j * angles))
    assert found.centres == pytest.approx(centres, abs=1e-10)
    assert found.radii == pytest.approx(radii, rel=1e-11)
    assert found.deviations.max() < 1e-12


def test_a_fit_is_a_minimum_of_the_squares():
    points = arc(19)
    found = fit_circles(points[None])

    def squares(centre):
        distances = np.abs(points - centre)
        return np.sum((distances - distances.mean()) ** 2)

    least = squares(found.centres[0])
    for step in 1e-4 * np.exp(1j * np.arange(8)):
        assert squares(found.centres[0] + step) > least


def test_the_narrowest_ring():
    """No neighbour of its centre has a narrower ring, and four points touch it, in turn inside and outside."""
    points = arc(181)
    centre, radius = narrowest_ring(points)
    width = np.ptp(np.abs(points - centre))
    for step in 1e-5 * np.exp(1j * np.arange(8)):
        assert np.ptp(np.abs(points - centre - step)) > width
    errors = np.abs(points - centre) - radius
    touching = errors[np.abs(errors) > 0.5 * width * (1 - 1e-6)]
    assert len(touching) >= 4
    assert (np.diff(np.sign(touching)) != 0).sum() >= 3
    assert width < 2 * fit_circles(points[None]).deviations[0]


def test_the_example_of_the_specification():
    """With a circle by the algebraic fit to 19 marks, as there."""
    points = arc(19)
    matrix = np.column_stack([2 * points.real, 2 * points.imag, np.ones(19)])
    x, y, rest = np.linalg.lstsq(matrix, np.abs(points) ** 2, rcond=None)[0]
    radius = np.sqrt(rest + x * x + y * y)
    assert (x, y, radius) == pytest.approx((0.615385, 0.273349, 1.306634), abs=3e-6)
    arguments = np.array([radius]), np.array([x + 1j * y]), np.array([DIRECTION])
    rest, _ = slider_positions(arc(3601)[None], *arguments)
    travel, sines = slider_positions(EXAMPLE.points(START + np.linspace(0, 2 * np.pi, 7201))[None], *arguments)
    assert np.ptp(rest) == pytest.approx(0.00665, abs=1e-5)
    assert np.ptp(travel) == pytest.approx(1.48, abs=1e-4)
    assert np.degrees(np.arcsin(np.abs(sines).max())) == pytest.approx(50, abs=0.6)
    # The narrowest ring of the whole arc does better than that fit to the whole arc.
    assert measure(EXAMPLE, START, np.pi / 2, DIRECTION).error < 0.00764


def test_a_slider_keeps_its_distance():
    found = measure(EXAMPLE, START, np.pi / 2, DIRECTION)
    points = EXAMPLE.points(np.linspace(START, START + 2 * np.pi, 100))
    arguments = np.array([found.link]), np.array([found.centre]), np.array([DIRECTION])
    travel, _ = slider_positions(points[None], *arguments)
    slider = found.centre + travel[0] * np.exp(1j * DIRECTION)
    assert np.abs(slider - points) == pytest.approx(found.link, rel=1e-14)


def test_the_search_beats_the_example():
    task = DwellTask(np.pi / 2, 1.48, np.radians(35), np.radians(50))
    found = find_dwell(task, generations=150)
    assert found.stroke >= 1.47
    assert found.error / found.stroke < 0.0045
    assert np.degrees(found.pressure_angle_max) <= 50.5
    angles = found.linkage.transmission_angles(np.linspace(0, 2 * np.pi, 361))
    assert np.degrees(np.minimum(angles, np.pi - angles).min()) > 34.9


def test_what_does_not_exist():
    with pytest.raises(RequestError, match="no dwell within these limits"):
        find_dwell(DwellTask(np.pi, 5.0, np.radians(80), np.radians(5)), generations=5)
    with pytest.raises(RequestError, match="does not reach the guide"):
        measure(EXAMPLE, START, np.pi / 2, 0.9)
