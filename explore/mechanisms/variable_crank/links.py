"""Masses of the variable crank's rod, pin and disc, and the forces in its pins, by free bodies.

f2 and f3 are the masses of rod and pin times their accelerations less that of gravity, y is along the slider's line and
across the rod's span, t the tangent of the rod's angle. The moments about the crank's pin give the force across the
line that the rod needs to turn, M/y with M = I beta'' + z x f2, z from the pin to the rod's centroid; so the slider,
P the thrust along its line, is pressed on its guide by W - P t, W = m g + M/y. The rod gives (P, P t - M/y) to the
slider and takes this and f2 from the pin. The pin takes this and f3, together R, from groove and slot; with L' the
slope of the crank's length L by the angle they give G across the groove and S across the crank,

    G = R_radial sqrt(L^2 + L'^2)/L,    S = R_around + R_radial L'/L.
"""

import math

from explore.base.compiling import LANES
from explore.base.subroutines import subroutine
from explore.mechanisms.variable_crank.columns import (
    ACCELERATION,
    CRANK_LENGTH,
    CRANK_PIN,
    CRANK_RATE,
    CRANK_SECOND_RATE,
    DISC_PIVOT,
    DISC_TERMS,
    FORCE_TERMS,
    LINKS_GROOVE,
    LINKS_POWER,
    LINKS_POWER_TERMS,
    LINKS_TERMS,
    LINKS_X,
    LINKS_Y,
    POSITION,
    PRESSED,
    PRESSED_TERMS,
    ROD_X,
    ROD_Y,
    SLIDER_PIN,
    SLOT_FORCE,
    THRUST,
    TURN,
    VELOCITY,
    Row,
)

_MM = 1e-3


@subroutine(fast=True, no_alias=True)
def fill_links(constants, tangents, anchor, out):
    """Fill what the masses of rod, pin and disc add to forces (N) and power (W) at one node of each lane.

    These are rows of their own, and not part of `forces.fill_forces`, so that the compiler does not order its sums
    anew: designs without these masses keep every bit.
    """
    mirror = 1.0 if anchor == 0 else -1.0
    # One long loop, because its parts would exchange twenty numbers per node.
    for lane in range(LANES):
        u = tangents[lane]
        w = mirror / (1.0 + u * u)
        sine, cosine = 2.0 * u * w, (1.0 - u * u) * w
        speed, gravity = constants[Row.CRANK_SPEED * LANES + lane], constants[Row.LOAD_GRAVITY * LANES + lane]
        crank, rate = _MM * out[CRANK_LENGTH * LANES + lane], _MM * out[CRANK_RATE * LANES + lane]
        second, turning = _MM * out[CRANK_SECOND_RATE * LANES + lane], speed * crank
        velocity, acceleration = _MM * out[VELOCITY * LANES + lane], _MM * out[ACCELERATION * LANES + lane]
        height, over = -crank * sine, 1.0 / (_MM * out[POSITION * LANES + lane] - crank * cosine)
        # velocity and acceleration of the pin, and of the rod's angle
        vx, vy = rate * cosine - turning * sine, rate * sine + turning * cosine
        inward, sideways = second - speed * turning, 2.0 * speed * rate
        ax, ay = inward * cosine - sideways * sine, inward * sine + sideways * cosine
        rod_rate = -vy * over
        rod_mass, share = constants[Row.LOAD_ROD_MASS * LANES + lane], constants[Row.LOAD_ROD_CENTROID * LANES + lane]
        rest, rod_inertia = 1.0 - share, constants[Row.LOAD_ROD_INERTIA * LANES + lane]
        spin = rod_inertia * (rod_rate * rod_rate * height - ay) * over
        f2x, f2y = rod_mass * (rest * ax + share * acceleration), rod_mass * (rest * ay + gravity)
        turn = spin * over + share * (f2y - height * over * f2x)
        pin_mass = constants[Row.LOAD_PIN_MASS * LANES + lane]
        x, y = f2x + pin_mass * ax, f2y + pin_mass * (ay + gravity)
        weight = constants[Row.LOAD_MASS * LANES + lane] * gravity
        lever = math.sqrt(crank * crank + (rate / speed) * (rate / speed)) / crank
        moment = _MM * constants[Row.LOAD_DISC_MASS * LANES + lane] * constants[Row.LOAD_DISC_CENTROID * LANES + lane]
        lifting = moment * gravity * speed
        out[TURN * LANES + lane], out[PRESSED * LANES + lane] = turn, weight + turn
        out[ROD_X * LANES + lane], out[ROD_Y * LANES + lane] = f2x, f2y
        out[LINKS_X * LANES + lane], out[LINKS_Y * LANES + lane] = x, y
        out[LINKS_GROOVE * LANES + lane] = (cosine * x + sine * (y - turn)) * lever
        power = x * vx + y * vy + share * (f2x * (velocity - vx) - f2y * vy) + spin * rod_rate + lifting * cosine
        out[LINKS_POWER * LANES + lane] = power
        # Sizes of the terms: the second derivative of the crank's length is a sum of terms of the rod's size.
        length = crank + _MM * constants[Row.LENGTH * LANES + lane]
        size = speed * speed * length + abs(second) + abs(sideways)
        rod_terms = rod_mass * (abs(rest) * size + abs(share * acceleration) + gravity)
        spin_terms = rod_inertia * (rod_rate * rod_rate * abs(height) + size) * over
        turn_terms = spin_terms * over + abs(share) * rod_terms * (1.0 + abs(height * over))
        terms = rod_terms + pin_mass * (size + gravity)
        out[PRESSED_TERMS * LANES + lane], out[LINKS_TERMS * LANES + lane] = weight + turn_terms, terms + turn_terms
        reach = speed * length + abs(rate) + abs(velocity)
        terms = terms * (1.0 + abs(share)) * reach + spin_terms * abs(rod_rate) + abs(lifting)
        out[LINKS_POWER_TERMS * LANES + lane] = terms


@subroutine(fast=True, no_alias=True)
def fill_pins(constants, tangents, anchor, out):
    """Fill the slot's force (N), and squares of the forces in pins and pivot, from `fill_links` and the thrust."""
    mirror = 1.0 if anchor == 0 else -1.0
    for lane in range(LANES):
        u = tangents[lane]
        w = mirror / (1.0 + u * u)
        sine, cosine = 2.0 * u * w, (1.0 - u * u) * w
        speed, crank = constants[Row.CRANK_SPEED * LANES + lane], out[CRANK_LENGTH * LANES + lane]
        thrust, turn = out[THRUST * LANES + lane], out[TURN * LANES + lane]
        lift = -crank * sine / (out[POSITION * LANES + lane] - crank * cosine) * thrust - turn
        rod_x, rod_y = thrust + out[ROD_X * LANES + lane], lift + out[ROD_Y * LANES + lane]
        x, y = thrust + out[LINKS_X * LANES + lane], lift + out[LINKS_Y * LANES + lane]
        slot = cosine * y - sine * x + (cosine * x + sine * y) * out[CRANK_RATE * LANES + lane] / (speed * crank)
        mass, gravity = constants[Row.LOAD_DISC_MASS * LANES + lane], constants[Row.LOAD_GRAVITY * LANES + lane]
        pull = _MM * mass * speed * speed * constants[Row.LOAD_DISC_CENTROID * LANES + lane]
        disc_x, disc_y = -slot * sine - pull * cosine, slot * cosine - pull * sine + mass * gravity
        out[SLOT_FORCE * LANES + lane] = slot
        out[CRANK_PIN * LANES + lane] = rod_x * rod_x + rod_y * rod_y
        out[SLIDER_PIN * LANES + lane] = thrust * thrust + lift * lift
        out[DISC_PIVOT * LANES + lane] = disc_x * disc_x + disc_y * disc_y
        out[DISC_TERMS * LANES + lane] = out[FORCE_TERMS * LANES + lane] + mass * gravity + abs(pull)
