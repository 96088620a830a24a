"""Task "dead-positions": crank-rockers with a given swing and time ratio."""

from dataclasses import dataclass
from functools import partial

import numpy as np
import numpy.typing as npt

from explore.base.errors import Problems, RequestError
from explore.model.columns import Column
from explore.model.progress import ReportProgress
from explore.model.quantities import FloatArray
from explore.synthesis.candidates import SOLUTION, Candidates
from explore.synthesis.dead_positions import DeadPositions, Family, find_best, find_ranges
from explore.synthesis.tasks.contract import MOST_CANDIDATES, Task, TaskSections, TaskType
from explore.synthesis.tasks.placed_four_bars import FORMULAS, LENGTHS, FourBarBounds

_FAMILY = Column(
    "family", "", "sense of the crank from the extended dead position in which it turns further", "bookkeeping",
    "|i1", {1: "with_rocker", -1: "against_rocker"},
)  # fmt: skip
_SENTENCES = {
    "with_rocker": "the crank turns by more than half a turn from its extended dead position as the rocker swings",
    "against_rocker": "the crank turns by more than half a turn from its extended dead position against the rocker",
}
#: Share of a range of the families that is left out at its ends, where rounding decides whether a bound is met.
_ENDS = 1e-9


#: Family of linkages and a range of its number.
_Range = tuple[Family, tuple[float, float]]


@dataclass(frozen=True)
class _Search:
    """The families of a swing and time ratio, and what a linkage of them has to meet; the ground in mm.

    `count` is the number of candidates; each range of the families has at least three, its ends and its best.
    """

    task: DeadPositions
    ground: float
    bounds: FourBarBounds
    count: int

    def find(self, _: ReportProgress | None) -> Candidates:
        """The candidates, those of the best transmission angle first."""
        signs = (1, -1) if self.task.dead_angle else (1,)
        families = [Family(self.task, sign) for sign in signs]
        ranges = self._ranges(families, self.bounds.angle, self.bounds.link_ratio_max)
        asked = f"swing {np.degrees(self.task.swing):g} deg and time ratio {self.task.time_ratio:g}"
        tried = [f"searched {'both families' if len(families) > 1 else 'the family'} of crank-rockers of {asked}"]
        if not ranges:
            ranges, reason = self._nearest(families)
            tried.append(reason)
        width = sum(stop - start for _, (start, stop) in ranges)
        found = []
        for family, (start, stop) in ranges:
            margin = _ENDS * (stop - start)
            n = round(self.count * (stop - start) / width) - 1 if width else 0
            spread = np.linspace(start + margin, stop - margin, max(n, 2))
            rho = np.append(spread, find_best(family, start, stop))
            found.append((np.full(len(rho), family.sign), family.worst_transmission_angle(rho), *family.lengths(rho)))
        sign, angle, crank, coupler, rocker = (np.concatenate(each) for each in zip(*found, strict=True))
        order = np.argsort(-angle, kind="stable")
        lengths = (crank, coupler, rocker, np.ones(len(crank)))
        return Candidates(
            parameters={name: (self.ground * each)[order] for name, each in zip(LENGTHS, lengths, strict=True)},
            added=(SOLUTION, _FAMILY),
            values={"solution": np.arange(1, len(order) + 1), "family": sign[order]},
            tried=tuple(tried),
            sentences=_SENTENCES,
        )

    def _ranges(self, families: list[Family], angle: float, ratio: float) -> list[_Range]:
        """The ranges of the families with these bounds on the transmission angle, rad, and on the ratio of links."""

        def allows(family: Family, rho: FloatArray) -> npt.NDArray[np.bool_]:
            is_steep = family.worst_transmission_angle(rho) >= angle
            return np.asarray(is_steep & (_link_ratio(family, rho) <= ratio))

        found = []
        for family in families:
            steepest = [find_best(family, *pair) for pair in find_ranges(family, lambda rho: np.ones_like(rho, bool))]
            found += [(family, pair) for pair in find_ranges(family, partial(allows, family), steepest)]
        return found

    def _nearest(self, families: list[Family]) -> tuple[list[_Range], str]:
        """The ranges without the bound on the transmission angle, or without bounds, and why there are no others."""
        asked, ratio = self.bounds.transmission_angle_min, self.bounds.link_ratio_max
        for limit, words in ((ratio, "links within that ratio"), (np.inf, "links of any ratio")):
            ranges = self._ranges(families, 0.0, limit)
            if ranges:
                best = max(float(family.worst_transmission_angle(np.array([find_best(family, *pair)]))[0])
                           for family, pair in ranges)  # fmt: skip
                bounds = f"a transmission angle of at least {asked:g} deg and links within a ratio of {ratio:g}"
                return ranges, f"none has {bounds}; the best with {words} has {np.degrees(best):.6g} deg"
        task = self.task
        asked_for = f"a swing of {np.degrees(task.swing):g} deg and a time ratio of {task.time_ratio:g}"
        raise RequestError(f"no crank-rocker has {asked_for}; change one of the two")


def _link_ratio(family: Family, rho: FloatArray) -> FloatArray:
    """The longest link over the shortest, shape (n,)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        lengths = np.array([*family.lengths(rho), np.ones_like(rho)])
        return np.asarray(lengths.max(axis=0) / lengths.min(axis=0))


def _read(sections: TaskSections, problems: Problems) -> Task | None:
    target = sections.target
    swing = target.number("swing_angle", "deg", "40", above=0.0, below=180.0)
    time_ratio = target.number("time_ratio", "1", "1.25", least=1.0)
    ground = target.number("ground", "mm", default=100.0, above=0.0)
    bounds = FourBarBounds.read(sections.bounds)
    swing_off = sections.bounds.number("swing_angle_off", "deg", default=0.1, above=0.0)
    time_off = sections.bounds.number("time_ratio_off", "1", default=0.01, above=0.0)
    count = sections.search.count("count", 20, MOST_CANDIDATES)
    if problems:
        return None
    search = _Search(DeadPositions(float(np.radians(swing)), time_ratio), ground, bounds, count)
    return Task(
        mechanism="crank-rocker",
        find=search.find,
        parameters=LENGTHS,
        fixed=("ground",),
        objectives=("transmission_angle_worst:max", "footprint:min"),
        metrics=("swing_angle", "time_ratio", "transmission_angle_min", "transmission_angle_max", "link_ratio"),
        constraints={
            "swing_angle": {"min": swing - swing_off, "max": swing + swing_off},
            "time_ratio": {"min": time_ratio - time_off, "max": time_ratio + time_off},
            **bounds.constraints,
        },
        formulas=FORMULAS,
    )


TYPE = TaskType("dead-positions", "a crank-rocker with a given swing and time ratio", _read)
