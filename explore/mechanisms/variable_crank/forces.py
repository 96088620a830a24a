"""Forces of the variable crank under the slider's mass and friction; the rod, the pin and the disc have no mass.

With s the sign of the slider's velocity v, a its acceleration and t the tangent of the rod's angle, thrust along the
slider's line, force of its guide, drive torque and force across the groove are

    P = m (a + mu g s)/(1 + mu s t),    N = m g - P t,    T = P v/w,    F = P (cos(phi) + sin(phi) t) |dr/dphi|/L,

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


@subroutine(fast=True)
def fill_forces(constants, tangents, anchor, law, out):
    """Fill forces (N), torque (N m) and power (W) from the motion at one node of each lane."""
    sense = 1.0 if law >= FIRST_LAW_BACK else -1.0
    mirror = 1.0 if anchor == 0 else -1.0
    for lane in range(LANES):
        u = tangents[lane]
        w = mirror / (1.0 + u * u)
        sine, cosine = (1.0 - u * u) * w, -2.0 * u * w
        mass, friction = constants[Row.SLIDER_MASS * LANES + lane], constants[Row.FRICTION_COEFFICIENT * LANES + lane]
        weight, speed = mass * constants[Row.FREE_FALL * LANES + lane], constants[Row.CRANK_SPEED * LANES + lane]
        crank = out[CRANK_LENGTH * LANES + lane]
        slope = out[CRANK_RATE * LANES + lane] / speed
        across = out[POSITION * LANES + lane] - crank * cosine
        t = -crank * sine / across
        inertia = 1e-3 * mass * out[ACCELERATION * LANES + lane]
        drag = friction * sense
        thrust = (inertia + drag * weight) / (1.0 + drag * t)
        lifted = weight - thrust * t < 0.0
        thrust = (inertia - drag * weight) / (1.0 - drag * t) if lifted else thrust
        guide = weight - thrust * t
        velocity = 1e-3 * out[VELOCITY * LANES + lane]
        power = thrust * velocity
        terms = (abs(inertia) + friction * weight) / (1.0 - friction * abs(t))
        lever = math.sqrt(crank * crank + slope * slope) / crank
        out[THRUST * LANES + lane], out[GUIDE_FORCE * LANES + lane] = thrust, guide
        out[GROOVE_FORCE * LANES + lane] = thrust * (cosine + sine * t) * lever
        out[TORQUE * LANES + lane], out[POWER * LANES + lane] = power / speed, power
        out[POSITIVE_POWER * LANES + lane] = power if power > 0.0 else 0.0
        out[FRICTION_POWER * LANES + lane] = friction * abs(guide * velocity)
        out[FORCE_TERMS * LANES + lane] = (weight + terms) * lever
        out[TORQUE_TERMS * LANES + lane] = abs(velocity) * terms / speed
        out[POWER_TERMS * LANES + lane] = abs(velocity) * terms
