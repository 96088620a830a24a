"""Panels of signals of which nothing is known, many designs at once, with as many nodes as resolve every signal.

Between two breaks signals are smooth. The error that is claimed of a rule of N nodes is four times the largest Legendre
coefficient of the four highest orders below N. Where coefficients fall like rho^-k the error falls like rho^-2N, far
below; beside a corner both fall like the same power of N. Coefficients are not carried on, because a weak and near
singularity may hide below a strong and far one. A corner between an end of the panel and the node next to it shows in
the difference of the signal from its interpolant at this end, which counts for the length of that gap. Designs whose
error is above the tolerance with the most nodes are left to the adaptive rule.
"""

import math
from functools import cache

import numpy as np
import numpy.typing as npt

from explore.base.compiling import LANES
from explore.base.subroutines import subroutine
from explore.evaluation.quadrature import bounds
from explore.evaluation.quadrature.adaptive import keep_tails, mark_panels
from explore.evaluation.quadrature.bounds import FLAG_TERMS
from explore.evaluation.quadrature.equispaced import leave_panel
from explore.evaluation.quadrature.panels import COUNT, HALF, LENGTH, PANEL_CAPACITY
from explore.evaluation.quadrature.resolving import COUNTS, TOGETHER, project
from explore.evaluation.quadrature.rules import gauss_legendre_rules
from explore.evaluation.quadrature.tiles import FIRST_TAIL, MEAN, SUMS_SIZE

#: Numbers of nodes of a piece, multiples of four as `project` needs.
PIECE_COUNTS = (12, 16, 24, 32, 48, 64, 96)
#: Number of highest orders whose coefficients are looked at: two even and two odd ones.
_ORDERS = 4
#: Bound of the gap between an end and the node next to it over half the panel's length, times N^2.
_GAP = 3.0
#: Smallest number of nodes per radian, that of a turn of the fewest equal steps.
_PER_RADIAN = COUNTS[0] / (2.0 * math.pi)
#: Smallest number of nodes per half length in t, with which the weights of the nodes are exact to rounding.
_PER_HALF_LENGTH = 10.0
#: Tolerance that the smallest numbers of nodes often meet; smaller ones begin with more, in proportion to their digits.
_EASY = 1e-6
#: Factor on the largest coefficient, because coefficients of a double pole grow up to the inverse of its distance.
_GROWTH = 4.0


@cache
def piece_factors() -> npt.NDArray[np.float64]:
    """Factors of the samples in the coefficients for all `PIECE_COUNTS`: node after node of the first half of a piece.

    At each node there are four factors of the sum of the samples at this and at the opposite node, two of which are 0,
    and four of their difference. Those of each count follow those of fewer nodes.
    """
    _, row_of, rules = gauss_legendre_rules()
    tables = []
    for count in PIECE_COUNTS:
        nodes, weights = rules[row_of[count] : row_of[count] + count // 2, :2].T
        orders = np.arange(count - _ORDERS, count)
        polynomials = np.polynomial.legendre.legvander(-nodes, count - 1)[:, orders]
        factors = np.zeros((count // 2, 2, TOGETHER))
        for k, order in enumerate(orders):
            factors[:, order % 2, k // 2] = weights * (order + 0.5) * polynomials[:, k]
        tables.append(factors.ravel())
    return np.concatenate(tables)


@subroutine()
def open_pieces(work, sums, flags, tolerance, count):
    """Fill the first number of nodes of each panel, and no earlier tails of the flagged rows."""
    digits = max(math.log(tolerance) / math.log(_EASY), 1.0)
    for k in range(count):
        least = max(float(PIECE_COUNTS[0]), _PER_RADIAN * work.panels[LENGTH + k])
        work.panels[COUNT + k], work.todo[k] = float(fewest_nodes(work.panels, k, digits * least)), k
    for s in range(len(flags)):
        for k in range(count if flags[s] else 0):
            sums.earlier_tails[s * PANEL_CAPACITY + k] = math.inf


@subroutine()
def fewest_nodes(panels, k, least):
    """The smallest number of nodes of a panel that is not below a least one."""
    return _next_count(max(least, _PER_RADIAN * panels[LENGTH + k], _PER_HALF_LENGTH * panels[HALF + k]))


@subroutine()
def _next_count(least):
    """The smallest of `PIECE_COUNTS` that is not below a number, or the largest one."""
    count = PIECE_COUNTS[-1]
    for k in range(len(PIECE_COUNTS) - 1, -1, -1):
        count = PIECE_COUNTS[k] if PIECE_COUNTS[k] >= least else count
    return count


@subroutine()
def add_coefficients(signals, rows, flags, count, factors, tile_sums, parts):
    """Replace the tails of the flagged rows of a tile of pieces, differences at both ends, by errors of the mean.

    `signals` begin with the first of the `count` nodes. The sums in `tile_sums` are known.
    """
    begin = 0
    for fewer in PIECE_COUNTS:
        begin += TOGETHER * fewer if fewer < count else 0
    for s in range(rows):
        if not flags[s] or flags[s] == FLAG_TERMS:
            continue
        row = tile_sums[s * SUMS_SIZE :]
        project(signals, rows, s, count, factors[begin:], row[MEAN : MEAN + LANES], parts)
        tails = row[FIRST_TAIL : FIRST_TAIL + LANES]
        for lane in range(LANES):
            largest = 0.0
            for k in range(2 * TOGETHER):
                largest = max(largest, abs(parts[k * LANES + lane]))
            tails[lane] = _GROWTH * largest + _GAP / (count * count) * tails[lane]


@subroutine()
def count_again(work, n, n_todo):
    """Fill the nodes of this round of the live designs: those of the panels to sample, which are in their order."""
    t = 0
    for j in range(n):
        work.bounds[bounds.TOTAL + j] = 0.0
        while t < n_todo and work.owner[work.todo[t]] == work.live[j]:
            work.bounds[bounds.TOTAL + j] += work.panels[COUNT + work.todo[t]] + 2.0
            t += 1


@subroutine()
def choose_next_pieces(work, sums, w, flags, tolerance, n, stride, is_disturbed):
    """Keep the designs live whose error more nodes lower to the tolerance; leave others to the adaptive rule.

    Return the numbers of live designs and of the panels that have more nodes now, as the only ones to sample.
    """
    left, n_todo = 0, 0
    for j in range(n):
        if work.bounds[bounds.IMPROVABLE + j] == 0.0:
            continue
        i = work.live[j]
        mark_panels(work, sums, w, flags, tolerance, j, stride, is_disturbed)
        marked, most = 0, 0
        for p in range(work.panel_count[i]):
            needed = work.codes[work.first_panel[i] + p * stride]
            marked, most = marked + (1 if needed > 0 else 0), max(most, needed)
        if marked == 0 or most > PIECE_COUNTS[-1]:
            leave_panel(work.panels, work.first_panel[i])
            continue
        for p in range(work.panel_count[i]):
            k = work.first_panel[i] + p * stride
            if work.codes[k] > 0:
                keep_tails(sums, flags[w], k, k)
                work.panels[COUNT + k], work.todo[n_todo] = float(_next_count(work.codes[k])), k
                n_todo += 1
        work.live[left] = i
        left += 1
    return left, n_todo
