"""Make `explore/data/pivot_points.npz`: all solutions of generic problems of points with prescribed pivots.

As in `make_nine_points.py`, but two points less for each pivot. The number of solutions through five points with both
pivots, 36, is that of A. P. Morgan and C. W. Wampler, Solving a planar four-bar design problem using continuation, J.
Mech. Des. 112 (1990) 544-550. Through seven points with one pivot there are 486, two cognates to each of 243 curves,
from every linkage that was tried.

Run from the folder of the project: python tests/reference/make_pivot_points.py
"""

import sys
from pathlib import Path

import numpy as np
from make_nine_points import random_linkage

from explore.synthesis.nine_points.classes import is_degenerate
from explore.synthesis.nine_points.homotopy import follow
from explore.synthesis.nine_points.pivots import distinct_rows
from explore.synthesis.nine_points.tracking import ARRIVED, FATE

QUIET = 8


def prescribed(z, parameters, n_vectors):
    """Parameters with the pivots of a solution in the place of points, and which of them are used."""
    changed, used = parameters.copy(), np.zeros(16, dtype=bool)
    changed[n_vectors:8] = changed[8 + n_vectors :] = 0
    used[:n_vectors] = used[8 : 8 + n_vectors] = True
    for place in range(n_vectors, 8, 2):
        pivot = 2 if place == 6 else 6
        changed[place], changed[8 + place] = z[pivot], z[pivot + 1]
        used[[place, 8 + place]] = True
    return changed, used


def find_solutions(seed, n_vectors, report=print):
    """All solutions of a random problem, its parameters, and the number of solutions after each round."""
    rng = np.random.default_rng(seed)
    z, parameters = random_linkage(rng)
    start, used = prescribed(z, parameters, n_vectors)
    solutions, history = z[None], []
    while len(history) <= QUIET or history[-1] > history[-1 - QUIET]:
        corners = (rng.normal(size=(2, 16)) + 1j * rng.normal(size=(2, 16))) * np.sqrt(0.5) * used
        moved = solutions
        for first, second in ((start, corners[0]), (corners[0], corners[1]), (corners[1], start)):
            moved, facts = follow(moved, first, second - first, 1e-4, 3000, 1e-9, n_vectors)
            moved = moved[(facts[:, FATE] == ARRIVED) & ~is_degenerate(moved, 1e-7)]
        both = np.concatenate([solutions, moved])
        solutions = both[distinct_rows(both)]
        history.append(len(solutions))
        report(f"round {len(history)}: {len(solutions)} solutions")
    return solutions, start, history


if __name__ == "__main__":
    arrays = {}
    for n_vectors in (4, 6):
        for number, seed in enumerate((1, 2)):
            name = f"{n_vectors + 1}_{number}"
            arrays[f"solutions_{name}"], arrays[f"parameters_{name}"], _ = find_solutions(seed, n_vectors)
    target = Path(sys.argv[1] if len(sys.argv) > 1 else "explore/data/pivot_points.npz")
    np.savez(target, **arrays)
