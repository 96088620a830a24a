"""The smallest root of a function of one number, for many designs at once: brackets, corners and dips that touch 0."""

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from explore.model.quantities import FloatArray

#: Largest error, relative to the prescribed value or to 1, of a metric that touches the value without crossing it.
TOUCHING_TOLERANCE = 1e-12
#: Largest relative error where it crosses the value, as it changes from double to double beside a flattened loop.
_CROSSING_TOLERANCE = 1e-9
#: Tolerances of the last bit, so that equal designs get equal lengths whatever the iterations.
_TOLERANCES: Any = {"xatol": 0.0, "xrtol": 4.0 * np.finfo(float).eps, "fatol": 0.0, "frtol": 0.0}

#: Numbers of designs.
Indices = npt.NDArray[np.intp]
#: Function of numbers and of the designs that they belong to, NaN where it has no value.
Difference = Callable[..., FloatArray]


def first_root(
    difference: Difference, lengths: FloatArray, differences: FloatArray, designs: Indices, scale: float
) -> FloatArray:
    """Smallest root of each design's difference within a scan; NaN where there is none.

    Where the difference jumps from one sign to the other, or a dip of its size does not reach 0, there is no root, and
    the next change of sign or dip is tried.
    """
    differences = np.where(np.abs(differences) <= TOUCHING_TOLERANCE * scale, 0.0, differences)
    roots, first, order = np.full(len(designs), np.nan), np.zeros(len(designs), int), np.arange(len(lengths))[:, None]
    todo = np.arange(len(designs))
    while len(todo):
        rest = np.where(order >= first[todo], differences[:, todo], np.nan)
        signs = np.sign(rest)
        starts = signs[1:] * signs[:-1] <= 0.0
        starts[:-1] |= _dips(np.abs(rest), signs)
        at, has_start = starts.argmax(axis=0), starts.any(axis=0)
        todo, at, rest = todo[has_start], at[has_start], rest[:, has_start]
        if len(todo):
            near = np.where(order <= at + 2, rest, np.nan)
            roots[todo] = smallest_root(difference, lengths[:, todo], near, designs[todo], scale)
            first[todo] = at + 1
            todo = todo[np.isnan(roots[todo])]
    return roots


def smallest_root(
    difference: Difference, lengths: FloatArray, differences: FloatArray, designs: Indices, scale: float
) -> FloatArray:
    """Smallest root of each design's difference within a scan, where it is smooth; NaN where there is none."""
    from scipy.optimize.elementwise import find_root

    differences[np.abs(differences) <= TOUCHING_TOLERANCE * scale] = 0.0
    sign_changes = np.sign(differences[1:]) * np.sign(differences[:-1]) <= 0.0
    at, has_change = sign_changes.argmax(axis=0), np.asarray(sign_changes.any(axis=0))
    columns = np.arange(len(designs))
    left = np.where(has_change, lengths[at, columns], np.nan)
    right = np.where(has_change, lengths[at + 1, columns], np.nan)
    roots, dip_left, dip_right = _dip(difference, lengths, differences, designs, left, scale)
    left, right = np.where(np.isnan(dip_left), left, dip_left), np.where(np.isnan(dip_right), right, dip_right)
    for length, at_length in ((left, differences[at, columns]), (right, differences[at + 1, columns])):
        hit = np.isnan(roots) & np.isnan(dip_left) & has_change & (at_length == 0.0)
        roots[hit] = length[hit]
    rows = np.flatnonzero(np.isnan(roots) & np.isfinite(left))
    if len(rows):
        root = find_root(difference, (left[rows], right[rows]), args=(designs[rows],), tolerances=_TOLERANCES)
        roots[rows] = np.where(np.abs(root.f_x) <= _CROSSING_TOLERANCE * scale, root.x, np.nan)
    return roots


def _dips(sizes: FloatArray, signs: FloatArray) -> npt.NDArray[np.bool_]:
    """Whether each length but the first and the last has a smaller difference than its neighbours, of one sign."""
    is_one_sign = (signs[1:-1] == signs[:-2]) & (signs[1:-1] == signs[2:])
    return np.asarray(is_one_sign & (sizes[1:-1] <= sizes[:-2]) & (sizes[1:-1] < sizes[2:]))


def _dip(
    difference: Difference,
    lengths: FloatArray,
    differences: FloatArray,
    designs: Indices,
    change: FloatArray,
    scale: float,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The minimum of the difference's size before the first change of sign: a root there, or two lengths around one.

    Root, left and right length are of shape (n,), NaN where there is none.
    """
    from scipy.optimize.elementwise import find_minimum

    root, left, right = (np.full(len(designs), np.nan) for _ in range(3))
    signs = np.sign(differences)
    dips = _dips(np.abs(differences), signs) & ~(lengths[2:] > change)
    rows = np.flatnonzero(dips.any(axis=0))
    if len(rows) == 0:
        return root, left, right
    at = dips.argmax(axis=0)[rows]

    def distance(length: FloatArray, design: Indices, sign: FloatArray) -> FloatArray:
        return sign * difference(length, design)

    nearest = find_minimum(
        distance,
        (lengths[at, rows], lengths[at + 1, rows], lengths[at + 2, rows]),
        args=(designs[rows], signs[at, rows]),
        tolerances=_TOLERANCES,
    )
    root[rows] = np.where(np.abs(nearest.f_x) <= TOUCHING_TOLERANCE * scale, nearest.x, np.nan)
    crosses = nearest.f_x < 0.0
    left[rows], right[rows] = np.where(crosses, lengths[at, rows], np.nan), np.where(crosses, nearest.x, np.nan)
    return root, left, right
