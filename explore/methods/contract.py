"""What a way of solving the motion of four-bar linkages is given, and what it answers.

A method is a frozen dataclass whose fields are its tolerances. It solves a `Task` for many designs and never raises for
a bad one: each design has an outcome. The crank turns with 1 rad/s; all angles are in rad, n designs, t crank angles.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from enum import Flag, IntEnum, auto
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from explore.vocabulary import FloatArray

#: Rows of `Motion.signals`; a level fills the first two, four or six.
COUPLER_ANGLE, ROCKER_ANGLE, COUPLER_VELOCITY, ROCKER_VELOCITY, COUPLER_ACCELERATION, ROCKER_ACCELERATION = range(6)


class Level(IntEnum):
    """How much of the motion a question needs."""

    GEOMETRY = 0
    POSITIONS = 1
    VELOCITIES = 2
    ACCELERATIONS = 3

    @property
    def rows(self) -> slice:
        """The rows of `Motion.signals` that this level adds to the one below."""
        return slice(2 * self - 2, 2 * self)


class Capability(Flag):
    """What a method can do."""

    #: Designs are solved together, by array operations or compiled code.
    BATCHED = auto()
    #: Each crank angle is solved for itself; the others go from one angle to the next.
    ANY_ANGLE = auto()
    #: It steps by the crank angles of the task, so that their distance matters; integrators choose steps of their own.
    FOLLOWS_ANGLES = auto()
    #: It notices when it left the branch that it was asked for.
    CHECKS_BRANCH = auto()
    #: It belongs to another package and stands here for what users have today.
    PEER = auto()


class Outcome(IntEnum):
    """What became of one design, as far as the method can tell."""

    OK = 1
    CANNOT_ASSEMBLE = 2
    CRANK_BLOCKED = 3
    CHANGE_POINT = 4
    NOT_FINITE = 8
    NOT_CONVERGED = 40
    WRONG_BRANCH = 41
    OPEN_LOOP = 42
    GAVE_UP = 43
    RAISED = 44

    @property
    def label(self) -> str:
        """The word used in tables."""
        return self.name.lower()

    @property
    def sentence(self) -> str:
        """What the outcome means, for people."""
        return _SENTENCES[self]


_SENTENCES = {
    Outcome.OK: "solved",
    Outcome.CANNOT_ASSEMBLE: "the links cannot be assembled",
    Outcome.CRANK_BLOCKED: "the crank cannot turn fully",
    Outcome.CHANGE_POINT: "all links fall into one line, from where the motion may continue on either branch",
    Outcome.NOT_FINITE: "a value is not a finite number",
    Outcome.NOT_CONVERGED: "the iteration did not converge; whether a solution exists is not known",
    Outcome.WRONG_BRANCH: "the iteration converged to the other branch",
    Outcome.OPEN_LOOP: "the links no longer close the loop",
    Outcome.GAVE_UP: "the integrator could not find a step that keeps its tolerance",
    Outcome.RAISED: "the solver raised an exception",
}


@dataclass(frozen=True)
class Task:
    """Motions to solve.

    Attributes
    ----------
    lengths : (n, 4) array
        Crank, coupler, rocker, ground, in one unit of length.
    branch : (n,) array
        1 or -1: on which side of the line from crank pin to rocker pivot the coupler joint lies.
    crank_angle : (n, t) array
        Ascending, rad. Statements about whole turns hold for any angles.
    level
        How much to compute: positions, velocities as well, or accelerations as well.
    start : (n, 2) array, optional
        Coupler and rocker angle at the first crank angle as somebody knows them; the exact ones unless given.
    """

    lengths: FloatArray
    branch: FloatArray
    crank_angle: FloatArray
    level: Level = Level.ACCELERATIONS
    start: FloatArray | None = None

    def __post_init__(self) -> None:
        """Check the shapes: a mistake here would broadcast silently."""
        n, angles = len(self.lengths), self.crank_angle
        shapes = self.lengths.shape == (n, 4) and self.branch.shape == (n,) and angles.shape[:1] == (n,)
        if not shapes or angles.ndim != 2 or (self.start is not None and self.start.shape != (n, 2)):
            raise ValueError("a task needs lengths (n, 4), branch (n,), crank_angle (n, t) and start (n, 2)")
        if self.level is Level.GEOMETRY:
            raise ValueError("geometry needs no method: it is known in closed form")

    def __len__(self) -> int:
        """How many designs."""
        return len(self.lengths)

    def part(self, which: npt.NDArray[Any] | slice) -> Task:
        """The same task for some of the designs."""
        start = None if self.start is None else self.start[which]
        return replace(
            self,
            lengths=self.lengths[which],
            branch=self.branch[which],
            crank_angle=self.crank_angle[which],
            start=start,
        )


@dataclass(frozen=True)
class Motion:
    """What a method found; NaN where it found nothing.

    Attributes
    ----------
    signals : (2 level, n, t) array
        Rows as named in this module: rad, 1, 1/rad.
    outcome : (n,) array
        An `Outcome` for each design.
    evaluations : (n,) array
        How often the equations were evaluated: positions, residuals or rates, and corrections.
    iterations : (n,) array
        Steps of the iteration or of the integration; 0 where there are none.
    """

    signals: FloatArray
    outcome: npt.NDArray[np.int8]
    evaluations: npt.NDArray[np.int64]
    iterations: npt.NDArray[np.int64]

    @classmethod
    def blank(cls, task: Task) -> Motion:
        """A motion to be filled: NaN, all designs OK, no work done."""
        n = len(task)
        signals = np.full((2 * task.level, *task.crank_angle.shape), np.nan)
        outcome = np.full(n, Outcome.OK, dtype=np.int8)
        return cls(signals, outcome, np.zeros(n, dtype=np.int64), np.zeros(n, dtype=np.int64))

    def put(self, which: npt.NDArray[Any] | slice, part: Motion) -> None:
        """Take over the motion of some of the designs."""
        self.signals[:, which] = part.signals
        self.outcome[which] = part.outcome
        self.evaluations[which] = part.evaluations
        self.iterations[which] = part.iterations


class Method(Protocol):
    """A way of solving motions: frozen data with one verb."""

    @property
    def name(self) -> str:
        """The key in the list of methods."""
        ...

    @property
    def summary(self) -> str:
        """What it is, in a line."""
        ...

    @property
    def capabilities(self) -> Capability:
        """What it can do: of the class, or of its settings."""
        ...

    def solve(self, task: Task) -> Motion:
        """Solve the task; a bad design is an outcome, never an exception."""
        ...


def label(method: Any) -> str:
    """Name and settings, such as ``rk45(rtol=1e-06)``; fields without repr are in the name, or the same for all."""
    own = [f.name for f in fields(method) if f.repr]
    settings = ", ".join(f"{name}={_short(getattr(method, name))}" for name in own)
    return f"{method.name}({settings})" if settings else method.name


def _short(value: object) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)
