"""Links that slide: as outputs, with loads along them, and with friction, as of two slots that hold one pin."""

import math
import random

import mpmath
import numpy as np
import pytest
from joints import Joints
from linkage_cases import trammel, trammel_of_blocks
from mpmath import mpf
from test_linkage_multipliers import balance, random_loads

import explore
from explore.base.errors import ConfigError
from explore.model.status import Status

YOKE = {
    "driver": "crank", "output": "slot", "frame": {"O": [0, 0]},
    "links": {"crank": {"O": 0, "A": "r"}, "yoke": {"P": [120, 0]}},
    "slots": {"slot": {"pin": "A", "link": "yoke", "along": [[0, 0], ["slant", 1]]}},
    "slides": {"yoke": {"link": "frame", "direction": [1, 0]}},
}  # fmt: skip
#: A shaper whose ram has two pins in the frame, one of them in the lever too.
RAM = {
    "driver": "crank",
    "frame": {"O": [0, 0], "C": [0, -110]},
    "links": {"crank": {"O": 0, "A": "r"}, "lever": {"C": 0, "D": 200}, "ram": {"S": 0, "T": 60}},
    "slots": {
        "block": {"pin": "A", "link": "lever", "along": ["C", [1, 0]]},
        "eye": {"pin": "S", "link": "lever", "along": ["C", [1, 0]]},
        "guide": {"pin": "S", "link": "frame", "along": [[0, 145], [1, 145]]},
        "nose": {"pin": "T", "link": "frame", "along": [[0, 145], [1, 145]]},
    },
    "branch": {"block": "positive", "T": "far"},
}
#: A shaper whose ram slides in the frame, and a block on its lever that an arm holds.
BLOCKS = {
    "driver": "crank",
    "frame": {"O": [0, 0], "C": [0, -110], "F": [150, -40]},
    "links": {
        "crank": {"O": 0, "A": "r"}, "lever": {"C": 0, "D": 260}, "link": {"D": 0, "S": 80},
        "ram": {"S": [0, 145], "T": [30, 150]}, "arm": {"F": 0, "P": 260}, "block": {"P": [0, 20], "B": [12, 5]},
    },
    "slots": {"eye": {"pin": "A", "link": "lever", "along": ["C", "D"]}},
    "slides": {"block": {"link": "lever", "direction": [1, 0]}, "ram": {"link": "frame", "direction": [1, 0]}},
    "branch": {"eye": "positive", "S": "far", "P": "far"},
}  # fmt: skip
TABLES = {"slots": RAM, "blocks": BLOCKS}
SPEED = 6.0
ANGLES = np.arange(3.0, 360.0, 10.0)


def yoke(**friction):
    loads = {"gravity": [0, -9.81], "masses": {"P": "m"}, "friction": friction}
    return explore.Linkage(YOKE | {"loads": loads})


def test_a_scotch_yoke_with_a_straight_slot_is_a_closed_form():
    """The guide bears the weight alone."""
    linkage = yoke(yoke="mu")
    values = {"r": 35.0, "slant": 0.0, "m": 2.0, "mu": 0.2, "speed": SPEED}
    motion = explore.simulate(linkage, values, angles=ANGLES.tolist())
    rate = -0.035 * np.sin(np.radians(ANGLES))
    inertia = -2.0 * SPEED**2 * 0.035 * np.cos(np.radians(ANGLES))
    torque = inertia * rate + 0.2 * 2.0 * 9.81 * np.abs(rate)
    assert motion["drive_torque"].to_numpy() == pytest.approx(torque, abs=1e-15)
    assert motion["yoke_velocity"].to_numpy() == pytest.approx(1e3 * SPEED * rate, abs=1e-12)
    row = explore.evaluate(linkage, values, metrics=["net_work", "drive_torque_mean"], window="cycle", tolerance=1e-9)
    lost = 0.2 * 2.0 * 9.81 * 4.0 * 0.035
    assert row["net_work"].iloc[0] == pytest.approx(lost, rel=1e-12)
    assert row["drive_torque_mean"].iloc[0] == pytest.approx(lost / (2.0 * math.pi), rel=1e-12)


#: Loads of all kinds along a slide, and one over its position.
ALONG = {
    "masses": {"P": 2.0},
    "opposing": {"yoke": 50},
    "springs": {"coil": {"between": "yoke", "rate": 300, "rest": -5}},
    "dampers": {"oil": {"between": "yoke", "rate": 20}},
    "curves": {
        "push": {"over": "yoke", "points": [[-40, 0], [0, 10], [40, 5]]},
        "end": {"over": "from_least", "points": [[0, 0], [30, 20], [90, 0]]},
    },
    "forces": {"P": ["push + end", 0]},
}


def torque_along(angle):
    """The torque of the drive of the Scotch yoke, whose slot is straight, by power."""
    place, rate = 0.035 * np.cos(angle), -0.035 * np.sin(angle)
    push = np.interp(1e3 * place, [-40, 0, 40], [0, 10, 5]) + np.interp(1e3 * place + 35.0, [0, 30, 90], [0, 20, 0])
    steady = -2.0 * SPEED**2 * place - push + 300 * (place + 0.005) + 20 * SPEED * rate
    return steady * rate + 50 * np.abs(rate)


def test_loads_along_a_slide_act_by_its_position_and_velocity():
    linkage = explore.Linkage(YOKE | {"output": "yoke", "loads": ALONG})
    values = {"r": 35.0, "slant": 0.0, "speed": SPEED}
    motion, angles = explore.simulate(linkage, values, angles=ANGLES.tolist()), np.radians(ANGLES)
    assert motion["drive_torque"].to_numpy() == pytest.approx(torque_along(angles), abs=2e-15)
    assert motion["yoke_position"].to_numpy() == pytest.approx(35.0 * np.cos(angles), abs=1e-13)
    assert motion["yoke_velocity"].to_numpy() == pytest.approx(-35.0 * SPEED * np.sin(angles), abs=1e-12)
    metrics = ["net_work", "drive_torque_rms_cycle", "stroke", "time_ratio", "yoke_velocity_min_backward"]
    row = explore.evaluate(linkage, values, metrics=metrics, tolerance=1e-9).iloc[0]
    torque = torque_along((np.arange(1_000_000) + 0.5) * 2e-6 * np.pi)  # with corners: errors of 1e-12
    assert row["net_work"] == pytest.approx(2.0 * np.pi * torque.mean(), rel=1e-9)
    assert row["drive_torque_rms_cycle"] == pytest.approx(np.sqrt((torque**2).mean()), rel=1e-9)
    assert row[metrics[2:]].to_list() == pytest.approx([70.0, 1.0, -35.0 * SPEED], rel=1e-14)


def test_the_strokes_of_a_link_that_slides_are_those_of_its_pin(tmp_path):
    """Of a slider-crank, as table with a slot and with a slide; proofs too."""
    parts = {"driver": "crank", "frame": {"O": [0, 0]}, "branch": {"B": "far"}}
    links = {"crank": {"O": 0, "A": "r"}, "rod": {"A": 0, "B": "l"}}
    line = [[0, 12], [1, 12]]
    slot = parts | {"output": "ram", "links": links, "slots": {"ram": {"pin": "B", "link": "frame", "along": line}}}
    slide = parts | {"output": "ram", "links": links | {"ram": {"B": [0, 12]}}}
    slide |= {"slides": {"ram": {"link": "frame", "direction": [1, 0]}}}
    metrics = ["stroke", "time_ratio", "ram_velocity_max_forward", "cv", "mean"]
    lengths = {"r": [30, 40], "l": 120, "speed": 5}
    rows = []
    for number, table in enumerate((slot, slide)):
        study = explore.Study(mechanism=explore.Linkage(table), parameters=lengths, metrics=metrics, window="drive")
        results = explore.sweep(study, tmp_path / f"{number}.h5")
        assert explore.certify(results, [0, 1])["verdict"].to_list() == ["proved", "proved"]
        rows.append(results.to_pandas()[metrics].to_numpy())
    assert rows[1] == pytest.approx(rows[0], rel=1e-13)


def test_a_slanted_slot_and_its_guide_rub_each_other():
    """Against substitution: the pin presses on the yoke with q across the slot, and the guide with n."""
    values = {"r": 35.0, "slant": 0.3, "m": 2.0, "speed": SPEED}
    motion = explore.simulate(yoke(yoke=0.2, slot=0.15), values, angles=ANGLES.tolist())
    slope = np.array([0.3, 1.0]) / math.hypot(0.3, 1.0)  # along the slot
    across = np.array([-slope[1], slope[0]])
    for row, angle in zip(motion.itertuples(), np.radians(ANGLES), strict=True):
        pin, pin_rate = (
            35.0 * np.array([math.cos(angle), math.sin(angle)]),
            np.array([-math.sin(angle), math.cos(angle)]),
        )
        rate = pin_rate[0] - 0.3 * pin_rate[1]  # of the yoke, over r and the speed
        change = -math.cos(angle) + 0.3 * math.sin(angle)
        sense, slipping = np.sign(rate), np.sign((pin_rate - [rate, 0.0]) @ slope)
        q = n = 0.0
        for _ in range(200):
            friction = 0.15 * abs(q) * slipping  # of the pin, which takes the yoke along
            q = (2.0 * SPEED**2 * 0.035 * change + 0.2 * abs(n) * sense - friction * slope[0]) / across[0]
            n = 2.0 * 9.81 - q * across[1] - friction * slope[1]
        on_crank = -(q * across + 0.15 * abs(q) * slipping * slope)
        torque = -(pin[0] * on_crank[1] - pin[1] * on_crank[0]) * 1e-3
        assert row.drive_torque == pytest.approx(torque, abs=1e-14)
        assert row.yoke_normal_force == pytest.approx(n, abs=1e-12)
        assert abs(row.slot_normal_force) == pytest.approx(abs(q), abs=1e-12)


BOTH = {
    "gravity": [3, -9.81], "masses": {"M": 1.5, "bar": {"mass": 0.8, "centroid": [20, 5], "inertia": 0.002}},
    "friction": {"h": 0.1, "v": 0.15},
}  # fmt: skip


def test_blocks_of_a_trammel_are_its_slots():
    values = {"l": 100.0, "m": 30.0, "speed": 4.0}
    joints = Joints(trammel().content, values)
    none = {key: {} for key in ("forces", "torques", "springs", "dampers", "opposing")}
    slots = explore.simulate(trammel(loads=BOTH), values, angles=ANGLES.tolist())
    slides = explore.simulate(trammel_of_blocks(loads=BOTH), values, angles=ANGLES.tolist())
    for name in ("drive_torque", "friction_power", "h_normal_force", "v_normal_force", "lock_ratio"):
        expected = slots[name].to_numpy()
        assert np.abs(expected).max() > 0.0
        assert slides[name].to_numpy() == pytest.approx(expected, abs=2e-14 * np.abs(expected).max()), name
    for angle, row in list(slots.iterrows())[::7]:
        with mpmath.workdps(40):
            found = balance(joints, none | BOTH, mpf(4), row, mpf(angle) * mpmath.pi / 180)
        for signal in ("drive_torque", "h_normal_force", "v_normal_force"):
            assert row[signal] == pytest.approx(float(found[signal]), abs=1e-12), signal


@pytest.mark.parametrize("name", TABLES)
def test_forces_are_balanced_by_the_multipliers_of_all_joints(name):
    """With friction wherever something slides, under random loads."""
    table, values, rng = TABLES[name], {"r": 45.0}, random.Random(name)
    joints, linkage = Joints(table, values), explore.Linkage(table)
    given = values | {"speed": SPEED}
    loads = random_loads(rng, joints, explore.simulate(linkage, given, angles=[0, 360]))
    loads["friction"] = {name: rng.uniform(0.05, 0.15) for name in (*joints.slots, *joints.slides)}
    rough = explore.Linkage(table | {"loads": loads})
    for angle in (20.0, 140.0, 230.0):
        row = explore.simulate(rough, given, angles=[angle]).iloc[0]
        with mpmath.workdps(40):
            found = balance(joints, loads, mpf(SPEED), row, mpf(angle) * mpmath.pi / 180)
        largest = max(abs(float(force)) for signal, force in found.items() if signal != "drive_torque")
        assert {f"{name}_normal_force" for name in loads["friction"]} <= found.keys()
        assert ("block_sliding_velocity" in row) == (name == "blocks")
        for signal, force in found.items():
            size = max(abs(float(force)), largest * (0.01 if signal == "drive_torque" else 1.0))
            assert row[signal] == pytest.approx(float(force), abs=1e-13 * size), signal


def test_works_over_the_turn_are_integrals_of_single_angles():
    """Of a shaper whose ram has friction in three slots, with corners where a force changes its sign."""
    loads = {"forces": {"S": [-40, 20]}, "friction": dict.fromkeys(("eye", "guide", "nose"), 0.1)}
    loads |= {"masses": {"T": 3.0}, "gravity": [0, -9.81]}
    linkage, given = explore.Linkage(RAM | {"loads": loads}), {"r": 45.0, "speed": SPEED}
    names = ["net_work", "drive_torque_rms", "drive_torque_max", "friction_power_mean"]
    row = explore.evaluate(linkage, given, metrics=names, window="cycle", tolerance=1e-9).iloc[0]
    assert row["status"] == Status.OK
    angles = (np.arange(7200) + 0.5) * 0.05
    motion = explore.simulate(linkage, given, angles=angles.tolist())
    torque, lost = motion["drive_torque"].to_numpy(), motion["friction_power"].to_numpy()
    # jumps of the torque where the ram turns back are between two of the angles
    assert row["net_work"] == pytest.approx(torque.mean() * 2.0 * math.pi, rel=1e-3)
    assert row["net_work"] == pytest.approx(row["friction_power_mean"] * 2.0 * math.pi / SPEED, rel=1e-9)
    assert row["friction_power_mean"] == pytest.approx(lost.mean(), rel=1e-6)
    assert row["drive_torque_rms"] == pytest.approx(math.sqrt((torque**2).mean()), rel=1e-3)
    assert row["drive_torque_max"] == pytest.approx(torque.max(), rel=1e-3)


def test_friction_that_may_lock_has_no_force():
    """A steep slot presses the yoke to its guide: at a product of both of 1 nothing moves it."""
    values = {"r": 35.0, "slant": 2.0, "m": 2.0, "speed": SPEED}
    metrics = ["drive_torque_max", "lock_ratio_max"]
    for coefficient, status in ((0.2, Status.OK), (0.6, Status.NOT_FINITE)):
        row = explore.evaluate(yoke(yoke=coefficient), values, metrics=metrics, window="cycle").iloc[0]
        assert row["status"] == status
        if status == Status.OK:
            assert row["lock_ratio_max"] == pytest.approx(0.2 * 2.0, rel=1e-12)


def test_what_cannot_rub_is_refused():
    with pytest.raises(ConfigError, match=r"friction.crank: unknown slot, slide or pin 'crank'"):
        yoke(crank=0.1)


def test_a_slide_at_rest_is_not_rough():
    """A pin of the frame is in a slot across the block."""
    table = YOKE | {"frame": {"O": [0, 0], "G": [100, 100]}, "links": YOKE["links"] | {"block": {"L": [5, 5]}}}
    table |= {"slots": YOKE["slots"] | {"key": {"pin": "G", "link": "block", "along": [[0, 0], [1, 0]]}}}
    table |= {"slides": YOKE["slides"] | {"block": {"link": "frame", "direction": [0, 1]}}}
    for kind in ("friction", "opposing"):
        reason = f"{kind}.block: block does not slide, as it is of one rigid part with frame; leave it out"
        with pytest.raises(ConfigError, match=reason):
            explore.Linkage(table | {"loads": {"masses": {"P": 1}, kind: {"block": 0.1}}})


def test_a_name_that_would_have_the_velocity_of_a_slide_is_refused_where_it_rubs():
    """Of a block that turns with its lever; a yoke that does not has the name of its position."""
    reason = r"friction.block: its velocity is block_sliding_velocity, which block_sliding has too; choose another name"
    links = {"links": BLOCKS["links"] | {"block_sliding": {"A": 0, "E": 20}, "rocker": {"O": 0, "E": 40}}}
    rough = {"loads": {"masses": {"P": 1}, "friction": {"block": "mu_sliding"}}}
    with pytest.raises(ConfigError, match=reason):
        explore.Linkage(BLOCKS | links | rough)
    values = {"r": 45.0, "mu_sliding": 0.1, "speed": SPEED}
    assert explore.evaluate(explore.Linkage(BLOCKS | rough), values)["status"].iloc[0] == Status.OK
    copied = explore.Linkage(YOKE | {"copies": {"sliding": 90}})
    assert explore.evaluate(copied, {"r": 35.0, "slant": 0.0, "speed": SPEED})["status"].iloc[0] == Status.OK
