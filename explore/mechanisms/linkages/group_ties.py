"""The two ties of a group of links at one crank angle: how they change with the angles of two links.

With z, u, w the directions of the driver and of the two links in complex numbers, at the angles theta, alpha and beta,
a tie is the function k + Re(K z + L u + M w + N u/z + P w/z + Q w/u) of them: of a slot the distance of its pin from
its line, of a bar half of V.V - l^2, with V = f + g z + a u + b w, which has smaller rounding errors than the sum of
terms. The group assembles where both ties are 0.
"""

import math

from explore.base.subroutines import subroutine

#: Numbers of a tie: k, K, L, M, N, P, Q; what rounding errors are relative to; f, g, a, b; l, 0 for a slot; |K| to |Q|.
TIE_SIZE = 29
#: Place of what rounding errors are relative to.
ROUNDED = 13
#: Place of f, before the other parts of V.
PARTS = 14
#: Place of l.
LENGTH = 22
#: Place of |K|, before the other sizes.
SIZES = 23
#: Numbers of a state: theta, alpha, beta, rad; the rates of alpha and beta by theta; and how far the state is unique.
STATE_SIZE = 6
#: Numbers of a tie at a state: its six complex terms, its value, and its slopes by alpha, beta and theta.
TERM_SIZE = 16
#: Place of the value.
VALUE = 12
#: Place of the slope by alpha.
BY_ALPHA = 13
#: Place of the slope by beta.
BY_BETA = 14
#: Place of the slope by theta.
BY_THETA = 15
#: Numbers of a pair of ties: both ties, inverse of the slopes by alpha and beta, second derivatives of these.
PAIR_SIZE = 2 * TERM_SIZE + 6
#: Place of the inverse among them.
INVERSE = 2 * TERM_SIZE
#: Place of the second derivatives.
CURVING = INVERSE + 4


@subroutine(inlined=True)
def _fill_term(tie, k, c, s, terms):
    """Fill a term, with the direction c + i s that it turns by."""
    x, y = tie[2 * k + 1], tie[2 * k + 2]
    terms[2 * k], terms[2 * k + 1] = x * c - y * s, x * s + y * c


@subroutine()
def exchange_links(tie, exchanged):
    """Fill the numbers of a tie with those of the same tie when the two links change their places."""
    for k in range(TIE_SIZE):
        exchanged[k] = tie[k]
    for k in range(2):
        exchanged[3 + k], exchanged[5 + k] = tie[5 + k], tie[3 + k]
        exchanged[7 + k], exchanged[9 + k] = tie[9 + k], tie[7 + k]
        exchanged[PARTS + 4 + k], exchanged[PARTS + 6 + k] = tie[PARTS + 6 + k], tie[PARTS + 4 + k]
    exchanged[12] = -tie[12]
    exchanged[SIZES + 1], exchanged[SIZES + 2] = tie[SIZES + 2], tie[SIZES + 1]
    exchanged[SIZES + 3], exchanged[SIZES + 4] = tie[SIZES + 4], tie[SIZES + 3]


@subroutine()
def evaluate_ties(ties, state, pair):
    """Fill the numbers of a pair of ties at a state but for the second derivatives; return their determinant."""
    cz, sz = math.cos(state[0]), math.sin(state[0])
    cu, su = math.cos(state[1]), math.sin(state[1])
    cw, sw = math.cos(state[2]), math.sin(state[2])
    for i in range(2):
        tie, terms = ties[i * TIE_SIZE :], pair[i * TERM_SIZE :]
        _fill_term(tie, 0, cz, sz, terms)
        _fill_term(tie, 1, cu, su, terms)
        _fill_term(tie, 2, cw, sw, terms)
        _fill_term(tie, 3, cu * cz + su * sz, su * cz - cu * sz, terms)
        _fill_term(tie, 4, cw * cz + sw * sz, sw * cz - cw * sz, terms)
        _fill_term(tie, 5, cw * cu + sw * su, sw * cu - cw * su, terms)
        terms[VALUE] = tie[0] + terms[0] + terms[2] + terms[4] + terms[6] + terms[8] + terms[10]
        if tie[LENGTH] > 0.0:
            part = tie[PARTS:]
            x = part[0] + part[2] * cz - part[3] * sz + part[4] * cu - part[5] * su + part[6] * cw - part[7] * sw
            y = part[1] + part[2] * sz + part[3] * cz + part[4] * su + part[5] * cu + part[6] * sw + part[7] * cw
            terms[VALUE] = 0.5 * (x * x + y * y - tie[LENGTH] * tie[LENGTH])
        terms[BY_ALPHA] = terms[11] - terms[3] - terms[7]
        terms[BY_BETA] = -(terms[5] + terms[9] + terms[11])
        terms[BY_THETA] = terms[7] + terms[9] - terms[1]
    other = pair[TERM_SIZE:]
    determinant = pair[BY_ALPHA] * other[BY_BETA] - pair[BY_BETA] * other[BY_ALPHA]
    pair[INVERSE], pair[INVERSE + 1] = other[BY_BETA] / determinant, -pair[BY_BETA] / determinant
    pair[INVERSE + 2], pair[INVERSE + 3] = -other[BY_ALPHA] / determinant, pair[BY_ALPHA] / determinant
    return determinant


@subroutine()
def correct_angles(pair, state):
    """Take a step of Newton's method; return its length, rad."""
    e, f, inverse = pair[VALUE], pair[TERM_SIZE + VALUE], pair[INVERSE:]
    alpha, beta = -(inverse[0] * e + inverse[1] * f), -(inverse[2] * e + inverse[3] * f)
    state[1] += alpha
    state[2] += beta
    return abs(alpha) + abs(beta)


@subroutine()
def derive_angles(pair, state):
    """Fill the rates and second derivatives of alpha and beta by theta, at a state of both ties."""
    inverse, curving, e, f = pair[INVERSE:], pair[CURVING:], pair[BY_THETA], pair[TERM_SIZE + BY_THETA]
    state[3], state[4] = -(inverse[0] * e + inverse[1] * f), -(inverse[2] * e + inverse[3] * f)
    e, f = _bend(pair, state[3], state[4]), _bend(pair[TERM_SIZE:], state[3], state[4])
    curving[0], curving[1] = -(inverse[0] * e + inverse[1] * f), -(inverse[2] * e + inverse[3] * f)


@subroutine()
def _bend(terms, alpha, beta):
    """The second derivative of a tie but for those of the angles, at rates of these."""
    first, second, between = alpha - 1.0, beta - 1.0, beta - alpha
    own = terms[0] + alpha * alpha * terms[2] + beta * beta * terms[4]
    return -(own + first * first * terms[6] + second * second * terms[8] + between * between * terms[10])


@subroutine(inlined=True)
def rate_by_alpha(terms, theta, alpha, beta):
    """The derivative of the slope by alpha at rates of the three angles."""
    return (beta - alpha) * terms[10] - alpha * terms[2] - (alpha - theta) * terms[6]


@subroutine(inlined=True)
def rate_by_beta(terms, theta, alpha, beta):
    """The derivative of the slope by beta at rates of the three angles."""
    return -(beta * terms[4] + (beta - theta) * terms[8] + (beta - alpha) * terms[10])


@subroutine()
def rate_of_determinant(pair, theta, alpha, beta):
    """The derivative of the determinant at rates of the three angles."""
    other = pair[TERM_SIZE:]
    p, q = rate_by_alpha(pair, theta, alpha, beta), rate_by_beta(pair, theta, alpha, beta)
    r, s = rate_by_alpha(other, theta, alpha, beta), rate_by_beta(other, theta, alpha, beta)
    return p * other[BY_BETA] + pair[BY_ALPHA] * s - q * other[BY_ALPHA] - pair[BY_BETA] * r
