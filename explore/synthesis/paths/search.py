"""Four-bars through many points: curves of an atlas laid over the path, and the best of them improved."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from explore.model.quantities import FloatArray
from explore.synthesis.linkages import ComplexArray, FourBar
from explore.synthesis.paths.alignment import Starts, close_path, lay_over, lay_over_parts, lay_timed
from explore.synthesis.paths.atlas import describe, make_atlas
from explore.synthesis.paths.fitting import ORDERED, SHIFTED, TIMED, Problem, fit
from explore.synthesis.paths.numbers import (
    ACROSS,
    ALONG,
    FRAME,
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

#: Steps of each stage, and the share of the starts that goes on to the next; from so many steps on, to the last digits.
_STAGES = ((8, 0.15), (30, 0.15), (400, 0.2), (4000, 1.0))
_FINE = 400
#: Curves of the atlas that are laid over the path, and starts that are improved together.
_N_NEAREST, _CHUNK = 3000, 512
#: Shapes that are tried for open paths and for timed points.
_N_TRIED = 8192
#: Errors that differ by less, relatively, are the same solution.
_SAME = 1e-4


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
    weights
        Of the squared distances, shape (n,); None for 1.
    held
        Numbers of the linkage that are given, by their place among the nine: see `explore.synthesis.paths.numbers`.
    """

    points: ComplexArray
    is_closed: bool = True
    crank_angles: FloatArray | None = None
    angles_from: str = "free"
    span_min: float = 0.0
    transmission_angle_min: float = float(np.radians(20.0))
    link_ratio_max: float = 10.0
    weights: FloatArray | None = None
    held: Mapping[int, float] = field(default_factory=dict)

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
        upper[[LOG_COUPLER, LOG_ROCKER]] = np.log(self.link_ratio_max * self.size)
        for number, value in self.held.items():
            lower[number] = upper[number] = value
        return lower, upper

    def starts(self, count: int) -> Starts:
        """Shapes laid over the path, about `count` of them."""
        if self.crank_angles is not None:
            shapes = make_atlas(_N_TRIED).shapes
            return lay_timed(self.points, self.crank_angles, shapes, is_shift_free=self.angles_from == "free")
        if not self.is_closed:
            return lay_over_parts(self.points, make_atlas(_N_TRIED).shapes, self.span_min)
        target, atlas = close_path(self.points), make_atlas()
        return lay_over(target, atlas.shapes[atlas.nearest(describe(target.points[None])[0], count)])


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
    order = np.argsort(starts.errors, kind="stable")[:n_starts]
    found: list[PathSolution] = []
    for first in range(0, len(order), _CHUNK):
        found += _improve(task, starts, order[first : first + _CHUNK])
    found.sort(key=lambda solution: solution.error)
    distinct: list[PathSolution] = []
    for solution in found:
        if not any(abs(solution.error - other.error) <= _SAME * other.error for other in distinct):
            distinct.append(solution)
    return distinct[:count]


def _improve(task: PathTask, starts: Starts, rows: np.ndarray) -> list[PathSolution]:
    """Improve starts in stages, of which each takes the best on."""
    numbers, angles = numbers_of_starts(starts, rows), starts.angles[rows].copy()
    weights = np.ones(len(task.points)) if task.weights is None else task.weights
    lower, upper = task.bounds()
    problems = [
        Problem(
            task.points, weights, float(starts.branches[row]), float(starts.senses[row]), True, task.mode, lower, upper,
            float(task.span_min),
        )
        for row in rows
    ]  # fmt: skip
    alive = np.arange(len(rows))
    errors = np.full(len(rows), np.inf)
    for most_steps, share in _STAGES:
        tolerance = 1e-7 if most_steps < _FINE else 1e-10
        for k in alive:
            errors[k] = fit(problems[k], numbers[k], angles[k], most_steps, tolerance)
        alive = alive[np.argsort(errors[alive], kind="stable")][: max(4, int(len(alive) * share))]
    found = []
    for k in alive:
        linkage = linkage_of(numbers[k], starts.branches[rows[k]])
        if max(linkage.lengths) <= task.link_ratio_max * task.size:
            found.append(PathSolution(linkage, angles[k] + numbers[k, FRAME], float(errors[k])))
    return found


def numbers_of_starts(starts: Starts, rows: np.ndarray) -> FloatArray:
    """The nine numbers of starts, shape (n, 9)."""
    crank, coupler, rocker, ground, along, across = starts.shapes[rows].T
    numbers = np.empty((len(rows), N_NUMBERS))
    numbers[:, PIVOT_X], numbers[:, PIVOT_Y] = starts.places[rows].real, starts.places[rows].imag
    numbers[:, FRAME] = starts.frames[rows]
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
