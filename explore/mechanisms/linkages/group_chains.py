"""The two chains of a group of four links at one crank angle: how their lengths change with the angles of two links.

Of chain i the vector is V = C + a u + b w in complex numbers, with C = c + g z, and z, u, w the directions of the
driver and of the two links at the angles theta, alpha and beta. The group assembles where (V.V - l^2)/2 = 0 for both.
"""

import math

from explore.base.subroutines import subroutine

#: Numbers of a chain: c, g, a, b, and l.
CHAIN_SIZE = 9
#: Numbers of a state: theta, alpha, beta, rad; the rates of alpha and beta by theta; and how far the state is unique.
STATE_SIZE = 6
#: Numbers of a chain at a state: V, g z, a u, b w, half of V.V - l^2, and its slopes by alpha, beta and theta.
TERM_SIZE = 12
#: Numbers of a pair of chains: both chains, inverse of the slopes by alpha and beta, second derivatives of these.
PAIR_SIZE = 2 * TERM_SIZE + 6
#: Place of the inverse among them.
INVERSE = 2 * TERM_SIZE
#: Place of the second derivatives.
CURVING = INVERSE + 4


@subroutine(inlined=True)
def length_of(x, y):
    """The length of a vector; `math.hypot` minds the range of doubles, which lengths leave far behind."""
    return math.sqrt(x * x + y * y)


@subroutine()
def evaluate_chains(chains, state, pair):
    """Fill the numbers of a pair of chains at a state but for the second derivatives; return their determinant."""
    cz, sz = math.cos(state[0]), math.sin(state[0])
    cu, su = math.cos(state[1]), math.sin(state[1])
    cw, sw = math.cos(state[2]), math.sin(state[2])
    for i in range(2):
        chain, terms = chains[i * CHAIN_SIZE :], pair[i * TERM_SIZE :]
        gx, gy = chain[2] * cz - chain[3] * sz, chain[2] * sz + chain[3] * cz
        ax, ay = chain[4] * cu - chain[5] * su, chain[4] * su + chain[5] * cu
        bx, by = chain[6] * cw - chain[7] * sw, chain[6] * sw + chain[7] * cw
        vx, vy = chain[0] + gx + ax + bx, chain[1] + gy + ay + by
        terms[0], terms[1], terms[2], terms[3] = vx, vy, gx, gy
        terms[4], terms[5], terms[6], terms[7] = ax, ay, bx, by
        terms[8] = 0.5 * (vx * vx + vy * vy - chain[8] * chain[8])
        terms[9], terms[10], terms[11] = ax * vy - ay * vx, bx * vy - by * vx, gx * vy - gy * vx
    other = pair[TERM_SIZE:]
    determinant = pair[9] * other[10] - pair[10] * other[9]
    pair[INVERSE], pair[INVERSE + 1] = other[10] / determinant, -pair[10] / determinant
    pair[INVERSE + 2], pair[INVERSE + 3] = -other[9] / determinant, pair[9] / determinant
    return determinant


@subroutine()
def correct_angles(pair, state):
    """Take a step of Newton's method; return its length, rad."""
    e, f, inverse = pair[8], pair[TERM_SIZE + 8], pair[INVERSE:]
    alpha, beta = -(inverse[0] * e + inverse[1] * f), -(inverse[2] * e + inverse[3] * f)
    state[1] += alpha
    state[2] += beta
    return abs(alpha) + abs(beta)


@subroutine()
def derive_angles(pair, state):
    """Fill the rates and second derivatives of alpha and beta by theta, at a state of both chains."""
    inverse, curving, e, f = pair[INVERSE:], pair[CURVING:], pair[11], pair[TERM_SIZE + 11]
    state[3], state[4] = -(inverse[0] * e + inverse[1] * f), -(inverse[2] * e + inverse[3] * f)
    e, f = _bend(pair, state[3], state[4]), _bend(pair[TERM_SIZE:], state[3], state[4])
    curving[0], curving[1] = -(inverse[0] * e + inverse[1] * f), -(inverse[2] * e + inverse[3] * f)


@subroutine()
def _bend(terms, alpha, beta):
    """The second derivative of half of V.V but for those of the angles, at rates of these."""
    wx = terms[2] + terms[4] * alpha + terms[6] * beta
    wy = terms[3] + terms[5] * alpha + terms[7] * beta
    ix = terms[2] + terms[4] * alpha * alpha + terms[6] * beta * beta
    iy = terms[3] + terms[5] * alpha * alpha + terms[7] * beta * beta
    return wx * wx + wy * wy - terms[0] * ix - terms[1] * iy
