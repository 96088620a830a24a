"""Make `explore/data/nine_points.npz`: all solutions of two generic problems of nine points.

A random linkage gives a problem with one solution. Its parameters are led around random triangles, which takes known
solutions to others of the same problem, until ten rounds find no new one. The number of classes that remains, 1442, is
that of Wampler, Morgan and Sommese (1992); the second problem starts from another random linkage. From some linkages a
round or two short of it no new one comes (seed 11 stops at 1441).

Run from the folder of the project: python tests/reference/make_nine_points.py
"""

import sys
from pathlib import Path

import numpy as np

from explore.synthesis.nine_points.classes import distinct, is_degenerate, residuals
from explore.synthesis.nine_points.homotopy import follow

QUIET = 10


def random_linkage(rng):
    """A random complex solution, and parameters of a problem that it solves."""
    while True:
        z = np.exp(2j * np.pi * rng.random(8)) * rng.uniform(0.6, 1.5, 8)
        x, xh, a, ah, y, yh, b, bh = z
        parameters = np.empty(16, dtype=np.complex128)
        for j in range(8):
            turn = np.exp(2j * np.pi * rng.random()) * rng.uniform(0.6, 1.5)
            g, gh = turn - 1, 1 / turn - 1
            # Both equations: -d dh + l d + m dh + n = 0. Their difference is linear in d and dh.
            l1, m1, n1 = ah - xh - xh * gh, a - x - x * g, ah * x * g + a * xh * gh
            l2, m2, n2 = bh - yh - yh * gh, b - y - y * g, bh * y * g + b * yh * gh
            ld, md, nd = l1 - l2, m1 - m2, n1 - n2
            d = np.roots([ld / md, nd / md + l1 - m1 * ld / md, n1 - m1 * nd / md])[rng.integers(2)]
            parameters[j], parameters[8 + j] = d, -(ld * d + nd) / md
        # Plain and hatted numbers scale independently.
        for o in (0, 1):
            size = np.abs(parameters[8 * o : 8 * o + 8]).mean()
            parameters[8 * o : 8 * o + 8] /= size
            z[o::2] /= size
        if np.abs(parameters).max() < 4 and np.abs(parameters).min() > 0.1:
            return z, parameters


def find_classes(seed, report=print):
    """Solutions of all classes of a random problem, its parameters, and the number of classes after each round."""
    rng = np.random.default_rng(seed)
    solution, start = random_linkage(rng)
    solutions, history = solution[None], []
    while len(history) <= QUIET or history[-1] > history[-1 - QUIET]:
        corners = (rng.normal(size=(2, 16)) + 1j * rng.normal(size=(2, 16))) * np.sqrt(0.5)
        moved = solutions
        for first, second in ((start, corners[0]), (corners[0], corners[1]), (corners[1], start)):
            moved, arrived = follow(moved, first, second - first, 3e-4, 3000, 1e-9)
            moved = moved[arrived & ~is_degenerate(moved, 1e-7)]
        both = np.concatenate([solutions, moved[residuals(moved, start) < 1e-9]])
        solutions = both[distinct(both)]
        history.append(len(solutions))
        report(f"round {len(history)}: {len(solutions)} classes")
    return solutions, start, history


if __name__ == "__main__":
    arrays = {}
    for number, seed in enumerate((12, 13)):
        arrays[f"solutions_{number}"], arrays[f"parameters_{number}"], _ = find_classes(seed)
    target = Path(sys.argv[1] if len(sys.argv) > 1 else "explore/data/nine_points.npz")
    np.savez(target, **arrays)
