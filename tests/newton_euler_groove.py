"""Forces of the variable crank by a second method: the equations of Newton and Euler of disc, pin, rod and slider.

The motion of the pin is that of a point of the rod, which other tests compare with 40 digits; the rod's rates follow
from the differentiated loop, forces from one linear system for each of the two sides that the slider may lean on; all
in m, N, rad. No formula is shared with the package.
"""

import numpy as np

import explore

DEFAULTS = {"mass": 1.0, "gravity": 9.80665, "rod_centroid": 0.5}
LOADS = ("constant_force", "opposing_force", "stiffness", "damping", "friction", "rod_mass", "rod_inertia", "pin_mass",
         "disc_mass", "disc_centroid")  # fmt: skip
_KINDS = ("", "velocity_", "acceleration_")


def motion_of(design, degrees):
    """Positions, velocities and accelerations of pin and slider, each (3, t, 2), and the rod's rates, each (t,)."""
    signals = explore.simulate("variable-crank", design, angles=degrees, points={"b": (0.0, 0.0)})
    pin = 1e-3 * np.array([[signals[f"b_{kind}{axis}"] for axis in "xy"] for kind in _KINDS]).transpose(0, 2, 1)
    names = ("slider_position", "slider_velocity", "slider_acceleration")
    slider = 1e-3 * np.array([np.stack([signals[name], np.zeros(len(degrees))], axis=-1) for name in names])
    span = slider[0] - pin[0]
    square = (span**2).sum(axis=1)

    def cross(rate):
        return span[:, 0] * rate[:, 1] - span[:, 1] * rate[:, 0]

    return pin, slider, cross(slider[1] - pin[1]) / square, cross(slider[2] - pin[2]) / square


def forces(design, degrees, middle):
    """Forces by name, in pins each (t, 2), others each (t,); `middle` is the slider's position at mid-stroke, m."""
    pin, slider, turning, spinning = motion_of(design, degrees)
    design = dict.fromkeys(LOADS, 0.0) | DEFAULTS | design
    speed, gravity, count = design["speed"], np.array([0.0, -design["gravity"]]), len(degrees)
    velocity = slider[1, :, 0]
    applied = design["constant_force"] - design["opposing_force"] * np.sign(velocity)
    applied = applied - design["stiffness"] * (slider[0, :, 0] - middle) - design["damping"] * velocity
    radial = pin[0] / np.linalg.norm(pin[0], axis=1)[:, None]
    around = np.stack([-radial[:, 1], radial[:, 0]], axis=-1)
    normal = np.stack([pin[1, :, 1], -pin[1, :, 0]], axis=-1) / np.linalg.norm(pin[1], axis=1)[:, None]
    disc_arm = 1e-3 * design["disc_centroid"] * radial
    rod_arm = design["rod_centroid"] * (slider[0] - pin[0])
    across = np.stack([-rod_arm[:, 1], rod_arm[:, 0]], axis=-1)
    rod_acceleration = pin[2] + spinning[:, None] * across - (turning**2)[:, None] * rod_arm
    right = np.zeros((count, 10))
    right[:, 0:2] = design["disc_mass"] * (-(speed**2) * disc_arm - gravity)
    right[:, 3:5] = design["pin_mass"] * (pin[2] - gravity)
    right[:, 5:7] = design["rod_mass"] * (rod_acceleration - gravity)
    right[:, 7] = design["rod_inertia"] * spinning
    right[:, 8:10] = design["mass"] * (slider[2] - gravity)
    right[:, 8] -= applied
    chosen = None
    for side in (1.0, -1.0):
        # unknowns: A on the disc, slot and groove on the pin, B on the rod, C on the slider, force of the guide, torque
        system = np.zeros((count, 10, 10))
        for axis in range(2):
            system[:, axis, axis], system[:, axis, 2] = 1.0, -around[:, axis]
            system[:, 3 + axis, 2], system[:, 3 + axis, 3] = around[:, axis], normal[:, axis]
            system[:, 3 + axis, 4 + axis] = -1.0
            system[:, 5 + axis, 4 + axis], system[:, 5 + axis, 6 + axis] = 1.0, -1.0
            system[:, 8 + axis, 6 + axis] = 1.0
        for row, column, sign, arm in ((2, 0, 1.0, -disc_arm), (7, 4, 1.0, -rod_arm),
                                       (7, 6, -1.0, slider[0] - pin[0] - rod_arm)):  # fmt: skip
            system[:, row, column] = -sign * arm[:, 1]
            system[:, row, column + 1] = sign * arm[:, 0]
        to_pin = pin[0] - disc_arm
        system[:, 2, 2] = -(to_pin[:, 0] * around[:, 1] - to_pin[:, 1] * around[:, 0])
        system[:, 2, 9] = 1.0
        system[:, 8, 8] = -design["friction"] * side * np.sign(velocity)
        system[:, 9, 8] = 1.0
        solution = np.linalg.solve(system, right[..., None])[..., 0]
        chosen = solution if chosen is None else np.where(chosen[:, 8:9] >= 0.0, chosen, solution)
    return {
        "disc_pivot_force": chosen[:, 0:2], "slot_force": chosen[:, 2], "groove_force": chosen[:, 3],
        "crank_pin_force": chosen[:, 4:6], "slider_pin_force": chosen[:, 6:8], "thrust": chosen[:, 6],
        "guide_force": chosen[:, 8], "drive_torque": chosen[:, 9],
    }  # fmt: skip
