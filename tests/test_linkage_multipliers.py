"""Torques and joint forces of classic linkages under random loads, against multipliers of all joints together.

The second road knows no dyads: Newton's iteration on the equations of all joints, differences with 40 digits, and the
Lagrange multipliers with which the generalised forces of loads and inertia are in balance.
"""

import random
import tomllib
from importlib.resources import files

import mpmath
import pytest
from joints import STEP, Joints, jacobian
from mpmath import mpf
from slot_groups import GROUPED

import explore

FEW = ("oscillating-cylinder", "watt-1", "whitworth")
MANY = (
    "crank-shaper", "four-bar", "hoecken", "jansen", "klann", "pump-jack", "slider-crank", "stephenson-1",
    "toggle-press", "watt-2", "wiper",
)  # fmt: skip
METERS = mpf("0.001")


def classic(name, rng):
    """The table of a classic without its loads, and values of its parameters."""
    text = files("explore").joinpath(f"data/linkages/{name}.toml").read_text()
    content = tomllib.loads(text)
    given = {key: value for key, value in content["parameters"].items() if key != "speed"}
    values = {
        key: rng.uniform(value["min"], value["max"]) if isinstance(value, dict) else value
        for key, value in given.items()
    }
    table = {key: part for key, part in content["linkage"].items() if key != "loads"}
    if "sketch" in table:
        own = table.get("parameters", {})
        table["parameters"] = {key: own.get(key, {}) | {"default": value} for key, value in values.items()}
    return table, values


def random_loads(rng, joints, motion):
    """Loads of all kinds, each on some parts of the linkage, which has rows of its motion without them a turn apart."""
    some = lambda items, share=0.4: [item for item in items if rng.random() < share]  # noqa: E731
    moving = [point for point in joints.owners if point not in joints.bodies["frame"]]
    swinging = [link for link in joints.links if list(joints.links).index(link) != joints.driver // 3]
    pairs = [
        (a, b) for k, a in enumerate(joints.owners) for b in list(joints.owners)[:k]
        if not set(joints.owners[a]) & set(joints.owners[b])
    ]  # fmt: skip
    masses = {
        link: {"mass": rng.uniform(0.1, 3), "centroid": [rng.uniform(-60, 120), rng.uniform(-50, 50)], "inertia": 0.01}
        for link in joints.links
    }
    between = [*map(list, rng.sample(pairs, 1)), *some(joints.slots)]
    driver = list(joints.links)[joints.driver // 3]
    # a coil on a link that turns fully has no rest
    ends = {link: motion[f"{link}_angle"].iloc[[0, -1]].to_numpy() for link in swinging if f"{link}_angle" in motion}
    coils = {link: first + rng.uniform(-40, 40) for link, (first, last) in ends.items() if abs(last - first) < 1.0}
    return {
        "gravity": [rng.uniform(-10, 10), rng.uniform(-10, 10)],
        "masses": masses | {point: rng.uniform(0.1, 2) for point in some(moving)},
        "forces": {point: [rng.uniform(-99, 99), rng.uniform(-99, 99)] for point in some(moving)},
        "torques": {
            **{link: rng.uniform(-2, 2) for link in some(joints.links)},
            rng.choice(swinging): {"torque": rng.uniform(-2, 2), "against": driver},
        },
        "springs": {
            **{f"s{k}": {"between": each, "rate": 200, "rest": rng.uniform(0, 200)} for k, each in enumerate(between)},
            **{f"c{k}": {"between": link, "rate": 1.2, "rest": rest} for k, (link, rest) in enumerate(coils.items())},
        },
        "dampers": {
            f"d{k}": {"between": each, "rate": 0.3}
            for k, each in enumerate([*between, *some(swinging), [driver, rng.choice(swinging)]])
        },
        "opposing": {name: rng.uniform(1, 100) for name in some(joints.slots)},
    }  # fmt: skip


def balance(joints, loads, speed, row, theta):
    """Drive torque, N m, forces of pins that join two links only, N, and of slots."""
    q = joints.solve(joints.start(row, theta), theta)
    ahead, behind = joints.solve(q, theta + STEP), joints.solve(q, theta - STEP)
    forces = mpmath.matrix(len(q), 1)

    def act(function, force):
        slopes = jacobian(function, q)
        for i, part in enumerate(force):
            for k in range(len(q)):
                forces[k] += slopes[i, k] * part

    def rate(function):
        return [speed * (a - b) / (2 * STEP) for a, b in zip(function(ahead), function(behind), strict=True)]

    def acceleration(function):
        parts = zip(function(ahead), function(q), function(behind), strict=True)
        return [speed**2 * (a - 2 * here + b) / STEP**2 for a, here, b in parts]

    def coordinate(each):
        """The length, or angle, and the unit of its power, m or N mm in N m."""
        if isinstance(each, str):
            if each in joints.slots:
                return (lambda z: [joints.along_and_across(z, each)[0]]), METERS, 1
            return (lambda z: [joints.angle(z, each)]), 1, 1 / METERS
        if each[0] in joints.links:
            return (lambda z: [joints.angle(z, each[0]) - joints.angle(z, each[1])]), 1, 1 / METERS
        places = lambda z: [joints.point(z, point) for point in each]  # noqa: E731
        return (lambda z: [mpmath.hypot(*(a - b for a, b in zip(*places(z), strict=True)))]), METERS, 1

    for owner, mass in loads["masses"].items():
        place = lambda z, owner=owner: joints.point(z, owner)  # noqa: E731
        if owner in joints.links:
            centroid = joints.place(mass["centroid"])
            place = lambda z, owner=owner, centroid=centroid: joints.at(z, owner, centroid)  # noqa: E731
            turn = lambda z, owner=owner: [joints.angle(z, owner)]  # noqa: E731
            act(turn, [-mpf(mass["inertia"]) * acceleration(turn)[0] / METERS])
        amount = mpf(mass["mass"] if owner in joints.links else mass)
        act(place, [amount * (g - a * METERS) for g, a in zip(loads["gravity"], acceleration(place), strict=True)])
    for point, force in loads["forces"].items():
        act(lambda z, point=point: joints.point(z, point), force)
    for link, torque in loads["torques"].items():
        against = torque["against"] if isinstance(torque, dict) else None
        turn, _, power = coordinate([link, against] if against else link)
        act(turn, [(torque["torque"] if against else torque) * power])
    for spring in loads["springs"].values():
        function, unit, power = coordinate(spring["between"])
        stretch = function(q)[0] - spring["rest"]
        if unit == 1:  # an angle, within half a turn
            stretch = mpmath.arg(mpmath.expj(function(q)[0] - mpmath.radians(spring["rest"])))
        act(function, [-spring["rate"] * stretch * unit * power])
    for damper in loads["dampers"].values():
        function, unit, power = coordinate(damper["between"])
        act(function, [-damper["rate"] * rate(function)[0] * unit * power])
    for slot, force in loads["opposing"].items():
        function, _, _ = coordinate(slot)
        act(function, [-force * mpmath.sign(rate(function)[0])])
    for name, coefficient in loads.get("friction", {}).items():  # of the size in the row, which has to come out again
        function = coordinate(name)[0] if name in joints.slots else lambda z, name=name: [joints.slid(z, name)]
        act(function, [-coefficient * abs(row[f"{name}_normal_force"]) * mpmath.sign(rate(function)[0])])
    multipliers = mpmath.lu_solve(jacobian(lambda z: joints.equations(z, theta), q).T, -forces)
    found = {"drive_torque": multipliers[len(q) - 1] * METERS}
    busy = {slot[0] for slot in joints.slots.values()} | {*loads["masses"]} | {*loads["forces"]}
    busy = busy.union(*(each["between"] for each in loads["springs"].values() if isinstance(each["between"], list)))
    for k, (point, _, link) in enumerate(joints.pins):
        if len(joints.owners[point]) == 2 and point not in busy:
            found |= {f"{point}_force_on_{link}_{axis}": multipliers[2 * k + i] for i, axis in enumerate("xy")}
    first = 2 * len(joints.pins)
    found |= {f"{name}_normal_force": multipliers[first + k] for k, name in enumerate(joints.slots)}
    first += len(joints.slots) + 1  # behind the turning of each slide
    return found | {f"{name}_normal_force": multipliers[first + 2 * k] for k, name in enumerate(joints.slides)}


@pytest.mark.parametrize("name", [*FEW, *GROUPED, *(pytest.param(name, marks=pytest.mark.slow) for name in MANY)])
def test_random_loads_are_balanced_by_the_multipliers_of_all_joints(name):
    rng = random.Random(name)
    if name in GROUPED:
        table, values = GROUPED[name], {"r": 6.0}
    else:
        table, values = classic(name, rng)
    joints = Joints(table, values)
    speed, angle, linkage = rng.uniform(2, 20), rng.uniform(*table.get("range", (0, 360))), explore.Linkage(table)
    own = {parameter.name for parameter in linkage.mechanism.parameters} & values.keys()
    given = {key: values[key] for key in own} | {"speed": speed}
    turn = [angle] if "range" in table else [angle, angle + 360.0]
    loads = random_loads(rng, joints, explore.simulate(linkage, given, angles=turn))
    if name in GROUPED:
        loads["friction"] = dict.fromkeys(joints.slots, 0.1)
    row = explore.simulate(explore.Linkage(table | {"loads": loads}), given, angles=[angle]).iloc[0]
    with mpmath.workdps(40):
        found = balance(joints, loads, mpf(speed), row, mpf(angle) * mpmath.pi / 180)
    # to the rounding of some hundred operations, of the largest force, and that at a lever of 10 mm
    largest = max(abs(float(force)) for signal, force in found.items() if signal != "drive_torque")
    assert len(found) >= 2
    for signal, force in found.items():
        size = max(abs(float(force)), largest * (0.01 if signal == "drive_torque" else 1.0))
        assert row[signal] == pytest.approx(float(force), abs=1e-13 * size), signal
