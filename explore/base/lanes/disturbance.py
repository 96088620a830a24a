"""Factors that disturb operations: how a result changes by them tells how it changes by rounding errors.

Each operation of a calculation is multiplied by 1 + m DISTURBANCE, m a random number of mean 0 and mean square 1. The
change of the result, over DISTURBANCE, is the sum of the amplifications of all operations, each times its m. Its square
has the sum of their squares as mean over many m, whatever terms cancel and however the operations depend on each other
(D. S. Parker, Monte Carlo Arithmetic, 1997; here with a disturbance that is large beside rounding, so that one
calculation is enough). The m are not all of one size, because equal amplifications would cancel in half of all pairs.
"""

import numpy as np
import numpy.typing as npt

from explore.base.subroutines import subroutine

#: Relative change of an operation: large beside rounding, small beside what separates a design from its limits.
DISTURBANCE = 2.0**-40
#: Change of a disturbed half-tangent over that of an operation; all of a panel may be off together by 4 units.
OF_TANGENTS = 4.0
#: Number of operations after which the factors of one node repeat.
PERIOD = 128
#: Distance of the first factor of a node from that of the node before; odd, so that PERIOD nodes have different ones.
STEP = 37
#: Least and greatest size of a number m, before their mean square is made 1.
_SIZES = (0.6, 1.35)


def _numbers(rng: np.random.Generator, count: int) -> npt.NDArray[np.float64]:
    """Numbers of random signs and sizes, half of them of each sign."""
    sizes = rng.uniform(*_SIZES, count)
    return rng.permutation(np.repeat([-1.0, 1.0], count // 2)) * sizes / np.sqrt((sizes * sizes).mean())


#: Factors of the operations of all nodes; see `first_factor`.
FACTORS = 1.0 + DISTURBANCE * _numbers(np.random.default_rng(1), 2 * PERIOD)


@subroutine(inlined=True)
def first_factor(node):
    """Position in FACTORS of the first of the PERIOD factors of a node."""
    return STEP * node % PERIOD
