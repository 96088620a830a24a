"""Forces of the variable crank under load: of slider, guide and groove, and the drive torque by the balance of power.

With s the sign of the slider's velocity v, a its acceleration, x - x_m its distance from mid-stroke, t the tangent of
the rod's angle, and W what presses the slider on its guide, the force that the load needs, thrust along the slider's
line, force of its guide, drive torque and force across the groove are

    Q = m a - F0 + s Fo + k (x - x_m) + c v,    P = (Q + mu s W)/(1 + mu s t),    N = W - P t,
    T = (P v + P_l)/w,    F = P (cos(phi) + sin(phi) t) |dr/dphi|/L + F_l,

and where N is negative, the slider lifted to the other side of its guide, mu changes its sign. W is the weight m g
where rod and pin have no mass; `links` has W, P_l and F_l.
"""

import math

from explore.base.compiling import LANES
from explore.base.subroutines import subroutine
from explore.mechanisms.variable_crank.columns import (
    ACCELERATION,
    CRANK_LENGTH,
    CRANK_RATE,
    FIRST_LAW_BACK,
    FORCE_TERMS,
    FRICTION_POWER,
    GROOVE_FORCE,
    GUIDE_FORCE,
    LINKS_GROOVE,
    LINKS_POWER,
    LINKS_POWER_TERMS,
    LINKS_TERMS,
    POSITION,
    POSITIVE_POWER,
    POWER,
    POWER_TERMS,
    PRESSED,
    PRESSED_TERMS,
    THRUST,
    TORQUE,
    TORQUE_TERMS,
    VELOCITY,
    Row,
)


@subroutine(fast=True, no_alias=True)
def fill_forces(constants, tangents, anchor, law, out):
    """Fill forces (N), torque (N m) and power (W) from the motion and `links.fill_links` at one node of each lane."""
    sense = 1.0 if law >= FIRST_LAW_BACK else -1.0
    mirror = 1.0 if anchor == 0 else -1.0
    for lane in range(LANES):
        u = tangents[lane]
        w = mirror / (1.0 + u * u)
        sine, cosine = 2.0 * u * w, (1.0 - u * u) * w
        mass, friction = constants[Row.LOAD_MASS * LANES + lane], constants[Row.LOAD_FRICTION * LANES + lane]
        pressed, speed = out[PRESSED * LANES + lane], constants[Row.CRANK_SPEED * LANES + lane]
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
        thrust = (needed + drag * pressed) / (1.0 + drag * t)
        lifted = pressed - thrust * t < 0.0
        thrust = (needed - drag * pressed) / (1.0 - drag * t) if lifted else thrust
        guide = pressed - thrust * t
        power = thrust * velocity + out[LINKS_POWER * LANES + lane]
        terms = abs(inertia) + abs(constant) + opposing + stiffness * (position + middle) + abs(viscous)
        pressed_terms = out[PRESSED_TERMS * LANES + lane]
        terms = (terms + friction * pressed_terms) / (1.0 - friction * abs(t))
        lever = math.sqrt(crank * crank + slope * slope) / crank
        out[THRUST * LANES + lane], out[GUIDE_FORCE * LANES + lane] = thrust, guide
        groove = thrust * (cosine + sine * t) * lever + out[LINKS_GROOVE * LANES + lane]
        out[GROOVE_FORCE * LANES + lane] = groove
        out[TORQUE * LANES + lane], out[POWER * LANES + lane] = power / speed, power
        out[POSITIVE_POWER * LANES + lane] = power if power > 0.0 else 0.0
        out[FRICTION_POWER * LANES + lane] = (friction * abs(guide) + opposing) * abs(velocity) + viscous * velocity
        out[FORCE_TERMS * LANES + lane] = (pressed_terms + terms) * lever + out[LINKS_TERMS * LANES + lane] * lever
        power_terms = abs(velocity) * terms + out[LINKS_POWER_TERMS * LANES + lane]
        out[TORQUE_TERMS * LANES + lane], out[POWER_TERMS * LANES + lane] = power_terms / speed, power_terms
