"""Coupler curves of many shapes, by points at equal steps of their length."""

import numpy as np

from explore.compiling import compiled
from explore.subroutines import subroutine


@subroutine()
def _trace(shape, branch, rays, curve):
    """The coupler point at directions of the crank, with the pin of the rocker left of the diagonal for branch 1."""
    crank, coupler, rocker, ground = shape[0], shape[1], shape[2], shape[3]
    point = complex(shape[4], shape[5])
    for i in range(len(rays)):
        pin = crank * rays[i]
        diagonal = ground - pin
        square = diagonal.real * diagonal.real + diagonal.imag * diagonal.imag
        along = 0.5 * (square + (coupler - rocker) * (coupler + rocker)) / square
        across = branch * np.sqrt(max(coupler * coupler / square - along * along, 0.0))
        curve[i] = pin + point * diagonal * complex(along, across) / coupler


@subroutine()
def _step_evenly(curve, lengths, points):
    """Points at equal steps of the length of a closed curve; `lengths` receives the length up to each of its points."""
    n, m = len(curve), len(points)
    lengths[0] = 0.0
    for i in range(n):
        side = curve[(i + 1) % n] - curve[i]
        lengths[i + 1] = lengths[i] + np.sqrt(side.real * side.real + side.imag * side.imag)
    i = 0
    for k in range(m):
        place = lengths[n] * k / m
        while lengths[i + 1] < place:
            i += 1
        share = (place - lengths[i]) / (lengths[i + 1] - lengths[i] + 1e-300)
        points[k] = curve[i] * (1.0 - share) + curve[(i + 1) % n] * share


@compiled("void(float64[:,::1], complex128[::1], complex128[::1], complex128[:,::1], float64[:,::1])", allocates=True)
def step_paths(shapes, rays, scratch, points, lengths):
    """Curves of shapes, by points at equal steps of their length, (n, N_STEPS), and lengths up to each angle's
    point.
    """
    for i in range(len(shapes)):
        _trace(shapes[i], 1.0, rays, scratch)
        _step_evenly(scratch, lengths[i], points[i])


@compiled(
    "void(float64[:,::1], float64[::1], complex128[:,::1], complex128[::1], int64[::1], float64[::1])", allocates=True
)
def lay_at_angles(shapes, branches, rays, path, best, errors):
    """Lay the points of shapes at directions of the crank over those of a path by the best similarity.

    Parameters
    ----------
    shapes, branches
        Of the linkages, shapes (n, 6) and (n,).
    rays
        Unit vectors of the crank, a row a way to lay, shape (m, k).
    path
        Points less their mean, shape (k,).
    best, errors
        Receive the row that fits best, and the sum of squares that it leaves, shape (n,).
    """
    curve, energy, count = np.empty(len(path), np.complex128), 0.0, len(path)
    for i in range(count):
        energy += path[i].real * path[i].real + path[i].imag * path[i].imag
    for k in range(len(shapes)):
        errors[k] = np.inf
        for row in range(len(rays)):
            _trace(shapes[k], branches[k], rays[row], curve)
            total, inner, square = 0j, 0j, 0.0
            for i in range(count):
                total += curve[i]
                inner += path[i] * curve[i].conjugate()
                square += curve[i].real * curve[i].real + curve[i].imag * curve[i].imag
            square -= (total.real * total.real + total.imag * total.imag) / count
            left = energy - (inner.real * inner.real + inner.imag * inner.imag) / (square + 1e-300)
            if left < errors[k]:
                errors[k], best[k] = left, row
