"""Forces of a four-bar by a second method: the nine equations of Newton and Euler of three links.

Positions by Freudenstein's equation, velocities and accelerations from the differentiated loop, all in m, N, rad; no
formula is shared with the package.
"""

import math

import numpy as np


def mid_angle(design):
    """Mean of the rocker's limit angles, by the cosine rule."""
    a, b, c, d = (design[name] for name in ("crank", "coupler", "rocker", "ground"))
    angles = [math.pi - math.acos((d * d + c * c - reach * reach) / (2.0 * c * d)) for reach in (b + a, b - a)]
    return design.get("branch", 1.0) * sum(angles) / 2.0


def kinematics(design, theta):
    """Angles of coupler and rocker, their velocities and accelerations for the design's speed, each of shape (t,)."""
    a, b, c, d = (design[name] for name in ("crank", "coupler", "rocker", "ground"))
    speed = design["speed"]
    # A cos(th3) + B sin(th3) + C = 0 of the rocker, the solution with C above the ground line on branch 1
    cosine, sine = np.cos(theta), np.sin(theta)
    big_a, big_b = 2.0 * c * (d - a * cosine), -2.0 * a * c * sine
    big_c = a * a + c * c + d * d - b * b - 2.0 * a * d * cosine
    from_diagonal = np.arccos(np.clip(-big_c / np.hypot(big_a, big_b), -1.0, 1.0))
    rocker = np.arctan2(big_b, big_a) + design.get("branch", 1.0) * from_diagonal
    coupler = np.arctan2(c * np.sin(rocker) - a * sine, d + c * np.cos(rocker) - a * cosine)
    s2, c2, s3, c3 = np.sin(coupler), np.cos(coupler), np.sin(rocker), np.cos(rocker)
    matrix = np.moveaxis(np.array([[-b * s2, c * s3], [b * c2, -c * c3]]), -1, 0)
    right = np.stack([a * sine * speed, -a * cosine * speed], axis=-1)
    w2, w3 = np.linalg.solve(matrix, right[..., None])[..., 0].T
    right = np.stack(
        [
            a * cosine * speed**2 + b * c2 * w2**2 - c * c3 * w3**2,
            a * sine * speed**2 + b * s2 * w2**2 - c * s3 * w3**2,
        ],
        axis=-1,
    )
    a2, a3 = np.linalg.solve(matrix, right[..., None])[..., 0].T
    return coupler, rocker, w2, w3, a2, a3


def forces(design, theta, turned_by=(0.0, 0.0, 0.0)):
    """Pin forces a, b, c, d, each (t, 2), on crank, coupler, rocker and rocker; drive torque; load torque, (t,).

    `turned_by` are torques on crank, coupler and rocker besides the load.
    """
    defaults = {"gravity": 9.80665, "speed": 60.0}

    def value(name):
        return float(design.get(name, defaults.get(name, 0.0)))

    design = design | {"speed": value("speed")}
    coupler, rocker, w2, w3, a2, a3 = kinematics(design, theta)
    speed, gravity, zero = value("speed"), value("gravity"), np.zeros_like(theta)
    load = value("constant_torque") - value("opposing_torque") * np.sign(w3) - value("damping") * w3
    load -= value("stiffness") * (rocker - mid_angle(design))
    crank_to, coupler_to, rocker_to = (
        1e-3 * design[name] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        for name, angle in (("crank", theta), ("coupler", coupler), ("rocker", rocker))
    )

    def acceleration(arm, w, a):
        return a[:, None] * np.stack([-arm[:, 1], arm[:, 0]], axis=-1) - (w**2)[:, None] * arm

    arms = [
        vector * design.get(f"{n}_centroid", 0.5)
        for n, vector in (("crank", crank_to), ("coupler", coupler_to), ("rocker", rocker_to))
    ]
    speeds = np.full_like(theta, speed)
    at_b = acceleration(crank_to, speeds, zero)
    centroids = [
        acceleration(arms[0], speeds, zero),
        at_b + acceleration(arms[1], w2, a2),
        acceleration(arms[2], w3, a3),
    ]
    masses = [value(f"{name}_mass") for name in ("crank", "coupler", "rocker")]
    weight = np.array([0.0, gravity])
    inertia_forces = [mass * (acc + weight) for mass, acc in zip(masses, centroids, strict=True)]
    # moment of inertia of the rocker about its own centroid, from that about the pivot
    about_d = value("inertia") + value("rocker_inertia")
    rocker_moment = about_d * a3 - masses[2] * (arms[2] ** 2).sum(axis=1) * a3
    # unknowns: A (on crank), B (on coupler), C (on rocker), D (on rocker), torque
    system, right = np.zeros((len(theta), 9, 9)), np.zeros((len(theta), 9))

    def moment(row, column, sign, arm):
        system[:, row, column] += -sign * arm[:, 1]
        system[:, row, column + 1] += sign * arm[:, 0]

    for axis in range(2):
        system[:, axis, axis], system[:, axis, 2 + axis] = 1.0, -1.0  # crank: A - B
        system[:, 3 + axis, 2 + axis], system[:, 3 + axis, 4 + axis] = 1.0, -1.0  # coupler: B - C
        system[:, 6 + axis, 4 + axis], system[:, 6 + axis, 6 + axis] = 1.0, 1.0  # rocker: C + D
        for link in range(3):
            right[:, 3 * link + axis] = inertia_forces[link][:, axis]
    moment(2, 0, 1.0, -arms[0])
    moment(2, 2, -1.0, crank_to - arms[0])
    system[:, 2, 8] = 1.0
    moment(5, 2, 1.0, -arms[1])
    moment(5, 4, -1.0, coupler_to - arms[1])
    right[:, 2] = -turned_by[0]
    right[:, 5] = value("coupler_inertia") * a2 - turned_by[1]
    moment(8, 4, 1.0, rocker_to - arms[2])
    moment(8, 6, 1.0, -arms[2])
    right[:, 8] = rocker_moment - load - turned_by[2]
    solution = np.linalg.solve(system, right[..., None])[..., 0]
    return {pin: solution[:, 2 * k : 2 * k + 2] for k, pin in enumerate("abcd")}, solution[:, 8], load, w3
