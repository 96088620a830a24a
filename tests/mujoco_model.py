"""Forces of a planar linkage by MuJoCo's inverse dynamics, which shares nothing with the package.

The linkage is cut at one pin into a tree of bodies, whose motion is given. MuJoCo gives the forces at all joints that
this motion takes; they are those of the drive, of the loads, and of the force at the cut, J^T f.
"""

from dataclasses import dataclass

import numpy as np

import explore


@dataclass(frozen=True)
class Body:
    """A body of the tree, with a hinge or slide at the origin of its frame; lengths in m.

    A hinge turns by the angle to the parent; a slide moves along x.
    """

    name: str
    mass: float
    inertia: float  # about the centroid
    centroid: tuple[float, float]
    at: tuple[float, float] = (0.0, 0.0)  # in the parent's frame
    parent: str = ""
    joint: str = "hinge"
    stiffness: float = 0.0
    rest: float = 0.0
    damping: float = 0.0


@dataclass(frozen=True)
class Cut:
    """The pin that is cut: its place in the frames of two bodies."""

    first: str
    first_at: tuple[float, float]
    second: str
    second_at: tuple[float, float]


@dataclass(frozen=True)
class Guided:
    """A place of a body that a fixed groove guides, and the unit vectors across the groove, shape (t, 2)."""

    body: str
    at: tuple[float, float]
    normals: np.ndarray


def text(*numbers):
    return " ".join(repr(float(number)) for number in numbers)


def _element(bodies, body):
    axis = "0 0 1" if body.joint == "hinge" else "1 0 0"
    children = "".join(_element(bodies, child) for child in bodies if child.parent == body.name)
    return (
        f'<body name="{body.name}" pos="{text(*body.at)} 0">'
        f'<joint name="{body.name}" type="{body.joint}" axis="{axis}" stiffness="{text(body.stiffness)}" '
        f'springref="{text(body.rest)}" damping="{text(body.damping)}"/>'
        f'<inertial pos="{text(*body.centroid)} 0" mass="{text(body.mass)}" '
        f'diaginertia="{text(*[body.inertia] * 3)}"/>{children}</body>'
    )


def inverse_dynamics(bodies, cut, gravity, motion, loads, drive, guided=None):
    """Forces for a motion.

    Parameters
    ----------
    bodies, cut, gravity
        The tree and the pin that closes it; gravity acts along -y.
    motion : dict
        Position, velocity and acceleration of each joint, by the name of its body, each of shape (t,).
    loads : dict
        Torques or forces on joints beside springs and dampers, by the name of the body, each of shape (t,).
    drive : str
        Name of the body that the drive turns.
    guided : Guided, optional
        A groove on a body.

    Returns
    -------
    tuple
        Drive torque, shape (t,); and by the name of the body the force of its joint on it, each of shape (t, 2), by the
        name "cut" that of the second body on the first, by the name "guided" that of the groove.
    """
    import mujoco

    world = "".join(_element(bodies, body) for body in bodies if not body.parent)
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><compiler angle="radian"/><option gravity="{text(0.0, -gravity, 0.0)}"/>'
        f"<worldbody>{world}</worldbody></mujoco>"
    )
    data = mujoco.MjData(model)
    numbers = {body.name: model.body(body.name).id for body in bodies}
    joints = [model.joint(k).name for k in range(model.njnt)]
    count = len(next(iter(motion.values()))[0])
    torque = np.empty(count)
    pins = {name: np.zeros((count, 2)) for name in [*numbers, "cut", "guided"]}
    cuts = [(cut.first, cut.first_at), (cut.second, cut.second_at)]
    cuts += [(guided.body, guided.at)] if guided else []
    jacobian = np.zeros((len(cuts), 3, model.nv))
    for k in range(count):
        for j, name in enumerate(joints):
            data.qpos[j], data.qvel[j], data.qacc[j] = (values[k] for values in motion[name])
        data.xfrc_applied[:] = 0.0
        mujoco.mj_inverse(model, data)
        places = []
        for row, (name, at) in enumerate(cuts):
            number = numbers[name]
            places.append(data.xpos[number] + data.xmat[number].reshape(3, 3) @ [*at, 0.0])
            mujoco.mj_jac(model, data, jacobian[row], None, places[row], number)
        assert np.allclose(*places[:2], rtol=0.0, atol=1e-9)  # the motion closes the loop
        columns = [np.array(joints) == drive, (jacobian[0] - jacobian[1])[:2].T]
        columns += [jacobian[2, :2].T @ guided.normals[k]] if guided else []
        system = np.column_stack(columns).astype(float)
        applied = [loads[name][k] if name in loads else 0.0 for name in joints]
        torque[k], *force = np.linalg.solve(system, data.qfrc_inverse - applied)
        pins["cut"][k] = force[:2]
        vectors = [pins["cut"][k], -pins["cut"][k]]
        if guided:
            pins["guided"][k] = force[2] * guided.normals[k]
            vectors.append(pins["guided"][k])
        # These forces, about the centroids, for the balance of forces of each body.
        for (name, _), place, vector in zip(cuts, places, vectors, strict=True):
            number = numbers[name]
            data.xfrc_applied[number] = [*vector, 0.0, *np.cross(place - data.xipos[number], [*vector, 0.0])]
        mujoco.mj_rnePostConstraint(model, data)
        for name, number in numbers.items():
            pins[name][k] = data.cfrc_int[number, 3:5]
    return torque, pins


def magnitude(force):
    return np.hypot(*force.T)


def rod_motion(mechanism, design, degrees):
    """Positions, velocities and accelerations of both pins of a rod, m, each (3, t, 2), and its rates, each (t,).

    The pin of the crank moves as a point of the rod, which other tests compare with 40 digits.
    """
    signals = explore.simulate(mechanism, design, angles=degrees, points={"b": (0.0, 0.0)})
    kinds = ("", "velocity_", "acceleration_")
    pin = 1e-3 * np.array([[signals[f"b_{kind}{axis}"] for axis in "xy"] for kind in kinds]).transpose(0, 2, 1)
    slider = np.zeros_like(pin)
    slider[..., 0] = [1e-3 * signals[f"slider_{name}"] for name in ("position", "velocity", "acceleration")]
    slider[0, :, 1] = 1e-3 * design.get("offset", 0.0)
    span = slider[0] - pin[0]
    turning, spinning = (np.linalg.det(np.stack([span, slider[k] - pin[k]], axis=-1)) for k in (1, 2))
    square = (span**2).sum(axis=1)
    return pin, slider, turning / square, spinning / square
