"""Linkages of tables by MuJoCo, which shares nothing with the package: places, velocities, accelerations and forces."""

from fractions import Fraction

import numpy as np
import pytest
from linkage_cases import CASES, linkage_of, values_of, with_loads
from mujoco_model import text

import explore
from explore.mechanisms.linkages.expressions import evaluate_coordinate
from explore.mechanisms.linkages.table import FRAME

pytestmark = pytest.mark.slow
ANGLES = np.arange(5.0, 365.0, 24.0)
NAMES = ("watt-2", "stephenson-1", "stephenson-3", "jansen", "klann", "crank-shaper", "whitworth")
LOADED = ("hoecken", "slider-crank", "toggle-press", "oscillating-cylinder", "pump-jack", *NAMES)
#: Mass, kg, and moment of inertia, kg mm², of blocks without them, which MuJoCo needs.
LIGHT = 1e-12
#: Gravity, m/s².
GRAVITY = (1.5, -9.81)
#: Step along the motion of the differences of MuJoCo's Jacobian, rad.
STEP = 1e-3


def place_of(place, values):
    return np.array([float(evaluate_coordinate(part, values)) for part in place])


class Model:
    """Free bodies in a plane, blocks that slide along their slots, and connections at all pins; in mm, kg and s.

    `masses` are those of the table: of blocks by the pin.
    """

    def __init__(self, linkage, values, masses=None):
        import mujoco

        self.mujoco, self.table, self.values, self.masses = mujoco, linkage.table, values, masses or {}
        blocks = {body.name: "" for body in self.table.bodies}
        connections = []
        for slot in self.table.slots:
            first, last = (self.end_of(slot, end) for end in slot.along)
            direction = (last - first) / np.hypot(*(last - first))
            blocks[slot.body] += (
                f'<body name="{slot.name}:block" pos="{text(*first)} 0">'
                f'<joint name="{slot.name}" type="slide" axis="{text(*direction)} 0"/>'
                f'<inertial pos="0 0 0" mass="{self.masses.get(slot.pin, LIGHT)}" '
                f'diaginertia="{text(*[LIGHT] * 3)}"/></body>'
            )
            bodies = [(f"{slot.name}:block", np.zeros(2))]
            bodies += [
                (body.name, place_of(body.place_of[slot.pin], values)) for body in self.table.bodies_at(slot.pin)
            ]
            connections += [(slot.pin, bodies[0], other) for other in bodies[1:]]
        for point in self.table.points:
            bodies = [] if point in {slot.pin for slot in self.table.slots} else self.places_of(point)
            connections += [(point, bodies[0], other) for other in bodies[1:]]
        links = "".join(
            f'<body name="{link.name}">'
            f'<joint name="{link.name}:x" type="slide" axis="1 0 0"/>'
            f'<joint name="{link.name}:y" type="slide" axis="0 1 0"/>'
            f'<joint name="{link.name}:turn" type="hinge" axis="0 0 1"/>'
            f"{self.inertial_of(link.name)}{blocks[link.name]}</body>"
            for link in self.table.links
        )
        sites, equalities = {}, ""
        for k, (_, *pair) in enumerate(connections):
            for side, (body, at) in enumerate(pair):
                sites.setdefault(body, []).append(f'<site name="s{k}:{side}" pos="{text(*at)} 0"/>')
            equalities += f'<connect site1="s{k}:0" site2="s{k}:1"/>'
        body = links + blocks[FRAME]
        for name, found in sites.items():
            if name != FRAME:
                start = body.index(">", body.index(f'<body name="{name}"')) + 1
                body = body[:start] + "".join(found) + body[start:]
        world = "".join(sites.get(FRAME, [])) + body
        self.forced = [f"{point}_force_on_{other}" for point, _, (other, _) in connections]
        self.model = mujoco.MjModel.from_xml_string(
            '<mujoco><compiler angle="radian"/>'
            f'<option jacobian="dense" gravity="{text(*(1e3 * np.array(GRAVITY)))} 0"/>'
            f"<worldbody>{world}</worldbody><equality>{equalities}</equality></mujoco>"
        )
        self.data = mujoco.MjData(self.model)
        self.joints = [self.model.joint(k).name for k in range(self.model.njnt)]

    def inertial_of(self, link):
        given = self.masses.get(link, {"mass": 1.0, "centroid": (0.0, 0.0), "inertia": 1e-6})
        inertia = text(*[1e6 * given["inertia"]] * 3)
        return f'<inertial pos="{text(*given["centroid"])} 0" mass="{given["mass"]}" diaginertia="{inertia}"/>'

    def end_of(self, slot, end):
        place = self.table.body_of[slot.body].place_of[end] if isinstance(end, str) else end
        return place_of(place, self.values)

    def places_of(self, point):
        """The bodies that a pin joins, each with the place of the pin in its coordinates."""
        return [(body.name, place_of(body.place_of[point], self.values)) for body in self.table.bodies_at(point)]

    def coordinates(self, row, order):
        """The coordinates of all joints, or their rates of an order, of a row of `explore.simulate`."""
        ending = ("", "_velocity", "_acceleration")[order]
        found = {}
        for link in self.table.links:
            point, at = next((name, place_of(place, self.values)) for name, place in link.points)
            turn, rate, change = self.turn_of(link.name, row)
            arm = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]) @ at
            across = np.array([-arm[1], arm[0]])
            of_point = self.place_in(row, point, ending)
            # The body's frame is at its origin, which the arm leads to from the point.
            origin = of_point - (arm, rate * across, change * across - rate**2 * arm)[order]
            found |= {f"{link.name}:x": origin[0], f"{link.name}:y": origin[1]}
            found[f"{link.name}:turn"] = (turn, rate, change)[order]
        found |= {slot.name: row[f"{slot.name}{ending or '_position'}"] for slot in self.table.slots}
        return np.array([found[name] for name in self.joints])

    def place_in(self, row, point, ending):
        fixed = self.table.frame.place_of.get(point)
        if fixed is not None:
            return place_of(fixed, self.values) if not ending else np.zeros(2)
        return np.array([row[f"{point}{ending}_x"], row[f"{point}{ending}_y"]])

    def turn_of(self, link, row):
        """How far a link has turned, and its rates."""
        if link == self.table.driver:
            return np.deg2rad(row.name), self.values.get("speed", 1.0), 0.0
        if f"{link}_velocity" not in row:
            return 0.0, 0.0, 0.0  # it slides on the frame
        # Two of its points have the angle.
        points = self.table.body_of[link].points[:2]
        (own, other), (here, there) = (
            [place_of(place, self.values) for _, place in points],
            [self.place_in(row, name, "") for name, _ in points],
        )
        turn = np.arctan2(*(there - here)[::-1]) - np.arctan2(*(other - own)[::-1])
        return turn, row[f"{link}_velocity"], row[f"{link}_acceleration"]

    def connections(self, coordinates):
        """Distances of all connections, and their Jacobian."""
        self.data.qpos[:] = coordinates
        self.mujoco.mj_forward(self.model, self.data)
        rows = self.data.efc_type == self.mujoco.mjtConstraint.mjCNSTR_EQUALITY
        return self.data.efc_pos[rows], self.data.efc_J.reshape(-1, self.model.nv)[rows]

    def forces(self, driver, coordinates, rates, changes):
        """The torque on the driver, N m, and the force of each connection on its second body, N, for a motion."""
        self.data.qvel[:] = rates
        _, jacobian = self.connections(coordinates)
        self.data.qacc[:], taken = changes, np.empty(self.model.nv)
        self.mujoco.mj_rne(self.model, self.data, 1, taken)
        drive = np.eye(self.model.nv)[driver]
        system = np.column_stack([drive, jacobian.reshape(-1, 3, self.model.nv)[:, :2].reshape(-1, self.model.nv).T])
        solution, *_, singular = np.linalg.lstsq(system, taken, rcond=None)
        assert singular[-1] > 1e-6 * singular[0]  # one solution
        return 1e-6 * solution[0], -1e-3 * solution[1:].reshape(-1, 2)


@pytest.mark.parametrize("name", NAMES)
def test_motions_agree_with_mujoco(name):
    """Its constraints hold at our places, and its Jacobian gives our rates; the driver turns at 1 rad/s."""
    pytest.importorskip("mujoco")
    linkage, values = linkage_of(CASES[name]), values_of(CASES[name])
    model = Model(linkage, values)
    motion = explore.simulate(linkage, values | {"speed": 1.0}, angles=ANGLES)
    driver = model.joints.index(f"{linkage.table.driver}:turn")
    others = [k for k in range(len(model.joints)) if k != driver]
    for _, row in motion.iterrows():
        places, rates, changes = (model.coordinates(row, order) for order in range(3))
        distances, jacobian = model.connections(places)
        size = np.abs(places).max()
        assert np.abs(distances).max() < 1e-12 * size

        def unknown(right, jacobian=jacobian):
            solution, *_, singular = np.linalg.lstsq(jacobian[:, others], right, rcond=None)
            assert singular[-1] > 1e-6 * singular[0]  # one solution
            return solution

        by_mujoco = unknown(-jacobian[:, driver])
        np.testing.assert_allclose(by_mujoco, rates[others], rtol=0, atol=1e-11 * np.abs(rates).max())
        # The change of the Jacobian along the motion by differences of order 6, whose error is below rounding.
        ahead, behind = (
            [model.connections(places + sign * k * STEP * rates)[1] @ rates for k in (1, 2, 3)] for sign in (1, -1)
        )
        weights = [float(Fraction(weight)) for weight in ("3/4", "-3/20", "1/60")]
        moved = sum(w * (a - b) for w, a, b in zip(weights, ahead, behind, strict=True)) / STEP
        by_mujoco = unknown(-moved - jacobian[:, driver] * changes[driver])
        np.testing.assert_allclose(by_mujoco, changes[others], rtol=0, atol=1e-11 * np.abs(changes).max())


@pytest.mark.parametrize("name", LOADED)
def test_forces_agree_with_mujoco(name):
    """Its masses, at our motions, are moved by our torque of the drive and our forces in the joints."""
    pytest.importorskip("mujoco")
    case, rng = CASES[name], np.random.default_rng(7)
    table, values = linkage_of(case).table, values_of(case) | {"speed": 12.0}
    masses = {slot.pin: rng.uniform(0.1, 2.0) for slot in table.slots if slot.pin not in table.frame.place_of}
    for link in table.links:
        mass, centroid, inertia = rng.uniform(0.1, 2.0), rng.uniform(-40.0, 60.0, 2).tolist(), rng.uniform(1e-4, 1e-2)
        masses[link.name] = {"mass": mass, "centroid": centroid, "inertia": inertia}
    linkage = with_loads(case, {"gravity": list(GRAVITY), "masses": masses})
    model = Model(linkage, values, masses)
    driver = model.joints.index(f"{table.driver}:turn")
    motion = explore.simulate(linkage, values, angles=ANGLES)
    torques, forces = [], []
    for _, row in motion.iterrows():
        torque, of_row = model.forces(driver, *(model.coordinates(row, order) for order in range(3)))
        torques.append(torque)
        forces.append(of_row)
    ours = np.stack([motion[[f"{signal}_x", f"{signal}_y"]] for signal in model.forced], axis=1)
    np.testing.assert_allclose(forces, ours, rtol=0, atol=1e-11 * np.abs(ours).max())
    np.testing.assert_allclose(torques, motion["drive_torque"], rtol=0, atol=1e-11 * np.abs(torques).max())
