"""Full turns of signals of which nothing is known, with as many equal steps as resolve them: 64 to 256.

What samples tell of the error of a turn's mean and variance are projections: the Fourier coefficients of the highest
orders, and the differences of the signal from its interpolant at a few more angles, which show what equal steps cannot
tell from lower orders. Their largest sizes add up to the error that is claimed. Where coefficients fall, those of the
orders N, 2N, ..., which the mean errs by, are much smaller than those of the orders up to N/2, exponentially or, beside
a corner, algebraically; rounding errors have all orders alike. Designs with a larger error are left to the adaptive
rule, and so are those with equal samples, between which a pulse may stand.
"""

import math
from functools import cache

import numpy as np
import numpy.typing as npt

from explore.base.compiling import LANES
from explore.base.lanes.elementary import tangent
from explore.base.subroutines import subroutine
from explore.evaluation.quadrature import bounds
from explore.evaluation.quadrature.bounds import CHUNK, FLAG_SQUARES, FLAG_TERMS
from explore.evaluation.quadrature.equispaced import leave_panel
from explore.evaluation.quadrature.panels import CENTRE, COUNT, DECAY, HALF, PANEL_CAPACITY, RATE, SCALE
from explore.evaluation.quadrature.tiles import DEVIATIONS, FIRST_TAIL, INTEGRAL, SUMS_SIZE

#: Numbers of nodes of a turn.
COUNTS = (64, 96, 128, 192, 256)
#: Number of highest orders whose coefficients are looked at: a signal with eight equal parts of a turn has one of them.
_ORDERS = 8
#: Half-angles of the comparisons on both sides of the anchor over a full turn: of no node, no multiples of each other.
_PLACES = (0.0791, 0.1905, 0.3017, 0.4366)
#: Number of angles where the interpolant is compared with the signal.
CHECKS = 2 * len(_PLACES)
#: Number of projections of sums, and of as many differences, of samples at opposite angles that are filled at once.
TOGETHER = 4
#: Number of such fours.
_FOURS = (_ORDERS + len(_PLACES)) // TOGETHER
#: Size of the work space for the projections of a signal.
PARTS_SIZE = 2 * _FOURS * TOGETHER * LANES
#: Factor on the largest coefficient, because coefficients of a double pole grow up to the inverse of its distance.
_GROWTH = 4.0
#: Share of the expected number of nodes with which one more round is tried.
_HOPE = 0.8


@cache
def turn_factors() -> npt.NDArray[np.float64]:
    """Factors of the samples in the projections for all `COUNTS`: four after four, node after node of half a turn.

    At each node there are four factors of the sum of the samples at this and at the opposite angle, and four of their
    difference. Those of each count follow those of fewer nodes.
    """
    tables = []
    for count in COUNTS:
        nodes = np.pi * (2.0 * np.arange(count // 2) + 1.0 - count) / count
        waves = np.arange(count // 2 - _ORDERS + 1, count // 2 + 1)[:, None] * nodes
        here, there = (np.pi * np.array(_PLACES)[:, None] - 0.5 * side * nodes for side in (1.0, -1.0))
        here, there = (0.5 * np.sin(count * half) / (count * np.tan(half)) for half in (here, there))
        of_sums = np.concatenate([2.0 / count * np.cos(waves), here + there])
        of_differences = np.concatenate([2.0 / count * np.sin(waves), here - there])
        both = np.stack([of_sums, of_differences]).reshape(2, _FOURS, TOGETHER, count // 2)
        tables.append(both.transpose(1, 3, 0, 2).ravel())
    return np.concatenate(tables)


@subroutine()
def open_turns(panels, n):
    """Turn the first of the two panels of n designs into one of the fewest equal steps."""
    for k in range(n):
        panels[COUNT + k], panels[CENTRE + k], panels[HALF + k] = float(COUNTS[0]), 0.0, 0.5 * math.pi
        panels[SCALE + k], panels[RATE + k], panels[DECAY + k] = 0.0, 1.0, 0.0


@subroutine()
def place_checks(count, tangents):
    """Fill the half-tangents of the angles of comparison behind those of the nodes, the same in all lanes."""
    for k in range(CHECKS):
        u = tangent(math.pi * _PLACES[k // 2])
        for lane in range(LANES):
            tangents[(count + k) * LANES + lane] = u if k % 2 == 0 else -u


@subroutine(fast=True, no_alias=True)
def project(signals, rows, s, count, factors, means, parts):
    """Fill four projections of sums, and four of differences, of the deviations of a row at opposite angles."""
    # LLVM would unroll a loop of constant length instead of vectorising it.
    width = len(means)
    for k in range(2 * TOGETHER * LANES):
        parts[k] = 0.0
    for j in range(0, count // 2, 2):
        f = factors[2 * TOGETHER * j :]
        a1, a2, a3, a4, b1, b2, b3, b4 = f[0], f[1], f[2], f[3], f[4], f[5], f[6], f[7]
        c1, c2, c3, c4, d1, d2, d3, d4 = f[8], f[9], f[10], f[11], f[12], f[13], f[14], f[15]
        x1, x2 = signals[(j * rows + s) * LANES :], signals[((count - 1 - j) * rows + s) * LANES :]
        x3, x4 = signals[((j + 1) * rows + s) * LANES :], signals[((count - 2 - j) * rows + s) * LANES :]
        for lane in range(width):
            mean = means[lane]
            y1, y2, y3, y4 = x1[lane] - mean, x2[lane] - mean, x3[lane] - mean, x4[lane] - mean
            u, v, w, z = y1 + y2, y1 - y2, y3 + y4, y3 - y4
            parts[lane] = parts[lane] + (a1 * u + c1 * w)
            parts[LANES + lane] = parts[LANES + lane] + (a2 * u + c2 * w)
            parts[2 * LANES + lane] = parts[2 * LANES + lane] + (a3 * u + c3 * w)
            parts[3 * LANES + lane] = parts[3 * LANES + lane] + (a4 * u + c4 * w)
            parts[4 * LANES + lane] = parts[4 * LANES + lane] + (b1 * v + d1 * z)
            parts[5 * LANES + lane] = parts[5 * LANES + lane] + (b2 * v + d2 * z)
            parts[6 * LANES + lane] = parts[6 * LANES + lane] + (b3 * v + d3 * z)
            parts[7 * LANES + lane] = parts[7 * LANES + lane] + (b4 * v + d4 * z)


@subroutine()
def resolve_rows(signals, rows, flags, count, factors, tile_sums, parts):
    """Fill the errors of the mean of each flagged row, relative, as its tails, from the samples of a tile of turns.

    Behind the `count` nodes of `signals` are the angles of comparison. The moments in `tile_sums` are known.
    """
    begin = 0
    for fewer in COUNTS:
        begin += _FOURS * TOGETHER * fewer if fewer < count else 0
    for s in range(rows):
        if not flags[s] or flags[s] == FLAG_TERMS:
            continue
        row = tile_sums[s * SUMS_SIZE :]
        means = row[FIRST_TAIL : FIRST_TAIL + LANES]
        for lane in range(LANES):
            means[lane] = row[INTEGRAL + lane] / (2.0 * math.pi)
        for four in range(_FOURS):
            project(
                signals, rows, s, count, factors[begin + four * TOGETHER * count :], means,
                parts[2 * TOGETHER * four * LANES :],
            )  # fmt: skip
        for lane in range(LANES):
            means[lane] = _error(signals, rows, s, count, flags[s], lane, means[lane], row[DEVIATIONS + lane], parts)


@subroutine()
def _error(signals, rows, s, count, flags, lane, mean, deviations, parts):
    """The error of the mean of a row in one lane, relative; infinite if all samples are equal."""
    highest = difference = 0.0
    for k in range(_ORDERS + CHECKS // 2):
        at = (2 * (k // TOGETHER) * TOGETHER + k % TOGETHER) * LANES + lane
        of_sums, of_differences = parts[at], parts[at + TOGETHER * LANES]
        if k < _ORDERS:
            highest = max(highest, of_sums * of_sums + of_differences * of_differences)
            continue
        place = ((count + 2 * (k - _ORDERS)) * rows + s) * LANES + lane
        here, there = signals[place] - mean, signals[place + rows * LANES] - mean
        difference = max(difference, abs(here - of_sums - of_differences), abs(there - of_sums + of_differences))
    variance = deviations / (2.0 * math.pi)
    size = abs(mean) if flags & FLAG_SQUARES else math.sqrt(mean * mean + variance)
    return (_GROWTH * math.sqrt(highest) + difference) / size if variance > 0.0 and size > 0.0 else math.inf


@subroutine()
def take_turns(work, sums, n, rows):
    """Fill the errors of all rows of the live designs, which are their tails; count the angles of comparison."""
    for s in range(rows):
        for j in range(n):
            work.estimates[s * CHUNK + j] = sums.tails[s * PANEL_CAPACITY + work.live[j]]
    for j in range(n):
        work.bounds[bounds.TOTAL + j] += CHECKS


@subroutine()
def choose_next_counts(b, panels, n, live, tolerance, todo):
    """Keep the designs live whose error more nodes lower to the tolerance; leave others to the adaptive rule.

    Return the number of live designs, which is that of their panels. Errors fall like a power of the number of nodes.
    """
    left = 0
    for j in range(n):
        if b[bounds.IMPROVABLE + j] == 0.0:
            continue
        i, worst = live[j], b[bounds.WORST + j]
        needed = panels[COUNT + i] * math.log(tolerance) / math.log(worst) if worst < 1.0 else math.inf
        count = 0
        for more in COUNTS:
            is_next = count == 0 and more > panels[COUNT + i] and more >= _HOPE * needed
            count = more if is_next else count
        if count == 0:
            leave_panel(panels, i)
            continue
        panels[COUNT + i] = float(count)
        live[left] = todo[left] = i
        left += 1
    return left
