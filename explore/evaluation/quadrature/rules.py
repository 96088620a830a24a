"""Gauss-Legendre rules: nodes and weights of all node counts that the panels can use."""

from functools import cache
from importlib.resources import files

import numpy as np
import numpy.typing as npt

#: Node counts that have a rule. Rounding up to the next one adds at most 10 % of nodes.
NODE_COUNTS = (*range(4, 41), *range(44, 81, 4), *range(88, 161, 8), *range(176, 321, 16))

LARGEST_NODE_COUNT = NODE_COUNTS[-1]


@cache
def gauss_legendre_rules() -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], npt.NDArray[np.float64]]:
    """All Gauss-Legendre rules in one table, with the size and the first row of the rule for each number of nodes.

    Entry n of the sizes and of the rows, (LARGEST_NODE_COUNT + 1,), is the smallest node count with a rule that is at
    least n, and the first row of the rule with n nodes. The table (rows, 3) has the non-negative nodes, descending, the
    weights, and the normalized Legendre polynomial of order n - 1. It was computed with 40 digits by
    ``tests/reference/make_gauss_legendre.py`` and rounded once. At these sizes the weights of numpy and scipy lose up
    to six digits near the ends.
    """
    with files("explore").joinpath("data/gauss_legendre.npy").open("rb") as stream:
        rules = np.load(stream, allow_pickle=False)
    table = np.column_stack([rules, np.empty(len(rules))])
    size_of = np.zeros(LARGEST_NODE_COUNT + 1, dtype=np.int64)
    row_of = np.zeros(LARGEST_NODE_COUNT + 1, dtype=np.int64)
    row, low = 0, 0
    for size in NODE_COUNTS:
        size_of[low : size + 1] = size
        row_of[size] = row
        nodes, weights = table[row : row + (size + 1) // 2, :2].T
        table[row : row + (size + 1) // 2, 2] = _last_polynomial(nodes, weights)
        row, low = row + (size + 1) // 2, size + 1
    return size_of, row_of, table


def _last_polynomial(nodes: npt.NDArray[np.float64], weights: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """sqrt(N - 1/2) P_{N-1} at the non-negative nodes of a rule of N nodes, descending.

    There w = 2 (1 - x^2)/(N P_{N-1})^2, and P_{N-1} changes its sign from node to node.
    """
    size = 2 * len(nodes) - int(nodes[-1] == 0.0)
    signs = np.where(np.arange(len(nodes)) % 2 == 0, 1.0, -1.0)
    return np.asarray(signs * np.sqrt((2.0 * size - 1.0) * (1.0 - nodes) * (1.0 + nodes) / weights) / size)
