"""Whether a linkage assembles at every crank angle of a turn or an interval, from values at nodes of it.

The factors of all joints must stay positive: in a cell between two nodes they are if the least Bernstein coefficients
of their cubics exceed what these may miss. Cells that this does not decide are halved.

Rows of the values of a node: the factors, and behind them squares of distances that must not vanish at complex angles
either; the slopes of both by the angle; and the sizes of the terms of the factors.
"""

from explore.base.compiling import LANES, compiled
from explore.base.subroutines import subroutine
from explore.mechanisms.linkages.cells import NODES, SAFETY, copy_cell, exceeds, halve_cell, least, missed

#: Verdict on a design that turns; -1 - s is one that is blocked at factor s.
TURNS = 1.0
#: Verdict on a design that is not decided yet.
DOUBTFUL = 0.0
#: Verdict on a design whose factor 0 is too close to tell; that of factor s is larger by s.
FIRST_TIE = 2.0
#: Rounding error of a factor, relative to the size of its terms.
ROUNDING = 1e-14
#: Narrowest cell that is halved, rad.
FINEST = 1e-7
#: Type of an array of numbers.
_F1 = "float64[::1]"


@compiled(f"int64({_F1}, int64, int64, float64, {_F1}, {_F1})", no_alias=True)
def sift(values, factors, functions, length, verdicts, work):
    """Fill the verdict of each lane from all nodes; return the number of doubtful lanes.

    `functions` is the number of factors and squares of distances; `work` has a row for each of them.
    """
    rows, width = (2 * functions + factors) * LANES, length / (2.0 * (NODES - 1))
    for lane in range(LANES):
        verdicts[lane] = TURNS
    for k in range(factors * LANES):
        work[k] = 1.0
    for cell in range(2 * (NODES - 1)):
        j = cell + cell // (NODES - 1)
        before = j - 1 if j % NODES > 0 else j
        after = j + 2 if j % NODES < NODES - 2 else j + 1
        counts_left, counts_right = 1.0 if before < j else 0.0, 1.0 if after > j + 1 else 0.0
        # all factors in one loop
        f0, f1 = values[j * rows :], values[(j + 1) * rows :]
        d0, d1 = f0[functions * LANES :], f1[functions * LANES :]
        fl, fr = values[before * rows :], values[after * rows :]
        dl, dr = fl[functions * LANES :], fr[functions * LANES :]
        size = f0[2 * functions * LANES :]
        for k in range(factors * LANES):
            left = counts_left * missed(fl[k], f1[k], dl[k], d1[k], 2.0 * width, f0[k])
            right = counts_right * missed(f0[k], fr[k], d0[k], dr[k], 2.0 * width, f1[k])
            low = least(f0[k], f1[k], d0[k], d1[k], width)
            sure = low - SAFETY / 16.0 * (left if left > right else right) > ROUNDING * size[k]
            work[k] = work[k] if sure else 0.0
    for s in range(factors):
        sure = work[s * LANES :]
        for lane in range(LANES):
            verdicts[lane] = verdicts[lane] if sure[lane] == 1.0 else DOUBTFUL
    if _count_doubtful(verdicts) == 0:
        return 0
    for s in range(factors - 1, -1, -1):
        for j in range(2 * NODES):
            value, size = values[j * rows + s * LANES :], values[j * rows + (2 * functions + s) * LANES :]
            for lane in range(LANES):
                verdicts[lane] = verdicts[lane] if value[lane] >= -ROUNDING * size[lane] else -1.0 - s
    return _count_doubtful(verdicts)


@subroutine()
def _count_doubtful(verdicts):
    doubtful = 0
    for lane in range(LANES):
        doubtful += 1 if verdicts[lane] == DOUBTFUL else 0
    return doubtful


@compiled(f"Tuple((int64, float64))({_F1}, int64, int64, int64, int64, {_F1}, {_F1})")
def halve_doubtful(cells, factors, functions, waiting, taken, middles, children):
    """Replace the last cells by those halves that are not decided; return their number and the verdict."""
    size, n_children, first = 2 + 4 * factors, 0, waiting - taken
    for q in range(taken):
        cell = cells[(first + q) * size :]
        for s in range(factors):
            if not middles[s * LANES + q] >= -ROUNDING * middles[(2 * functions + s) * LANES + q]:
                return 0, -1.0 - s
        for side in range(2):
            child, doubt = children[n_children * size :], -1
            halve_cell(cell, factors, functions, middles, q, side, child)
            for s in range(factors):
                tiny = ROUNDING * middles[(2 * functions + s) * LANES + q]
                if not exceeds(cell, child, factors, s, 1.0, middles[s * LANES + q], tiny):
                    doubt = s if doubt < 0 else doubt
            if doubt >= 0:
                if child[1] < FINEST:
                    return 0, FIRST_TIE + doubt
                n_children += 1
    for k in range(n_children):
        copy_cell(children, k, cells, first + k, size)
    return first + n_children, DOUBTFUL
