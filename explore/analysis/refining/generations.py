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

from explore.analysis.refining.constraints import Outside, along_constraints, learned_gradients, return_positions
from explore.analysis.refining.coordinates import Choices, Coordinates
from explore.analysis.refining.members import Members, best_of, contributions, thinned
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
        self._scales = np.array(scales or [1.0] * len(self._margins))
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
