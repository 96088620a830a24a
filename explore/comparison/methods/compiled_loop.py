"""The loops of one design compiled: their gaps, Newton's matrix, rates and second derivatives."""

import math

import numpy as np
import numpy.typing as npt

from explore.base.compiling import compiled
from explore.base.subroutines import subroutine
from explore.comparison.methods.loop import Loop


def number_terms(loop: Loop) -> npt.NDArray[np.int64]:
    """Numbers of chain, angle and length of each term, a row each; angle -1 is the frame's, length -1 is none."""
    numbered = enumerate(loop.chains)
    return np.array(
        [[chain, *(-1 if k is None else k for k in term[:2])] for chain, terms in numbered for term in terms]
    )


# compiled for the types of the first call, which only a comparison makes
@compiled(allocates=True)
def fill_rates(which, numbers, n_angles, n_lengths, turns, given, crank_angle, unknowns, rates):
    """Fill the rates of the unknowns of one design, and return whether all are finite.

    `given` is empty, or the given length and its derivative.
    """
    m, chains = len(unknowns), len(unknowns) // 2
    turned, slid = np.ones(n_angles + turns + 1, np.complex128), np.empty(n_lengths + (len(given) > 0))
    by_angle, by_length = np.empty((chains, len(turned)), np.complex128), np.empty((chains, len(slid)), np.complex128)
    sliding, rows = np.empty(len(slid)), np.empty((m, m + 1))
    if turns:
        turned[n_angles] = unit_vector(crank_angle)
    if len(given) > 0:
        slid[n_lengths], sliding[n_lengths] = given[0], given[1]
    for k in range(n_angles):
        turned[k] = unit_vector(unknowns[k])
    slid[:n_lengths] = unknowns[n_angles:]
    add_terms(which, numbers, turned, slid, by_angle, by_length)
    fill_rate_terms(rows, by_angle, by_length, n_angles, n_lengths, turns, sliding)
    solve_rows(rows, by_angle, by_length, n_angles)
    rates[:] = rows[:, m]
    return np.isfinite(rates).all()


@subroutine()
def unit_vector(angle):
    """The unit vector at an angle."""
    return complex(math.cos(angle), math.sin(angle))


@subroutine()
def add_terms(which, numbers, turned, slid, by_angle, by_length):
    """Fill the sums of terms by angle and by length; the largest gap of a chain."""
    by_angle[:] = 0.0
    by_length[:] = 0.0
    largest = 0.0
    for k in range(len(which)):
        chain, angle, length = which[k]
        vector = numbers[k] * turned[angle]
        if length >= 0:
            by_length[chain, length] += vector
            vector *= slid[length]
        by_angle[chain, angle] += vector
    for chain in range(len(by_angle)):
        gap = abs(by_angle[chain].sum())
        if not gap <= largest:
            largest = gap
    return largest


@subroutine()
def add_right(rows, chain, value):
    """Add to both right-hand sides of a chain."""
    rows[2 * chain, -1] += value.real
    rows[2 * chain + 1, -1] += value.imag


@subroutine()
def fill_gap(rows, by_angle):
    """Fill the right-hand sides with the gaps."""
    rows[:, -1] = 0.0
    for chain in range(len(by_angle)):
        add_right(rows, chain, by_angle[chain].sum())


@subroutine()
def fill_rate_terms(rows, by_angle, by_length, n_angles, n_lengths, turns, sliding):
    """Fill the right-hand sides for the rates."""
    rows[:, -1] = 0.0
    for chain in range(len(by_angle)):
        if turns:
            add_right(rows, chain, -1j * by_angle[chain, n_angles])
        if len(sliding) > n_lengths:
            add_right(rows, chain, -by_length[chain, n_lengths] * sliding[n_lengths])


@subroutine()
def fill_acceleration_terms(rows, by_angle, by_length, carriers, turning, sliding):
    """Fill the right-hand sides for the second derivatives but for that of a given length."""
    rows[:, -1] = 0.0
    for chain in range(len(by_angle)):
        for k in range(len(turning)):
            add_right(rows, chain, turning[k] * turning[k] * by_angle[chain, k])
        for k in range(len(sliding)):
            add_right(rows, chain, -2j * turning[carriers[k]] * sliding[k] * by_length[chain, k])


@subroutine()
def solve_rows(rows, by_angle, by_length, n_angles):
    """Solve the equations of Newton's matrix in place of their right-hand sides, by elimination; its determinant."""
    m, determinant = len(rows), 1.0
    for chain in range(len(by_angle)):
        for k in range(m):
            column = 1j * by_angle[chain, k] if k < n_angles else by_length[chain, k - n_angles]
            rows[2 * chain, k], rows[2 * chain + 1, k] = column.real, column.imag
    for k in range(m):
        pivot = k
        for row in range(k + 1, m):
            if abs(rows[row, k]) > abs(rows[pivot, k]):
                pivot = row
        if pivot != k:
            determinant = -determinant
            for column in range(m + 1):
                rows[k, column], rows[pivot, column] = rows[pivot, column], rows[k, column]
        determinant *= rows[k, k]
        for row in range(k + 1, m):
            factor = rows[row, k] / rows[k, k]
            for column in range(k + 1, m + 1):
                rows[row, column] -= factor * rows[k, column]
    for k in range(m - 1, -1, -1):
        for column in range(k + 1, m):
            rows[k, m] -= rows[k, column] * rows[column, m]
        rows[k, m] /= rows[k, k]
    return determinant
