"""Which designs a page holds: all of them, or every Pareto-optimal one and an evenly drawn part of the others."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from explore.ranking.rankings import Ranking
from explore.store.results import Results

#: Designs that a page holds at most; from here on it is drawn from them.
MOST = 100_000
#: Of a larger file: Pareto-optimal designs, other feasible ones and infeasible ones.
MOST_FRONT, MOST_FEASIBLE, MOST_INFEASIBLE = 50_000, 40_000, 10_000
#: The same file gives the same page.
_SEED = 1

INFEASIBLE, FEASIBLE, FRONT = range(3)


@dataclass(frozen=True)
class Part:
    """How many designs of one kind there are, and how many of them the page holds."""

    kind: int
    there: int
    held: int


@dataclass(frozen=True)
class Rows:
    """The designs of a page.

    Attributes
    ----------
    numbers
        Of the designs, ascending, shape (n,).
    kinds
        INFEASIBLE, FEASIBLE or FRONT, shape (n,).
    parts
        What they are drawn from, by kind.
    """

    numbers: npt.NDArray[np.int64]
    kinds: npt.NDArray[np.uint8]
    parts: tuple[Part, ...]


def choose_rows(results: Results, ranking: Ranking | None) -> Rows:
    """The designs of a page; `ranking` is that of the study's own objectives, None where it has none."""
    numbers, kinds = _all_kinds(results, ranking)
    members = [np.flatnonzero(kinds == kind) for kind in (INFEASIBLE, FEASIBLE, FRONT)]
    held = members
    if len(numbers) > MOST:
        random = np.random.default_rng(_SEED)
        limits = (MOST_INFEASIBLE, MOST_FEASIBLE, MOST_FRONT)
        held = [_drawn(random, places, most) for places, most in zip(members, limits, strict=True)]
    places = np.sort(np.concatenate(held))
    parts = tuple(Part(kind, len(members[kind]), len(held[kind])) for kind in (INFEASIBLE, FEASIBLE, FRONT))
    return Rows(numbers[places], kinds[places], parts)


def _all_kinds(results: Results, ranking: Ranking | None) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.uint8]]:
    """Numbers and kinds of all designs that are there, 9 bytes each."""
    numbers, kinds = [np.empty(0, np.int64)], [np.empty(0, np.uint8)]
    for columns in results.blocks(["design", "feasible"]):
        numbers.append(columns["design"])
        kinds.append(columns["feasible"].astype(np.uint8))
    found, kind = np.concatenate(numbers), np.concatenate(kinds)
    if ranking is not None:
        kind[np.searchsorted(found, ranking.frame.index.to_numpy())] = FRONT
    return found, kind


def _drawn(random: np.random.Generator, places: npt.NDArray[np.int64], most: int) -> npt.NDArray[np.int64]:
    """So many of the places, each with the same chance."""
    return places if len(places) <= most else random.choice(places, most, replace=False, shuffle=False)
