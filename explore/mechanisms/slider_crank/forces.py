"""The slider-crank under load: drive torque by the balance of power, forces of pins and guide by free bodies.

With s the sign of the slider's velocity, the force along the line that the rod must overcome, friction apart, is

    Q = m x.. - F0 + s Fo + k (x - x_m) + c x.,    x_m at mid-stroke.

f2 is the mass of the rod times the acceleration of its centroid less that of gravity, y along and h across the rod's
span, t = h/y the tangent of its angle. The moments about the crank pin give the force across the line that the rod
needs to turn, M/y with M = I beta.. + z x f2, z from the crank pin to the centroid. With W = m g + M/y the thrust P of
the rod on the slider and the force N of the guide, mu |N| being that of friction, satisfy

    N = W - P t,    P = Q + mu s |N|:    N = (W - Q t)/(1 + d t),    P = (Q + d W)/(1 + d t),    d = mu s sign(N).

This is unique while mu |t| < 1, where N has the sign of W - Q t; else friction can lock the slider.
"""

import math

from explore.base.compiling import LANES
from explore.base.subroutines import subroutine
from explore.mechanisms.slider_crank import columns
from explore.mechanisms.slider_crank.columns import ExtendedRow as Row
from explore.mechanisms.slider_crank.kernel import sums

_MM = 1e-3
#: Rounding of a torque, relative to its terms.
_ROUNDING = 1e-14


@subroutine(fast=True, no_alias=True)
def fill_forces(constants, tangents, anchor, law, out):
    """Fill forces, N, their squares in pins, and torques, N m, at one node of each lane.

    Torques stand for powers too, which are torques times the speed.
    """
    sense = -1.0 if law == columns.INWARD else 1.0
    mirror = 1.0 if anchor == 0 else -1.0
    # One long loop, because its parts would exchange thirty numbers per node.
    for lane in range(LANES):
        u = mirror * tangents[lane]
        square = u * u
        one_over_w = 1.0 / (1.0 + square)
        a, b, p, q, e = sums(constants, anchor, lane)
        crank = constants[Row.MOVING_CRANK * LANES + lane]
        root = math.sqrt((b + p * square) * (q + a * square))
        t = mirror * ((e - crank) + (e + crank) * square) / root
        crank *= _MM
        bx, by = -2.0 * u * one_over_w * crank, mirror * (1.0 - square) * one_over_w * crank
        gravity, speed = constants[Row.LOAD_GRAVITY * LANES + lane], constants[Row.LOAD_SPEED * LANES + lane]
        ss = speed * speed
        rate, second = _MM * out[columns.VELOCITY * LANES + lane], ss * _MM * out[columns.ACCELERATION * LANES + lane]
        # the rod: mass times (acceleration of the centroid less gravity), velocity of the centroid, moment of inertia
        rod_mass, share = constants[Row.LOAD_ROD_MASS * LANES + lane], constants[Row.LOAD_ROD_CENTROID * LANES + lane]
        rest = 1.0 - share
        f2x, f2y = rod_mass * (share * second - rest * ss * bx), rod_mass * (gravity - rest * ss * by)
        v2x, v2y = share * rate - rest * by, rest * bx
        spin = constants[Row.LOAD_ROD_INERTIA * LANES + lane] * ss * out[columns.ROD_ACCELERATION * LANES + lane]
        rod_velocity = out[columns.ROD_VELOCITY * LANES + lane]
        one_over_along = 1.0 / (_MM * root * one_over_w)
        turning = spin * one_over_along + share * (f2y - t * f2x)
        # the slider
        mass, friction = constants[Row.LOAD_MASS * LANES + lane], constants[Row.LOAD_FRICTION * LANES + lane]
        weight, inertia = mass * gravity, mass * second
        constant = constants[Row.LOAD_CONSTANT_FORCE * LANES + lane]
        opposing = constants[Row.LOAD_OPPOSING_FORCE * LANES + lane]
        stiffness = _MM * constants[Row.LOAD_STIFFNESS * LANES + lane]
        position, middle = out[columns.POSITION * LANES + lane], constants[Row.MIDDLE * LANES + lane]
        viscous = constants[Row.LOAD_DAMPING * LANES + lane] * speed * rate
        needed = inertia - constant + sense * opposing + stiffness * (position - middle) + viscous
        pressed = weight + turning
        upward = pressed - needed * t >= 0.0
        drag = sense * friction if upward else -sense * friction
        over = 1.0 / (1.0 + drag * t)
        thrust, guide = (needed + drag * pressed) * over, (pressed - needed * t) * over
        # forces of the rod on the slider, of the crank on the rod, of the ground on the crank
        fcx, fcy = thrust, weight - guide
        fbx, fby = fcx + f2x, fcy + f2y
        crank_mass = constants[Row.LOAD_CRANK_MASS * LANES + lane]
        arm = constants[Row.LOAD_CRANK_CENTROID * LANES + lane]
        f1x, f1y = -crank_mass * ss * arm * bx, crank_mass * (gravity - ss * arm * by)
        fax, fay = fbx + f1x, fby + f1y
        out[columns.THRUST * LANES + lane], out[columns.GUIDE_FORCE * LANES + lane] = thrust, guide
        out[columns.SLIDER_PIN * LANES + lane] = fcx * fcx + fcy * fcy
        out[columns.CRANK_PIN * LANES + lane] = fbx * fbx + fby * fby
        out[columns.CRANK_PIVOT * LANES + lane] = fax * fax + fay * fay
        lifting = crank_mass * gravity * arm * bx
        torque = thrust * rate + f2x * v2x + f2y * v2y + spin * rod_velocity + lifting
        out[columns.TORQUE * LANES + lane] = torque
        out[columns.LOST_TORQUE * LANES + lane] = (friction * abs(guide) + opposing) * abs(rate) + viscous * rate
        # sizes of the terms: those of the position are rounded, each below the middle plus the stroke
        needed_terms = abs(inertia) + abs(constant) + opposing + stiffness * (position + middle) + abs(viscous)
        rod_terms = abs(f2x) + abs(f2y)
        pressed_terms = weight + abs(spin) * one_over_along + abs(share) * (abs(f2y) + abs(t * f2x))
        thrust_terms = (needed_terms + friction * pressed_terms) / (1.0 - friction * abs(t))
        terms = thrust_terms * (1.0 + abs(t)) + pressed_terms + rod_terms + abs(f1x) + abs(f1y)
        out[columns.FORCE_TERMS * LANES + lane] = terms
        torque_terms = (
            (thrust_terms + rod_terms * abs(share)) * (abs(rate) + crank)
            + rod_terms * abs(rest) * crank + abs(spin * rod_velocity) + abs(lifting)
        )  # fmt: skip
        out[columns.TORQUE_TERMS * LANES + lane] = torque_terms
        # What is nothing but rounding, as at the end of a stroke, drives nothing.
        out[columns.POSITIVE_TORQUE * LANES + lane] = torque if torque >= _ROUNDING * torque_terms else 0.0


@subroutine(inlined=True)
def fill_load_constants(record, lane):
    """Fill the constants of the forces of one lane, and return whether friction can lock the slider."""
    for k in range(columns.LOAD_SIZE):
        at = (Row.CONSTANT_FORCE + k) * LANES + lane
        record[(Row.LOAD_CONSTANT_FORCE + k) * LANES + lane] = record[at]
    a, b = record[Row.MINUS_MINUS * LANES + lane], record[Row.MINUS_PLUS * LANES + lane]
    p, q = record[Row.PLUS_PLUS * LANES + lane], record[Row.PLUS_MINUS * LANES + lane]
    record[Row.MIDDLE * LANES + lane] = 0.5 * (math.sqrt(p * q) + math.sqrt(a * b))
    # Forces are infinite where friction locks the slider, at heights of the rod's span less than its length by this.
    friction = record[Row.FRICTION * LANES + lane]
    steep = math.sqrt(1.0 + friction * friction)
    lost = record[Row.ROD * LANES + lane] * friction * friction / (steep * (1.0 + steep))
    record[Row.SINGULAR_ABOVE * LANES + lane] = math.sqrt((b - lost) / (p - lost))
    record[Row.SINGULAR_BELOW * LANES + lane] = math.sqrt((a - lost) / (q - lost))
    return (a if a < b else b) <= lost
