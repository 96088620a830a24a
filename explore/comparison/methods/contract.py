"""Input and output of a method that solves the motion of a mechanism by its loops.

A method is a frozen dataclass whose fields are its settings. It solves a `Task` for many designs and reports an outcome
for each in place of an exception. The crank turns at 1 rad/s; angles are in rad, for n designs, t crank angles and m
unknowns of the loops.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from enum import Flag, IntEnum, auto, unique
from functools import cached_property
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from explore.comparison.methods.loop import Loop
from explore.mechanisms.loops import Columns
from explore.model.quantities import FloatArray


class Level(IntEnum):
    """Highest derivative of the motion that is computed."""

    GEOMETRY = 0
    POSITIONS = 1
    VELOCITIES = 2
    ACCELERATIONS = 3


class Capability(Flag):
    """Properties of a method."""

    #: Designs are solved together, in array operations or compiled code.
    BATCHED = auto()
    #: Crank angles are solved independently, in any order; other methods proceed from one angle to the next.
    ANY_ANGLE = auto()
    #: The step is that of the crank angles of the task; integrators choose their own.
    FOLLOWS_ANGLES = auto()
    #: A change to another assembly is detected, unless two triangles change at once: the determinant keeps its sign.
    CHECKS_BRANCH = auto()
    #: The solver is that of another package.
    PEER = auto()
    #: Only one chain is solved, in which a triangle has two unknowns.
    TRIANGLE = auto()
    #: Only a triangle with two unknown angles is solved, on a link that turns.
    TWO_ANGLES = auto()


@unique
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
    Outcome.CHANGE_POINT: "two assemblies meet at a crank angle, from where the motion may continue as either",
    Outcome.NO_MOTION: "no continuous motion exists",
    Outcome.NOT_FINITE: "a value is not a finite number",
    Outcome.NOT_CONVERGED: "the iteration did not converge; a solution may or may not exist",
    Outcome.WRONG_BRANCH: "the iteration converged to another assembly",
    Outcome.OPEN_LOOP: "the links no longer close the loop",
    Outcome.GAVE_UP: "the integrator could not find a step that keeps its tolerance",
    Outcome.RAISED: "the solver raised an exception",
}


@dataclass(frozen=True)
class Task:
    """Designs, crank angles and level of the motions to solve.

    Attributes
    ----------
    loop
        The loops to solve.
    parameters : (n, p) array
        Those of the loop.
    crank_angle : (n, t) array
        Ascending, rad. An outcome refers to the whole motion whatever these angles.
    level
        Positions, velocities or accelerations; each includes those before.
    start : (n, m) array, optional
        Approximate unknowns at the first crank angle; by default the exact ones.
    """

    loop: Loop
    parameters: FloatArray
    crank_angle: FloatArray
    level: Level = Level.ACCELERATIONS
    start: FloatArray | None = None

    def __post_init__(self) -> None:
        """Check the shapes, because wrong ones would broadcast."""
        n, p, m, angles = len(self.parameters), len(self.loop.parameters), self.loop.count, self.crank_angle
        shapes = self.parameters.shape == (n, p) and angles.shape[:1] == (n,)
        if not shapes or angles.ndim != 2 or (self.start is not None and self.start.shape != (n, m)):
            raise ValueError(f"a task needs parameters (n, {p}), crank_angle (n, t) and start (n, {m})")
        if self.level is Level.GEOMETRY:
            raise ValueError("no method solves the level geometry, which is known in closed form")

    def __len__(self) -> int:
        """Number of designs."""
        return len(self.parameters)

    @cached_property
    def columns(self) -> Columns:
        """Parameters by name, of shape (n,)."""
        return self.loop.columns(self.parameters.T)

    @cached_property
    def upright(self) -> Columns:
        """Parameters by name, of shape (n, 1)."""
        return self.loop.columns(self.parameters.T[:, :, None])

    @cached_property
    def numbers(self) -> list[list[Any]]:
        """The number of each term of the loops, of shape (n,)."""
        return self.loop.numbers(self.columns)

    @cached_property
    def exact_start(self) -> FloatArray:
        """The exact unknowns at the first crank angle, shape (n, m); NaN where there are none."""
        with np.errstate(all="ignore"):
            first = self.loop.closed.close(self.columns).fill(self.crank_angle[:, :1], self.loop.count)
        return np.asarray(first[:, :, 0].T)

    @cached_property
    def size(self) -> FloatArray:
        """The longest vector of constant length of each design."""
        return np.asarray(self.loop.size(self.columns))

    def part(self, which: npt.NDArray[Any] | slice) -> Task:
        """The same task for some of the designs."""
        start = None if self.start is None else self.start[which]
        return replace(self, parameters=self.parameters[which], crank_angle=self.crank_angle[which], start=start)


@dataclass(frozen=True)
class Motion:
    """Signals, outcomes and work of a method; NaN where it has no solution.

    Attributes
    ----------
    signals : (m level, n, t) array
        The unknowns, angles first, then as many derivatives by the crank angle.
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
        signals = np.full((task.loop.count * task.level, *task.crank_angle.shape), np.nan)
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
    def capabilities(self) -> Capability:
        """Properties, which may depend on the settings."""
        ...

    def solve(self, task: Task) -> Motion:
        """Solve the task; the failure of a design is an outcome, not an exception."""
        ...


def method_label(method: Any) -> str:
    """Name and settings of a method or an averaging rule, such as ``rk45(rtol=1e-06)``; fields with repr only."""
    names = [f.name for f in fields(method) if f.repr]
    values = ((name, getattr(method, name)) for name in names)
    settings = ", ".join(
        f"{name}={value:g}" if isinstance(value, float) else f"{name}={value}" for name, value in values
    )
    return f"{method.name}({settings})" if settings else method.name
