"""Tables that mechanisms declare: their graphs move as the hand-written kernels do."""

import numpy as np
import pytest

import explore
from explore.mechanisms.linkages.declared import table_of
from explore.mechanisms.registry import MECHANISMS

#: Signals of the tables by those of the mechanisms.
NAMES = {
    "transmission_angle": "rocker joint_transmission_angle",
    **{f"slider_{rate}": f"slider_{rate}" for rate in ("position", "velocity", "acceleration")},
    **{
        f"{link}_{rate}": f"{link}_{rate}"
        for link in ("coupler", "rocker", "rod")
        for rate in ("velocity", "acceleration")
    },
}
ANGLES = [0.0, 1e-7, 1e-3, 1.0, 40.0, 89.9999, 90.0, 179.0, 180.0, 180.001, 250.0, 270.0, 359.999999]


def four_bars(rng):
    """Ones near change points by 1e-9 to 0.1, near kites that are parallelograms, with a tiny crank; a double crank."""
    for gap in 10.0 ** rng.uniform(-9.0, -1.0, 12):
        crank, coupler, rocker = rng.uniform(5.0, 40.0), *rng.uniform(50.0, 300.0, 2)
        yield crank, coupler, rocker, abs(coupler - rocker) + crank * (1.0 + gap)
        yield crank, coupler, rocker, coupler + rocker - crank * (1.0 + gap)
    for near in (1e-9, 1e-6, 1e-3):
        yield 100.0, 200.0, 200.0 + near, 100.0 + 2.0 * near
    yield 1e-4, 90.0, 70.0, 100.0
    yield 200.0, 180.0, 210.0, 80.0  # a double crank


def slider_cranks(rng):
    """Random ones, and ones near change points, where h, the crank's height over the line, nearly cancels the rod."""
    for gap in 10.0 ** rng.uniform(-2.0, -1.0, 12):
        crank, offset = rng.uniform(5.0, 90.0), rng.uniform(-60.0, 60.0)
        yield crank, (crank + abs(offset)) * (1.0 + gap), offset
        yield crank, rng.uniform(1.1, 5.0) * (crank + abs(offset)), offset


CASES = {
    "crank-rocker": [
        dict(zip(("crank", "coupler", "rocker", "ground", "branch"), (*lengths, branch), strict=True))
        for lengths in four_bars(np.random.default_rng(1))
        for branch in (1.0, -1.0)
    ],
    "test-rig": [
        dict(zip(("crank", "coupler", "rocker", "ground"), lengths, strict=True))
        for lengths in [*four_bars(np.random.default_rng(2))][:-1]
    ],
    "slider-crank": [
        dict(zip(("crank", "rod", "offset"), lengths, strict=True))
        for lengths in slider_cranks(np.random.default_rng(3))
    ],
}


@pytest.mark.parametrize("mechanism", CASES)
def test_a_table_moves_as_its_mechanism(mechanism):
    """To 1e-14 of the largest value, as both are sums of positive terms, near change points and kites too."""
    table = MECHANISMS.of_table(table_of(MECHANISMS[mechanism]))
    for design in CASES[mechanism]:
        expected = explore.simulate(mechanism, {**design, "speed": 1.0}, angles=ANGLES)
        found = explore.simulate(table.name, {**design, "speed": 1.0}, angles=ANGLES)
        for name in NAMES.keys() & set(expected):
            difference = np.abs(found[NAMES[name]].to_numpy() - expected[name].to_numpy()).max()
            assert difference <= 1e-14 * np.abs(expected[name]).max(), (name, design)


PINS = {"a": "crank pivot_force_on_frame", "b": "crank joint_force_on_coupler", "c": "rocker joint_force_on_rocker",
        "d": "rocker pivot_force_on_frame"}  # fmt: skip
#: Signals under load of the tables by the signals of the mechanisms.
FORCES = {
    **{f"pin_force_{pin}": name for pin, name in PINS.items()},
    "drive_torque": "drive_torque", "power": "drive_power", "drive_power": "drive_power",
    "positive_power": "positive_power", "friction_power": "friction_power", "guide_force": "slider_normal_force",
    "crank_pivot_force": "crank pivot_force_on_frame", "crank_pin_force": "crank pin_force_on_rod",
    "slider_pin_force": "slider pin_force_on_rod",
}  # fmt: skip
ANGLES_OF_LOADS = [0.3, 17.0, 89.0, 133.0, 181.0, 222.0, 301.0, 347.0]


@pytest.mark.parametrize("mechanism", CASES)
def test_forces_of_a_table_are_those_of_its_mechanism(mechanism):
    """To 3e-14 of the largest value, with all loads, of designs that are off their limits by 0.1 % or more."""
    rng, table = np.random.default_rng(8), MECHANISMS.of_table(table_of(MECHANISMS[mechanism]))
    loads = {p.name: p for p in MECHANISMS[mechanism].parameters if p.affects == "load" and p.name != "gravity"}
    if mechanism == "slider-crank":
        designs = [{"crank": 40.0, "rod": 90.0 + 20.0 * k, "offset": 5.0 * k - 10.0} for k in range(6)]
    else:
        lengths = [(50.0, 200.0, 120.0, 180.0), (40.0, 90.0, 160.0, 170.0), (30.0, 301.0, 300.0, 100.0)] * 2
        designs = [dict(zip(("crank", "coupler", "rocker", "ground"), each, strict=True)) for each in lengths]
    for number, design in enumerate(designs):
        values = {name: float(rng.uniform(0.1, 0.9)) for name in loads} | {"gravity": 9.0, "speed": 20.0}
        values |= {"branch": 1.0 - 2.0 * (number % 2)} if mechanism == "crank-rocker" else {}
        values |= {"friction": 0.2} if mechanism == "slider-crank" else {}
        expected = explore.simulate(mechanism, design | values, angles=ANGLES_OF_LOADS)
        found = explore.simulate(table.name, design | values, angles=ANGLES_OF_LOADS)
        names = FORCES.keys() & set(expected)
        assert len(names) >= 8
        for name in names:
            difference = np.abs(found[FORCES[name]].to_numpy() - expected[name].to_numpy()).max()
            assert difference <= 3e-14 * np.abs(expected[name]).max(), (name, design)


@pytest.mark.parametrize("mechanism", ["crank-rocker", "test-rig", "slider-crank"])
def test_a_table_has_the_names_of_the_drawing_and_the_points_of_a_user(mechanism):
    own = MECHANISMS[mechanism]
    table, link = table_of(own), own.floating_link
    assert set(table.points) == set(own.drawing.points)
    assert {body.name for body in table.links} == {each.name for each in own.drawing.links}
    assert {parameter.name for parameter in table.parameters} <= {parameter.name for parameter in own.parameters}
    more = table_of(own.with_points(("knife", "tip")))
    first, _, *added = more.body_of[link.name].place_of
    assert [first, *added] == [link.origin, "knife", "tip"]
    assert [each.name for each in more.parameters[-4:]] == ["knife_along", "knife_across", "tip_along", "tip_across"]
    design = CASES[mechanism][1]
    columns = {**design, "knife_along": 30.0, "knife_across": -7.0, "tip_along": 1.0, "tip_across": 50.0, "speed": 1.0}
    found = explore.simulate(MECHANISMS.of_table(more).name, columns, angles=ANGLES)
    points = {"knife": (30.0, -7.0), "tip": (1.0, 50.0)}
    expected = explore.simulate(mechanism, {**design, "speed": 1.0}, points=points, angles=ANGLES)
    for name in [name for name in expected if name.startswith(("knife", "tip"))]:
        assert np.abs(found[name] - expected[name]).max() <= 1e-13 * np.abs(expected[name]).max(), name
