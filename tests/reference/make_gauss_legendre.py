"""Compute explore/data/gauss_legendre.npy: the Gauss-Legendre rules of all quadrature.rules.NODE_COUNTS.

Newton's method on the three-term recurrence with 40 digits, each number rounded once to double; about a minute.
Run by hand after a change of NODE_COUNTS: ``python tests/reference/make_gauss_legendre.py``.
"""

from pathlib import Path

import mpmath
import numpy as np

import explore
from explore.evaluation.quadrature.rules import NODE_COUNTS

DIGITS = 40


def legendre(n, x):
    """P_n(x) and its derivative, |x| < 1, by the three-term recurrence."""
    previous, current = mpmath.mpf(1), x
    for k in range(2, n + 1):
        previous, current = current, ((2 * k - 1) * x * current - (k - 1) * previous) / k
    return current, n * (x * current - previous) / (x * x - 1)


def rule(n):
    """Non-negative nodes, descending, and their weights, as doubles: shape ((n + 1)//2, 2)."""
    rows = []
    with mpmath.workdps(DIGITS):
        for k in range(1, (n + 1) // 2 + 1):
            x = mpmath.mpf(0) if 2 * k == n + 1 else mpmath.cos(mpmath.pi * (4 * k - 1) / (4 * n + 2))
            for _ in range(8):
                value, slope = legendre(n, x)
                x -= value / slope
                if abs(value / slope) < mpmath.mpf(10) ** (4 - DIGITS):
                    break
            _, slope = legendre(n, x)
            rows.append((float(x), float(2 / ((1 - x * x) * slope * slope))))
    return np.array(rows)


def main():
    """Write the table."""
    table = np.concatenate([rule(n) for n in NODE_COUNTS])
    np.save(Path(explore.__file__).parent / "data" / "gauss_legendre.npy", table, allow_pickle=False)


if __name__ == "__main__":
    main()
