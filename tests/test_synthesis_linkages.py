"""Coupler curves and cognates: reference values, the sextic of the curve, the same path by three linkages."""

import json

import numpy as np
import pytest
from synthesis_cases import _FILE, case, plane

from explore.base.errors import RequestError
from explore.synthesis.cognates import find_cognates, third_pivot
from explore.synthesis.linkages import FourBar

CASES = ["coupler_1", "coupler_2", "coupler_3"]


def linkage_of(inputs, branch=1):
    crank, coupler, rocker, ground = (float(inputs[name]) for name in ("crank", "coupler", "rocker", "ground"))
    return FourBar(0j, complex(ground), crank, coupler, rocker, plane(inputs["kappa"]), branch)


def samples(name):
    return next(c for c in json.loads(_FILE.read_text(encoding="utf-8"))["cases"] if c["id"] == name)["samples"]


@pytest.mark.parametrize("name", CASES)
def test_positions_are_those_of_the_reference(name):
    inputs, outputs = case(name)
    for sample in samples(name):
        linkage = linkage_of(inputs, sample["branch"])
        angle = np.radians([float(sample["theta_deg"])])
        assert linkage.crank_pins(angle)[0] == pytest.approx(plane(sample["A"]), abs=1e-15)
        assert linkage.rocker_pins(angle)[0] == pytest.approx(plane(sample["B"]), abs=5e-15)
        assert linkage.points(angle)[0] == pytest.approx(plane(sample["M"]), abs=1e-14)
    assert linkage_of(inputs).is_crank_turning == outputs["grashof"]
    assert third_pivot(linkage_of(inputs)) == pytest.approx(plane(outputs["third_pivot"]), abs=1e-15)


@pytest.mark.parametrize("name", CASES)
def test_lengths_of_the_cognates(name):
    inputs, outputs = case(name)
    at_crank, at_third = find_cognates(linkage_of(inputs))
    own, other = outputs["cognate2"], outputs["cognate3"]
    names = ("crank_at_A0", "coupler", "rocker_at_K", "ground")
    assert at_crank.lengths == pytest.approx([float(own[n]) for n in names], rel=1e-15)
    names = ("link_at_K", "coupler", "link_at_B0", "ground")
    assert at_third.lengths == pytest.approx([float(other[n]) for n in names], rel=1e-15)


def sextic(linkage, points):
    """The equation of the coupler curve, relative to its terms (spec 1), with the frame on the x-axis."""
    a, b, c, d = linkage.lengths
    e, f = abs(linkage.point) * b, abs(1 - linkage.point) * b
    gamma = np.angle((1 - linkage.point) / -linkage.point)
    x, y = points.real, points.imag
    p, q = x**2 + y**2 + e**2 - a**2, (x - d) ** 2 + y**2 + f**2 - c**2
    cos, sin = np.cos(gamma), np.sin(gamma)
    u = f * ((x - d) * cos + y * sin) * p - e * x * q
    v = f * ((x - d) * sin - y * cos) * p + e * y * q
    w = 2 * e * f * (sin * (x * (x - d) + y**2) - d * y * cos)
    return (u**2 + v**2 - w**2) / (u**2 + v**2 + w**2)


@pytest.mark.parametrize("branch", [1, -1])
@pytest.mark.parametrize("name", CASES)
def test_the_path_is_on_the_sextic(name, branch):
    linkage = linkage_of(case(name)[0], branch)
    points = linkage.points(np.linspace(0.0, 2 * np.pi, 100))
    # Terms of sixth order cancel: a few rounding errors times the condition of the sums.
    assert np.abs(sextic(linkage, points)).max() < 1e-12


def random_linkages(count, seed):
    """Linkages of all kinds, each with an angle of the crank at which it can be assembled."""
    rng = np.random.default_rng(seed)
    found = []
    while len(found) < count:
        pivots, point = rng.normal(size=(2, 2)) @ [1, 1j], complex(*rng.normal(size=2))
        linkage = FourBar(*(3 * pivots).tolist(), *rng.uniform(0.3, 4, 3).tolist(), point, int(rng.choice([1, -1])))
        angle = float(rng.uniform(0, 2 * np.pi))
        if np.isfinite(linkage.rocker_pins([angle])[0]):
            found.append((linkage, angle))
    return found


def test_cognates_draw_the_same_path():
    """1,000 linkages: at the angles that Cayley's parallelograms give, both cognates are at the same point."""
    for linkage, angle in random_linkages(1000, 1):
        at_crank, at_third = find_cognates(linkage, angle)
        pin, point = linkage.crank_pins([angle])[0], linkage.points([angle])[0]
        first = np.angle(point - pin)
        second = np.angle((1 - linkage.point) * (pin - linkage.crank_pivot))
        # At a dead centre half of the digits are lost.
        assert at_crank.points([first])[0] == pytest.approx(point, abs=1e-6)
        assert at_third.points([second])[0] == pytest.approx(point, abs=1e-6)


def test_cognates_of_cognates_lead_back():
    for linkage, angle in random_linkages(100, 2):
        at_third = find_cognates(linkage, angle)[1]
        turned = np.angle((1 - linkage.point) * (linkage.crank_pins([angle])[0] - linkage.crank_pivot))
        back = find_cognates(at_third, turned)[1]
        assert back.lengths == pytest.approx(linkage.lengths, rel=1e-12)
        assert back.point == pytest.approx(linkage.point, rel=1e-12)
        assert (back.crank_pivot, back.branch) == (pytest.approx(linkage.crank_pivot, abs=1e-12), linkage.branch)


def test_transmission_angle_and_missing_positions():
    linkage = FourBar(0j, 4 + 0j, 1.0, 3.0, 2.0, 0.5 + 0j)
    # Crank along the frame: a triangle of 3, 2 and 3, or of 3, 2 and 5, which is flat.
    assert np.cos(linkage.transmission_angles([0.0])[0]) == pytest.approx(4 / 12, rel=1e-15)
    assert linkage.transmission_angles([np.pi])[0] == pytest.approx(np.pi, abs=1e-7)
    assert not linkage.is_crank_turning
    assert FourBar(0j, 4 + 0j, 1.0, 3.0, 2.5, 0.5 + 0j).is_crank_turning
    assert np.isnan(FourBar(0j, 4 + 0j, 1.0, 3.0, 0.5, 0.5 + 0j).points([np.pi])[0])


def test_what_has_no_cognates():
    with pytest.raises(RequestError, match="is a pin of the linkage"):
        find_cognates(FourBar(0j, 4 + 0j, 1.0, 3.5, 2.5, 0j))
    with pytest.raises(RequestError, match="cannot be assembled at the crank angle 3 rad"):
        find_cognates(FourBar(0j, 4 + 0j, 1.0, 2.5, 1.0, 0.5j), 3.0)
