"""Task "motion": four-bars whose coupler carries a body through poses."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from explore.base.errors import Problems, RequestError
from explore.model.columns import Arrays
from explore.model.progress import ReportProgress
from explore.model.quantities import FloatArray, GivenMetric
from explore.model.targets import PosesTarget
from explore.studies.request.path_order import remark_on_order
from explore.studies.request.targets import read_poses
from explore.synthesis import defects
from explore.synthesis.candidates import SOLUTION, Candidates
from explore.synthesis.guidance import Pairs, PivotBox, find_pairs
from explore.synthesis.pose_fits import PoseBounds, fit_poses
from explore.synthesis.poses import Poses, problem_of
from explore.synthesis.tasks.contract import Task, TaskSections, TaskType
from explore.synthesis.tasks.pivot_boxes import Box, pivot_bounds, read_box
from explore.synthesis.tasks.placed_four_bars import (
    FORMULAS,
    LENGTHS,
    PARAMETERS,
    PASSAGE,
    POINT,
    parameters_of,
    passage_codes,
    read_passage,
)

#: Least number of poses.
_FEWEST = 3
#: Largest number of poses.
_MOST = 100
#: Largest number of poses that are met exactly.
_EXACT = 5
#: Largest number of candidates.
_MOST_CANDIDATES = 500
#: Sentences on the fates of a body.
_SENTENCES = {
    defects.PASSES: "the crank takes the body through all poses in their order",
    defects.WRONG_ORDER: "the body passes all poses, but in another order",
    defects.OTHER_BRANCH: "the crank would have to pass a dead point between the poses",
    defects.OTHER_CIRCUIT: "the linkage would have to be taken apart between the poses",
}

_PASSAGE = GivenMetric(replace(PASSAGE, long_name="whether the crank takes the body through all poses in their order"))
_ADDED = (SOLUTION, _PASSAGE.column)
#: Rounding by which an exact candidate may miss, over the size of the poses and in rad.
_ROUNDING = 1e-6
#: Reason against poses without a size.
_ONE_PLACE = "all poses have the same place: the body turns about it; give the places of another of its points"
#: Distance of pivots over the size of the poses up to which candidates are alike and one of them is enough.
_ALIKE = 0.1


@dataclass(frozen=True)
class _Search:
    """The poses, with points in mm, and what a linkage has to meet.

    The least transmission angle, rad; the longest link over the size of the poses' points, and over the shortest; where
    "crank_pivot" and "rocker_pivot" may be; whether the crank has to take the body through the poses in one motion and
    in order. `count` is the number of candidates.
    """

    poses: Poses
    transmission_angle_min: float
    size_ratio_max: float
    link_ratio_max: float
    boxes: Mapping[str, Box]
    must_pass: bool
    count: int

    @property
    def size(self) -> float:
        """The larger side of the box of the points."""
        return float(max(np.ptp(self.poses.points.real), np.ptp(self.poses.points.imag)))

    @property
    def is_exact(self) -> bool:
        """Whether the poses are few enough to be met exactly."""
        return len(self.poses.points) <= _EXACT

    def find(self, _: ReportProgress | None) -> Candidates:
        """The candidates, best first."""
        if self.is_exact:
            return self._find_exact()
        bounds = PoseBounds(
            self.transmission_angle_min, self.size_ratio_max, self.link_ratio_max, **self.boxes,
            is_ordered=self.must_pass,
        )  # fmt: skip
        found = fit_poses(self.poses, bounds, self.count)
        words = f"a transmission angle of at least {np.degrees(self.transmission_angle_min):g} deg"
        words += f" and links of at most {self.size_ratio_max * self.size:.4g} mm"
        if not found:
            raise RequestError(f"no four-bar whose crank turns was found with {words}; widen [bounds] or move a pose")
        tried = (
            f"searched four-bars whose crank turns, with {words}, of least errors over {len(self.poses.points)} poses"
        )
        turned = np.exp(1j * np.array([each.body_angle for each in found]))
        return Candidates(
            parameters=parameters_of([each.linkage for each in found]) | {"body_angle": np.degrees(np.angle(turned))},
            added=_ADDED,
            values={
                "solution": np.arange(1, len(found) + 1),
                "passage": passage_codes([_fate(each.angles) for each in found]),
            },
            tried=(f"{tried}: {len(found)} local optima",),
            sentences=_SENTENCES,
            most=self.count,
        )

    def _find_exact(self) -> Candidates:
        n, length_max = len(self.poses.points), self.size_ratio_max * self.size
        boxes = _corners(self.boxes["crank_pivot"]), _corners(self.boxes["rocker_pivot"])
        pairs = find_pairs(self.poses, length_max, boxes=boxes)
        if not len(pairs.fates):
            where = "and fixed pivots in the boxes " if any(self.boxes.values()) else ""
            raise RequestError(
                f"no two links within {length_max:.4g} mm {where}meet the {n} poses; widen [bounds] or move a pose"
            )
        longest = pairs.lengths.max(axis=0)
        passes = pairs.turning & (longest <= length_max) & boxes[0].has(pairs.fixed[0]) & boxes[1].has(pairs.fixed[1])
        if self.must_pass:
            passes &= pairs.fates == defects.PASSES
        with np.errstate(divide="ignore"):
            passes &= longest <= self.link_ratio_max * pairs.lengths.min(axis=0)
        angles = np.nan_to_num(pairs.transmission_angles)
        good = passes & (angles >= self.transmission_angle_min)
        tried = [
            f"looked at {len(longest):,} four-bars of two links that meet the {n} poses: {good.sum():,} meet all bounds"
        ]
        if n == _EXACT:
            tried[0] += "; there are no others"
        if not good.any():
            best = np.degrees(angles[passes].max()) if passes.any() else 0.0
            words = (
                f"the best has a transmission angle of {best:.4g} deg" if passes.any() else self._met(pairs, longest)
            )
            tried.append(f"none meets all bounds: {words}")
        order = np.lexsort((longest, -angles, ~passes, ~good))
        if n < _EXACT:
            order = order[good[order]] if good.any() else self._apart(pairs, order[: 50 * self.count])
        return self._exact_candidates(pairs.rows(order), tried)

    def _exact_candidates(self, pairs: Pairs, tried: Sequence[str]) -> Candidates:
        """All of the pairs, of which the objectives keep some."""
        (crank_pivot, rocker_pivot), (pin, end) = pairs.fixed, pairs.moving
        coupler = end - pin
        arm = (self.poses.points[0] - pin) * np.abs(coupler) / coupler
        parameters = {
            **dict(zip(LENGTHS, pairs.lengths, strict=True)),
            "branch": pairs.branches,
            f"{POINT}_along": arm.real,
            f"{POINT}_across": arm.imag,
            "crank_pivot_x": crank_pivot.real,
            "crank_pivot_y": crank_pivot.imag,
            "ground_angle": np.degrees(np.angle(rocker_pivot - crank_pivot)),
            "body_angle": np.degrees(np.angle(np.exp(1j * self.poses.angles[0]) / coupler)),
        }
        values: Arrays = {"solution": np.arange(1, len(arm) + 1), "passage": passage_codes(pairs.fates.tolist())}
        places = np.concatenate([pairs.fixed, pairs.moving]).T / (_ALIKE * self.size)
        traits = np.hstack([places.real, places.imag]) if len(self.poses.points) < _EXACT else None
        return Candidates(parameters, _ADDED, values, tuple(tried), _SENTENCES, most=self.count, traits=traits)

    def _met(self, pairs: Pairs, longest: FloatArray) -> str:
        """How many meet each bound, for the message that none meets all."""
        inside = [_corners(box).has(pivots) for box, pivots in zip(self.boxes.values(), pairs.fixed, strict=True)]
        counts = {
            "pass in order": pairs.fates == defects.PASSES, "have a crank that turns": pairs.turning,
            f"have links within {self.size_ratio_max * self.size:.4g} mm": longest <= self.size_ratio_max * self.size,
            "have their pivots in the boxes": inside[0] & inside[1],
        }  # fmt: skip
        return ", ".join(f"{met.sum():,} {words}" for words, met in counts.items() if not met.all())

    def _apart(self, pairs: Pairs, rows: np.ndarray) -> np.ndarray:
        """The first of rows that are alike, up to the number of candidates."""
        pivots = np.concatenate([pairs.fixed, pairs.moving])
        kept: list[int] = []
        for row in rows.tolist():
            if len(kept) == self.count:
                break
            apart = np.abs(pivots[:, kept] - pivots[:, [row]]).max(axis=0)
            if not (apart < _ALIKE * self.size).any():
                kept.append(row)
        return np.array(kept, dtype=np.int64)


def _corners(box: Box) -> PivotBox:
    """A box of a pivot by its corners."""
    (x, right), (y, top) = (box.get(axis, (-np.inf, np.inf)) for axis in "xy")
    return PivotBox(complex(x, y), complex(right, top))


def _fate(angles: FloatArray) -> str:
    """Whether the crank takes the body through the poses in their order; the branch is one by construction."""
    steps = np.diff(angles)
    is_one_way = (steps >= 0.0).all() or (steps <= 0.0).all()
    return defects.PASSES if is_one_way and np.ptp(angles) < 2.0 * np.pi else defects.WRONG_ORDER


def _read(sections: TaskSections, problems: Problems) -> Task | None:
    (places, poses), bounds = _read_poses(sections, problems), sections.bounds
    angle = bounds.number("transmission_angle_min", "deg", default=20.0, least=0.0, below=90.0)
    ratio = bounds.number("size_ratio_max", "1", default=10.0, above=0.0)
    link_ratio = bounds.number("link_ratio_max", "1", default=np.inf, above=1.0)
    boxes = {name: read_box(bounds, name) for name in ("crank_pivot", "rocker_pivot")}
    passage = read_passage(bounds)
    count = sections.search.count("count", 20, _MOST_CANDIDATES)
    if problems or poses is None:
        return None
    search = _Search(poses, float(np.radians(angle)), ratio, link_ratio, boxes, bool(passage), count)
    formulas, constraints = pivot_bounds(boxes, search.size)
    if np.isfinite(link_ratio):
        constraints["link_ratio"] = {"max": link_ratio * (1.0 + 1e-9)}
    constraints |= {
        "transmission_angle_worst": {"min": angle * (1.0 - 1e-9)},
        "longest_link": {"max": ratio * search.size * (1.0 + 1e-9)},
    }
    objectives = ["transmission_angle_worst:max", "footprint:min"]
    if search.is_exact and passage:
        constraints["position_error_max"] = {"max": _ROUNDING * search.size}
        constraints["angle_error_max"] = {"max": float(np.degrees(_ROUNDING))}
    if not search.is_exact:  # poses that are met exactly are missed by rounding errors only, which order nothing
        objectives[:0] = ["position_error_max:min", "angle_error_max:min"]
    target, key = _target(poses, is_ordered=bool(passage)), "file" if "file" in sections.target else "poses"
    return Task(
        mechanism="crank-rocker",
        find=search.find,
        parameters=(*PARAMETERS, "body_angle"),
        objectives=tuple(objectives),
        measured=(_PASSAGE,),
        metrics=(
            "position_error_max",
            "angle_error_max",
            "pose_error_rms",
            "transmission_angle_min",
            "transmission_angle_max",
        ),
        constraints={**constraints, **passage},
        formulas={**FORMULAS, **formulas, "longest_link": {"formula": f"max({', '.join(LENGTHS)})", "unit": "mm"}},
        points=(POINT,),
        target=target.to_content(),
        given={"poses": [list(place) for place in places]},
        remarks=remark_on_order(target.path, ("target", key)) if passage else [],
    )


def _target(poses: Poses, *, is_ordered: bool) -> PosesTarget:
    """The poses as the target of a study."""
    places = zip(poses.points.real.tolist(), poses.points.imag.tolist(), np.degrees(poses.angles).tolist(), strict=True)
    return PosesTarget(POINT, tuple(places), order="given" if is_ordered else "any")


def _read_poses(sections: TaskSections, problems: Problems) -> tuple[Sequence[Sequence[float]], Poses | None]:
    """The poses as they are given, mm and deg, and as they are searched for, None after a mistake is noted."""
    entries, own = sections.target.entries("poses", "file"), Problems()
    places = read_poses(entries, sections.folder, own, _FEWEST, _MOST)
    problems += [(("target", *key), reason) for key, reason in own]
    if not places:
        return (), None
    x, y, degrees = np.array(places).T
    poses = Poses(x + 1j * y, np.radians(degrees))
    size = float(max(np.ptp(x), np.ptp(y)))
    if reason := problem_of(poses, size, _ROUNDING) if size else _ONE_PLACE:
        sections.target.note("file" if "file" in entries else "poses", reason)
        return (), None
    return places, poses


TYPE = TaskType("motion", "a four-bar whose coupler carries a body through poses", _read)
