"""The forces of the oscillating-torque test rig, compiled: coupler, four pins, drive torque.

What the load needs of the motion is decided for each design: torques and springs need positions, damping velocities,
inertia and masses accelerations. Without masses the coupler is a two-force member, and all follows from the torque
about the rocker's pivot that it must give, tau = J alpha_3 - M::

    N = -tau r2 / x,    T = tau w3 / w1,    all pin forces |N|          (x twice the area of the triangle BCD)

With masses the moments of the rocker about D and of the coupler about B give the force at C, and the sums of forces
the others.
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
from explore.mechanisms.test_rig_kernel import (
    CONSTANT_TORQUE,
    COSINE,
    COUPLER,
    COUPLER_CENTROID,
    COUPLER_INERTIA,
    COUPLER_MASS,
    CRANK_CENTROID,
    CRANK_MASS,
    DAMPING,
    GRAVITY,
    GROUND,
    INERTIA,
    LEVEL,
    LEVER,
    LOAD,
    MASSES,
    MIDDLE,
    OPPOSING_TORQUE,
    ROCKER,
    ROCKER_CENTROID,
    ROCKER_INERTIA,
    ROCKER_MASS,
    SINE,
    SPEED,
    STIFFNESS,
)  # fmt: skip

# Rows of the scratch array after those of the four-bar, and the bits that ask for them. The rows of the pins hold
# squares; the rows of terms hold the size of what force and torque are summed up from.
COUPLER_FORCE, PIN_A, PIN_B, PIN_C, PIN_D, DRIVE_TORQUE, FORCE_TERMS, TORQUE_TERMS = range(
    four_bar.SIGNAL_ROWS, four_bar.SIGNAL_ROWS + 8
)
ROCKER_FORCE, ROCKER_MOMENT, DEVIATION, DEVIATION_COSINE, DEVIATION_SINE = range(
    four_bar.SIGNAL_ROWS + 8, four_bar.SIGNAL_ROWS + 13
)
SIGNAL_ROWS = four_bar.SIGNAL_ROWS + 13
FORCES, TORQUE, HARMONICS = 16, 32, 64

_MOTION = four_bar.VELOCITIES | four_bar.ACCELERATIONS | four_bar.ANGLES | four_bar.TRANSMISSION
_FIRST = LOAD - CONSTANT_TORQUE


@compiled("float64(float64[::1], int64)")
def _of(row, parameter):
    """A parameter of the load."""
    return row[_FIRST + parameter]


@compiled("void(float64[::1], float64[::1], float64[::1], int64, float64[:, ::1])", fast=True)
def _torque(row, sin_half, cos_half, count, out):
    """Torque that the coupler must give the rocker, without its weight, and the size of its terms, N m.

    They are put into the rows of the drive torque and of the force terms.
    """
    constant = _of(row, CONSTANT_TORQUE)
    for j in range(count):
        out[DRIVE_TORQUE, j] = -constant
        out[FORCE_TERMS, j] = abs(constant)
    opposing = _of(row, OPPOSING_TORQUE)
    if opposing != 0.0:
        # The rocker turns clockwise on the stroke through crank angle 0. The place decides, not the sign of a velocity
        # that is all rounding at the ends.
        first, last = rocking.stroke(row, True)
        for j in range(count):
            cosine = abs(cos_half[j])
            sine = sin_half[j] if cos_half[j] >= 0.0 else -sin_half[j]
            clockwise = (sine >= first * cosine) and (sine <= last * cosine)
            out[DRIVE_TORQUE, j] += -opposing if clockwise else opposing
            out[FORCE_TERMS, j] += abs(opposing)
    stiffness = _of(row, STIFFNESS)
    if stiffness != 0.0:
        middle = row[MIDDLE]
        for j in range(count):
            angle = out[ROCKER_ANGLE, j] - middle
            out[DRIVE_TORQUE, j] += stiffness * angle
            out[FORCE_TERMS, j] += stiffness * (abs(angle) + math.pi)  # the two angles are rounded, each below pi
    damping = _of(row, DAMPING) * _of(row, SPEED)
    if damping != 0.0:
        for j in range(count):
            out[DRIVE_TORQUE, j] += damping * out[ROCKER_VELOCITY, j]
            out[FORCE_TERMS, j] += damping * abs(out[ROCKER_VELOCITY, j])
    inertia = (_of(row, INERTIA) + _of(row, ROCKER_INERTIA)) * _of(row, SPEED) * _of(row, SPEED)
    if inertia != 0.0:
        for j in range(count):
            out[DRIVE_TORQUE, j] += inertia * out[ROCKER_ACCELERATION, j]
            out[FORCE_TERMS, j] += inertia * abs(out[ROCKER_ACCELERATION, j])


@compiled("void(float64[::1], float64[::1], float64[::1], int64, int64, float64[:, ::1])", fast=True)
def _massless(row, sin_half, cos_half, count, needs, out):
    """Forces without masses, from the torque about the rocker's pivot."""
    four_products, p0, q0, lever = row[FOUR_CRANK_GROUND], row[E1_E2], row[E3_E4], row[LEVER]
    crank = 1e-3 * row[CRANK]
    for j in range(count):
        p = p0 + four_products * sin_half[j] * sin_half[j]
        q = q0 + four_products * cos_half[j] * cos_half[j]
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
def _with_masses(row, sin_half, cos_half, count, out):
    """Forces with masses: lengths in m, forces in N, on the link that the pin's name begins with after A.

    u and v are the unit vectors along coupler and rocker, u x v = sin(theta_3 - theta_2) > 0.
    """
    four_products, p0, q0, lever = row[FOUR_CRANK_GROUND], row[E1_E2], row[E3_E4], row[LEVER]
    coupler_excess, difference_squared = row[COUPLER_EXCESS], row[GROUND_MINUS_CRANK_SQUARED]
    crank, coupler, rocker, ground = 1e-3 * row[CRANK], row[COUPLER], row[ROCKER], row[GROUND]
    speed, gravity = _of(row, SPEED), _of(row, GRAVITY)
    square_speed = speed * speed
    crank_mass, coupler_mass, rocker_mass = _of(row, CRANK_MASS), _of(row, COUPLER_MASS), _of(row, ROCKER_MASS)
    crank_arm, coupler_arm = _of(row, CRANK_CENTROID) * crank, _of(row, COUPLER_CENTROID) * coupler
    rocker_arm = _of(row, ROCKER_CENTROID) * rocker
    coupler_inertia = _of(row, COUPLER_INERTIA)
    for j in range(count):
        sine_squared, cosine_squared = sin_half[j] * sin_half[j], cos_half[j] * cos_half[j]
        p, q = p0 + four_products * sine_squared, q0 + four_products * cosine_squared
        d_squared = difference_squared + four_products * sine_squared
        root = math.sqrt(p * q)
        along, across = 0.5 * (coupler_excess + p) / d_squared, 0.5 * root / d_squared
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
        spin, weight = coupler_inertia * square_speed * a2, rocker_arm * rocker_mass * gravity
        # v x F and u x F of the force F on the rocker at C
        on_v = (out[DRIVE_TORQUE, j] + weight * vx) / rocker
        on_u = -(spin + coupler_arm * (ux * f2y - uy * f2x)) / coupler
        per_sine = rocker * lever / root  # 1 / (u x v)
        fcx, fcy = (on_u * vx - on_v * ux) * per_sine, (on_u * vy - on_v * uy) * per_sine
        fbx, fby = fcx + f2x, fcy + f2y
        fax, fay, fdx, fdy = fbx + f1x, fby + f1y, f3x - fcx, f3y - fcy
        out[COUPLER_FORCE, j] = fcx * ux + fcy * uy
        out[ROCKER_FORCE, j], out[ROCKER_MOMENT, j] = fcx * vx + fcy * vy, rocker * on_v
        out[PIN_A, j], out[PIN_B, j] = fax * fax + fay * fay, fbx * fbx + fby * fby
        out[PIN_C, j], out[PIN_D, j] = fcx * fcx + fcy * fcy, fdx * fdx + fdy * fdy
        on_coupler, on_rocker = abs(f2x) + abs(f2y), abs(f3x) + abs(f3y)
        turning = (abs(spin) + abs(coupler_arm) * on_coupler) / coupler
        terms = ((out[FORCE_TERMS, j] + abs(weight)) / rocker + turning) * per_sine
        terms += abs(f1x) + abs(f1y) + on_coupler + on_rocker
        out[FORCE_TERMS, j], out[TORQUE_TERMS, j] = terms, crank * terms
        out[DRIVE_TORQUE, j] = bx * fby - by * fbx + crank_mass * gravity * crank_arm * cosine


@compiled(FILL_SIGNATURE, fast=True)
def fill(row, sin_half, cos_half, count, needs, out):
    """Signals at the nodes: those of `four_bar.fill`, and forces (N, squares N^2) and torque (N m) at the load's speed.

    See `explore.vocabulary.Mechanism` for the arguments.
    """
    motion = needs & _MOTION
    loaded = needs & (FORCES | TORQUE) != 0
    if needs & (TORQUE | HARMONICS):
        motion |= four_bar.VELOCITIES  # of unit crank velocity: a ratio that follows from the position
    if loaded:
        motion |= int(row[LEVEL])
    if motion:
        four_bar.fill(row, sin_half, cos_half, count, motion, out)
    if loaded:
        _torque(row, sin_half, cos_half, count, out)
        if row[MASSES] != 0.0:
            _with_masses(row, sin_half, cos_half, count, out)
        else:
            _massless(row, sin_half, cos_half, count, needs, out)
    if needs & HARMONICS:
        for j in range(count):
            cosine = cos_half[j] * cos_half[j] - sin_half[j] * sin_half[j]
            sine = 2.0 * sin_half[j] * cos_half[j]
            deviation = out[ROCKER_VELOCITY, j] - row[COSINE] * cosine - row[SINE] * sine
            out[DEVIATION, j] = deviation
            out[DEVIATION_COSINE, j], out[DEVIATION_SINE, j] = 2.0 * deviation * cosine, 2.0 * deviation * sine
