"""Four-bars through many points or poses: curves of an atlas laid over the path, and the best of them improved."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from explore.model.quantities import FloatArray
from explore.synthesis.linkages import ComplexArray, FourBar
from explore.synthesis.paths.alignment import Starts, close_path, lay_over, lay_over_parts, lay_timed
from explore.synthesis.paths.atlas import describe, draw_shapes, make_atlas
from explore.synthesis.paths.improving import Candidates, improve
from explore.synthesis.paths.limits import Limits
from explore.synthesis.paths.numbers import (
    ACROSS,
    ALONG,
    BODY,
    CRANK,
    FRAME,
    GROUND,
    LARGEST,
    LEAST,
    LOG_COUPLER,
    LOG_ROCKER,
    N_CONSTANTS,
    N_NUMBERS,
    PIVOT_X,
    PIVOT_Y,
    close_shape,
)
from explore.synthesis.paths.placed_pivots import LOG_RATIO, OTHER_X, OTHER_Y
from explore.synthesis.paths.placing import Drawn, Goal, draw_four_bars, lay
from explore.synthesis.paths.problems import ORDERED, SHIFTED, TIMED, UNORDERED, Task

#: Number of shapes of the atlas.
_N_ATLAS = 100_000
#: Number of shapes of the atlas that are laid over a closed path.
_N_NEAREST = 3000
#: Number of shapes that are tried for other paths.
_N_TRIED = 8192
#: Number of crank-rockers that are tried for each double crank.
_DOUBLE = 4
#: Price of a limit of lengths that is missed, over the size of the path.
_PRICE = 30.0
#: Share by which the search stays within limits of lengths.
_INSIDE = 1e-4
#: Distance from the path's box up to which pivots without a bound are drawn, in sizes of the path.
_MARGIN = 2.0


@dataclass(frozen=True)
class PathTask:
    """Points that a coupler point shall pass, in order, and the directions of its body there, if these are given.

    Attributes
    ----------
    points
        Shape (n,), complex.
    is_closed
        Whether the path returns from the last point to the first.
    crank_angles
        Angles of the crank at the points, rad, shape (n,); None where they are free.
    angles_from
        What the crank's angles count from: "free", any angle, or "frame", the line of the pivots.
    span_min
        Angle that the crank turns at least from the first to the last point, rad: without it, a short arc of a large
        curve is the best fit to a simple open path.
    transmission_angle_min
        The least of the transmission angle and its supplement over the turn, rad.
    link_ratio_max
        The longest link over the size of the path, the larger side of its box.
    link_ratio_min
        The shortest link over that size. Without it, some curves are best met by links of no length.
    weights
        Of the squared distances, shape (n,); None for 1.
    held
        Numbers of the linkage that are given, or ranges of them, by their place among the ten: see
        `explore.synthesis.paths.numbers`.
    other_pivot
        The ranges of the other pivot's coordinates, by `OTHER_X` and `OTHER_Y`; those that are missing are open.
    arm_ratio_max
        The distance of the coupler point from the crank's pin over the size of the path.
    longest_to_shortest
        The longest link over the shortest.
    angles, lever
        Angles of the body at the points, rad, shape (n,), and the length at whose end they count as distances.
    is_ordered
        Whether the crank passes the points in their order.
    """

    points: ComplexArray
    is_closed: bool = True
    crank_angles: FloatArray | None = None
    angles_from: str = "free"
    span_min: float = 0.0
    transmission_angle_min: float = float(np.radians(20.0))
    link_ratio_max: float = 10.0
    link_ratio_min: float = 0.01
    weights: FloatArray | None = None
    held: Mapping[int, float | tuple[float, float]] = field(default_factory=dict)
    other_pivot: Mapping[int, tuple[float, float]] = field(default_factory=dict)
    arm_ratio_max: float = np.inf
    longest_to_shortest: float = np.inf
    angles: FloatArray | None = None
    lever: float = 0.0
    is_ordered: bool = True

    @property
    def size(self) -> float:
        """The larger side of the box of the points."""
        return float(max(np.ptp(self.points.real), np.ptp(self.points.imag)))

    @property
    def mode(self) -> int:
        """How the crank's angles may move."""
        if self.crank_angles is None:
            return ORDERED if self.is_ordered else UNORDERED
        return SHIFTED if self.angles_from == "free" else TIMED

    @property
    def is_placed(self) -> bool:
        """Whether both pivots are numbers of the search."""
        return bool(self.other_pivot)

    @property
    def directions(self) -> ComplexArray:
        """Unit vectors of the body at the points, if it has angles."""
        return np.asarray(np.exp(1j * (np.zeros(0) if self.angles is None else self.angles)))

    @property
    def limits(self) -> Limits:
        """The limits of lengths that have a price: those of the links are bounds where the pivots are not placed."""
        total = len(self.points) if self.weights is None else float(np.sum(self.weights))
        arm, ratio = self.arm_ratio_max * self.size * (1.0 - _INSIDE), self.longest_to_shortest * (1.0 - _INSIDE)
        price = (_PRICE * self.size) ** 2 * total
        if not self.is_placed:
            return Limits(0.0, np.inf, arm, ratio, price)
        shortest, longest = self.link_ratio_min * (1.0 + _INSIDE), self.link_ratio_max * (1.0 - _INSIDE)
        return Limits(shortest * self.size, longest * self.size, arm, ratio, price)

    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Bounds of the ten numbers, or of those with placed pivots."""
        lower, upper = np.full(N_NUMBERS, -np.inf), np.full(N_NUMBERS, np.inf)
        lower[[LEAST, LARGEST]] = self.transmission_angle_min
        upper[[LEAST, LARGEST]] = np.pi - self.transmission_angle_min
        lower[[LOG_COUPLER, LOG_ROCKER]] = np.log(self.link_ratio_min * self.size)
        upper[[LOG_COUPLER, LOG_ROCKER]] = np.log(self.link_ratio_max * self.size)
        if self.is_placed:
            lower[[OTHER_X, OTHER_Y, LOG_RATIO]], upper[[OTHER_X, OTHER_Y, LOG_RATIO]] = -np.inf, np.inf
        for number, value in {**self.held, **self.other_pivot}.items():
            lower[number], upper[number] = value if isinstance(value, tuple) else (value, value)
        return lower, upper

    def starts(self, count: int) -> Starts:
        """Crank-rockers and double cranks laid over the path, about `count` of the nearest where there are more."""
        return Starts.joined([self._starts(True, 1, count), self._starts(False, _DOUBLE, count // _DOUBLE)])

    def _starts(self, is_ground_longer: bool, part: int, count: int) -> Starts:
        if self.is_closed and self.crank_angles is None:
            target, atlas = close_path(self.points), make_atlas(_N_ATLAS // part, is_ground_longer=is_ground_longer)
            return lay_over(target, atlas.shapes[atlas.nearest(describe(target.points[None])[0], count)])
        if self.crank_angles is not None:
            shapes = draw_shapes(_N_TRIED // part, is_ground_longer=is_ground_longer)
            return lay_timed(self.points, self.crank_angles, shapes, is_shift_free=self.angles_from == "free")
        return _laid_over_parts(tuple(self.points.tolist()), self.span_min, part, is_ground_longer)


@lru_cache(maxsize=4)
def _laid_over_parts(points: tuple[complex, ...], span_min: float, part: int, is_ground_longer: bool) -> Starts:
    """Starts of an open path, which do not depend on the bounds that it is searched with again."""
    shapes = draw_shapes(_N_TRIED // part, is_ground_longer=is_ground_longer)
    return lay_over_parts(np.array(points), shapes, span_min)


@dataclass(frozen=True)
class PathSolution:
    """A linkage for a path, its crank's angles in the plane at the points, and the body's angle from the coupler, rad.

    The error is the sum of squared distances of the points to where the linkage is at these angles, and of turns of the
    body times the lever.
    """

    linkage: FourBar
    angles: FloatArray
    error: float
    body_angle: float = 0.0


def find_paths(task: PathTask, count: int = 10, n_starts: int = _N_NEAREST) -> list[PathSolution]:
    """Linkages with the least sums of squared distances that were found, each a local optimum, best first.

    `count` is the number that is wanted; all that were found are returned.
    """
    if task.is_placed or task.angles is not None:
        starts = placed_starts(task).best(n_starts)
    else:
        laid = task.starts(n_starts)
        laid = laid.rows(np.argsort(laid.errors, kind="stable")[:n_starts])
        is_longer, numbers = laid.shapes[:, GROUND] >= laid.shapes[:, CRANK], numbers_of_starts(laid)
        starts = Candidates(laid.branches, laid.senses, is_longer, numbers, laid.angles.copy(), laid.errors)
    weights = np.ones(len(task.points)) if task.weights is None else np.ascontiguousarray(task.weights, dtype=float)
    lower, upper = task.bounds()
    shortest, longest = task.link_ratio_min * task.size, task.link_ratio_max * task.size
    points = np.ascontiguousarray(task.points, dtype=np.complex128)
    problem = Task(
        points, weights, task.mode, lower, upper, float(task.span_min), shortest, longest, task.is_placed, task.limits,
        task.directions, float(task.lever),
    )  # fmt: skip
    candidates = improve(problem, starts, count)
    found: list[PathSolution] = []
    for k in range(len(candidates.errors)):
        numbers, branch = candidates.numbers[k], float(candidates.branches[k])
        linkage = linkage_of(numbers, branch, is_ground_longer=bool(candidates.are_grounds_longer[k]))
        ratios = np.array(linkage.lengths) / task.size
        if task.link_ratio_min * (1.0 - 1e-9) <= ratios.min() and ratios.max() <= task.link_ratio_max * (1.0 + 1e-9):
            angles, body_angle = candidates.angles[k] + numbers[FRAME], float(numbers[BODY])
            found.append(PathSolution(linkage, angles, float(candidates.errors[k]), body_angle))
    return found


def numbers_of_boxes(
    crank_pivot: Mapping[str, tuple[float, float]], rocker_pivot: Mapping[str, tuple[float, float]]
) -> tuple[dict[int, float | tuple[float, float]], dict[int, tuple[float, float]]]:
    """Held numbers of `PathTask` and ranges of its other pivot, from ranges of the pivots' x and y."""
    held: dict[int, float | tuple[float, float]] = {
        number: crank_pivot[axis] for number, axis in ((PIVOT_X, "x"), (PIVOT_Y, "y")) if axis in crank_pivot
    }
    other = {number: rocker_pivot[axis] for number, axis in ((OTHER_X, "x"), (OTHER_Y, "y")) if axis in rocker_pivot}
    return held, other


def placed_starts(task: PathTask) -> Candidates:
    """Drawn four-bars laid over the points or poses, with pivots within their bounds where the other one has any."""
    weights, timed = np.ones(len(task.points)) if task.weights is None else task.weights, task.crank_angles
    goal = Goal(
        task.points, np.asarray(weights, dtype=float), task.directions, task.lever, task.is_closed, task.span_min,
        timed, task.angles_from == "free",
    )  # fmt: skip
    corners, windows, parts = _corners(task), goal.windows(), []
    for is_longer in (True, False):
        drawn = draw_four_bars(
            *corners, task.transmission_angle_min, is_ground_longer=is_longer, is_placed=task.is_placed
        )
        parts.append(_laid(drawn, goal, windows, is_ground_longer=is_longer))
    return Candidates.joined(parts)


def _laid(drawn: Drawn, goal: Goal, windows: FloatArray, *, is_ground_longer: bool) -> Candidates:
    laid = lay(goal, drawn, windows)
    numbers = np.zeros((len(laid.errors), N_NUMBERS))
    numbers[:, PIVOT_X], numbers[:, PIVOT_Y] = laid.pivots.real, laid.pivots.imag
    numbers[:, FRAME], sizes = np.angle(laid.frames), np.abs(laid.frames)[:, None]
    numbers[:, [LOG_COUPLER, LOG_ROCKER]] = np.log(drawn.lengths[:, 1:3] * sizes + 1e-300)
    numbers[:, [LEAST, LARGEST]] = drawn.angles
    arms = laid.arms * np.exp(-1j * numbers[:, FRAME])
    numbers[:, ALONG], numbers[:, ACROSS], numbers[:, BODY] = arms.real, arms.imag, laid.bodies
    angles = np.ascontiguousarray(windows[laid.windows])
    senses = np.where(angles[:, -1] >= angles[:, 0], 1.0, -1.0)
    good = np.isfinite(numbers).all(axis=1)
    rows = Candidates(drawn.branches, senses, np.full(len(senses), is_ground_longer), numbers, angles, laid.errors)
    return rows.rows(np.flatnonzero(good))


def _corners(task: PathTask) -> tuple[FloatArray, FloatArray]:
    """Corners, lower and upper, that the pivots are drawn between: x and y of the crank's, then of the other one."""
    lower, upper = (each[[PIVOT_X, PIVOT_Y, OTHER_X, OTHER_Y]].copy() for each in task.bounds())
    places = np.array([task.points.real, task.points.imag] * 2)
    margin = _MARGIN * task.size
    low = np.where(np.isfinite(lower), lower, np.minimum(places.min(axis=1) - margin, upper))
    high = np.where(np.isfinite(upper), upper, np.maximum(places.max(axis=1) + margin, lower))
    return low, high


def numbers_of_starts(starts: Starts) -> FloatArray:
    """The ten numbers of starts, shape (n, 10)."""
    crank, coupler, rocker, ground, along, across = starts.shapes.T
    numbers = np.zeros((len(starts.errors), N_NUMBERS))
    numbers[:, PIVOT_X], numbers[:, PIVOT_Y] = starts.places.real, starts.places.imag
    numbers[:, FRAME] = starts.frames
    numbers[:, LOG_COUPLER], numbers[:, LOG_ROCKER] = np.log(coupler), np.log(rocker)
    for number, side in ((LEAST, ground - crank), (LARGEST, ground + crank)):
        cosine = (coupler**2 + rocker**2 - side**2) / (2.0 * coupler * rocker)
        numbers[:, number] = np.arccos(np.clip(cosine, -1.0, 1.0))
    numbers[:, ALONG], numbers[:, ACROSS] = along, across
    return numbers


def linkage_of(numbers: FloatArray, branch: float, *, is_ground_longer: bool = True) -> FourBar:
    """The linkage of ten numbers."""
    constants = np.empty(N_CONSTANTS)
    close_shape(numbers, is_ground_longer, constants)
    crank, coupler, rocker, ground = constants[:4].tolist()
    pivot = complex(numbers[PIVOT_X], numbers[PIVOT_Y])
    other = pivot + ground * np.exp(1j * numbers[FRAME])
    point = complex(numbers[ALONG], numbers[ACROSS]) / coupler
    return FourBar(pivot, complex(other), crank, coupler, rocker, point, int(branch))
