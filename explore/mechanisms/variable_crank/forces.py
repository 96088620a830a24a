"""Forces of the variable crank under loads on the slider; the rod, the pin and the disc have no mass.

With s the sign of the slider's velocity v, a its acceleration, x - x_m its distance from mid-stroke, and t the tangent
of the rod's angle, the force that the load needs, thrust along the slider's line, force of its guide, drive torque and
force across the groove are

    Q = m a - F0 + s Fo + k (x - x_m) + c v,    P = (Q + mu s m g)/(1 + mu s t),    N = m g - P t,
    T = P v/w,    F = P (cos(phi) + sin(phi) t) |dr/dphi|/L,

and where N is negative, the slider lifted to the other side of its guide, mu changes its sign.
"""

import math

from explore.compiling import LANES
from explore.mechanisms.variable_crank.columns import (
    ACCELERATION,
    CRANK_LENGTH,
    CRANK_RATE,
    FIRST_LAW_BACK,
    FORCE_TERMS,
    FRICTION_POWER,
    GROOVE_FORCE,
    GUIDE_FORCE,
    POSITION,
    POSITIVE_POWER,
    POWER,
    POWER_TERMS,
    THRUST,
    TORQUE,
    TORQUE_TERMS,
    VELOCITY,
    Row,
)
from explore.subroutines import subroutine


@subroutine(fast=True, apart=True)
def fill_forces(constants, tangents, anchor, law, out):
    """Fill forces (N), torque (N m) and power (W) from the motion at one node of each lane."""
    sense = 1.0 if law >= FIRST_LAW_BACK else -1.0
    mirror = 1.0 if anchor == 0 else -1.0
    for lane in range(LANES):
        u = tangents[lane]
        w = mirror / (1.0 + u * u)
        sine, cosine = (1.0 - u * u) * w, -2.0 * u * w
        mass, friction = constants[Row.LOAD_MASS * LANES + lane], constants[Row.LOAD_FRICTION * LANES + lane]
        weight, speed = mass * constants[Row.LOAD_GRAVITY * LANES + lane], constants[Row.CRANK_SPEED * LANES + lane]
        constant = constants[Row.LOAD_CONSTANT_FORCE * LANES + lane]
        opposing = constants[Row.LOAD_OPPOSING_FORCE * LANES + lane]
        stiffness = 1e-3 * constants[Row.LOAD_STIFFNESS * LANES + lane]
        crank = out[CRANK_LENGTH * LANES + lane]
        slope = out[CRANK_RATE * LANES + lane] / speed
        position, middle = out[POSITION * LANES + lane], constants[Row.MIDDLE * LANES + lane]
        across = position - crank * cosine
        t = -crank * sine / across
        inertia = 1e-3 * mass * out[ACCELERATION * LANES + lane]
        velocity = 1e-3 * out[VELOCITY * LANES + lane]
        viscous = constants[Row.LOAD_DAMPING * LANES + lane] * velocity
        needed = inertia - constant + sense * opposing + stiffness * (position - middle) + viscous
        drag = friction * sense
        thrust = (needed + drag * weight) / (1.0 + drag * t)
        lifted = weight - thrust * t < 0.0
        thrust = (needed - drag * weight) / (1.0 - drag * t) if lifted else thrust
        guide = weight - thrust * t
        power = thrust * velocity
        terms = abs(inertia) + abs(constant) + opposing + stiffness * (position + middle) + abs(viscous)
        terms = (terms + friction * weight) / (1.0 - friction * abs(t))
        lever = math.sqrt(crank * crank + slope * slope) / crank
        out[THRUST * LANES + lane], out[GUIDE_FORCE * LANES + lane] = thrust, guide
        out[GROOVE_FORCE * LANES + lane] = thrust * (cosine + sine * t) * lever
        out[TORQUE * LANES + lane], out[POWER * LANES + lane] = power / speed, power
        out[POSITIVE_POWER * LANES + lane] = power if power > 0.0 else 0.0
        out[FRICTION_POWER * LANES + lane] = (friction * abs(guide) + opposing) * abs(velocity) + viscous * velocity
        out[FORCE_TERMS * LANES + lane] = (weight + terms) * lever
        out[TORQUE_TERMS * LANES + lane] = abs(velocity) * terms / speed
        out[POWER_TERMS * LANES + lane] = abs(velocity) * terms
