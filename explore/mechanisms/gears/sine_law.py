"""The sine law of the return sector: its constants by one scalar equation, the ratio, and the driven angle.

With L = ln m, M = m^b, w = 2 pi - b and the ratio i = 1/(k L m^phi) of the working sector 0 <= phi <= b, the return is

    i = C0 sin(C1 (phi - C2)) + C3 = C3 - C0 cos(tau),  tau = C1 (phi - b) - dip,

with the value and the slope of the working sector at both joints, so that the driven gear turns once. The five
conditions have one solution for each branch n: C1 = 2 x/w with x between (n - 1/2) pi and n pi,

    tan x / x = -q,  q = 2 tanh(L b/2)/(w L);  x = n pi - y:  sin y = q (n pi - y) cos y.

The rest is explicit and, with E = 1/M, P = 1 - E + 2 E sin^2 y and H = sqrt((E sin 2y)^2 + P^2), free of cancellation:

    dip = arctan(E sin 2y / P),  k C0 = H/(C1 sin 2y),  k (C3 - C0) = E (1/L - E sin 2y/(C1 (H + P)))

The dip is how far, in tau, the ratio goes on falling after the joint. The driven angle is the integral of 1/i:

    integral of dtau/(C3 - C0 cos tau) = (tau + 2 arctan(beta sin tau/(1 - beta cos tau)))/s,
    s = sqrt((C3 - C0)(C3 + C0)),  beta = 2 C0/(sqrt(C3 - C0) + sqrt(C3 + C0))^2 < 1,

the usual 2/s arctan(tan(tau/2) sqrt((C3 + C0)/(C3 - C0))) in a form whose arctangent never leaves its main branch.
"""

import math

from explore.base.compiling import LANES
from explore.base.lanes.arctangent import arctangent
from explore.base.lanes.elementary import cosine, sine
from explore.base.subroutines import subroutine
from explore.mechanisms.gears.columns import (
    AMPLITUDE,
    BETA,
    CONSTANT,
    DIP,
    DRIVEN_SECTOR,
    FREQUENCY,
    LOG_GROWTH,
    LOWEST,
    OFFSET,
    ONE_LESS_BETA,
    SCALE,
    SECTOR_ANGLE,
    START,
)

#: Largest number of steps of Newton's method.
_MOST_STEPS = 60


@subroutine()
def _solve_branch(q, branch):
    """The root y of sin y = q (branch pi - y) cos y between 0 and pi/2: Newton's method in a bracket.

    The difference of both sides increases with y, so the root is single.
    """
    low, high = 0.0, 0.5 * math.pi
    y = 0.5 * (low + high)
    for _ in range(_MOST_STEPS):
        x = branch * math.pi - y
        excess = math.sin(y) - q * x * math.cos(y)
        if excess > 0.0:
            high = y
        else:
            low = y
        step = excess / ((1.0 + q) * math.cos(y) + q * x * math.sin(y))
        following = y - step if low <= y - step <= high else 0.5 * (low + high)
        if abs(following - y) <= 1e-15 * y:
            break
        y = following
    return y


@subroutine()
def solve_sine_law(branch, constants, lane):
    """Fill the constants of the pair and of the sine law of one lane from LOG_GROWTH and SECTOR_ANGLE.

    Return C2, between 0 and the period of the sine, rad.
    """
    log_growth, sector = constants[LOG_GROWTH * LANES + lane], constants[SECTOR_ANGLE * LANES + lane]
    width = 2.0 * math.pi - sector
    y = _solve_branch(2.0 * math.tanh(0.5 * log_growth * sector) / (width * log_growth), branch)
    frequency = 2.0 * (branch * math.pi - y) / width
    inverse = math.exp(-log_growth * sector)
    sine, across = math.sin(2.0 * y), inverse * math.sin(2.0 * y)
    along = -math.expm1(-log_growth * sector) + 2.0 * inverse * math.sin(y) * math.sin(y)
    length = math.sqrt(across * across + along * along)
    dip = math.atan2(across, along)
    # the amplitude, the lowest and the highest ratio, times k
    amplitude = length / (frequency * sine)
    lowest = inverse * (1.0 / log_growth - across / (frequency * (length + along)))
    highest = lowest + 2.0 * amplitude
    roots = math.sqrt(lowest) + math.sqrt(highest)
    constants[BETA * LANES + lane] = 2.0 * amplitude / (roots * roots)
    constants[ONE_LESS_BETA * LANES + lane] = 2.0 * math.sqrt(lowest) / roots
    scale = 1.0 / (frequency * math.sqrt(lowest * highest))
    offset = _anomaly(constants, lane, -dip)
    last = _anomaly(constants, lane, 2.0 * (branch * math.pi - y) - dip)
    working = math.expm1(log_growth * sector)
    constant = 2.0 * math.pi / (working + scale * (last - offset))
    constants[CONSTANT * LANES + lane] = constant
    constants[START * LANES + lane] = 1.0 / (constant * log_growth)
    constants[DRIVEN_SECTOR * LANES + lane] = constant * working
    constants[FREQUENCY * LANES + lane] = frequency
    constants[AMPLITUDE * LANES + lane] = amplitude / constant
    constants[LOWEST * LANES + lane] = lowest / constant
    constants[DIP * LANES + lane] = dip
    constants[SCALE * LANES + lane] = constant * scale
    constants[OFFSET * LANES + lane] = offset
    period = 2.0 * math.pi / frequency
    shift = sector + (dip + 0.5 * math.pi) / frequency
    return shift - period * math.floor(shift / period)


@subroutine(inlined=True)
def _anomaly(constants, lane, tau):
    """The integral of dtau/(C3 - C0 cos tau) from 0, times s."""
    half, beta = sine(0.5 * tau), constants[BETA * LANES + lane]
    denominator = constants[ONE_LESS_BETA * LANES + lane] + 2.0 * beta * half * half
    return tau + 2.0 * arctangent(2.0 * beta * half * cosine(0.5 * tau), denominator)


@subroutine(inlined=True)
def sine_ratio(constants, lane, beyond):
    """The ratio at an angle beyond the end of the working sector, and its first and second derivatives by the angle."""
    frequency, amplitude = constants[FREQUENCY * LANES + lane], constants[AMPLITUDE * LANES + lane]
    half_tau = 0.5 * (frequency * beyond - constants[DIP * LANES + lane])
    half, other = sine(half_tau), cosine(half_tau)
    slope = frequency * amplitude
    ratio = constants[LOWEST * LANES + lane] + 2.0 * amplitude * half * half
    return ratio, 2.0 * slope * half * other, slope * frequency * (other - half) * (other + half)


@subroutine(inlined=True)
def sine_driven_angle(constants, lane, beyond):
    """The driven angle at an angle beyond the end of the working sector, rad."""
    tau = constants[FREQUENCY * LANES + lane] * beyond - constants[DIP * LANES + lane]
    turned = _anomaly(constants, lane, tau) - constants[OFFSET * LANES + lane]
    return constants[DRIVEN_SECTOR * LANES + lane] + constants[SCALE * LANES + lane] * turned


@subroutine()
def sine_driver_angle(constants, lane, driven_angle):
    """The angle in the return sector at a driven angle, rad: the inverse of `sine_driven_angle`."""
    turned = (driven_angle - constants[DRIVEN_SECTOR * LANES + lane]) / constants[SCALE * LANES + lane]
    anomaly = turned + constants[OFFSET * LANES + lane]
    beta, half = constants[BETA * LANES + lane], math.cos(0.5 * anomaly)
    denominator = constants[ONE_LESS_BETA * LANES + lane] + 2.0 * beta * half * half
    tau = anomaly - 2.0 * math.atan(beta * math.sin(anomaly) / denominator)
    reach = tau + constants[DIP * LANES + lane]
    return constants[SECTOR_ANGLE * LANES + lane] + reach / constants[FREQUENCY * LANES + lane]
