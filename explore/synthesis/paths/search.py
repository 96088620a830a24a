"""Four-bars through many points: curves of an atlas laid over the path, and the best of them improved."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from explore.model.quantities import FloatArray
from explore.synthesis.linkages import ComplexArray, FourBar
from explore.synthesis.paths.alignment import Starts, close_path, join, lay_over, lay_over_parts, lay_timed
from explore.synthesis.paths.atlas import describe, draw_shapes, make_atlas
from explore.synthesis.paths.fitting import ORDERED, SHIFTED, TIMED, Task
from explore.synthesis.paths.improving import Candidates, improve
from explore.synthesis.paths.numbers import (
    ACROSS,
    ALONG,
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

#: Shapes of the atlas, those of them that are laid over a closed path, and shapes that are tried for other paths.
_N_ATLAS, _N_NEAREST, _N_TRIED = 100_000, 3000, 8192
#: One double crank is tried for so many crank-rockers.
_DOUBLE = 4


@dataclass(frozen=True)
class PathTask:
    """Points that a coupler point shall pass, in order.

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
        Numbers of the linkage that are given, or ranges of them, by their place among the nine: see
        `explore.synthesis.paths.numbers`.
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

    @property
    def size(self) -> float:
        """The larger side of the box of the points."""
        return float(max(np.ptp(self.points.real), np.ptp(self.points.imag)))

    @property
    def mode(self) -> int:
        """How the crank's angles may move."""
        if self.crank_angles is None:
            return ORDERED
        return SHIFTED if self.angles_from == "free" else TIMED

    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Bounds of the nine numbers."""
        lower, upper = np.full(N_NUMBERS, -np.inf), np.full(N_NUMBERS, np.inf)
        lower[[LEAST, LARGEST]] = self.transmission_angle_min
        upper[[LEAST, LARGEST]] = np.pi - self.transmission_angle_min
        lower[[LOG_COUPLER, LOG_ROCKER]] = np.log(self.link_ratio_min * self.size)
        upper[[LOG_COUPLER, LOG_ROCKER]] = np.log(self.link_ratio_max * self.size)
        for number, value in self.held.items():
            lower[number], upper[number] = value if isinstance(value, tuple) else (value, value)
        return lower, upper

    def starts(self, count: int) -> Starts:
        """Crank-rockers and double cranks laid over the path, about `count` of the nearest where there are more."""
        return join([self._starts(True, 1, count), self._starts(False, _DOUBLE, count // _DOUBLE)])

    def _starts(self, is_ground_longer: bool, part: int, count: int) -> Starts:
        if self.is_closed and self.crank_angles is None:
            target, atlas = close_path(self.points), make_atlas(_N_ATLAS // part, is_ground_longer=is_ground_longer)
            return lay_over(target, atlas.shapes[atlas.nearest(describe(target.points[None])[0], count)])
        shapes = draw_shapes(_N_TRIED // part, is_ground_longer=is_ground_longer)
        if self.crank_angles is not None:
            return lay_timed(self.points, self.crank_angles, shapes, is_shift_free=self.angles_from == "free")
        return lay_over_parts(self.points, shapes, self.span_min)


@dataclass(frozen=True)
class PathSolution:
    """A linkage for a path.

    Attributes
    ----------
    linkage
        The four-bar.
    angles
        Angles of the crank in the plane at the points, rad.
    error
        Sum of squared distances of the points to where the linkage is at these angles.
    """

    linkage: FourBar
    angles: FloatArray
    error: float


def find_paths(task: PathTask, count: int = 10, n_starts: int = _N_NEAREST) -> list[PathSolution]:
    """Linkages with the least sums of squared distances that were found, each a local optimum, best first."""
    starts = task.starts(n_starts)
    best = np.argsort(starts.errors, kind="stable")[:n_starts]
    candidates = improve(_task_of(task), _candidates_of(starts.rows(best)), count)
    found: list[PathSolution] = []
    for k in range(len(candidates.errors)):
        numbers, branch = candidates.numbers[k], float(candidates.branches[k])
        linkage = linkage_of(numbers, branch, is_ground_longer=bool(candidates.are_grounds_longer[k]))
        ratios = np.array(linkage.lengths) / task.size
        if task.link_ratio_min * (1.0 - 1e-9) <= ratios.min() and ratios.max() <= task.link_ratio_max * (1.0 + 1e-9):
            found.append(PathSolution(linkage, candidates.angles[k] + numbers[FRAME], float(candidates.errors[k])))
    return found[:count]


def _task_of(task: PathTask) -> Task:
    weights = np.ones(len(task.points)) if task.weights is None else np.ascontiguousarray(task.weights, dtype=float)
    lower, upper = task.bounds()
    shortest, longest = task.link_ratio_min * task.size, task.link_ratio_max * task.size
    points = np.ascontiguousarray(task.points, dtype=np.complex128)
    return Task(points, weights, task.mode, lower, upper, float(task.span_min), shortest, longest)


def _candidates_of(starts: Starts) -> Candidates:
    is_longer = starts.shapes[:, GROUND] >= starts.shapes[:, CRANK]
    return Candidates(
        starts.branches, starts.senses, is_longer, numbers_of_starts(starts), starts.angles.copy(), starts.errors
    )


def numbers_of_starts(starts: Starts) -> FloatArray:
    """The nine numbers of starts, shape (n, 9)."""
    crank, coupler, rocker, ground, along, across = starts.shapes.T
    numbers = np.empty((len(starts.errors), N_NUMBERS))
    numbers[:, PIVOT_X], numbers[:, PIVOT_Y] = starts.places.real, starts.places.imag
    numbers[:, FRAME] = starts.frames
    numbers[:, LOG_COUPLER], numbers[:, LOG_ROCKER] = np.log(coupler), np.log(rocker)
    for number, side in ((LEAST, ground - crank), (LARGEST, ground + crank)):
        cosine = (coupler**2 + rocker**2 - side**2) / (2.0 * coupler * rocker)
        numbers[:, number] = np.arccos(np.clip(cosine, -1.0, 1.0))
    numbers[:, ALONG], numbers[:, ACROSS] = along, across
    return numbers


def linkage_of(numbers: FloatArray, branch: float, *, is_ground_longer: bool = True) -> FourBar:
    """The linkage of nine numbers."""
    constants = np.empty(N_CONSTANTS)
    close_shape(numbers, is_ground_longer, constants)
    crank, coupler, rocker, ground = constants[:4].tolist()
    pivot = complex(numbers[PIVOT_X], numbers[PIVOT_Y])
    other = pivot + ground * np.exp(1j * numbers[FRAME])
    point = complex(numbers[ALONG], numbers[ACROSS]) / coupler
    return FourBar(pivot, complex(other), crank, coupler, rocker, point, int(branch))
