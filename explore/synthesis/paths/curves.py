"""Coupler curves of many shapes, by points at equal steps of their length."""

import numpy as np

from explore.base.compiling import compiled
from explore.base.subroutines import subroutine


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

    Shapes of linkages, (n, 6), and their branches, (n,); unit vectors of the crank, a row a way to lay, (m, k); points
    of the path less their mean, (k,). `best` and `errors` receive the row that fits best, and the sum of squares that
    it leaves, (n,).
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


@subroutine()
def _angle_at(place, lengths):
    """The crank angle at a place along a curve, a share of the length that may lie beyond 1."""
    turns, n = np.floor(place), len(lengths) - 1
    along = (place - turns) * lengths[n]
    low, high = 0, n
    while high - low > 1:
        middle = (low + high) // 2
        if lengths[middle] <= along:
            low = middle
        else:
            high = middle
    share = (along - lengths[low]) / (lengths[high] - lengths[low] + 1e-300)
    return 2.0 * np.pi * ((low + share) / n + turns)


@subroutine()
def _fit_of_part(curve, place, step, path, images):
    """Fill how much of a path's square a part of a curve meets: as it is, mirrored, reversed, and both."""
    n, count = len(curve), len(path)
    total_x, total_y, square = 0.0, 0.0, 0.0
    xx, yy, xy, yx, back_xx, back_yy, back_xy, back_yx = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(count):
        position = place + k * step
        whole = int(position)
        share = position - whole
        point = curve[whole % n] * (1.0 - share) + curve[(whole + 1) % n] * share
        x, y, to, back = point.real, point.imag, path[k], path[count - 1 - k]
        total_x, total_y, square = total_x + x, total_y + y, square + x * x + y * y
        xx, yy, xy, yx = xx + x * to.real, yy + y * to.imag, xy + x * to.imag, yx + y * to.real
        back_xx, back_yy = back_xx + x * back.real, back_yy + y * back.imag
        back_xy, back_yx = back_xy + x * back.imag, back_yx + y * back.real
    scale = 1.0 / (square - (total_x * total_x + total_y * total_y) / count + 1e-300)
    images[0] = ((xx + yy) ** 2 + (yx - xy) ** 2) * scale
    images[1] = ((xx - yy) ** 2 + (yx + xy) ** 2) * scale
    images[2] = ((back_xx + back_yy) ** 2 + (back_yx - back_xy) ** 2) * scale
    images[3] = ((back_xx - back_yy) ** 2 + (back_yx + back_xy) ** 2) * scale


@compiled(
    "void(complex128[:,::1], float64[:,::1], complex128[::1], float64[::1], int64, float64, float64[::1],"
    " int64[:,::1])",
    allocates=True,
)
def lay_parts(curves, lengths, path, shares, n_starts, least_span, best, chosen):
    """Lay parts of curves over an open path by the best similarity.

    The curves and lengths are as `step_paths` fills them, the path points at equal steps of its length, less their
    mean, (k,). `shares` are parts of the length, of each of which so many starts are tried, and the crank turns at
    least by `least_span`, rad, over a part. `best` receives how much of the path's square is met, (n,), -1 where no
    part turns the crank so far, and `chosen` the numbers of share, start and image, (n, 3): as it is, mirrored,
    reversed, both.
    """
    images, n = np.empty(4), curves.shape[1]
    for i in range(len(curves)):
        best[i] = -1.0
        for number in range(len(shares)):
            for start in range(n_starts):
                first = start / n_starts
                if least_span > 0.0:
                    span = _angle_at(first + shares[number], lengths[i]) - _angle_at(first, lengths[i])
                    if span < least_span:
                        continue
                _fit_of_part(curves[i], first * n, shares[number] * n / (len(path) - 1), path, images)
                for image in range(4):
                    if images[image] > best[i]:
                        best[i] = images[image]
                        chosen[i, 0], chosen[i, 1], chosen[i, 2] = number, start, image
