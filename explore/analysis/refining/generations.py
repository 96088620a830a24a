"""Generations of designs around a Pareto front, each drawn from the designs before it and the seed alone.

The first designs are the start: the front to refine. Each generation then has two parts. Designs of the generation
before that break a constraint come back to where its margin is almost 0. The others step from a parent on the front in
a random direction, most of them along the constraints that are near. Half of the steps have parents evenly over the
front, half in proportion to what a parent adds to the hypervolume.

Where no design of the start is feasible, those of least total violation of the constraints stand in for the front until
a generation has a feasible one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from explore.analysis.refining.coordinates import Choices, Coordinates
from explore.analysis.refining.members import Members, Rows, best_of, contributions, thinned
from explore.model.columns import Arrays
from explore.model.quantities import FloatArray
from explore.model.request import Objective
from explore.results.ranking.pareto import objectives_to_minimise

#: Column with the number of a design's parent.
PARENT = "parent"
#: Parent of a design of the start.
NO_PARENT = -1
#: Largest number of members of the front that parents are chosen among.
MOST_MEMBERS = 8192
#: Largest number of members while no design is feasible.
MOST_NEAREST = 256
#: Neighbour among the parents whose distance is the length of a step, times a power of 10.
NEIGHBOUR = 8
#: Range of the power of 10 on the length of a step.
STEP_POWERS = (-1.5, 0.3)
#: Length of a step, in place of a distance, where all parents are at one position.
FIRST_DISTANCE = 0.1
#: Share of the steps that run along constraints near by.
ALONG = 0.8
#: Share of the steps that change one of the listed values.
CHANGES = 0.1
#: Number of times that a design may come back.
RETURNS = 2
#: Range of the power of 10 that is the share of its way by which a returning design stays behind the constraint.
BEHIND_POWERS = (-6.0, -3.0)


@dataclass(frozen=True)
class Draw:
    """The designs of one generation: parameters by name and the number of each design's parent, each of shape (n,)."""

    columns: Arrays
    parents: npt.NDArray[np.int64]


class Generations:
    """Draws generations in order: `draw` gives the next one's designs, `include` takes what became of them.

    `scales` has for each margin the violation that counts as 1 in the sum of all, for a start where nothing is
    feasible. `start` has the columns of the front to refine, or of the designs of least violation, which count among
    `n_designs`. The last generation may be shorter than `size`.
    """

    def __init__(
        self,
        coordinates: Coordinates,
        objectives: Sequence[Objective],
        margins: Sequence[str],
        start: Arrays,
        scales: Sequence[float] = (),
        *,
        n_designs: int,
        size: int,
        seed: int,
    ) -> None:
        self._coordinates, self._objectives, self._margins = coordinates, tuple(objectives), tuple(margins)
        self._scales = np.array(scales)
        self._n_designs, self._size, self._seed = n_designs, size, seed
        self._start = {name: start[name] for name in coordinates.names}
        self._n_start = len(next(iter(start.values())))
        self.number = 0
        members = self._members(start, np.arange(self._n_start))
        # Whether the front is one of feasible designs.
        self._has_front = "feasible" not in start or bool((start["feasible"] != 0).all())
        self.front = thinned(best_of(members), MOST_MEMBERS) if self._has_front else members
        nobody = members.take(slice(0, 0))
        self._outside = Outside(nobody, nobody, np.zeros(0, dtype=np.int64))

    @property
    def count(self) -> int:
        """Number of generations."""
        return -(-self._n_designs // self._size)

    @property
    def needed_columns(self) -> list[str]:
        """Names of the columns that `include` reads."""
        objectives = (objective.metric for objective in self._objectives)
        return list(dict.fromkeys([*self._coordinates.names, *objectives, *self._margins, "feasible", PARENT]))

    def draw(self) -> Draw:
        """Draw the designs of the next generation; the same ones each time."""
        first = self.number * self._size
        n = min(self._size, self._n_designs - first)
        start = {name: values[first : first + n] for name, values in self._start.items()}
        n_start = min(max(self._n_start - first, 0), n)
        n -= n_start
        generator = np.random.default_rng(np.random.SeedSequence(self._seed, spawn_key=(self.number,)))
        back = self._outside.take(slice(0, n))
        steps, choices, parents = self._steps(generator, n - len(back.members))
        drawn = self._coordinates.columns(
            np.concatenate([return_positions(generator, back), steps]), np.concatenate([back.members.choices, choices])
        )
        return Draw(
            {name: np.concatenate([start[name], drawn[name]]) for name in start},
            np.concatenate([np.full(n_start, NO_PARENT), back.parents.designs, parents]),
        )

    def include(self, columns: Arrays) -> None:
        """Take the evaluated designs of the next generation: its columns, with `PARENT` and ``feasible``."""
        designs = self.number * self._size + np.arange(len(columns[PARENT]))
        first = min(max(self._n_start - self.number * self._size, 0), len(designs))  # the start is known already
        members = self._members(columns, designs).take(slice(first, None))
        back = self._outside.take(slice(0, len(members)))
        order = np.argsort(self.front.designs)
        places = order[np.searchsorted(self.front.designs, columns[PARENT][first + len(back.members) :], sorter=order)]
        parents = self.front.take(places)
        members = replace(members, gradients=learned_gradients(back.members.join(parents), members))
        is_inside = (columns["feasible"][first:] != 0) & np.isfinite(members.values).all(axis=1)
        if self._has_front or is_inside.any():
            returns = np.concatenate([back.returns + 1, np.zeros(len(parents), dtype=np.int64)])
            if self._has_front:
                self._outside = Outside(members, back.parents.join(parents), returns).take(~is_inside).returnable()
            feasible = best_of(members.take(is_inside))
            self.front = thinned(best_of(self.front.join(feasible)) if self._has_front else feasible, MOST_MEMBERS)
            self._has_front = True
        else:
            self.front = self._nearest(self.front.join(members))
        self.number += 1

    def _nearest(self, members: Members) -> Members:
        """The members of least total violation; a margin that is not known counts as 0, but not all of them."""
        violations = np.fmax(-members.margins / self._scales, 0.0)
        totals = np.where(np.isfinite(members.margins).any(axis=1), np.nansum(violations, axis=1), np.inf)
        totals = np.where(totals > 0.0, totals, np.inf)  # met as far as known, and yet not feasible
        return members.take(np.lexsort((members.designs, totals))[:MOST_NEAREST])

    def _members(self, columns: Arrays, designs: npt.NDArray[np.int64]) -> Members:
        margins = [columns[name] for name in self._margins]
        positions = self._coordinates.positions(columns)
        return Members(
            designs,
            positions,
            self._coordinates.choices(columns),
            objectives_to_minimise(columns, self._objectives),
            np.stack(margins, axis=1) if margins else np.zeros((len(designs), 0)),
            np.zeros((len(designs), len(margins), positions.shape[1])),
        )

    def _steps(self, generator: np.random.Generator, n: int) -> tuple[FloatArray, Choices, npt.NDArray[np.int64]]:
        """Positions, choices and parents of so many steps from the front."""
        from scipy.spatial import cKDTree

        parents = self.front
        places = np.concatenate([parents.positions, parents.choices], axis=1)
        distances, _ = cKDTree(places).query(places, k=[min(NEIGHBOUR + 1, len(places))])
        share = contributions(parents) if self._has_front else np.ones(len(parents))
        share = 0.5 / len(share) + 0.5 * share / max(share.sum(), np.finfo(float).tiny)
        edges = np.cumsum(share / share.sum())
        marks = (np.arange(n) + generator.random()) / max(n, 1)  # systematic sampling: no parent by chance too often
        chosen = generator.permutation(np.minimum(np.searchsorted(edges, marks), len(parents) - 1))
        distances = np.where(distances > 0.0, distances, FIRST_DISTANCE)[chosen, 0]
        lengths = distances * 10.0 ** generator.uniform(*STEP_POWERS, n)
        steps = lengths[:, None] * generator.standard_normal((n, parents.positions.shape[1]))
        along = generator.random(n) < ALONG
        steps[along] = along_constraints(steps[along], parents.take(chosen[along]))
        positions = np.clip(parents.positions[chosen] + steps, 0.0, 1.0)
        return positions, self._changed(generator, parents.choices[chosen]), parents.designs[chosen]

    def _changed(self, generator: np.random.Generator, choices: Choices) -> Choices:
        """The choices, with one replaced by another value of its list in a few rows."""
        lists = self._coordinates.lists
        if not lists:
            return choices
        rows = np.flatnonzero(generator.random(len(choices)) < CHANGES)
        which = generator.integers(len(lists), size=len(rows))
        lengths = np.array([len(axis) for axis in lists])[which]
        choices = choices.copy()
        choices[rows, which] = (choices[rows, which] + generator.integers(1, lengths)) % lengths
        return choices


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
