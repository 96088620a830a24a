"""Forces of a four-bar under load, compiled: coupler, four pins, drive torque, for many lanes at once.

The load is the torque on the rocker besides that of the coupler, counter-clockwise positive::

    M = M0 - Mo sign(w3) - k (theta_3 - phi0) - c w3,    phi0 the mid-angle

That of each design decides how much of the motion is computed: torques and springs need positions, damping velocities,
inertia and masses accelerations. Without masses the coupler is a two-force member, and all forces follow from the
torque that it exerts about the rocker's pivot, tau = J alpha_3 - M::

    N = -tau r2 / x,    T = tau w3 / w1,    all pin forces |N|          (x twice the area of the triangle BCD)

With masses the moments of the rocker about D and of the coupler about B give the force at C; the balance of forces of
each link gives the others. On branch -1 the area is negative.
"""

import math
from enum import IntEnum, auto

from explore.base.compiling import LANES
from explore.base.subroutines import subroutine
from explore.mechanisms import four_bar
from explore.mechanisms.four_bar import (
    BRANCH,
    COUPLER_ACCELERATION,
    COUPLER_EXCESS,
    COUPLER_VELOCITY,
    CRANK,
    GROUND_MINUS_CRANK,
    GROUND_PLUS_CRANK,
    ROCKER_ACCELERATION,
    ROCKER_ANGLE,
    ROCKER_EXCESS,
    ROCKER_VELOCITY,
    factors,
)
from explore.mechanisms.rocking import ROCKING_SIZE


class Load(IntEnum):
    """Rows of the constants after those of `rocking`.

    The load in the order of the parameters, the last one the speed, in SI units, with the sense of the opposing torque
    on the stroke that follows the first break; lengths, m; mid-angle, rad; ratio of coupler force to torque times the
    root of p q; and the variant, whose bits tell which kinds of load a design has.
    """

    CONSTANT_TORQUE = ROCKING_SIZE
    OPPOSING_TORQUE = auto()
    STIFFNESS = auto()
    DAMPING = auto()
    INERTIA = auto()
    CRANK_MASS = auto()
    COUPLER_MASS = auto()
    ROCKER_MASS = auto()
    CRANK_CENTROID = auto()
    COUPLER_CENTROID = auto()
    ROCKER_CENTROID = auto()
    COUPLER_INERTIA = auto()
    ROCKER_INERTIA = auto()
    GRAVITY = auto()
    SPEED = auto()
    COUPLER_LENGTH = auto()
    ROCKER_LENGTH = auto()
    MIDDLE = auto()
    LEVER = auto()
    VARIANT = auto()


#: Names of the rows of the load that are parameters, with the speed.
LOAD_ROWS = tuple(row.name for row in Load if row <= Load.SPEED)
#: Number of the constants of a four-bar under load.
LOADED_SIZE = max(Load) + 1

# Bits of the variant: the load has a spring, a damper, inertia of the rocker, a torque against the motion, masses.
HAS_STIFFNESS, HAS_DAMPING, HAS_INERTIA, HAS_OPPOSING_TORQUE, HAS_MASSES = 1, 2, 4, 8, 16

# Rows of the signal array after those of the four-bar. The rows of the pins hold squares; the rows of terms hold the
# size of the terms that add up to force and torque.
COUPLER_FORCE, PIN_A, PIN_B, PIN_C, PIN_D, DRIVE_TORQUE, FORCE_TERMS, TORQUE_TERMS = range(
    four_bar.SIGNAL_ROWS, four_bar.SIGNAL_ROWS + 8
)
ROCKER_FORCE, ROCKER_MOMENT, POSITIVE_TORQUE, FRICTION_TORQUE = range(
    four_bar.SIGNAL_ROWS + 8, four_bar.SIGNAL_ROWS + 12
)
LOADED_SIGNAL_ROWS = four_bar.SIGNAL_ROWS + 12
# Bits of the needs after the four-bar's.
FORCES, TORQUE = 16, 32

#: Number of the law on the stroke from overlapped to extended, where the rocker turns clockwise on branch 1.
OVERLAPPED_TO_EXTENDED = 0
#: Rounding of a torque, relative to its terms.
_ROUNDING = 1e-14

_MOTION = four_bar.VELOCITIES | four_bar.ACCELERATIONS | four_bar.ANGLES | four_bar.TRANSMISSION


@subroutine(inlined=True)
def fill_load_constants(record, lane, first_length, first_load, speed, rocks):
    """Fill the constants of the forces of one lane, beside the mid-angle.

    The rows of the lengths begin with the crank's, `first_length`, those of the loads with the constant torque's,
    `first_load`. Unless the rocker swings (`rocks`) it has no mid-angle and strokes, and the forces are NaN.
    """
    for k in range(Load.SPEED - Load.CONSTANT_TORQUE):
        record[(Load.CONSTANT_TORQUE + k) * LANES + lane] = record[(first_load + k) * LANES + lane]
    branch, coupler = record[BRANCH * LANES + lane], record[(first_length + 1) * LANES + lane]
    # On branch -1, the mirror image, the rocker turns counter-clockwise on the stroke where it turns clockwise on 1.
    record[Load.OPPOSING_TORQUE * LANES + lane] *= branch
    record[Load.SPEED * LANES + lane] = record[speed * LANES + lane]
    record[Load.COUPLER_LENGTH * LANES + lane] = 1e-3 * coupler
    record[Load.ROCKER_LENGTH * LANES + lane] = 1e-3 * record[(first_length + 2) * LANES + lane]
    # Coupler force over the torque about the rocker's pivot is coupler / (2 area), the area sqrt(p q)/2 in mm^2.
    record[Load.LEVER * LANES + lane] = 2.0e3 * (branch * coupler) if rocks else math.nan
    masses = record[Load.CRANK_MASS * LANES + lane] + record[Load.COUPLER_MASS * LANES + lane]
    masses += record[Load.ROCKER_MASS * LANES + lane] + record[Load.COUPLER_INERTIA * LANES + lane]
    inertia = record[Load.INERTIA * LANES + lane] + record[Load.ROCKER_INERTIA * LANES + lane]
    variant = 1.0 * HAS_STIFFNESS if record[Load.STIFFNESS * LANES + lane] != 0.0 else 0.0
    variant += 1.0 * HAS_DAMPING if record[Load.DAMPING * LANES + lane] != 0.0 else 0.0
    variant += 1.0 * HAS_INERTIA if inertia != 0.0 else 0.0
    variant += 1.0 * HAS_OPPOSING_TORQUE if record[Load.OPPOSING_TORQUE * LANES + lane] != 0.0 else 0.0
    variant += 1.0 * HAS_MASSES if masses != 0.0 else 0.0
    record[Load.VARIANT * LANES + lane] = variant


@subroutine(fast=True, no_alias=True)
def _fill_torque(constants, law, variant, out):
    """Fill the torque that the coupler exerts on the rocker, without that of the rocker's weight, and its terms, N m.

    They are in the rows of the drive torque and of the force terms until the forces replace them.
    """
    direction = -1.0 if law == OVERLAPPED_TO_EXTENDED else 1.0
    for lane in range(LANES):
        constant = constants[Load.CONSTANT_TORQUE * LANES + lane]
        torque, terms = -constant, abs(constant)
        if variant & HAS_OPPOSING_TORQUE:
            opposing = constants[Load.OPPOSING_TORQUE * LANES + lane]
            torque, terms = torque + direction * opposing, terms + abs(opposing)
        if variant & HAS_STIFFNESS:
            stiffness = constants[Load.STIFFNESS * LANES + lane]
            angle = out[ROCKER_ANGLE * LANES + lane] - constants[Load.MIDDLE * LANES + lane]
            torque += stiffness * angle
            terms += stiffness * (abs(angle) + math.pi)  # the two angles are rounded, each below pi
        speed = constants[Load.SPEED * LANES + lane]
        if variant & HAS_DAMPING:
            damping = constants[Load.DAMPING * LANES + lane] * speed * out[ROCKER_VELOCITY * LANES + lane]
            torque, terms = torque + damping, terms + abs(damping)
        if variant & HAS_INERTIA:
            inertia = constants[Load.INERTIA * LANES + lane] + constants[Load.ROCKER_INERTIA * LANES + lane]
            inertia = inertia * speed * speed * out[ROCKER_ACCELERATION * LANES + lane]
            torque, terms = torque + inertia, terms + abs(inertia)
        out[DRIVE_TORQUE * LANES + lane], out[FORCE_TERMS * LANES + lane] = torque, terms


@subroutine(fast=True, no_alias=True)
def _fill_massless_forces(constants, tangents, anchor, needs, out):
    """Fill the forces of massless links, from the torque about the rocker's pivot."""
    for lane in range(LANES):
        p, q, _, w = factors(constants, anchor, lane, tangents[lane] * tangents[lane])
        per_torque = constants[Load.LEVER * LANES + lane] * w / math.sqrt(p * q)
        moment = out[DRIVE_TORQUE * LANES + lane]
        force = -moment * per_torque
        terms = out[FORCE_TERMS * LANES + lane] * abs(per_torque)
        square = force * force
        out[COUPLER_FORCE * LANES + lane] = force
        out[PIN_A * LANES + lane], out[PIN_B * LANES + lane] = square, square
        out[PIN_C * LANES + lane], out[PIN_D * LANES + lane] = square, square
        out[ROCKER_FORCE * LANES + lane], out[ROCKER_MOMENT * LANES + lane] = force * (q - p) / (q + p), moment
        out[FORCE_TERMS * LANES + lane] = terms
        out[TORQUE_TERMS * LANES + lane] = 1e-3 * constants[CRANK * LANES + lane] * terms
        if needs & TORQUE:
            out[DRIVE_TORQUE * LANES + lane] = moment * out[ROCKER_VELOCITY * LANES + lane]


@subroutine(fast=True, no_alias=True)
def _fill_forces_with_masses(constants, tangents, anchor, out):
    """Fill the forces of links with masses, in m and N.

    fa, fb, fc are the forces on crank, coupler and rocker at A, B, C; fd is that on the rocker at D. u and v are the
    unit vectors along coupler and rocker, u x v = sin(theta_3 - theta_2), which has the sign of the branch.
    """
    # One long loop, because its parts would exchange thirty numbers per node.
    sign = 1.0 if anchor == 0 else -1.0
    for lane in range(LANES):
        tangent = tangents[lane]
        square = tangent * tangent
        p, q, d, w = factors(constants, anchor, lane, square)
        crank, coupler = 1e-3 * constants[CRANK * LANES + lane], constants[Load.COUPLER_LENGTH * LANES + lane]
        rocker = constants[Load.ROCKER_LENGTH * LANES + lane]
        speed, gravity = constants[Load.SPEED * LANES + lane], constants[Load.GRAVITY * LANES + lane]
        square_speed = speed * speed
        crank_mass = constants[Load.CRANK_MASS * LANES + lane]
        coupler_mass = constants[Load.COUPLER_MASS * LANES + lane]
        rocker_mass = constants[Load.ROCKER_MASS * LANES + lane]
        crank_arm = constants[Load.CRANK_CENTROID * LANES + lane] * crank
        coupler_arm = constants[Load.COUPLER_CENTROID * LANES + lane] * coupler
        rocker_arm = constants[Load.ROCKER_CENTROID * LANES + lane] * rocker
        root = math.sqrt(p * q)
        # the projections of coupler and rocker on the diagonal from B to D, neither as a difference of the other
        of_coupler = 0.5 * (constants[COUPLER_EXCESS * LANES + lane] * w + p) / d
        of_rocker = 0.5 * (constants[ROCKER_EXCESS * LANES + lane] * w - p) / d
        across = 0.5 * constants[BRANCH * LANES + lane] * root / d
        cosine, sine = sign * (1.0 - square) / w, 2.0 * sign * tangent / w
        bx, by = crank * cosine, crank * sine
        minus, plus = constants[GROUND_MINUS_CRANK * LANES + lane], constants[GROUND_PLUS_CRANK * LANES + lane]
        dx, dy = 1e-3 * (minus + plus * square if anchor == 0 else plus + minus * square) / w, -by
        ux, uy = (of_coupler * dx - across * dy) / coupler, (of_coupler * dy + across * dx) / coupler
        vx, vy = (of_rocker * dx - across * dy) / rocker, (of_rocker * dy + across * dx) / rocker
        w2, w3 = out[COUPLER_VELOCITY * LANES + lane], out[ROCKER_VELOCITY * LANES + lane]
        a2, a3 = out[COUPLER_ACCELERATION * LANES + lane], out[ROCKER_ACCELERATION * LANES + lane]
        # mass times (acceleration of the centroid less gravity), for crank, coupler and rocker
        f1x = -crank_mass * square_speed * crank_arm * cosine
        f1y = crank_mass * (gravity - square_speed * crank_arm * sine)
        f2x = -coupler_mass * square_speed * (bx + coupler_arm * (a2 * uy + w2 * w2 * ux))
        f2y = coupler_mass * (gravity - square_speed * (by - coupler_arm * (a2 * ux - w2 * w2 * uy)))
        f3x = -rocker_mass * square_speed * rocker_arm * (a3 * vy + w3 * w3 * vx)
        f3y = rocker_mass * (gravity + square_speed * rocker_arm * (a3 * vx - w3 * w3 * vy))
        inertia_moment = constants[Load.COUPLER_INERTIA * LANES + lane] * square_speed * a2
        weight_moment = rocker_arm * rocker_mass * gravity
        v_cross_fc = (out[DRIVE_TORQUE * LANES + lane] + weight_moment * vx) / rocker
        u_cross_fc = -(inertia_moment + coupler_arm * (ux * f2y - uy * f2x)) / coupler
        per_sine = rocker * constants[Load.LEVER * LANES + lane] * w / root  # 1 / (u x v)
        fcx, fcy = (u_cross_fc * vx - v_cross_fc * ux) * per_sine, (u_cross_fc * vy - v_cross_fc * uy) * per_sine
        fbx, fby = fcx + f2x, fcy + f2y
        fax, fay, fdx, fdy = fbx + f1x, fby + f1y, f3x - fcx, f3y - fcy
        out[COUPLER_FORCE * LANES + lane] = fcx * ux + fcy * uy
        out[ROCKER_FORCE * LANES + lane], out[ROCKER_MOMENT * LANES + lane] = fcx * vx + fcy * vy, rocker * v_cross_fc
        out[PIN_A * LANES + lane], out[PIN_B * LANES + lane] = fax * fax + fay * fay, fbx * fbx + fby * fby
        out[PIN_C * LANES + lane], out[PIN_D * LANES + lane] = fcx * fcx + fcy * fcy, fdx * fdx + fdy * fdy
        coupler_terms, rocker_terms = abs(f2x) + abs(f2y), abs(f3x) + abs(f3y)
        moment_terms = (abs(inertia_moment) + abs(coupler_arm) * coupler_terms) / coupler
        terms = ((out[FORCE_TERMS * LANES + lane] + abs(weight_moment)) / rocker + moment_terms) * abs(per_sine)
        terms += abs(f1x) + abs(f1y) + coupler_terms + rocker_terms
        out[FORCE_TERMS * LANES + lane], out[TORQUE_TERMS * LANES + lane] = terms, crank * terms
        out[DRIVE_TORQUE * LANES + lane] = bx * fby - by * fbx + crank_mass * gravity * crank_arm * cosine


@subroutine(fast=True, no_alias=True)
def _fill_work(constants, out):
    """Fill the drive torque where it drives, and that by which the load dissipates; neither is negative."""
    for lane in range(LANES):
        torque, velocity = out[DRIVE_TORQUE * LANES + lane], abs(out[ROCKER_VELOCITY * LANES + lane])
        damping = constants[Load.DAMPING * LANES + lane] * constants[Load.SPEED * LANES + lane] * velocity
        # What is nothing but rounding, as at the end of a stroke, drives nothing.
        is_not_driving = torque < _ROUNDING * out[TORQUE_TERMS * LANES + lane]
        out[POSITIVE_TORQUE * LANES + lane] = 0.0 if is_not_driving else torque
        out[FRICTION_TORQUE * LANES + lane] = (abs(constants[Load.OPPOSING_TORQUE * LANES + lane]) + damping) * velocity


@subroutine()
def motion_needs(needs, variant):
    """The bits of the four-bar's signals that are needed, those on which the forces depend included."""
    motion = needs & _MOTION
    if needs & TORQUE:
        motion |= four_bar.VELOCITIES  # for unit crank velocity, ratios that depend on the position alone
    if needs & (FORCES | TORQUE):
        motion |= four_bar.ANGLES if variant & HAS_STIFFNESS else 0
        motion |= four_bar.VELOCITIES if variant & HAS_DAMPING else 0
        motion |= four_bar.VELOCITIES | four_bar.ACCELERATIONS if variant & (HAS_INERTIA | HAS_MASSES) else 0
    return motion


@subroutine()
def fill_forces(constants, tangents, anchor, law, variant, needs, out):
    """Fill forces (N, squares N^2) and torque (N m) at the design's speed, at one node of each lane.

    The arguments are those of `explore.model.mechanism.Mechanism.fill`; the motion is filled already.
    """
    _fill_torque(constants, law, variant, out)
    if variant & HAS_MASSES:
        _fill_forces_with_masses(constants, tangents, anchor, out)
    else:
        _fill_massless_forces(constants, tangents, anchor, needs, out)
    if needs & TORQUE:
        _fill_work(constants, out)
