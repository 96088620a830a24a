"""Mean and variance of a four-bar's angular velocities over any window, in closed form, for many lanes at once.

With u = cos(theta_1), C = 2 r1 r4 and M = (r2^2 - r3^2)/C, let d^2 = C (D - u), p = C (P - u) and q = C (Q + u). The
velocities of `four_bar` are k f - g and (k - 1) f - g with

    f = sin(theta_1)/w,  w = branch sqrt((P - u)(Q + u)),  k = (1 + M/(D - u))/2,
    g = Re h,  h = z/(e^{-i theta_1} - z),  z = r1/r4, which is the smaller root of z + 1/z = 2 D

and z_P, z_Q are those of P and Q. The square of a velocity has three parts. (k f)^2 is rational in u: in partial
fractions it is made of sin^2/(P - u), sin^2/(Q + u), sin^2/(D - u) and sin^2/(D - u)^2, and g^2 of |h|^2 and Re h^2.
With v = z sin/(1 - z u), phi = arctan(v) and W(v) = (1 - arctan(v)/v)/v^2, a smooth function between 0 and 1/3,

    of sin^2/(P - u) the integral is     z theta + sin (v^2 W - z u)/(1 - z u) + z phi,
    of |h|^2                             (theta + 2 phi) z^2/(1 - z^2),
    of Re h^2                            Im h - phi = v ((z u - v^2 (1 - z u))/((1 - z u)(1 + v^2)) + v^2 W),

without cancellation for short cranks (z -> 0) or near change points (z_P -> 1). The third part, f k g, is
sin(theta_1) times a function of u. With y = sqrt(q/p), rho = (r2 - r3)/(r2 + r3), x = rho y and S = arctan(x)/x its
integral consists of changes of the transmission angle 2 arctan(1/y), of arctan(x), and of

    K1 = 2 y S/(D + Q),  K2 = y/(D + Q)^2 (1/(1 + x^2) + S + y^2 (S - 1/(1 + x^2))/x^2),

the integrals of 1/((D - u) w) and, halved, of 1/((D - u)^2 w) by u. What still cancels are terms with 1/rho^2 near
kites, and K1 and K2 of tiny cranks; the sum of the magnitudes of all terms tells how much.
"""

import math
from typing import NamedTuple

from explore.base.compiling import INTEGRALS, INTEGRALS_SIGNATURE, LANES, compiled
from explore.base.lanes.arctangent import arctangent
from explore.base.subroutines import subroutine
from explore.mechanisms.four_bar import (
    BRANCH,
    COUPLER_VELOCITY,
    D_LEAST,
    FOUR_CRANK_GROUND,
    GROUND_MINUS_CRANK,
    GROUND_PLUS_CRANK,
    P_LEAST,
    Q_LARGEST,
    Q_LEAST,
    ROCKER_VELOCITY,
    SQUARES,
)

#: Rows of the signals, in the order of the integrals.
ROWS = (COUPLER_VELOCITY, ROCKER_VELOCITY)
#: Rounding of the terms and of the lengths in them, relative to the sum of their magnitudes.
_ROUNDING = 2e-15
#: Change of a mean by the rounding of the ends of its window, relative to the rms.
_ROUNDING_OF_ENDS = 4e-15
#: Bound of v^2 for the series of W, whose first term that is left out is then below 1e-17.
_SMALL = 0.09


class _Shape(NamedTuple):
    """A linkage: P - 1, Q - 1, D + Q, P + Q and inverses; (1 - z)/z and z of P, Q and D; M, rho, branch."""

    p_gap: float
    q_gap: float
    reach: float
    over_reach: float
    p_and_q: float
    over_p_and_q: float
    p_gap_z: float
    q_gap_z: float
    d_gap_z: float
    z_p: float
    z_q: float
    z_d: float
    d_root: float
    m: float
    rho: float
    over_rho: float
    branch: float


class _End(NamedTuple):
    """One end of a window: cosine and sine of half the angle, and the antiderivatives there with their magnitudes.

    The parts of P, Q and D are those of sin^2/(P - u), without z theta, and so on; h is Im h - phi.
    """

    cosine: float
    sine: float
    p: float
    p_size: float
    q: float
    q_size: float
    d: float
    d_size: float
    phi: float
    h: float
    h_size: float
    root_p: float
    root_q: float
    k1: float
    k2: float


@subroutine(contract=True, inlined=True)
def _series(square):
    """W(v) = (1 - arctan(v)/v)/v^2 of a small v by its power series in v^2."""
    series = 1.0 / 31.0
    series = 1.0 / 29.0 - square * series
    series = 1.0 / 27.0 - square * series
    series = 1.0 / 25.0 - square * series
    series = 1.0 / 23.0 - square * series
    series = 1.0 / 21.0 - square * series
    series = 1.0 / 19.0 - square * series
    series = 1.0 / 17.0 - square * series
    series = 1.0 / 15.0 - square * series
    series = 1.0 / 13.0 - square * series
    series = 1.0 / 11.0 - square * series
    series = 1.0 / 9.0 - square * series
    series = 1.0 / 7.0 - square * series
    series = 1.0 / 5.0 - square * series
    return 1.0 / 3.0 - square * series


@subroutine(contract=True, inlined=True)
def _three_inverses(a, b, c):
    """The inverses of three numbers, by one division."""
    b_c = b * c
    inverse = 1.0 / (a * b_c)
    return inverse * b_c, inverse * (a * c), inverse * (a * b)


@subroutine(contract=True, inlined=True)
def _sine_part(sine, over_sine, reach, over_reach, cosine, z, over_z):
    """The integral of sin^2/(P - u) without z theta, and its magnitude; v, phi and v^2 W.

    `reach` is (1 - z u)/z.
    """
    v, angle = sine * over_reach, arctangent(sine, reach)
    square, scaled = v * v, v * over_z
    rest = square * _series(square) if square < _SMALL else 1.0 - angle * (reach * over_sine)
    return scaled * (rest - z * cosine) + z * angle, abs(scaled) * rest + abs(v) + z * abs(angle), v, angle, rest


@subroutine(contract=True, inlined=True)
def _shape(constants, lane):
    """The linkage of one lane."""
    over_c = 2.0 / constants[FOUR_CRANK_GROUND * LANES + lane]
    p_gap, q_gap = constants[P_LEAST * LANES + lane] * over_c, constants[Q_LEAST * LANES + lane] * over_c
    d_gap, m = constants[D_LEAST * LANES + lane] * over_c, constants[SQUARES * LANES + lane] * over_c
    d_root = constants[GROUND_MINUS_CRANK * LANES + lane] * constants[GROUND_PLUS_CRANK * LANES + lane] * over_c
    reach = (constants[Q_LARGEST * LANES + lane] + constants[D_LEAST * LANES + lane]) * over_c
    p_and_q = p_gap + 2.0 + q_gap
    over_reach, over_m, over_p_and_q = _three_inverses(reach, m, p_and_q)
    # (1 - z)/z = P - 1 + sqrt(P^2 - 1)
    p_gap_z, q_gap_z = p_gap + math.sqrt(p_gap * (p_gap + 2.0)), q_gap + math.sqrt(q_gap * (q_gap + 2.0))
    d_gap_z = d_gap + d_root
    z_p, z_q, z_d = _three_inverses(1.0 + p_gap_z, 1.0 + q_gap_z, 1.0 + d_gap_z)
    return _Shape(
        p_gap, q_gap, reach, over_reach, p_and_q, over_p_and_q, p_gap_z, q_gap_z, d_gap_z, z_p, z_q, z_d, d_root, m,
        m * over_reach, reach * over_m, constants[BRANCH * LANES + lane],
    )  # fmt: skip


@subroutine(contract=True, inlined=True)
def _transmission_part(shape, root_p, root_q, v_square, one_less):
    """K1 and K2, and 1/((1 - z u)(1 + v^2)), which shares a division; all terms are positive."""
    over_roots = 1.0 / (root_p * root_q)
    y, over_y = root_q * root_q * over_roots, root_p * root_p * over_roots
    x, over_x = shape.rho * y, shape.over_rho * over_y
    square = x * x
    denominator, other = one_less * (1.0 + v_square), 1.0 + square
    inverse = 1.0 / (denominator * other)
    fraction, series, is_small = inverse * denominator, _series(square), square < _SMALL
    s = 1.0 - square * series if is_small else arctangent(shape.rho * root_q, root_p) * over_x
    rest = fraction - series if is_small else (s - fraction) * over_x * over_x
    scaled = y * shape.over_reach
    return 2.0 * scaled * s, scaled * shape.over_reach * (fraction + s + y * y * rest), inverse * other


@subroutine(contract=True, inlined=True)
def _end(shape, tangent):
    """One end of the window."""
    half_cosine = 1.0 / math.sqrt(1.0 + tangent * tangent)
    half_sine = tangent * half_cosine
    sine, less, more = 2.0 * half_sine * half_cosine, 2.0 * half_sine * half_sine, 2.0 * half_cosine * half_cosine
    cosine, over_sine = more - 1.0, 1.0 / sine
    p_reach, q_reach, d_reach = shape.p_gap_z + less, shape.q_gap_z + more, shape.d_gap_z + less
    over_p, over_q, over_d = _three_inverses(p_reach, q_reach, d_reach)
    p, p_size, _, _, _ = _sine_part(sine, over_sine, p_reach, over_p, cosine, shape.z_p, 1.0 + shape.p_gap_z)
    q, q_size, _, _, _ = _sine_part(-sine, -over_sine, q_reach, over_q, -cosine, shape.z_q, 1.0 + shape.q_gap_z)
    d, d_size, v, phi, rest = _sine_part(sine, over_sine, d_reach, over_d, cosine, shape.z_d, 1.0 + shape.d_gap_z)
    root_p, root_q = math.sqrt(shape.p_gap + less), math.sqrt(shape.q_gap + more)
    v_square, one_less = v * v, shape.z_d * d_reach
    k1, k2, over = _transmission_part(shape, root_p, root_q, v_square, one_less)
    first, second = shape.z_d * cosine * over, v_square * one_less * over
    h, h_size = v * (first - second + rest), abs(v) * (abs(first) + second + rest)
    return _End(half_cosine, half_sine, p, p_size, q, q_size, d, d_size, phi, h, h_size, root_p, root_q, k1, k2)


@subroutine(contract=True, inlined=True)
def _rational_part(rho, over_rho, s_p, s_q, s_d, s_dd, reach):
    """The integral of (k f)^2 times 4 (P + Q); `reach` is D + Q."""
    of_p, of_q = 1.0 + over_rho, 1.0 + rho
    of_d = 2.0 * (rho - over_rho) + (rho * rho - over_rho * over_rho)
    return of_p * of_p * s_p + of_q * of_q * s_q + of_d * s_d - reach * (1.0 - rho * rho) * s_dd


@subroutine(contract=True, inlined=True)
def _angle_changes(shape, first, last, start, stop):
    """Length of the window, changes of half the transmission angle and of arctan(x).

    All from one product, so that its rounding cancels in means over short windows.
    """
    cosines = start.cosine * stop.cosine
    sine = cosines * (last - first)
    half_length = arctangent(sine, cosines + start.sine * stop.sine)
    # a full turn instead of none
    length = 2.0 * (half_length if half_length > 0.0 else half_length + math.pi)
    fall = 2.0 * cosines * (last + first) * sine
    change = shape.p_and_q * fall / (stop.root_p * start.root_q + start.root_p * stop.root_q)
    p, q = stop.root_p * start.root_p, stop.root_q * start.root_q
    return length, arctangent(change, q + p), arctangent(-shape.rho * change, p + shape.rho * shape.rho * q)


@subroutine(contract=True, inlined=True)
def _bounds(shape, start, stop, length, over_length, share, angles):
    """Bounds of the errors of mean and mean square; `share` is z_D/(4 d_root), `angles` the sum of `_angle_changes`."""
    rho, over_rho, turn = abs(shape.rho), abs(shape.over_rho), abs(stop.phi) + abs(start.phi)
    g = share * (length + 2.0 * turn) + 0.5 * (stop.h_size + start.h_size)
    of_p, of_q, of_d = 1.0 + over_rho, 1.0 + rho, 2.0 * (rho + over_rho) + rho * rho + over_rho * over_rho
    rational = of_p * of_p * (shape.z_p * length + stop.p_size + start.p_size)
    rational += of_q * of_q * (shape.z_q * length + stop.q_size + start.q_size)
    rational += of_d * (shape.z_d * length + stop.d_size + start.d_size) + 4.0 * shape.reach * (1.0 + rho * rho) * g
    k_terms = 0.5 * abs(shape.d_root) * (stop.k1 + start.k1 + abs(shape.m) * (stop.k2 + start.k2))
    unit = _ROUNDING * over_length
    # A crank longer than the ground takes z beyond 1.
    of_mean = unit * (angles + turn) if shape.d_root > 0.0 else math.nan
    return of_mean, unit * (0.25 * shape.over_p_and_q * rational + g + angles + k_terms)


@compiled(INTEGRALS_SIGNATURE, contract=True, no_alias=True)
def integrals(constants, starts, stops, out):
    """Fill mean and variance of the velocities for unit speed; see `explore.model.mechanism.Mechanism.integrals`."""
    for lane in range(LANES):
        shape = _shape(constants, lane)
        start, stop = _end(shape, starts[lane]), _end(shape, stops[lane])
        length, of_transmission, of_difference = _angle_changes(shape, starts[lane], stops[lane], start, stop)
        over_length, turn, harmonic = 1.0 / length, stop.phi - start.phi, stop.h - start.h
        share, angles = 0.25 * shape.z_d / shape.d_root, abs(of_transmission) + abs(of_difference)
        of_mean, of_square = _bounds(shape, start, stop, length, over_length, share, angles)
        poisson = 2.0 * share * (length + 2.0 * turn)
        s_p, s_q = shape.z_p * length + (stop.p - start.p), shape.z_q * length + (stop.q - start.q)
        s_d, s_dd = shape.z_d * length + (stop.d - start.d), 2.0 * (poisson - harmonic)
        of_k1 = 0.25 * shape.d_root * (stop.k1 - start.k1)
        of_k2 = 0.25 * shape.d_root * shape.m * (stop.k2 - start.k2)
        for signal in range(2):
            sign = -1.0 if signal == 0 else 1.0
            rational = _rational_part(sign * shape.rho, sign * shape.over_rho, s_p, s_q, s_d, s_dd, shape.reach)
            cross = 0.5 * (sign * of_difference - of_transmission) - of_k1 - sign * of_k2
            mean = over_length * (shape.branch * (sign * of_transmission - of_difference) - turn)
            mean_square = 0.25 * shape.over_p_and_q * rational + 0.5 * (poisson + harmonic)
            mean_square = over_length * (mean_square - 2.0 * sign * shape.branch * cross)
            variance = mean_square - mean * mean
            # The ends of the window are rounded too.
            of_ends = _ROUNDING_OF_ENDS * math.sqrt(mean_square)
            at = signal * INTEGRALS * LANES + lane
            out[at], out[at + LANES] = mean, variance if variance > 0.0 else 0.0
            out[at + 2 * LANES] = of_mean + of_ends
            out[at + 3 * LANES] = of_square + 2.0 * abs(mean) * (of_mean + of_ends) + _ROUNDING_OF_ENDS * mean_square
