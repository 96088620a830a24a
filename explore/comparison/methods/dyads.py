"""The compiled simulation of cranks and dyads of pylinkage, one linkage at a time."""

import math
from dataclasses import dataclass
from importlib.util import find_spec
from typing import ClassVar, NamedTuple

import numpy as np

from explore.base.errors import RequestError
from explore.comparison.methods.closed_form import initial_guess
from explore.comparison.methods.contract import Capability, Motion, Outcome, Task
from explore.comparison.methods.textbook import direction_of
from explore.model.quantities import FloatArray

#: Largest difference between equal steps of the crank, the rounding of angles of a few turns, rad.
_EQUAL_STEPS = 1e-14


def is_pylinkage_installed() -> bool:
    """Whether pylinkage is installed."""
    return find_spec("pylinkage") is not None


@dataclass(frozen=True)
class PylinkageDyads:
    """``Linkage.step_fast_with_kinematics`` of pylinkage 1.3, which intersects two circles at each crank angle.

    Of the two intersections it takes the one nearer to the previous position, which may be on the other branch. Circles
    that do not meet give NaN; circles that touch within 1e-12 of the largest length give a point without velocity.
    The crank moves in equal steps that are summed up; for unequal crank angles it is called once per angle.
    """

    name: ClassVar[str] = "pylinkage"
    capabilities: ClassVar[Capability] = Capability.PEER | Capability.FOLLOWS_ANGLES | Capability.TWO_ANGLES

    def solve(self, task: Task) -> Motion:
        """Solve design by design from the exact position at the first angle; `RequestError` without pylinkage."""
        if not is_pylinkage_installed():
            raise RequestError("method pylinkage: pylinkage is not installed; pip install 'linkage-explore[peers]'")
        motion, start = Motion.blank(task), initial_guess(task)
        numbers = np.array(np.broadcast_arrays(*task.numbers[0], task.parameters[:, 0] * 0j)[:-1])
        places = {term.angle: numbers[k] for k, term in enumerate(task.loop.chains[0])}
        with np.errstate(all="ignore"):
            for i in range(len(task)):
                coupler, rocker, crank, ground = (places[k][i] if k in places else 0j for k in (0, 1, 2, None))
                links = _Links(crank, coupler, -rocker, -ground)
                motion.outcome[i] = _solve_one(links, task.crank_angle[i], start[i, 1], motion.signals[:, i])
        motion.evaluations[:] = task.crank_angle.shape[1]
        return motion


class _Links(NamedTuple):
    """Vectors of the links, each in its own coordinates: crank + coupler = ground + rocker."""

    crank: complex
    coupler: complex
    rocker: complex
    ground: complex


def _solve_one(links: _Links, crank: FloatArray, rocker: float, signals: FloatArray) -> Outcome:
    """Fill the signals of one design, shape (2 level, t)."""
    position, velocity, acceleration = _simulate(links, crank, rocker)
    pin, joint = position.swapaxes(0, 1)
    vectors = joint - pin, joint - [links.ground.real, links.ground.imag]
    own = links.coupler, links.rocker
    for k, (vector, link) in enumerate(zip(vectors, own, strict=True)):
        signals[k] = direction_of(vector[:, 0] + 1j * vector[:, 1], link)
        for row, rates in zip((2 + k, 4 + k), (velocity, acceleration), strict=True):
            if row < len(signals):
                # the angular rate of a link from the relative motion of its ends
                relative = rates[:, 1] - rates[:, 0] if k == 0 else rates[:, 1]
                signals[row] = _cross(vector, relative) / abs(link) ** 2
    return Outcome.OK if np.isfinite(signals).all() else Outcome.NOT_FINITE


def _simulate(links: _Links, crank: FloatArray, rocker: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Position, velocity and acceleration of crank pin and coupler joint, each of shape (t, 2, 2)."""
    from pylinkage.actuators import Crank
    from pylinkage.components import Ground
    from pylinkage.dyads import RRRDyad
    from pylinkage.simulation import Linkage

    steps = np.diff(crank, prepend=crank[0])
    equal = len(crank) > 1 and np.ptp(steps[1:]) <= _EQUAL_STEPS
    first = float(crank[0] - steps[1]) if equal else float(crank[0])  # a call steps before it records
    calls = [(len(crank), float(steps[1]))] if equal else [(1, float(step)) for step in steps]
    ground, pivot = Ground(0.0, 0.0), Ground(links.ground.real, links.ground.imag)
    offset = float(np.angle(links.crank))
    motor = Crank(ground, abs(links.crank), angular_velocity=1.0, initial_angle=first + offset)
    joint = links.ground + links.rocker * complex(math.cos(rocker), math.sin(rocker))
    dyad = RRRDyad(motor.output, pivot, abs(links.coupler), abs(links.rocker), joint.real, joint.imag)
    linkage = Linkage([ground, pivot, motor, dyad])
    linkage.set_input_velocity(motor, omega=1.0)
    parts = [linkage.step_fast_with_kinematics(iterations=count, dt=step) for count, step in calls]
    position, velocity, acceleration = (np.concatenate(kind)[:, 2:] for kind in zip(*parts, strict=True))
    return position, velocity, acceleration


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
