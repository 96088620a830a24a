"""Friction at pins: free bodies with friction put in again and again, torques by two roads,
and where friction may lock a linkage.
"""

import mpmath
import numpy as np
import pytest
from exact_loads import ExactFourBar
from flint import arb, ctx
from linkage_cases import CASES, FOUR_BAR, evaluate_graph, rough_directions, trace, with_loads
from test_linkage_loads import ANGLES as REACHED
from test_linkage_loads import TABLES

import explore
from explore import Linkage
from explore.base.errors import ConfigError
from explore.mechanisms.linkages.friction import balance_friction
from explore.mechanisms.linkages.loads import Loading
from explore.model.status import Status

PIN = {"coefficient": "mu", "radius": "radius"}
LOADS = {
    "gravity": [0, -9.80665],
    "masses": {
        "coupler": {"mass": "coupler_mass", "centroid": ["r2 / 2", 0], "inertia": "coupler_inertia"},
        "rocker": {"mass": "rocker_mass", "centroid": ["r3 / 2", 0], "inertia": "own_inertia"},
    },
    "torques": {"rocker": "constant_torque"},
    "friction": dict.fromkeys("OABC", PIN),
}
UNITS = {"parameters": {"own_inertia": {"unit": "kg m^2"}}}
ROUGH = Linkage(FOUR_BAR | {"output": "rocker", "loads": LOADS} | UNITS)
AMOUNTS = {
    "coupler_mass": 2.0, "coupler_inertia": 0.01, "rocker_mass": 1.5, "own_inertia": 0.05, "constant_torque": -20.0,
    "radius": 8.0,
}  # fmt: skip
LENGTHS = {"r1": 30.0, "r2": 90.0, "r3": 70.0, "r4": 100.0}
DESIGN = LENGTHS | AMOUNTS | {"mu": 0.1, "speed": 10.0}


def substituted(values, degrees):
    """Drive torque, and forces of pins, with friction of the forces before put in until nothing changes."""
    design = dict(zip(("crank", "coupler", "rocker", "ground"), LENGTHS, strict=True))
    design = {name: values[own] for name, own in design.items()} | values
    design["rocker_inertia"] = values["own_inertia"] + values["rocker_mass"] * (0.5e-3 * values["r3"]) ** 2
    with ctx.workprec(128):
        exact, turned_by = ExactFourBar(design), [arb(0)] * 3
        for _ in range(100):
            signals, pins, rates = exact.balanced(arb(degrees) * arb.pi() / 180, 1, turned_by)
            turned_by, (w1, w2, w3) = [arb(0)] * 3, rates
            turnings = ((w1, 0, None), (w1 - w2, 0, 1), (w2 - w3, 1, 2), (w3, 2, None))
            for (x, y), (turning, link, holder) in zip(pins, turnings, strict=True):
                moment = (values["mu"] * values["radius"] * (x * x + y * y).sqrt() * turning.sgn()).mid() / 1000
                turned_by[link] -= moment
                if holder is not None:
                    turned_by[holder] += moment
    return float(signals["drive_torque"]), [[float(part) for part in pin] for pin in pins]


@pytest.mark.parametrize("change", [{}, {"mu": 0.5}, {"speed": 40.0, "mu": 0.2}, {"r3": 60.2, "mu": 0.05}])
def test_forces_and_torque_are_those_of_repeated_substitution(change):
    """Substitution gains at least a digit each second time; what is left is the rounding of its equations."""
    values = DESIGN | change
    angles = np.arange(0.0, 360.0, 30.0) + 0.37
    torque, found = zip(*(substituted(values, angle) for angle in angles), strict=True)
    motion = explore.simulate(ROUGH, values, angles=angles.tolist())
    assert motion["drive_torque"].to_numpy() == pytest.approx(torque, abs=1e-12 * np.abs(torque).max())
    for pin, signal in enumerate(("O_force_on_crank", "A_force_on_coupler", "B_force_on_rocker", "C_force_on_rocker")):
        expected = np.array(found)[:, pin]
        own = motion[[f"{signal}_x", f"{signal}_y"]].to_numpy()
        assert own == pytest.approx(expected, abs=1e-12 * np.abs(expected).max()), pin


def rough_everywhere(linkage, rng):
    """The linkage with masses, and with friction at every pin and slot that can have some."""
    content, table = linkage.content, linkage.table
    fixed = set(table.frame.place_of)
    masses = {point: rng.uniform(0.1, 2.0) for point in table.points if point not in fixed}
    friction, driven = {}, table.driven_slot
    for name in [*table.points, *(slot.name for slot in table.slots if slot is not driven)]:
        entry = {"coefficient": 0.1, "radius": 3.0} if name in table.points else 0.05
        loads = {"gravity": [1.0, -9.81], "masses": masses, "friction": friction | {name: entry}}
        try:
            linkage, friction = Linkage(content | {"loads": loads}), loads["friction"]
        except ConfigError as problem:
            if "at most 8" in str(problem):
                break
    return linkage, friction


@pytest.mark.parametrize("name", TABLES)
def test_balances_of_links_lead_to_the_torque_by_power(name):
    """All kinds of joints, blocks of slots and pins of three links among them; with 30 digits."""
    linkage, values = TABLES[name]
    linkage, friction = rough_everywhere(linkage, np.random.default_rng(3))
    assert any(isinstance(entry, dict) for entry in friction.values())
    equations = trace(linkage)
    loading = Loading(equations, linkage.table.loads)
    reactions, sizes, ratio = balance_friction(equations, loading)
    loading.take_friction(reactions.across, sizes)
    slot = linkage.table.driven_slot
    power = reactions.along * equations.slot_position(slot).terms[1] if slot else reactions.moment
    numbers = [power, loading.torque, loading.loss, ratio]
    for angle in REACHED.get(name, ("0.7", "2.4")):
        with mpmath.workdps(40):
            followed, inputs = rough_directions(linkage, values, angle), values | {"speed": 3.0}
            moment, torque, loss, most = evaluate_graph(numbers, inputs, mpmath.mpf(angle), followed=followed)
            assert most < 1
            assert abs(moment / 1000 - torque) < 1e-24 * (abs(torque) + loss)
            assert loss > 0


def test_what_the_drive_gives_over_a_turn_friction_takes():
    metrics = ["drive_power_mean", "friction_power_mean", "net_work", "drive_torque_rms"]
    rows = explore.evaluate(ROUGH, DESIGN | {"mu": np.array([0.01, 0.1, 0.4])}, metrics=metrics, window="cycle")
    assert (rows["status"] == Status.OK).all()
    # The constant torque on the rocker gives back in a turn what it takes.
    assert rows["drive_power_mean"].to_numpy() == pytest.approx(rows["friction_power_mean"], rel=1e-11)
    assert rows["net_work"].to_numpy() == pytest.approx(rows["drive_power_mean"] * 2.0 * np.pi / 10.0, rel=1e-11)
    finer = explore.evaluate(
        ROUGH, DESIGN | {"mu": np.array([0.01, 0.1, 0.4])}, metrics=metrics, window="cycle", tolerance=1e-12
    )
    for metric in metrics:
        scale = np.maximum(np.abs(finer[metric]), 1.0)
        assert (np.abs(rows[metric] - finer[metric]) <= rows["error"] * scale + 1e-13 * scale).all(), metric


def test_friction_that_may_lock_has_no_force():
    """Where a sum of the gains reaches 1, at the edge too."""
    plain = explore.evaluate(ROUGH, DESIGN, metrics=["lock_ratio_max"], window="cycle").iloc[0]
    limit = 0.1 / plain["lock_ratio_max"]
    for share, is_locked in ((1.0 - 1e-3, False), (1.0 + 1e-7, True), (1.2, True)):
        row = explore.evaluate(
            ROUGH, DESIGN | {"mu": share * limit}, metrics=["drive_torque_max"], window="cycle", tolerance=1e-6
        ).iloc[0]
        assert (row["status"] == Status.NOT_FINITE) == is_locked, share


@pytest.mark.parametrize(
    ("friction", "problem"),
    [
        ({"X": 0.1}, r"X: unknown slot, slide or pin 'X'; available: guide, O, A, B"),
        ({"A": 0.1}, r"A: must be a table such as A = \{ coefficient = 0.1, radius = 8 \}, got 0.1"),
        ({"a": PIN}, r"a: unknown slot, slide or pin 'a'; did you mean 'A'\?"),
        ({"crank": PIN}, r"crank: unknown slot, slide or pin 'crank'; available: guide, O, A, B"),
        ({"guide": PIN}, r"guide: must be a number or an expression, got .*"),
        ({"A": {"coefficient": 0.1}}, r"A: the key 'radius' is missing; a complete one is A = .*"),
        ({"A": {"coefficient": -0.1, "radius": 2}}, r"A.coefficient: must not be negative, got -0.1"),
        ({"A": {"coefficient": 0.1, "radius": -2}}, r"A.radius: must not be negative, got -2"),
    ],
)
def test_friction_with_mistakes_is_refused(friction, problem):
    with pytest.raises(ConfigError, match=f"^linkage.loads.friction.{problem}$"):
        with_loads(CASES["slider-crank"], {"forces": {"B": [1, 2]}, "friction": friction})


def test_friction_at_more_pins_than_are_possible_is_refused():
    jansen, _ = TABLES["jansen"]
    loads = {"masses": {"T": 1}, "friction": {pin: {"coefficient": 0.1, "radius": 3} for pin in "YXUZT"}}
    with pytest.raises(ConfigError, match="^linkage.loads.friction: has 10 links that turn on pins with friction; at"):
        Linkage(jansen.content | {"loads": loads})


def test_links_of_one_triangle_have_no_friction():
    """Bars g, h and i of Jansen's leg are a triangle: the sense of their motion is rounding."""
    jansen, _ = TABLES["jansen"]
    loads = {"masses": {"T": 1}, "friction": {"T": {"coefficient": 0.1, "radius": 3}}}
    with pytest.raises(ConfigError, match=r"friction.T: bar_h does not turn against bar_i, as both are of one rigid"):
        Linkage(jansen.content | {"loads": loads})


def test_links_that_turn_on_a_pin_of_a_triangle_have_friction():
    """Bar f of Jansen's leg turns on S, where bars g and h of a triangle meet."""
    jansen, lengths = TABLES["jansen"]
    loads = {"masses": {"T": 1.0}, "friction": {"S": {"coefficient": 0.1, "radius": 3}}}
    linkage = Linkage(jansen.content | {"loads": loads})
    motion = explore.simulate(linkage, lengths | {"speed": 3.0}, angles=[70.0]).iloc[0]
    moment = 0.1 * 3e-3 * motion["S_force_on_bar_f"]
    assert motion["friction_power"] == pytest.approx(moment * abs(motion["S_turning_of_bar_f"]), rel=1e-12)
    assert "S_turning_of_bar_g" not in motion


def test_pins_that_nothing_turns_on_have_no_friction():
    frame, links = FOUR_BAR["frame"] | {"Q": [0, 0]}, FOUR_BAR["links"] | {"coupler": {"A": 0, "B": "r2", "P": 20}}
    for point, body in (("P", "coupler"), ("Q", "frame")):
        loads = {"masses": {"B": 1}, "friction": {point: PIN}}
        with pytest.raises(ConfigError, match=f"friction.{point}: only {body} has {point}; name a pin on which a link"):
            Linkage(FOUR_BAR | {"frame": frame, "links": links, "loads": loads})


def test_a_slider_turns_on_its_pin():
    """The wrist pin takes more than it does without friction; rod and block turn against each other."""
    loads = {"masses": {"B": 1.3}, "forces": {"B": [-25, 0]}, "friction": {"guide": 0.1, "B": PIN}}
    linkage, values = with_loads(CASES["slider-crank"], loads), {"r": 30.0, "l": 90.0, "e": 10.0, "speed": 11.0}
    assert Linkage(linkage.content) == linkage
    rows = explore.evaluate(
        linkage, values | {"mu": np.array([0.0, 0.1]), "radius": 10.0}, metrics=["friction_power_mean"], window="cycle"
    )
    assert (rows["status"] == Status.OK).all()
    assert rows["friction_power_mean"][1] > rows["friction_power_mean"][0] * 1.05


def test_a_pin_of_two_slots_has_no_friction():
    lines = {"u": [[0, 0], [1, 0]], "v": [[0, 0], [0, 1]]}
    slots = {name: {"pin": "B", "link": "frame", "along": line} for name, line in lines.items()}
    with pytest.raises(ConfigError, match=r"friction.B: B joins blocks and other bodies; only its slots can have"):
        Linkage(FOUR_BAR | {"slots": slots, "loads": {"masses": {"B": 1}, "friction": {"B": PIN}}})


def test_a_pin_that_runs_in_a_slot_of_a_link_has_corners_of_its_own():
    """The block turns with the rod on a pin of the frame; a force through 0 is a corner, where panels end."""
    linkage, values = TABLES["oscillating-cylinder"]
    loads = {"masses": {"B": 1.0}, "forces": {"B": [-20, 5]}, "friction": {"C": {"coefficient": 0.1, "radius": 3}}}
    linkage = Linkage(linkage.content | {"loads": loads})
    metrics = ["drive_torque_rms", "friction_power_mean"]
    rows = [
        explore.evaluate(linkage, values | {"speed": 3.0}, metrics=metrics, window="cycle", tolerance=tolerance).iloc[0]
        for tolerance in (1e-6, 1e-12)
    ]
    assert [row["status"] for row in rows] == [Status.OK] * 2
    assert rows[0][metrics].to_numpy() == pytest.approx(rows[1][metrics].to_numpy(), rel=rows[0]["error"])
