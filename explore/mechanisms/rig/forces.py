"""The forces of the oscillating-torque test rig, compiled: coupler, four pins, drive torque.

The load of each design decides how much of the motion is computed: torques and springs need positions, damping
velocities, inertia and masses accelerations. Without masses the coupler is a two-force member, and all forces follow
from the torque that it exerts about the rocker's pivot, tau = J alpha_3 - M::

    N = -tau r2 / x,    T = tau w3 / w1,    all pin forces |N|          (x twice the area of the triangle BCD)

With masses the moments of the rocker about D and of the coupler about B give the force at C; the balance of forces of
each link gives the others.
"""

import math

from explore.compiling import FILL_SIGNATURE, compiled
from explore.mechanisms import four_bar, rocking
from explore.mechanisms.four_bar import (
    COUPLER_ACCELERATION,
    COUPLER_EXCESS,
    COUPLER_VELOCITY,
    CRANK,
    E1_E2,
    E3_E4,
    FOUR_CRANK_GROUND,
    GROUND_MINUS_CRANK_SQUARED,
    ROCKER_ACCELERATION,
    ROCKER_ANGLE,
    ROCKER_VELOCITY,
)  # fmt: skip
from explore.mechanisms.rig.columns import (
    COUPLER_FORCE,
    DEVIATION,
    DEVIATION_COSINE,
    DEVIATION_SINE,
    DRIVE_TORQUE,
    FORCE_TERMS,
    FORCES,
    HARMONICS,
    PIN_A,
    PIN_B,
    PIN_C,
    PIN_D,
    ROCKER_FORCE,
    ROCKER_MOMENT,
    TORQUE,
    TORQUE_TERMS,
    KernelColumn,
)

_MOTION = four_bar.VELOCITIES | four_bar.ACCELERATIONS | four_bar.ANGLES | four_bar.TRANSMISSION


@compiled("void(float64[::1], float64[::1], float64[::1], int64, float64[:, ::1])", fast=True)
def _fill_torque(row, sin_half, cos_half, count, out):
    """Fill the torque that the coupler exerts on the rocker, without that of the rocker's weight, and its terms, N m.

    They are in the rows of the drive torque and of the force terms until the forces replace them.
    """
    constant = row[KernelColumn.CONSTANT_TORQUE]
    for j in range(count):
        out[DRIVE_TORQUE, j] = -constant
        out[FORCE_TERMS, j] = abs(constant)
    opposing = row[KernelColumn.OPPOSING_TORQUE]
    if opposing != 0.0:
        # The rocker turns clockwise on the stroke through crank angle 0. The sign of its velocity is no test of this,
        # because at the ends of a stroke it is a matter of rounding.
        first, last = rocking.stroke_ends(row, True)
        for j in range(count):
            cosine = abs(cos_half[j])
            sine = sin_half[j] if cos_half[j] >= 0.0 else -sin_half[j]
            clockwise = (sine >= first * cosine) and (sine <= last * cosine)
            out[DRIVE_TORQUE, j] += -opposing if clockwise else opposing
            out[FORCE_TERMS, j] += abs(opposing)
    stiffness = row[KernelColumn.STIFFNESS]
    if stiffness != 0.0:
        middle = row[KernelColumn.MID_ANGLE]
        for j in range(count):
            angle = out[ROCKER_ANGLE, j] - middle
            out[DRIVE_TORQUE, j] += stiffness * angle
            out[FORCE_TERMS, j] += stiffness * (abs(angle) + math.pi)  # the two angles are rounded, each below pi
    damping = row[KernelColumn.DAMPING] * row[KernelColumn.SPEED]
    if damping != 0.0:
        for j in range(count):
            out[DRIVE_TORQUE, j] += damping * out[ROCKER_VELOCITY, j]
            out[FORCE_TERMS, j] += damping * abs(out[ROCKER_VELOCITY, j])
    inertia = (
        (row[KernelColumn.INERTIA] + row[KernelColumn.ROCKER_INERTIA])
        * row[KernelColumn.SPEED]
        * row[KernelColumn.SPEED]
    )
    if inertia != 0.0:
        for j in range(count):
            out[DRIVE_TORQUE, j] += inertia * out[ROCKER_ACCELERATION, j]
            out[FORCE_TERMS, j] += inertia * abs(out[ROCKER_ACCELERATION, j])


@compiled("void(float64[::1], float64[::1], float64[::1], int64, int64, float64[:, ::1])", fast=True)
def _fill_massless_forces(row, sin_half, cos_half, count, needs, out):
    """Fill the forces of massless links, from the torque about the rocker's pivot."""
    four_crank_ground, p_min, q_min, lever = row[FOUR_CRANK_GROUND], row[E1_E2], row[E3_E4], row[KernelColumn.LEVER]
    crank = 1e-3 * row[CRANK]
    for j in range(count):
        p = p_min + four_crank_ground * sin_half[j] * sin_half[j]
        q = q_min + four_crank_ground * cos_half[j] * cos_half[j]
        per_torque = lever / math.sqrt(p * q)
        moment = out[DRIVE_TORQUE, j]
        force = -moment * per_torque
        terms = out[FORCE_TERMS, j] * per_torque
        square = force * force
        out[COUPLER_FORCE, j] = force
        out[PIN_A, j], out[PIN_B, j], out[PIN_C, j], out[PIN_D, j] = square, square, square, square
        out[ROCKER_FORCE, j], out[ROCKER_MOMENT, j] = force * (q - p) / (q + p), moment
        out[FORCE_TERMS, j], out[TORQUE_TERMS, j] = terms, crank * terms
    if needs & TORQUE:
        for j in range(count):
            out[DRIVE_TORQUE, j] *= out[ROCKER_VELOCITY, j]


@compiled("void(float64[::1], float64[::1], float64[::1], int64, float64[:, ::1])", fast=True)
def _fill_forces_with_masses(row, sin_half, cos_half, count, out):
    """Fill the forces of links with masses, in m and N.

    fa, fb, fc are the forces on crank, coupler and rocker at A, B, C; fd is that on the rocker at D. u and v are the
    unit vectors along coupler and rocker, u x v = sin(theta_3 - theta_2) > 0.
    """
    # One long loop, because its parts would exchange thirty numbers per node.
    four_crank_ground, p_min, q_min, lever = row[FOUR_CRANK_GROUND], row[E1_E2], row[E3_E4], row[KernelColumn.LEVER]
    coupler_excess, difference_squared = row[COUPLER_EXCESS], row[GROUND_MINUS_CRANK_SQUARED]
    crank, coupler, rocker, ground = (
        1e-3 * row[CRANK],
        row[KernelColumn.COUPLER_LENGTH],
        row[KernelColumn.ROCKER_LENGTH],
        row[KernelColumn.GROUND_LENGTH],
    )
    speed, gravity = row[KernelColumn.SPEED], row[KernelColumn.GRAVITY]
    square_speed = speed * speed
    crank_mass, coupler_mass, rocker_mass = (
        row[KernelColumn.CRANK_MASS],
        row[KernelColumn.COUPLER_MASS],
        row[KernelColumn.ROCKER_MASS],
    )
    crank_arm, coupler_arm = row[KernelColumn.CRANK_CENTROID] * crank, row[KernelColumn.COUPLER_CENTROID] * coupler
    rocker_arm = row[KernelColumn.ROCKER_CENTROID] * rocker
    coupler_inertia = row[KernelColumn.COUPLER_INERTIA]
    for j in range(count):
        sine_squared, cosine_squared = sin_half[j] * sin_half[j], cos_half[j] * cos_half[j]
        p, q = p_min + four_crank_ground * sine_squared, q_min + four_crank_ground * cosine_squared
        d_squared = difference_squared + four_crank_ground * sine_squared
        root_pq = math.sqrt(p * q)
        along, across = 0.5 * (coupler_excess + p) / d_squared, 0.5 * root_pq / d_squared
        cosine, sine = cosine_squared - sine_squared, 2.0 * sin_half[j] * cos_half[j]
        bx, by = crank * cosine, crank * sine
        dx, dy = ground - bx, -by
        cx, cy = along * dx - across * dy, along * dy + across * dx
        ux, uy, vx, vy = cx / coupler, cy / coupler, (cx - dx) / rocker, (cy - dy) / rocker
        w2, w3 = out[COUPLER_VELOCITY, j], out[ROCKER_VELOCITY, j]
        a2, a3 = out[COUPLER_ACCELERATION, j], out[ROCKER_ACCELERATION, j]
        # mass times (acceleration of the centroid less gravity), for crank, coupler and rocker
        f1x = -crank_mass * square_speed * crank_arm * cosine
        f1y = crank_mass * (gravity - square_speed * crank_arm * sine)
        f2x = -coupler_mass * square_speed * (bx + coupler_arm * (a2 * uy + w2 * w2 * ux))
        f2y = coupler_mass * (gravity - square_speed * (by - coupler_arm * (a2 * ux - w2 * w2 * uy)))
        f3x = -rocker_mass * square_speed * rocker_arm * (a3 * vy + w3 * w3 * vx)
        f3y = rocker_mass * (gravity + square_speed * rocker_arm * (a3 * vx - w3 * w3 * vy))
        inertia_moment, weight_moment = coupler_inertia * square_speed * a2, rocker_arm * rocker_mass * gravity
        v_cross_fc = (out[DRIVE_TORQUE, j] + weight_moment * vx) / rocker
        u_cross_fc = -(inertia_moment + coupler_arm * (ux * f2y - uy * f2x)) / coupler
        per_sine = rocker * lever / root_pq  # 1 / (u x v)
        fcx, fcy = (u_cross_fc * vx - v_cross_fc * ux) * per_sine, (u_cross_fc * vy - v_cross_fc * uy) * per_sine
        fbx, fby = fcx + f2x, fcy + f2y
        fax, fay, fdx, fdy = fbx + f1x, fby + f1y, f3x - fcx, f3y - fcy
        out[COUPLER_FORCE, j] = fcx * ux + fcy * uy
        out[ROCKER_FORCE, j], out[ROCKER_MOMENT, j] = fcx * vx + fcy * vy, rocker * v_cross_fc
        out[PIN_A, j], out[PIN_B, j] = fax * fax + fay * fay, fbx * fbx + fby * fby
        out[PIN_C, j], out[PIN_D, j] = fcx * fcx + fcy * fcy, fdx * fdx + fdy * fdy
        coupler_terms, rocker_terms = abs(f2x) + abs(f2y), abs(f3x) + abs(f3y)
        moment_terms = (abs(inertia_moment) + abs(coupler_arm) * coupler_terms) / coupler
        terms = ((out[FORCE_TERMS, j] + abs(weight_moment)) / rocker + moment_terms) * per_sine
        terms += abs(f1x) + abs(f1y) + coupler_terms + rocker_terms
        out[FORCE_TERMS, j], out[TORQUE_TERMS, j] = terms, crank * terms
        out[DRIVE_TORQUE, j] = bx * fby - by * fbx + crank_mass * gravity * crank_arm * cosine


@compiled(FILL_SIGNATURE, fast=True)
def fill(row, sin_half, cos_half, count, needs, out):
    """Fill the signals of `four_bar.fill`, and forces (N, squares N^2) and torque (N m) at the design's speed.

    See `explore.model.mechanism.Mechanism` for the arguments.
    """
    motion = needs & _MOTION
    needs_load = needs & (FORCES | TORQUE) != 0
    if needs & (TORQUE | HARMONICS):
        motion |= four_bar.VELOCITIES  # for unit crank velocity, ratios that depend on the position alone
    if needs_load:
        motion |= int(row[KernelColumn.MOTION_NEEDS])
    if motion:
        four_bar.fill(row, sin_half, cos_half, count, motion, out)
    if needs_load:
        _fill_torque(row, sin_half, cos_half, count, out)
        if row[KernelColumn.MASSES] != 0.0:
            _fill_forces_with_masses(row, sin_half, cos_half, count, out)
        else:
            _fill_massless_forces(row, sin_half, cos_half, count, needs, out)
    if needs & HARMONICS:
        for j in range(count):
            cosine = cos_half[j] * cos_half[j] - sin_half[j] * sin_half[j]
            sine = 2.0 * sin_half[j] * cos_half[j]
            deviation = out[ROCKER_VELOCITY, j] - row[KernelColumn.COSINE] * cosine - row[KernelColumn.SINE] * sine
            out[DEVIATION, j] = deviation
            out[DEVIATION_COSINE, j], out[DEVIATION_SINE, j] = 2.0 * deviation * cosine, 2.0 * deviation * sine
