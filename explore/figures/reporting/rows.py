"""The designs of a page: all, or of large files the Pareto-optimal ones and a uniform sample of the others."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from explore.results.store.results import Results

#: Largest number of designs of which a page holds all.
MAX_DESIGNS = 100_000
#: Largest number of Pareto-optimal designs of a larger file.
MAX_FRONT = 50_000
#: Largest number of other feasible designs of a larger file.
MAX_FEASIBLE = 40_000
#: Largest number of infeasible designs of a larger file.
MAX_INFEASIBLE = 10_000
#: Seed of the draw, fixed so that the same file gives the same page.
_SEED = 1

INFEASIBLE, FEASIBLE, FRONT = range(3)


@dataclass(frozen=True)
class KindCount:
    """Number of designs of one kind in the file (`total`) and on the page (`held`)."""

    kind: int
    total: int
    held: int


@dataclass(frozen=True)
class ReportRows:
    """The ascending numbers of the designs of a page, the kind of each, and the counts of each kind."""

    numbers: npt.NDArray[np.int64]
    kinds: npt.NDArray[np.uint8]
    parts: tuple[KindCount, ...]


def choose_rows(
    results: Results, front: npt.NDArray[np.int64], named: Sequence[int] = (), *, shares: int = 1
) -> ReportRows:
    """Choose the designs of a page that so many results share, from the Pareto-optimal ones and the others.

    No sample leaves out the infeasible designs that the page names.
    """
    numbers, kinds = _all_kinds(results, front)
    members = [np.flatnonzero(kinds == kind) for kind in (INFEASIBLE, FEASIBLE, FRONT)]
    on_page = members
    if len(numbers) > MAX_DESIGNS // shares:
        random = np.random.default_rng(_SEED)
        limits = (MAX_INFEASIBLE // shares, MAX_FEASIBLE // shares, MAX_FRONT // shares)
        always = np.searchsorted(numbers, np.sort(np.asarray(named, dtype=np.int64)))
        on_page = [_sample(random, places, most) for places, most in zip(members, limits, strict=True)]
        on_page[INFEASIBLE] = np.union1d(on_page[INFEASIBLE], always)
    places = np.sort(np.concatenate(on_page))
    parts = tuple(KindCount(kind, len(members[kind]), len(on_page[kind])) for kind in (INFEASIBLE, FEASIBLE, FRONT))
    return ReportRows(numbers[places], kinds[places], parts)


def _all_kinds(results: Results, front: npt.NDArray[np.int64]) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.uint8]]:
    """Numbers and kinds of all committed designs, shape (n,); 9 bytes each."""
    numbers, kinds = [np.empty(0, np.int64)], [np.empty(0, np.uint8)]
    for columns in results.blocks(["design", "feasible"]):
        numbers.append(columns["design"])
        kinds.append(columns["feasible"].astype(np.uint8))
    all_numbers, all_kinds = np.concatenate(numbers), np.concatenate(kinds)
    all_kinds[np.searchsorted(all_numbers, front)] = FRONT
    return all_numbers, all_kinds


def _sample(random: np.random.Generator, places: npt.NDArray[np.int64], most: int) -> npt.NDArray[np.int64]:
    """A uniform sample of at most `most` places."""
    return places if len(places) <= most else random.choice(places, most, replace=False, shuffle=False)
