"""Constraints near a design: steps along them, and the way back for designs that broke one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from explore.analysis.refining.members import Members, Rows
from explore.model.quantities import FloatArray

#: Number of times that a design may come back.
RETURNS = 2
#: Range of the power of 10 that is the share of its way by which a returning design stays behind the constraint.
BEHIND_POWERS = (-6.0, -3.0)


@dataclass(frozen=True)
class Outside:
    """Designs that break a constraint, their parents, and how many times each has come back."""

    members: Members
    parents: Members
    returns: npt.NDArray[np.int64]

    def take(self, rows: Rows) -> Outside:
        """Some of the designs, by a mask, a slice or by row."""
        return Outside(self.members.take(rows), self.parents.take(rows), self.returns[rows])

    def returnable(self) -> Outside:
        """The designs that break a constraint and did not return too often."""
        members, parents = self.members, self.parents
        return self.take(
            (self.returns < RETURNS)
            & (members.choices == parents.choices).all(axis=1)
            & np.isfinite(members.margins).all(axis=1)
            & (members.margins < 0.0).any(axis=1)
        )


def learned_gradients(before: Members, after: Members) -> FloatArray:
    """Gradients that explain how the margins changed from one position to the next: Broyden's update, row by row."""
    steps = after.positions - before.positions
    change = after.margins - before.margins - np.einsum("nkd,nd->nk", before.gradients, steps)
    lengths = (steps**2).sum(axis=1)
    is_known = np.isfinite(change) & (lengths > 0.0)[:, None]
    factors = np.where(is_known, change / np.where(lengths > 0.0, lengths, 1.0)[:, None], 0.0)
    return np.asarray(before.gradients + factors[:, :, None] * steps[:, None, :])


def along_constraints(steps: FloatArray, parents: Members) -> FloatArray:
    """The steps without their parts across the constraints that they can reach, taken out one after the other."""
    lengths = np.linalg.norm(steps, axis=1)
    for k in range(parents.margins.shape[1]):
        gradient, margin = parents.gradients[:, k], parents.margins[:, k]
        size = np.linalg.norm(gradient, axis=1)
        is_near = (size > 0.0) & (margin < size * lengths)
        normal = np.where(is_near, 1.0 / np.where(is_near, size, 1.0), 0.0)[:, None] * gradient
        steps = steps - (steps * normal).sum(axis=1, keepdims=True) * normal
    return steps


def return_positions(generator: np.random.Generator, outside: Outside) -> FloatArray:
    """Positions inside the constraints, next to the designs that broke them.

    They are straight back along the gradient of the margin that needs the longest way; or, where this way is longer
    than that to the parent, between parent and design, where the secants of the margins meet the first constraint.
    """
    behind = 10.0 ** generator.uniform(*BEHIND_POWERS, len(outside.members))
    members, parents = outside.members, outside.parents
    rows = np.arange(len(members))
    with np.errstate(divide="ignore", invalid="ignore"):  # a gradient of 0 gives no straight way
        ways = np.where(members.margins < 0.0, parents.margins / (parents.margins - members.margins), 1.0)
        squares = (members.gradients**2).sum(axis=2)
        needed = np.where(members.margins < 0.0, -members.margins / squares, 0.0)  # times the gradient
        hardest = (needed * np.sqrt(squares)).argmax(axis=1) if members.margins.shape[1] else rows
        straight = ((1.0 + behind) * needed[rows, hardest])[:, None] * members.gradients[rows, hardest]
        is_short = np.linalg.norm(straight, axis=1) < np.linalg.norm(members.positions - parents.positions, axis=1)
    way = ways.min(axis=1, initial=1.0) * (1.0 - behind)
    secant = parents.positions + way[:, None] * (members.positions - parents.positions)
    return np.asarray(np.where(is_short[:, None], np.clip(members.positions + straight, 0.0, 1.0), secant))
