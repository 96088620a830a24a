"""Drivers of linkages: pins that are driven along slots, bars between two lines, and copies at other phases."""

import math
import tomllib

import mpmath
import numpy as np
import pytest
from linkage_cases import (
    BOOM,
    BOOM_LENGTHS,
    DRIVEN_SLIDER,
    OLDHAM,
    SLIDING_BAR,
    evaluate_graph,
    trace,
    trammel,
    trammel_of_blocks,
)

import explore
from explore import Linkage
from explore.studies.config.linkage import make_linkage
from explore.studies.config.study_file import linkage_starter


@pytest.mark.parametrize("offset", [0.0, 15.0])
def test_a_driven_pin_is_where_the_length_of_its_cylinder_puts_it(offset):
    """To 60 digits, rates by differences; the position is that of a sine between the two ends of the travel."""
    equations, values = trace(Linkage(BOOM)), BOOM_LENGTHS | {"offset": offset}
    position = equations.slot_position(equations.table.slots[0])
    step = mpmath.mpf(10) ** -25
    with mpmath.workdps(90):
        for angle in (mpmath.mpf("0.3"), mpmath.mpf("2.9"), mpmath.mpf("5.5")):
            numbers = [*(part.terms[0] for part in equations.points["B"]), position.terms[0]]
            x, y, s = evaluate_graph(numbers, values, angle)
            assert abs(s - (85 - 25 * mpmath.cos(angle))) < mpmath.mpf("1e-60")
            assert abs(mpmath.hypot(x, y) - mpmath.hypot(s, offset)) < mpmath.mpf("1e-60")
            assert abs(mpmath.hypot(x - 100, y) - 50) < mpmath.mpf("1e-60")
            for series in equations.points["P"]:
                before, place, after = (
                    evaluate_graph([series.terms[0]], values, angle + k * step)[0] for k in (-1, 0, 1)
                )
                velocity, acceleration = evaluate_graph(list(series.terms[1:]), values, angle)
                assert abs((after - before) / (2 * step) - velocity) < mpmath.mpf("1e-40")
                assert abs((after - 2 * place + before) / step**2 - acceleration) < mpmath.mpf("1e-20")


@pytest.mark.parametrize("offset", [0.0, 15.0])
def test_a_driven_slot_moves_as_a_sine(offset):
    """Its position, from the points that the motion leads to, with both rates, to rounding."""
    motion = explore.simulate(Linkage(BOOM), BOOM_LENGTHS | {"offset": offset}, angles=np.arange(3.0, 360.0, 7.0))
    angles = np.deg2rad(motion.index.to_numpy())
    middle, half = (0.5 * (BOOM_LENGTHS["high"] + sign * BOOM_LENGTHS["low"]) for sign in (1.0, -1.0))
    expected = [middle - half * np.cos(angles), half * np.sin(angles), half * np.cos(angles)]
    for kind, values in zip(("position", "velocity", "acceleration"), expected, strict=True):
        np.testing.assert_allclose(motion[f"cylinder_{kind}"], values, rtol=0, atol=1e-13)


def test_a_driven_pin_that_its_link_cannot_follow_has_a_status():
    row = explore.evaluate(Linkage(BOOM), BOOM_LENGTHS | {"high": 151.0}, metrics=["boom_angle_max"])
    assert row.attrs["labels"]["status"][row["status"].iloc[0]] == "crank_blocked_at_B"
    with pytest.raises(explore.MotionError, match="the driven pin cannot move over its travel: B is out of reach"):
        explore.simulate(Linkage(BOOM), BOOM_LENGTHS | {"high": 151.0})


def test_a_driven_pin_in_the_frame():
    """A slider that is driven: the rod's other end runs in a second slot, so the two keep its length."""
    equations = trace(Linkage(DRIVEN_SLIDER))
    positions = [equations.slot_position(slot).terms[0] for slot in equations.table.slots]
    for angle in (0.0, 0.5, 2.0, math.pi, 5.0):
        first, second = evaluate_graph(positions, {"t": 30.0, "l": 50.0}, angle)
        assert float(first) == pytest.approx(-30.0 * math.cos(angle), abs=1e-14)
        assert float(second) == pytest.approx(math.sqrt(50.0**2 - first**2), rel=1e-15)


def test_paths_of_a_rod_whose_end_is_driven_in_the_frame_have_their_curvature():
    """The ends run on two lines, and the middle on a circle of half the rod: the driven end is no pivot."""
    links = {"rod": {"P": 0, "Q": "l", "M": "l / 2"}}
    motion = explore.simulate(Linkage(DRIVEN_SLIDER | {"links": links}), {"t": 30.0, "l": 50.0}, angles=[20, 130, 300])
    for point, curvature in (("P", 0.0), ("Q", 0.0), ("M", 1.0 / 25.0)):
        assert motion[f"{point}_curvature"].abs().to_numpy() == pytest.approx([curvature] * 3, abs=1e-14), point


def test_the_bar_of_a_trammel_draws_an_ellipse():
    """With slots, and with blocks that only translate: M is at ((m - l) cos, m sin) of the bar's angle."""
    blocks = trammel_of_blocks()
    for linkage in (trammel(), blocks):
        x, y = trace(linkage).points["M"]
        for angle in (0.0, 0.5, math.pi / 2, 5.0):
            expected = (-70.0 * math.cos(angle), 30.0 * math.sin(angle))
            found = evaluate_graph([x.terms[0], y.terms[0]], {"l": 100.0, "m": 30.0}, angle)
            assert list(map(float, found)) == pytest.approx(expected, abs=3e-14)
    row = explore.evaluate(blocks, {"l": 100.0, "m": 30.0}, metrics=["M_velocity_x_peak"])
    assert row["M_velocity_x_peak"].iloc[0] == pytest.approx(70.0, rel=1e-15)


def test_the_middle_disc_of_an_oldham_coupling_is_where_its_lines_meet():
    linkage, angles = Linkage(OLDHAM), [0.0, 37.0, 90.0, 200.0]
    motion = explore.simulate(linkage, {"e": 8.0}, angles=angles)
    turns = np.exp(1j * np.deg2rad(angles))
    ways = turns * (1.0 + 2.0j)
    # O + t turn = Q + s way
    t = ((8.0 + 3.0j).conjugate() * ways).imag / (turns.conjugate() * ways).imag
    for point, places in (("M", t * turns), ("B", 8.0 + 3.0j + 50.0 * turns)):
        found = motion[f"{point}_x"] + 1j * motion[f"{point}_y"]
        assert np.abs(found - places).max() < 1e-13, point
    row = explore.evaluate(linkage, {"e": 8.0}, metrics=["M_velocity_x_peak"])
    assert row["M_velocity_x_peak"].iloc[0] == pytest.approx(math.hypot(8.0, 3.0) * math.hypot(1.0, 0.5), rel=1e-14)
    across = OLDHAM["slides"] | {"last": {"link": "middle", "direction": [-2, 0]}}
    with pytest.raises(explore.ConfigError, match="slides.middle: is parallel to the slide of last in all designs"):
        Linkage(OLDHAM | {"slides": across})


def test_forces_of_an_oldham_coupling_balance():
    """Power, and the sums of forces and of moments about O, with the second derivatives of places."""
    loads = {"torques": {"last": 5.0}, "forces": {"B": [-20, 7]}, "gravity": [0, -9.81],
             "masses": {"middle": {"mass": 2, "centroid": [3, 1], "inertia": 0.01}, "B": 3}}  # fmt: skip
    design = {"e": 8.0, "speed": 10.0}
    motion = explore.simulate(Linkage(OLDHAM | {"loads": loads}), design, angles=np.arange(0.0, 360.0, 15.0))

    def of(name):
        return (motion[f"{name}_x"] + 1j * motion[f"{name}_y"]).to_numpy()

    turns = np.exp(1j * np.deg2rad(motion.index.to_numpy()))
    arm = (3.0 + 1.0j) * turns
    bodies = ((2.0, of("M") + arm, of("M_velocity") + 10j * arm, of("M_acceleration") - 100.0 * arm),
              (3.0, of("B"), of("B_velocity"), of("B_acceleration")))  # fmt: skip
    torque = motion["drive_torque"].to_numpy()
    power, force = torque * 10.0 + 5.0 * 10.0, -of("O_force_on_frame") - of("Q_force_on_frame")
    moment = torque + 5.0 - ((8.0 - 3.0j) * of("Q_force_on_frame")).imag * 1e-3
    applied = ((0.0, of("B"), of("B_velocity"), 0.0 * turns), -20.0 + 7.0j)
    for (mass, place, velocity, acceleration), push in ((bodies[0], 0.0), (bodies[1], 0.0), applied):
        net = push + mass * (-9.81j - 1e-3 * acceleration)
        power, force = power + 1e-3 * (velocity.conjugate() * net).real, force + net
        moment = moment + 1e-3 * (place.conjugate() * net).imag
    errors = [np.abs(each).max() for each in (power, force, moment)]
    assert max(errors) < 1e-11, errors
    assert np.abs(torque).max() > 1.0


@pytest.mark.parametrize(
    ("section", "problem"),
    [
        (
            {"slots": {"h": {"pin": "P", "link": "frame", "along": ["O", ["k", 0]]},
                       "v": {"pin": "Q", "link": "frame", "along": [["k", 30], ["l", 30]]}}},
            "linkage.slots.v: is parallel to the slot h in all designs, so the two place no joint; turn one of them",
        ),
        (
            {"driver": "crank", "links": {"crank": {"O": 0, "A": "l"}, "yoke": {"P": [120, 0]}},
             "slots": {"h": {"pin": "A", "link": "yoke", "along": [[0, 0], ["l", "2 * l"]]}},
             "slides": {"yoke": {"link": "frame", "direction": ["l", "l + l"]}}},
            "linkage.slots.h: is parallel to the slide of yoke in all designs, so the two place no joint; turn one",
        ),
        ({"slots": {}}, "linkage.links.bar: has no joint"),
        (
            {"links": {"bar": {"P": 0, "Q": "l", "M": ["m", 0]}, "rod": {"M": 0, "N": "l"}},
             "slots": {"h": {"pin": "P", "link": "frame", "along": ["O", [1, 0]]},
                       "v": {"pin": "N", "link": "frame", "along": ["O", [0, 1]]}}},
            "linkage.links.bar: the driver turns about one point of the frame, and bar has none, nor pins on two lines",
        ),
    ],
)  # fmt: skip
def test_lines_that_place_nothing_are_refused(section, problem):
    with pytest.raises(explore.ConfigError) as error:
        trammel(**section)
    assert any(line.startswith(problem) for line in error.value.problems), error.value.problems


#: A pin on a slide of the frame and in a slot of the driver, whose pivot is not at its origin.
SLOTTED = {
    "driver": "crank",
    "frame": {"O": [0, 0]},
    "links": {"crank": {"O": [3, 4], "A": ["r", 5]}, "bar": {"J": ["r", 50]}},
    "slots": {"slot": {"pin": "J", "link": "crank", "along": ["A", [60, 70]]}},
    "slides": {"bar": {"link": "frame", "direction": [1, 0]}},
}


@pytest.mark.parametrize("name", ["crank-shaper", "jansen", "scotch-yoke", "watt-2", "", "slide"])
def test_a_copy_moves_as_its_original_at_another_phase(name):
    section, values = SLOTTED, {"r": 40.0, "turn": 17.0}
    if name == "slide":  # along a direction of the driver
        section = SLIDING_BAR
    elif name:
        sections = tomllib.loads(linkage_starter(name))
        section, entries = Linkage(sections).content, sections["parameters"]
        values = {key: e if isinstance(e, int | float) else (e["min"] + e["max"]) / 2.0 for key, e in entries.items()
                  if key != "speed"} | {"turn": 17.0}  # fmt: skip
    original = Linkage(section)
    table = Linkage({**section, "copies": {"b": 90, "c": "3 * turn"}}).table
    equations, first = trace(make_linkage(table)), trace(original)
    moving = [point for point in original.table.points if point not in original.table.frame.place_of]
    compared = 0
    with mpmath.workdps(30):
        for copy, phase in (("b", mpmath.pi / 2), ("c", mpmath.pi * 51 / 180)):
            for point in moving:
                if f"{point}_{copy}" not in equations.points:  # a point of the driver that nothing hangs at
                    continue
                numbers = [series.terms[order] for series in equations.points[f"{point}_{copy}"] for order in (0, 1)]
                others = [series.terms[order] for series in first.points[point] for order in (0, 1)]
                found, expected = evaluate_graph(numbers, values, 0.7), evaluate_graph(others, values, 0.7 + phase)
                assert [float(x) for x in found] == pytest.approx([float(x) for x in expected], rel=1e-12, abs=1e-10)
                compared += 1
    assert compared >= 2


@pytest.mark.parametrize(
    ("parts", "line"),
    [
        ({"copies": {"x": 120}}, "linkage.copies.x: names of the copy end with _x: names that end with _x are of "),
        ({"copies": {"b": "sin("}}, "linkage.copies.b: "),
        ({"copies": {f"q{n}": 1 for n in range(30)}}, "linkage.copies: make 63 points; at most 60 are possible"),
        ({"copies": {"b": 1}, "links": {**SLOTTED["links"], "bar_b": {"J": 0}}},
         "linkage.copies.b: names of the copy end with _b: bar_b is the name of something else"),
        ({"copies": {"b": 1}, **{key: BOOM[key] for key in ("driver", "travel", "frame", "links", "slots")},
          "slides": {}}, "linkage.copies: cylinder is driven, so it has no phases; leave them out"),
    ],
)  # fmt: skip
def test_copies_that_cannot_be_have_a_line(parts, line):
    with pytest.raises(explore.ConfigError) as error:
        Linkage({**SLOTTED, **parts})
    assert any(each.startswith(line) for each in error.value.problems), error.value.problems
