"""Input and output of a method that solves the motion of mechanisms with one loop.

A method is a frozen dataclass whose fields are its settings. It solves a `Task` for many designs and reports an outcome
for each in place of an exception. The crank turns at 1 rad/s; angles are in rad, for n designs and t crank angles. The
loop is that of the four-bar linkage unless a task names another.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from enum import Flag, IntEnum, auto
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from explore.comparison.methods.four_bar_loop import FOUR_BAR
from explore.comparison.methods.vector_loop import VectorLoop
from explore.model.quantities import FloatArray


class MotionRow(IntEnum):
    """Rows of `Motion.signals` of a four-bar; a level fills the first two, four or six."""

    COUPLER_ANGLE = 0
    ROCKER_ANGLE = 1
    COUPLER_VELOCITY = 2
    ROCKER_VELOCITY = 3
    COUPLER_ACCELERATION = 4
    ROCKER_ACCELERATION = 5


class Level(IntEnum):
    """Highest derivative of the motion that is computed."""

    GEOMETRY = 0
    POSITIONS = 1
    VELOCITIES = 2
    ACCELERATIONS = 3

    @property
    def rows(self) -> slice:
        """The two rows of `Motion.signals` that this level adds to the one below."""
        return slice(2 * self - 2, 2 * self)


class Capability(Flag):
    """Properties of a method."""

    #: Designs are solved together, in array operations or compiled code.
    BATCHED = auto()
    #: Crank angles are solved independently, in any order; other methods proceed from one angle to the next.
    ANY_ANGLE = auto()
    #: The step is that of the crank angles of the task; integrators choose their own.
    FOLLOWS_ANGLES = auto()
    #: A change to the other branch is detected.
    CHECKS_BRANCH = auto()
    #: The solver is that of another package.
    PEER = auto()
    #: Only four-bar linkages are solved.
    FOUR_BAR_ONLY = auto()


class Outcome(IntEnum):
    """Result for one design as reported by the method."""

    OK = 1
    CANNOT_ASSEMBLE = 2
    CRANK_BLOCKED = 3
    CHANGE_POINT = 4
    NO_MOTION = 5
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
        """Meaning of the outcome in words."""
        return _SENTENCES[self]


_SENTENCES = {
    Outcome.OK: "solved",
    Outcome.CANNOT_ASSEMBLE: "the links cannot be assembled",
    Outcome.CRANK_BLOCKED: "the crank cannot turn fully",
    Outcome.CHANGE_POINT: "all links fall into one line, from where the motion may continue on either branch",
    Outcome.NO_MOTION: "no continuous motion exists",
    Outcome.NOT_FINITE: "a value is not a finite number",
    Outcome.NOT_CONVERGED: "the iteration did not converge; a solution may or may not exist",
    Outcome.WRONG_BRANCH: "the iteration converged to the other branch",
    Outcome.OPEN_LOOP: "the links no longer close the loop",
    Outcome.GAVE_UP: "the integrator could not find a step that keeps its tolerance",
    Outcome.RAISED: "the solver raised an exception",
}


@dataclass(frozen=True)
class Task:
    """Designs, crank angles and level of the motions to solve.

    Attributes
    ----------
    parameters : (n, p) array
        Those of the loop, of a four-bar crank, coupler, rocker, ground, in any one unit.
    branch : (n,) array
        1, or -1 for the other solution of the loop: for a four-bar, on which side of the line from crank pin to rocker
        pivot the coupler joint lies.
    crank_angle : (n, t) array
        Ascending, rad. An outcome refers to a full turn whatever these angles.
    level
        Positions, velocities or accelerations; each includes those before.
    start : (n, 2) array, optional
        Approximate unknowns, of a four-bar coupler and rocker angle, at the first crank angle; by default the exact
        ones.
    loop
        The loop to solve.
    """

    parameters: FloatArray
    branch: FloatArray
    crank_angle: FloatArray
    level: Level = Level.ACCELERATIONS
    start: FloatArray | None = None
    loop: VectorLoop = FOUR_BAR

    def __post_init__(self) -> None:
        """Check the shapes, because wrong ones would broadcast."""
        n, p, angles = len(self.parameters), len(self.loop.parameters), self.crank_angle
        shapes = self.parameters.shape == (n, p) and self.branch.shape == (n,) and angles.shape[:1] == (n,)
        if not shapes or angles.ndim != 2 or (self.start is not None and self.start.shape != (n, 2)):
            raise ValueError(f"a task needs parameters (n, {p}), branch (n,), crank_angle (n, t) and start (n, 2)")
        if self.level is Level.GEOMETRY:
            raise ValueError("no method solves the level geometry, which is known in closed form")

    def __len__(self) -> int:
        """Number of designs."""
        return len(self.parameters)

    def part(self, which: npt.NDArray[Any] | slice) -> Task:
        """The same task for some of the designs."""
        start = None if self.start is None else self.start[which]
        return replace(
            self,
            parameters=self.parameters[which],
            branch=self.branch[which],
            crank_angle=self.crank_angle[which],
            start=start,
        )


@dataclass(frozen=True)
class Motion:
    """Signals, outcomes and work of a method; NaN where it has no solution.

    Attributes
    ----------
    signals : (2 level, n, t) array
        Both unknowns and as many derivatives: for a four-bar in the order of `MotionRow`, rad, 1, 1/rad.
    outcome : (n,) array
        An `Outcome` for each design.
    evaluations : (n,) array
        Number of evaluations of positions, residuals, rates and corrections.
    iterations : (n,) array
        Number of steps of the iteration or integration; 0 for a method without steps.
    """

    signals: FloatArray
    outcome: npt.NDArray[np.int8]
    evaluations: npt.NDArray[np.int64]
    iterations: npt.NDArray[np.int64]

    @classmethod
    def blank(cls, task: Task) -> Motion:
        """A motion to be filled: all signals NaN, all outcomes OK, no work."""
        n = len(task)
        signals = np.full((2 * task.level, *task.crank_angle.shape), np.nan)
        outcome = np.full(n, Outcome.OK, dtype=np.int8)
        return cls(signals, outcome, np.zeros(n, dtype=np.int64), np.zeros(n, dtype=np.int64))

    def assign(self, which: npt.NDArray[Any] | slice, part: Motion) -> None:
        """Set the motion of some of the designs."""
        self.signals[:, which] = part.signals
        self.outcome[which] = part.outcome
        self.evaluations[which] = part.evaluations
        self.iterations[which] = part.iterations


class Method(Protocol):
    """A method to solve motions, with its settings."""

    @property
    def name(self) -> str:
        """Key in the registry."""
        ...

    @property
    def summary(self) -> str:
        """Description in one line."""
        ...

    @property
    def capabilities(self) -> Capability:
        """Properties, which may depend on the settings."""
        ...

    def solve(self, task: Task) -> Motion:
        """Solve the task; the failure of a design is an outcome, not an exception."""
        ...


def method_label(method: Any) -> str:
    """Name and settings of a method or an averaging rule, such as ``rk45(rtol=1e-06)``; fields with repr only."""
    names = [f.name for f in fields(method) if f.repr]
    settings = ", ".join(f"{name}={_format_setting(getattr(method, name))}" for name in names)
    return f"{method.name}({settings})" if settings else method.name


def _format_setting(value: object) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)
