"""Whether a linkage that passes through points does so in one motion: circuits, branches and order.

A solution of the equations passes through all points, but perhaps only after it is taken apart and assembled the other
way (another circuit), or past a dead point of its crank (another branch), or in another order.
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from explore.model.quantities import FloatArray
from explore.synthesis.linkages import ComplexArray, FourBar

#: Fate of a linkage that passes all points in order.
PASSES = "passes"
#: Fate of a linkage that passes all points in another order.
WRONG_ORDER = "wrong_order"
#: Fate of a linkage with a dead point between the points.
OTHER_BRANCH = "other_branch"
#: Fate of a linkage whose points lie on two circuits.
OTHER_CIRCUIT = "other_circuit"
#: Fate of a linkage that does not pass all points.
MISSES = "misses"
#: Sentences on the fates, from the best to the worst.
SENTENCES = {
    PASSES: "the crank takes the coupler point through all points in their order",
    WRONG_ORDER: "the coupler point passes all points, but in another order",
    OTHER_BRANCH: "the crank would have to pass a dead point between the points",
    OTHER_CIRCUIT: "the linkage would have to be taken apart between the points",
    MISSES: "the coupler point does not pass all points",
}
#: Largest distance of a point that is passed, over the largest link.
_NEAR = 1e-6
#: Arm of the coupler point over the coupler below which the point does not tell where the rocker's pin is.
_SHORT = 1e-3


@dataclass(frozen=True)
class Passage:
    """How a linkage passes points: its fate, and the crank's angles there.

    The angles, rad, ascend or descend where it passes; they are NaN at points that it misses.
    """

    fate: str
    angles: FloatArray


@dataclass(frozen=True)
class _Position:
    """A position with the coupler point at a point: angle of the crank from the frame, branch, number of the circuit,
    and by how much the links miss it.
    """

    angle: float
    branch: int
    circuit: int
    missed: float


def find_passage(linkage: FourBar, points: ComplexArray) -> Passage:
    """How a linkage passes points, shape (n,), in any of its assemblies, whatever its own branch."""
    positions = [_positions_at(linkage, complex(point)) for point in points]
    frame = float(np.angle(linkage.rocker_pivot - linkage.crank_pivot))
    if not all(positions):
        first = [each[0].angle + frame if each else np.nan for each in positions]
        return Passage(MISSES, np.array(first))
    circuits = set.intersection(*({p.circuit for p in each} for each in positions))
    if not circuits:
        return Passage(OTHER_CIRCUIT, np.array([each[0].angle + frame for each in positions]))
    passages = []
    for circuit in sorted(circuits):
        own = [[p for p in each if p.circuit == circuit] for each in positions]
        branches = set.intersection(*({p.branch for p in each} for each in own))
        if not branches:
            passages.append(Passage(OTHER_BRANCH, np.array([each[0].angle + frame for each in own])))
        for branch in sorted(branches):
            choices = [[p.angle + frame for p in each if p.branch == branch] for each in own]
            passages.append(_ordered(choices, is_turning=_ranges(linkage)[0] == "turn"))
    return min(passages, key=lambda passage: list(SENTENCES).index(passage.fate))


def _ordered(choices: Sequence[Sequence[float]], *, is_turning: bool) -> Passage:
    """The passage with one of the angles at each point: in order if they go one way, within a turn for a crank that
    turns. A point where the curve meets itself, or returns on itself, has several; the first are the most exact.
    """
    exact = [each[:1] for each in choices]
    for given, sense in itertools.product((exact, choices), (1.0, -1.0)):
        for first in given[0]:
            angles = _advanced(first, given[1:], sense, is_turning=is_turning)
            if angles is not None:
                return Passage(PASSES, angles)
    return Passage(WRONG_ORDER, np.array([each[0] for each in choices]))


def _advanced(first: float, others: Sequence[Sequence[float]], sense: float, *, is_turning: bool) -> FloatArray | None:
    """Angles that advance from the first by the least steps in a sense, less than a turn in all; None for none."""
    angles = [first]
    for choices in others:
        steps = [sense * (angle - angles[-1]) for angle in choices]
        if is_turning:
            steps = [step % (2.0 * math.pi) for step in steps]
        step = min((step for step in steps if step > 0.0), default=math.inf)
        angles.append(angles[-1] + sense * step)
    return np.array(angles) if abs(angles[-1] - first) < 2.0 * math.pi else None


def _ranges(linkage: FourBar) -> tuple[str, float, float]:
    """Where the crank moves from the frame: kind of the ranges, and their ends, rad.

    The diagonal from the crank's pin to the other pivot is between the difference and the sum of coupler and rocker:
    "turn" for all angles, "front" for up to the second end on both sides of 0, "back" for from the first end on, around
    pi, and "sides" for two ranges between both ends, on either side, each a circuit of its own.
    """
    crank, coupler, rocker, ground = linkage.lengths
    squares, double = crank**2 + ground**2, 2.0 * crank * ground
    far = (squares - (coupler + rocker) ** 2) / double
    near = (squares - (coupler - rocker) ** 2) / double
    first = math.acos(near) if near < 1.0 else 0.0
    second = math.acos(far) if far > -1.0 else math.pi
    kind = {(False, False): "turn", (False, True): "front", (True, False): "back", (True, True): "sides"}
    return kind[near < 1.0, far > -1.0], first, second


def _positions_at(linkage: FourBar, point: complex) -> list[_Position]:
    """The positions of the linkage with the coupler point at a point, the most exact first: none, one or more."""
    vector, frame = point - linkage.crank_pivot, linkage.rocker_pivot - linkage.crank_pivot
    found = []
    for pin in _pins_at(linkage, vector):
        angle = math.remainder(float(np.angle(pin / frame)), 2.0 * math.pi)
        kind = _ranges(linkage)[0]
        for branch, missed in _branches_at(linkage, frame, pin, vector).items():
            circuit = branch if kind == "turn" else (1 if angle >= 0.0 else -1) if kind == "sides" else 0
            found.append(_Position(angle % (2.0 * math.pi) if kind == "back" else angle, branch, circuit, missed))
    return sorted(found, key=lambda position: position.missed)


def _branches_at(linkage: FourBar, frame: complex, pin: complex, vector: complex) -> dict[int, float]:
    """The branches on which the coupler point is at a vector with the crank's pin at another, and by how much not."""
    if abs(linkage.point) < _SHORT:
        own = replace(linkage, crank_pivot=0j, rocker_pivot=frame)
        angles = np.angle([pin])
        missed = {n: abs(complex(replace(own, branch=n).points(angles)[0]) - vector) for n in (1, -1)}
    else:
        end = pin + (vector - pin) / linkage.point
        branch = 1 if ((frame - pin).conjugate() * (end - pin)).imag >= 0.0 else -1
        missed = {branch: abs(abs(end - frame) - linkage.rocker)}
    return {branch: miss for branch, miss in missed.items() if miss <= _NEAR * max(linkage.lengths)}


def _pins_at(linkage: FourBar, vector: complex) -> list[complex]:
    """Where the pin of the crank can be with the coupler point at a vector from the crank's pivot: none, or two."""
    arm, length, near = abs(linkage.point) * linkage.coupler, abs(vector), _NEAR * max(linkage.lengths)
    if length <= near * _NEAR:
        return _pins_at_pivot(linkage) if arm > 0.0 and abs(arm - linkage.crank) <= near else []
    if max(length - linkage.crank - arm, abs(linkage.crank - arm) - length) > near:
        return []
    along = (length**2 + linkage.crank**2 - arm**2) / (2.0 * length)
    along = min(max(along, -linkage.crank), linkage.crank)
    across = math.sqrt(linkage.crank**2 - along**2)
    return [vector / length * complex(along, side * across) for side in (1.0, -1.0)]


def _pins_at_pivot(linkage: FourBar) -> list[complex]:
    """Where the pin of the crank can be with the coupler point at the crank's pivot, which is as far from the pin.

    The pin of the rocker is then the crank's vector times a number, and has to be at the rocker from its pivot.
    """
    frame, factor = linkage.rocker_pivot - linkage.crank_pivot, 1.0 - 1.0 / linkage.point
    reach, ground = linkage.crank * abs(factor), linkage.ground
    if reach == 0.0 or abs(cosine := (reach**2 + ground**2 - linkage.rocker**2) / (2.0 * reach * ground)) > 1.0:
        return []
    ahead = complex(cosine, math.sqrt(1.0 - cosine**2))
    return [linkage.crank * frame / ground * turn * abs(factor) / factor for turn in (ahead, ahead.conjugate())]
