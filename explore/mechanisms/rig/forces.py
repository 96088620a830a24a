"""The forces of the oscillating-torque test rig, compiled: coupler, four pins, drive torque.

The load of each design decides how much of the motion is computed: torques and springs need positions, damping
velocities, inertia and masses accelerations. Without masses the coupler is a two-force member, and all forces follow
from the torque that it exerts about the rocker's pivot, tau = J alpha_3 - M::

    N = -tau r2 / x,    T = tau w3 / w1,    all pin forces |N|          (x twice the area of the triangle BCD)

With masses the moments of the rocker about D and of the coupler about B give the force at C; the balance of forces of
each link gives the others.
"""

import math

from explore.compiling import FILL_SIGNATURE, LANES, compiled
from explore.mechanisms import four_bar
from explore.mechanisms.four_bar import (
    COUPLER_ACCELERATION,
    COUPLER_EXCESS,
    COUPLER_VELOCITY,
    CRANK,
    ROCKER_ACCELERATION,
    ROCKER_ANGLE,
    ROCKER_VELOCITY,
    factors,
)
from explore.mechanisms.rig.columns import (
    CLOCKWISE,
    COUPLER_FORCE,
    DEVIATION,
    DEVIATION_COSINE,
    DEVIATION_SINE,
    DRIVE_TORQUE,
    FORCE_TERMS,
    FORCES,
    HARMONICS,
    HAS_DAMPING,
    HAS_INERTIA,
    HAS_MASSES,
    HAS_OPPOSING_TORQUE,
    HAS_STIFFNESS,
    PIN_A,
    PIN_B,
    PIN_C,
    PIN_D,
    ROCKER_FORCE,
    ROCKER_MOMENT,
    SIGNAL_ROWS,
    TORQUE,
    TORQUE_TERMS,
    Row,
)
from explore.subroutines import subroutine

_MOTION = four_bar.VELOCITIES | four_bar.ACCELERATIONS | four_bar.ANGLES | four_bar.TRANSMISSION


@subroutine(fast=True)
def _fill_torque(constants, law, variant, out):
    """Fill the torque that the coupler exerts on the rocker, without that of the rocker's weight, and its terms, N m.

    They are in the rows of the drive torque and of the force terms until the forces replace them.
    """
    direction = -1.0 if law == CLOCKWISE else 1.0
    for lane in range(LANES):
        constant = constants[Row.LOAD_CONSTANT_TORQUE * LANES + lane]
        torque, terms = -constant, abs(constant)
        if variant & HAS_OPPOSING_TORQUE:
            opposing = constants[Row.LOAD_OPPOSING_TORQUE * LANES + lane]
            torque, terms = torque + direction * opposing, terms + abs(opposing)
        if variant & HAS_STIFFNESS:
            stiffness = constants[Row.LOAD_STIFFNESS * LANES + lane]
            angle = out[ROCKER_ANGLE * LANES + lane] - constants[Row.MIDDLE * LANES + lane]
            torque += stiffness * angle
            terms += stiffness * (abs(angle) + math.pi)  # the two angles are rounded, each below pi
        speed = constants[Row.LOAD_SPEED * LANES + lane]
        if variant & HAS_DAMPING:
            damping = constants[Row.LOAD_DAMPING * LANES + lane] * speed * out[ROCKER_VELOCITY * LANES + lane]
            torque, terms = torque + damping, terms + abs(damping)
        if variant & HAS_INERTIA:
            inertia = constants[Row.LOAD_INERTIA * LANES + lane] + constants[Row.LOAD_ROCKER_INERTIA * LANES + lane]
            inertia = inertia * speed * speed * out[ROCKER_ACCELERATION * LANES + lane]
            torque, terms = torque + inertia, terms + abs(inertia)
        out[DRIVE_TORQUE * LANES + lane], out[FORCE_TERMS * LANES + lane] = torque, terms


@subroutine(fast=True)
def _fill_massless_forces(constants, tangents, anchor, needs, out):
    """Fill the forces of massless links, from the torque about the rocker's pivot."""
    for lane in range(LANES):
        p, q, _, w = factors(constants, anchor, lane, tangents[lane] * tangents[lane])
        per_torque = constants[Row.LEVER * LANES + lane] * w / math.sqrt(p * q)
        moment = out[DRIVE_TORQUE * LANES + lane]
        force = -moment * per_torque
        terms = out[FORCE_TERMS * LANES + lane] * per_torque
        square = force * force
        out[COUPLER_FORCE * LANES + lane] = force
        out[PIN_A * LANES + lane], out[PIN_B * LANES + lane] = square, square
        out[PIN_C * LANES + lane], out[PIN_D * LANES + lane] = square, square
        out[ROCKER_FORCE * LANES + lane], out[ROCKER_MOMENT * LANES + lane] = force * (q - p) / (q + p), moment
        out[FORCE_TERMS * LANES + lane] = terms
        out[TORQUE_TERMS * LANES + lane] = 1e-3 * constants[CRANK * LANES + lane] * terms
        if needs & TORQUE:
            out[DRIVE_TORQUE * LANES + lane] = moment * out[ROCKER_VELOCITY * LANES + lane]


@subroutine(fast=True)
def _fill_forces_with_masses(constants, tangents, anchor, out):
    """Fill the forces of links with masses, in m and N.

    fa, fb, fc are the forces on crank, coupler and rocker at A, B, C; fd is that on the rocker at D. u and v are the
    unit vectors along coupler and rocker, u x v = sin(theta_3 - theta_2) > 0.
    """
    # One long loop, because its parts would exchange thirty numbers per node.
    sign = 1.0 if anchor == 0 else -1.0
    for lane in range(LANES):
        tangent = tangents[lane]
        square = tangent * tangent
        p, q, d, w = factors(constants, anchor, lane, square)
        crank, coupler = 1e-3 * constants[CRANK * LANES + lane], constants[Row.COUPLER_LENGTH * LANES + lane]
        rocker, ground = constants[Row.ROCKER_LENGTH * LANES + lane], constants[Row.GROUND_LENGTH * LANES + lane]
        speed, gravity = constants[Row.LOAD_SPEED * LANES + lane], constants[Row.LOAD_GRAVITY * LANES + lane]
        square_speed = speed * speed
        crank_mass = constants[Row.LOAD_CRANK_MASS * LANES + lane]
        coupler_mass = constants[Row.LOAD_COUPLER_MASS * LANES + lane]
        rocker_mass = constants[Row.LOAD_ROCKER_MASS * LANES + lane]
        crank_arm = constants[Row.LOAD_CRANK_CENTROID * LANES + lane] * crank
        coupler_arm = constants[Row.LOAD_COUPLER_CENTROID * LANES + lane] * coupler
        rocker_arm = constants[Row.LOAD_ROCKER_CENTROID * LANES + lane] * rocker
        root = math.sqrt(p * q)
        along = 0.5 * (constants[COUPLER_EXCESS * LANES + lane] * w + p) / d
        across = 0.5 * root / d
        cosine, sine = sign * (1.0 - square) / w, 2.0 * sign * tangent / w
        bx, by = crank * cosine, crank * sine
        dx, dy = ground - bx, -by
        cx, cy = along * dx - across * dy, along * dy + across * dx
        ux, uy, vx, vy = cx / coupler, cy / coupler, (cx - dx) / rocker, (cy - dy) / rocker
        w2, w3 = out[COUPLER_VELOCITY * LANES + lane], out[ROCKER_VELOCITY * LANES + lane]
        a2, a3 = out[COUPLER_ACCELERATION * LANES + lane], out[ROCKER_ACCELERATION * LANES + lane]
        # mass times (acceleration of the centroid less gravity), for crank, coupler and rocker
        f1x = -crank_mass * square_speed * crank_arm * cosine
        f1y = crank_mass * (gravity - square_speed * crank_arm * sine)
        f2x = -coupler_mass * square_speed * (bx + coupler_arm * (a2 * uy + w2 * w2 * ux))
        f2y = coupler_mass * (gravity - square_speed * (by - coupler_arm * (a2 * ux - w2 * w2 * uy)))
        f3x = -rocker_mass * square_speed * rocker_arm * (a3 * vy + w3 * w3 * vx)
        f3y = rocker_mass * (gravity + square_speed * rocker_arm * (a3 * vx - w3 * w3 * vy))
        inertia_moment = constants[Row.LOAD_COUPLER_INERTIA * LANES + lane] * square_speed * a2
        weight_moment = rocker_arm * rocker_mass * gravity
        v_cross_fc = (out[DRIVE_TORQUE * LANES + lane] + weight_moment * vx) / rocker
        u_cross_fc = -(inertia_moment + coupler_arm * (ux * f2y - uy * f2x)) / coupler
        per_sine = rocker * constants[Row.LEVER * LANES + lane] * w / root  # 1 / (u x v)
        fcx, fcy = (u_cross_fc * vx - v_cross_fc * ux) * per_sine, (u_cross_fc * vy - v_cross_fc * uy) * per_sine
        fbx, fby = fcx + f2x, fcy + f2y
        fax, fay, fdx, fdy = fbx + f1x, fby + f1y, f3x - fcx, f3y - fcy
        out[COUPLER_FORCE * LANES + lane] = fcx * ux + fcy * uy
        out[ROCKER_FORCE * LANES + lane], out[ROCKER_MOMENT * LANES + lane] = fcx * vx + fcy * vy, rocker * v_cross_fc
        out[PIN_A * LANES + lane], out[PIN_B * LANES + lane] = fax * fax + fay * fay, fbx * fbx + fby * fby
        out[PIN_C * LANES + lane], out[PIN_D * LANES + lane] = fcx * fcx + fcy * fcy, fdx * fdx + fdy * fdy
        coupler_terms, rocker_terms = abs(f2x) + abs(f2y), abs(f3x) + abs(f3y)
        moment_terms = (abs(inertia_moment) + abs(coupler_arm) * coupler_terms) / coupler
        terms = ((out[FORCE_TERMS * LANES + lane] + abs(weight_moment)) / rocker + moment_terms) * per_sine
        terms += abs(f1x) + abs(f1y) + coupler_terms + rocker_terms
        out[FORCE_TERMS * LANES + lane], out[TORQUE_TERMS * LANES + lane] = terms, crank * terms
        out[DRIVE_TORQUE * LANES + lane] = bx * fby - by * fbx + crank_mass * gravity * crank_arm * cosine


@subroutine(fast=True)
def _fill_deviations(constants, tangents, anchor, out):
    """Fill the deviation of the rocker's velocity from a sine, and its products with sine and cosine."""
    sign = 1.0 if anchor == 0 else -1.0
    for lane in range(LANES):
        tangent = tangents[lane]
        one_over_w = sign / (1.0 + tangent * tangent)
        cosine, sine = (1.0 - tangent * tangent) * one_over_w, 2.0 * tangent * one_over_w
        deviation = out[ROCKER_VELOCITY * LANES + lane]
        deviation -= constants[Row.COSINE * LANES + lane] * cosine + constants[Row.SINE * LANES + lane] * sine
        out[DEVIATION * LANES + lane] = deviation
        out[DEVIATION_COSINE * LANES + lane], out[DEVIATION_SINE * LANES + lane] = (
            2.0 * deviation * cosine,
            2.0 * deviation * sine,
        )


@compiled(FILL_SIGNATURE)
def fill(constants, tangents, anchor, law, variant, count, needs, out):
    """Fill the signals of `four_bar`, and forces (N, squares N^2) and torque (N m) at the design's speed.

    See `explore.model.mechanism.Mechanism` for the arguments.
    """
    motion = needs & _MOTION
    needs_load = needs & (FORCES | TORQUE) != 0
    if needs & (TORQUE | HARMONICS):
        motion |= four_bar.VELOCITIES  # for unit crank velocity, ratios that depend on the position alone
    if needs_load:
        motion |= four_bar.ANGLES if variant & HAS_STIFFNESS else 0
        motion |= four_bar.VELOCITIES if variant & HAS_DAMPING else 0
        motion |= four_bar.VELOCITIES | four_bar.ACCELERATIONS if variant & (HAS_INERTIA | HAS_MASSES) else 0
    four_bar.fill_motion(constants, tangents, anchor, count, motion, SIGNAL_ROWS, out)
    for j in range(count):
        node, signals = tangents[j * LANES :], out[j * SIGNAL_ROWS * LANES :]
        if needs_load:
            _fill_torque(constants, law, variant, signals)
            if variant & HAS_MASSES:
                _fill_forces_with_masses(constants, node, anchor, signals)
            else:
                _fill_massless_forces(constants, node, anchor, needs, signals)
        if needs & HARMONICS:
            _fill_deviations(constants, node, anchor, signals)
