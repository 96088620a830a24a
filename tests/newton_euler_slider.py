"""Forces of the slider-crank by a second method: the equations of Newton and Euler of crank, rod and slider.

Positions by the law of cosines, velocities and accelerations from the differentiated loop, forces as one linear system
for each of the two sides that the slider may lean on; all in m, N, rad. No formula is shared with the package.
"""

import numpy as np

DEFAULTS = {"offset": 0.0, "speed": 1.0, "gravity": 9.80665, "crank_centroid": 0.5, "rod_centroid": 0.5}


def kinematics(design, theta):
    """Positions, velocities and accelerations of both pins, and of the rod's angle, for the design's speed.

    Returns
    -------
    tuple
        Crank pin and slider pin, each (3, t, 2), and the rod's angular velocity and acceleration, (t,).
    """
    r, rod, offset = (1e-3 * design[name] for name in ("crank", "rod", "offset"))
    speed = design["speed"]
    pin = r * np.stack([np.cos(theta), np.sin(theta)], axis=-1)
    pin_velocity = speed * np.stack([-pin[:, 1], pin[:, 0]], axis=-1)
    pin_acceleration = -(speed**2) * pin
    # (slider - pin)^2 = rod^2 along the line: x^2 - 2 x pin_x + |pin|^2 + offset^2 - 2 offset pin_y - rod^2 = 0
    constant = (pin**2).sum(axis=1) + offset * offset - 2.0 * offset * pin[:, 1] - rod * rod
    x = pin[:, 0] + np.sqrt(pin[:, 0] ** 2 - constant)
    slider = np.stack([x, np.full_like(x, offset)], axis=-1)
    # unknowns: velocity of the slider along its line, angular velocity of the rod
    span = slider - pin
    matrix = np.empty((len(theta), 2, 2))
    matrix[:, :, 0], matrix[:, 0, 1], matrix[:, 1, 1] = [1.0, 0.0], span[:, 1], -span[:, 0]
    velocity, turning = np.linalg.solve(matrix, pin_velocity[..., None])[..., 0].T
    right = pin_acceleration - (turning**2)[:, None] * span
    acceleration, spinning = np.linalg.solve(matrix, right[..., None])[..., 0].T
    zero = np.zeros_like(x)
    slider_rates = [np.stack([rate, zero], axis=-1) for rate in (velocity, acceleration)]
    return np.array([pin, pin_velocity, pin_acceleration]), np.array([slider, *slider_rates]), turning, spinning


def middle(design):
    """Position of the slider at mid-stroke, m: the mean of those with crank and rod in line."""
    r, rod, offset = (1e-3 * design[name] for name in ("crank", "rod", "offset"))
    return 0.5 * sum(np.sqrt(length**2 - offset**2) for length in (rod + r, rod - r))


def forces(design, theta):
    """Forces by name: on crank at its pivot, on rod at the crank pin, on slider at its pin, each (t, 2).

    And "thrust", "guide_force" and "drive_torque", each (t,).
    """
    design = dict.fromkeys(
        ("constant_force", "opposing_force", "stiffness", "damping", "mass", "friction", "crank_mass", "rod_mass",
         "rod_inertia"), 0.0
    ) | DEFAULTS | design  # fmt: skip
    pin, slider, turning, spinning = kinematics(design, theta)
    velocity, gravity = slider[1, :, 0], np.array([0.0, -design["gravity"]])
    applied = design["constant_force"] - design["opposing_force"] * np.sign(velocity)
    applied = applied - design["stiffness"] * (slider[0, :, 0] - middle(design)) - design["damping"] * velocity
    crank_arm = design["crank_centroid"] * pin[0]
    rod_arm = design["rod_centroid"] * (slider[0] - pin[0])
    across = np.stack([-rod_arm[:, 1], rod_arm[:, 0]], axis=-1)
    crank_acceleration = design["crank_centroid"] * pin[2]
    rod_acceleration = pin[2] + spinning[:, None] * across - (turning**2)[:, None] * rod_arm
    right = np.zeros((len(theta), 8))
    right[:, 0:2] = design["crank_mass"] * (crank_acceleration - gravity)
    right[:, 3:5] = design["rod_mass"] * (rod_acceleration - gravity)
    right[:, 5] = design["rod_inertia"] * spinning
    right[:, 6:8] = design["mass"] * (slider[2] - gravity)
    right[:, 6] -= applied
    to_b, to_c = pin[0] - crank_arm, slider[0] - pin[0] - rod_arm
    chosen = None
    for side in (1.0, -1.0):
        # unknowns: A on the crank, B on the rod, C on the slider, each x and y; force of the guide; torque
        system = np.zeros((len(theta), 8, 8))
        for axis in range(2):
            system[:, axis, axis], system[:, axis, 2 + axis] = 1.0, -1.0
            system[:, 3 + axis, 2 + axis], system[:, 3 + axis, 4 + axis] = 1.0, -1.0
            system[:, 6 + axis, 4 + axis] = 1.0
        for row, column, sign, arm in ((2, 0, 1.0, -crank_arm), (2, 2, -1.0, to_b), (5, 2, 1.0, -rod_arm),
                                       (5, 4, -1.0, to_c)):  # fmt: skip
            system[:, row, column] -= sign * arm[:, 1]
            system[:, row, column + 1] += sign * arm[:, 0]
        system[:, 2, 7] = 1.0
        system[:, 6, 6] = -design["friction"] * side * np.sign(velocity)
        system[:, 7, 6] = 1.0
        solution = np.linalg.solve(system, right[..., None])[..., 0]
        chosen = solution if chosen is None else np.where(chosen[:, 6:7] >= 0.0, chosen, solution)
    return {
        "crank_pivot_force": chosen[:, 0:2], "crank_pin_force": chosen[:, 2:4], "slider_pin_force": chosen[:, 4:6],
        "thrust": chosen[:, 4], "guide_force": chosen[:, 6], "drive_torque": chosen[:, 7],
    }  # fmt: skip
