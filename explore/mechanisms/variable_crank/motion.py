"""The motion of the variable crank: slider, crank length and groove, for many lanes.

With d, G of `series`, D the slider's lag in a reversal (+ about the outer dead centre, - about the inner one),

    X = X* - c d -+ D,    r = sqrt((G +- D sin(phi)/d^2) (l + X sin(phi))),    L = X cos(phi) + d r,

and where the two terms differ in sign L = (X^2 - l^2)/(X cos(phi) - d r). The derivatives of L are those of this form,
so that nothing is singular where crank and rod are perpendicular. The way back is the mirror image of the way there,
with the opposite half-tangents.
"""

import math

from explore.base.compiling import FILL_SIGNATURE, LANES, compiled
from explore.base.lanes.arctangent import arctangent
from explore.base.subroutines import subroutine
from explore.mechanisms.variable_crank.blend import blend
from explore.mechanisms.variable_crank.columns import (
    ACCELERATION,
    ACCELERATION_TERMS,
    ALL_POINTS,
    CRANK,
    CRANK_LENGTH,
    CRANK_RATE,
    CRANK_SECOND_RATE,
    CURVATURE,
    CURVATURE_TERMS,
    FIRST_LAW_BACK,
    FIRST_POINT,
    FORCES,
    GROOVE,
    PINS,
    POINTS,
    POSITION,
    PRESSURE_ANGLE,
    PRESSURE_TERMS,
    RATE_TERMS,
    ROD_ANGLE,
    SIGNAL_ROWS,
    STEADY_LAW,
    VELOCITY,
    Row,
)
from explore.mechanisms.variable_crank.floating_link import fill_place, fill_rates
from explore.mechanisms.variable_crank.forces import fill_forces
from explore.mechanisms.variable_crank.links import fill_links, fill_pins
from explore.mechanisms.variable_crank.series import separation
from explore.model.points import MOST_POINTS, POINT_ROWS


@subroutine(fast=True, no_alias=True)
def _fill_point(constants, tangents, anchor, number, out, point):
    """Fill the rows of one point, `point`, from those of slider and crank, at one node of each lane.

    They are an array of their own, or the loop would not vectorise.
    """
    mirror = 1.0 if anchor == 0 else -1.0
    along_row = Row.PLACES + 2 * number
    for lane in range(LANES):
        tangent = tangents[lane]
        one_over_w = mirror / (1.0 + tangent * tangent)
        cosine, sine = (1.0 - tangent * tangent) * one_over_w, 2.0 * tangent * one_over_w
        along, across = constants[along_row * LANES + lane], constants[(along_row + 1) * LANES + lane]
        rod, speed = constants[Row.LENGTH * LANES + lane], constants[Row.CRANK_SPEED * LANES + lane]
        crank, crank_rate = out[CRANK_LENGTH * LANES + lane], out[CRANK_RATE * LANES + lane]
        second_rate = out[CRANK_SECOND_RATE * LANES + lane]
        bx, by = crank * cosine, crank * sine
        ux, uy = (out[POSITION * LANES + lane] - bx) / rod, -by / rod
        rx, ry = along * ux - across * uy, along * uy + across * ux
        reach = abs(along) + abs(across)
        fill_place(point, lane, bx, by, rx, ry, crank + reach * (1.0 + crank / rod))
        turning = speed * crank
        bvx, bvy = crank_rate * cosine - turning * sine, crank_rate * sine + turning * cosine
        inward, sideways = second_rate - speed * turning, 2.0 * speed * crank_rate
        bax, bay = inward * cosine - sideways * sine, inward * sine + sideways * cosine
        # The part across the rod of the slider's rates less those of the pin is by the rod's turning.
        rate = (-uy * (out[VELOCITY * LANES + lane] - bvx) - ux * bvy) / rod
        rate_of_rate = (-uy * (out[ACCELERATION * LANES + lane] - bax) - ux * bay) / rod
        velocity_terms = speed * (crank + rod) + abs(crank_rate)
        acceleration_terms = abs(second_rate) + speed * (velocity_terms + abs(crank_rate))
        fill_rates(
            point, lane, bvx, bvy, bax, bay, rx, ry, rate, rate_of_rate, velocity_terms * (1.0 + reach / rod),
            acceleration_terms * (1.0 + reach / rod) + rate * rate * reach,
        )  # fmt: skip


@subroutine()
def fill_points(constants, tangents, anchor, needs, out):
    """Fill the rows of the points that are needed."""
    for number in range(MOST_POINTS):
        if needs & (3 * POINTS << 2 * number):
            point = out[(FIRST_POINT + number * POINT_ROWS) * LANES :]
            _fill_point(constants, tangents, anchor, number, out, point)


@subroutine(inlined=True)
def state(constants, lane, u, anchor, steady):
    """Sine and cosine of the angle, d, and the slider's position, excess over the rod, and rates by the angle.

    Then the side of the lag, z, and the lag with two derivatives; it is 0 where the law is that of a steady speed. The
    angle is on the way to the inner dead centre; its half-tangent from a dead centre keeps its digits beside that.
    """
    mirror = 1.0 if anchor == 0 else -1.0
    w = mirror / (1.0 + u * u)
    sine, cosine = 2.0 * u * w, (1.0 - u) * (1.0 + u) * w
    # Of the same rounded angle as the cosine, to all digits beside 90 degrees, where both are small.
    d = 2.0 * arctangent(u - mirror, 1.0 + mirror * u) - constants[Row.REGULAR_OFFSET * LANES + lane]
    travel, width = constants[Row.TRAVEL * LANES + lane], constants[Row.WIDTH * LANES + lane]
    side, z, lag, first, second = mirror, 0.0, 0.0, 0.0, 0.0
    if not steady:
        offset = abs(2.0 * arctangent(u, 1.0))
        is_near = offset < 0.5 * math.pi
        z = 0.5 - (offset if is_near else math.pi - offset) / width
        z = 0.0 if z < 0.0 else z
        side = mirror if is_near else -mirror
        lag, double, slope = blend(constants[Row.ORDER * LANES + lane], z)
        lag, first, second = travel * width * lag, -side * travel * double, travel * slope / width
    along = travel * d + side * lag
    position = constants[Row.REGULAR_POSITION * LANES + lane] - along
    excess = constants[Row.REGULAR_EXCESS * LANES + lane] - along
    return sine, cosine, d, position, excess, -travel - side * first, -side * second, side, z, lag, first, second


@subroutine(inlined=True)
def _put_slider(constants, lane, back, position, rate, second, out):
    """Put the slider's rows of one lane, from its position and rates by the angle."""
    speed = constants[Row.CRANK_SPEED * LANES + lane]
    out[POSITION * LANES + lane] = position
    out[VELOCITY * LANES + lane] = -speed * rate if back else speed * rate
    out[ACCELERATION * LANES + lane] = speed * speed * second
    out[ACCELERATION_TERMS * LANES + lane] = abs(speed * speed * second)


@subroutine(fast=True, no_alias=True)
def _fill_slider(constants, tangents, anchor, law, out):
    """Fill the slider's position, velocity and acceleration at one node of each lane."""
    back, steady = law >= FIRST_LAW_BACK, law % FIRST_LAW_BACK == STEADY_LAW
    for lane in range(LANES):
        u = -tangents[lane] if back else tangents[lane]
        _, _, _, position, _, rate, second, _, _, _, _, _ = state(constants, lane, u, anchor, steady)
        _put_slider(constants, lane, back, position, rate, second, out)


@subroutine(fast=True, inlined=True)
def _fill_crank_of_lane(constants, tangents, anchor, back, steady, lane, out):
    """Fill the slider, and the crank's length with its rates, of one lane."""
    u = -tangents[lane] if back else tangents[lane]
    sine, cosine, d, position, excess, rate, second, side, z, lag, lag1, lag2 = state(
        constants, lane, u, anchor, steady
    )
    _put_slider(constants, lane, back, position, rate, second, out)
    rod, travel = constants[Row.LENGTH * LANES + lane], constants[Row.TRAVEL * LANES + lane]
    g, g1, g2 = separation(
        rod,
        travel * constants[Row.REGULAR_COSINE * LANES + lane],
        travel * constants[Row.REGULAR_SINE * LANES + lane],
        d,
    )
    k, k1 = side * lag * sine, side * (lag1 * sine + lag * cosine)
    k2 = side * (lag2 * sine + 2.0 * lag1 * cosine - lag * sine)
    inverse = 1.0 / (d if z > 0.0 else 1.0)  # d is 0 where there is no lag
    square = inverse * inverse
    g, g1 = g + k * square, g1 + (k1 - 2.0 * k * inverse) * square
    g2 = g2 + (k2 + (-4.0 * k1 + 6.0 * k * inverse) * inverse) * square
    b, b1 = rod + position * sine, rate * sine + position * cosine
    b2 = second * sine + 2.0 * rate * cosine - position * sine
    r = math.sqrt(g * b)
    half = 0.5 / r
    r1 = (g1 * b + g * b1) * half
    r2 = (g2 * b + 2.0 * g1 * b1 + g * b2) * half - r1 * r1 / r
    along, along1 = position * cosine, rate * cosine - position * sine
    along2 = second * cosine - 2.0 * rate * sine - position * cosine
    root = d * r
    opposite = (d < 0.0) | (cosine < 0.0)
    crank = excess * (position + rod) / (along - root) if opposite else along + root
    crank1 = along1 + r + d * r1
    crank2 = along2 + 2.0 * r1 + d * r2
    sign = -1.0 if back else 1.0
    speed = constants[Row.CRANK_SPEED * LANES + lane]
    out[CRANK_LENGTH * LANES + lane] = crank
    out[CRANK_SECOND_RATE * LANES + lane] = speed * speed * crank2
    out[CRANK_RATE * LANES + lane], out[RATE_TERMS * LANES + lane] = sign * speed * crank1, speed * rod


@subroutine(fast=True, no_alias=True)
def _fill_crank(constants, tangents, anchor, law, out):
    """Fill the slider, and the crank's length with its rates, at one node of each lane."""
    back = law >= FIRST_LAW_BACK
    if law % FIRST_LAW_BACK == STEADY_LAW:
        for lane in range(LANES):
            _fill_crank_of_lane(constants, tangents, anchor, back, True, lane, out)
    else:
        for lane in range(LANES):
            _fill_crank_of_lane(constants, tangents, anchor, back, False, lane, out)


@subroutine(fast=True, no_alias=True)
def _fill_groove(constants, tangents, anchor, out):
    """Fill the rod's angle and the groove from slider and crank at one node of each lane."""
    mirror = 1.0 if anchor == 0 else -1.0
    for lane in range(LANES):
        u = tangents[lane]
        w = mirror / (1.0 + u * u)
        sine, cosine = 2.0 * u * w, (1.0 - u) * (1.0 + u) * w
        rod, one_over_speed = constants[Row.LENGTH * LANES + lane], 1.0 / constants[Row.CRANK_SPEED * LANES + lane]
        crank, slope = out[CRANK_LENGTH * LANES + lane], out[CRANK_RATE * LANES + lane] * one_over_speed
        bend = out[CRANK_SECOND_RATE * LANES + lane] * one_over_speed * one_over_speed
        hypotenuse = crank * crank + slope * slope
        one_over = 1.0 / (hypotenuse * math.sqrt(hypotenuse))
        out[ROD_ANGLE * LANES + lane] = arctangent(-crank * sine, out[POSITION * LANES + lane] - crank * cosine)
        out[PRESSURE_ANGLE * LANES + lane] = arctangent(slope, crank)
        out[PRESSURE_TERMS * LANES + lane] = rod / crank
        out[CURVATURE * LANES + lane] = (hypotenuse + slope * slope - crank * bend) * one_over
        out[CURVATURE_TERMS * LANES + lane] = (hypotenuse + slope * slope + crank * (abs(bend) + rod)) * one_over


@compiled(FILL_SIGNATURE)
def fill(constants, tangents, anchor, law, _variant, count, needs, out):
    """Fill the signals in declared units but for angles, rad; see `explore.model.mechanism.Mechanism`."""
    for j in range(count):
        node, signals = tangents[j * LANES :], out[j * SIGNAL_ROWS * LANES :]
        if needs & (CRANK | GROOVE | FORCES | ALL_POINTS):
            _fill_crank(constants, node, anchor, law, signals)
        else:
            _fill_slider(constants, node, anchor, law, signals)
        if needs & GROOVE:
            _fill_groove(constants, node, anchor, signals)
        if needs & FORCES:
            fill_links(constants, node, anchor, signals)
            fill_forces(constants, node, anchor, law, signals)
        if needs & PINS:
            fill_pins(constants, node, anchor, signals)
        if needs & ALL_POINTS:
            fill_points(constants, node, anchor, needs, signals)
