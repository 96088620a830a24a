"""All linkages through nine points, simulated: how each passes the points, and what is complete and proved."""

from dataclasses import dataclass

import numpy as np

from explore.model.progress import ReportProgress
from explore.synthesis.defects import MISSES, PASSES, SENTENCES, Passage, find_passage
from explore.synthesis.linkages import ComplexArray, FourBar, driven_by_rocker
from explore.synthesis.nine_points.classes import N_CLASSES
from explore.synthesis.nine_points.four_bars import distance_from_real, linkages_of
from explore.synthesis.nine_points.homotopy import has_more_digits
from explore.synthesis.nine_points.solving import NinePointSolutions, find_all

#: Largest relative distance of hats from conjugates in real singular solutions, which have about six digits.
_NEARLY_REAL = 1e-5


@dataclass(frozen=True)
class FoundLinkage:
    """A linkage through the nine points.

    Its crank is the link that drives it past the points best, of two the shorter one. Number of its real solution, from
    1, and of its cognate, 0 … 2; how it passes the points; whether it is proved to exist.
    """

    linkage: FourBar
    solution: int
    cognate: int
    passage: Passage
    is_proved: bool


@dataclass(frozen=True)
class NinePointReport:
    """All linkages through nine points, the ones that pass them in order first, and the complex solutions."""

    linkages: tuple[FoundLinkage, ...]
    solutions: NinePointSolutions

    @property
    def is_complete(self) -> bool:
        """Whether it is known where all paths lead, so that no other isolated linkage passes the points."""
        return self.solutions.is_complete

    @property
    def sentence(self) -> str:
        """What was found, what of it is proved, and whether anything can be missing."""
        solutions, n_passing = self.solutions, sum(each.passage.fate == PASSES for each in self.linkages)
        lost = "are lost or lead to what is not proved" if solutions.n_unproved else "are lost"
        point = "a link that is a point" if has_more_digits() else "a link that is a point, or too short to tell"
        others = [
            (solutions.n_singular, "to singular solutions"),
            (solutions.n_degenerate, f"to linkages with {point}"),
            (solutions.n_infinite, "to infinity"),
            (solutions.n_lost, f"{lost}, so that linkages may be missing"),
        ]
        ends = "; ".join(
            [f"{solutions.certificates.n_proved:,} lead to regular solutions, all proved"]
            + [f"{n:,} {to}" for n, to in others if n]
        )
        if not solutions.is_consistent:
            ends += "; these are more than there are paths, so that linkages may be missing"
        if not solutions.is_complete and not has_more_digits():
            ends += " (with the package's extra certify they are followed with more digits)"
        return (
            f"Of {N_CLASSES:,} paths {ends}. {len(solutions.real)} regular solutions are real; with cognates "
            f"{len(self.linkages)} linkages were found, {n_passing} of which take the points in order."
        )


def find_linkages(points: ComplexArray, report: ReportProgress | None = None) -> NinePointReport:
    """All linkages through nine points, each simulated; see `find_all`."""
    found = find_all(points, report)
    rows = [(found.solutions[row], bool(found.certificates.is_real[row])) for row in found.real]
    rows += [(row, False) for row in found.singular[distance_from_real(found.singular) < _NEARLY_REAL]]
    linkages = []
    for number, (solution, is_proved) in enumerate(rows, start=1):
        for cognate, linkage in enumerate(linkages_of(solution, complex(points[0]), found.size)):
            linkages.append(simulated(linkage, points, number, cognate, is_proved=is_proved))
    kept = [each for each in linkages if each.is_proved or each.passage.fate != MISSES]
    return NinePointReport(tuple(sorted(kept, key=rank)), found)


def simulated(linkage: FourBar, points: ComplexArray, number: int, cognate: int, *, is_proved: bool) -> FoundLinkage:
    """The linkage, driven by the link that passes the points best."""
    driven = [(each, find_passage(each, points)) for each in (linkage, driven_by_rocker(linkage))]
    best, passage = min(driven, key=lambda pair: list(SENTENCES).index(pair[1].fate))
    return FoundLinkage(best, number, cognate, passage, is_proved)


def rank(found: FoundLinkage) -> tuple[int, float]:
    """Fates from the best on, then the ratio of the longest link to the shortest."""
    lengths = np.array(found.linkage.lengths)
    return list(SENTENCES).index(found.passage.fate), float(lengths.max() / lengths.min())
