"""Whether a linkage that passes through points does so in one motion: circuits, branches and order.

A solution of the equations passes through all points, but perhaps only after it is taken apart and assembled the other
way (another circuit), or past a dead point of its crank (another branch), or in another order.
"""

import math
from dataclasses import dataclass

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


@dataclass(frozen=True)
class Passage:
    """How a linkage passes points: its fate, and the crank's angles there.

    The angles, rad, ascend or descend where it passes; they are NaN at points that it misses.
    """

    fate: str
    angles: FloatArray


@dataclass(frozen=True)
class _Position:
    """A position with the coupler point at a point: angle of the crank from the frame, branch, and number of the
    circuit.
    """

    angle: float
    branch: int
    circuit: int


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
            angles = np.array([next(p.angle for p in each if p.branch == branch) for each in own])
            passages.append(_ordered(angles + frame, is_turning=_ranges(linkage)[0] == "turn"))
    return min(passages, key=lambda passage: list(SENTENCES).index(passage.fate))


def _ordered(angles: FloatArray, *, is_turning: bool) -> Passage:
    """The passage with these angles: in order if they go one way, within a turn for a crank that turns."""
    for sense in (1.0, -1.0):
        steps = np.diff(sense * angles)
        if is_turning:
            steps = steps % (2.0 * math.pi)
        if (steps > 0.0).all() and steps.sum() < 2.0 * math.pi:
            return Passage(PASSES, angles[0] + sense * np.concatenate([[0.0], np.cumsum(steps)]))
    return Passage(WRONG_ORDER, angles)


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
    """The positions of the linkage with the coupler point at a point: none, one or two."""
    vector, size = point - linkage.crank_pivot, max(linkage.lengths)
    frame = linkage.rocker_pivot - linkage.crank_pivot
    found = []
    for pin in _pins_at(linkage, vector):
        end = pin + (vector - pin) / linkage.point
        diagonal = frame - pin
        if abs(abs(end - frame) - linkage.rocker) <= _NEAR * size:
            branch = 1 if (diagonal.conjugate() * (end - pin)).imag >= 0.0 else -1
            angle = math.remainder(float(np.angle(pin / frame)), 2.0 * math.pi)
            kind = _ranges(linkage)[0]
            circuit = branch if kind == "turn" else (1 if angle >= 0.0 else -1) if kind == "sides" else 0
            found.append(_Position(angle % (2.0 * math.pi) if kind == "back" else angle, branch, circuit))
    return found


def _pins_at(linkage: FourBar, vector: complex) -> list[complex]:
    """Where the pin of the crank can be with the coupler point at a vector from the crank's pivot: none, or two."""
    arm, length, near = abs(linkage.point) * linkage.coupler, abs(vector), _NEAR * max(linkage.lengths)
    if arm == 0.0:
        return []
    if length <= near * _NEAR:
        return _pins_at_pivot(linkage) if abs(arm - linkage.crank) <= near else []
    along = (length**2 + linkage.crank**2 - arm**2) / (2.0 * length)
    square = linkage.crank**2 - along**2
    if square < -(near**2):
        return []
    across = math.sqrt(max(square, 0.0))
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
