"""The vector loop of a mechanism: its gap, Newton's correction, velocities and accelerations of two unknowns.

::

    k(phi) + u + v = 0

The known vector k depends on the input angle. Each of u and v has one unknown: the angle of a link of known length, or
the length of a vector of known direction. With J = (du/dx, dv/dy), which Cramer's rule inverts,

    J (x, y)' = -(k' + carried),    J (x, y)'' = -(k'' + carried twice),

where the carried terms are those of a vector at constant rates of both unknowns. All functions broadcast; parameters
are on the first axis. Sums of large terms cancel where they do in textbooks (Norton, Design of Machinery, sections 4.5,
6.7 and 7.3), as the comparison shows.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from explore.model.mechanism import Mechanism
from explore.model.quantities import FloatArray

#: Components x and y: floats, or arrays that broadcast.
Vector = tuple[Any, Any]


@dataclass(frozen=True)
class UnknownAngle:
    """A link of known length whose angle is unknown; the sign is -1 if it is passed from its end to its start."""

    length: int
    sign: float = 1.0

    def vector(self, parameters: Any, unknown: Any, _direction: Vector, functions: Any) -> tuple[Vector, Vector]:
        """The vector, and its derivative by the unknown."""
        size = self.sign * parameters[self.length]
        x, y = size * functions.cos(unknown), size * functions.sin(unknown)
        return (x, y), (-y, x)

    def carry(self, total: Vector, _vector: Vector, _derivative: Vector) -> Vector:
        """Add the derivative by the input angle at a constant unknown."""
        return total

    def carry_twice(self, total: Vector, vector: Vector, _derivative: Vector, rate: Any) -> Vector:
        """Add the second derivative by the input angle at a constant rate of the unknown."""
        return total[0] - rate * rate * vector[0], total[1] - rate * rate * vector[1]

    def scale(self, size: Any) -> Any:
        """What errors of the unknown are relative to."""
        return np.ones_like(size)


@dataclass(frozen=True)
class UnknownLength:
    """A vector of unknown length along the x axis, or along the input link; the sign is as of `UnknownAngle`."""

    sign: float
    turns: bool

    def direction(self, direction: Vector) -> Vector:
        """Derivative of the vector by its length; `direction` is that of the input link."""
        return (self.sign * direction[0], self.sign * direction[1]) if self.turns else (self.sign, 0.0)

    def vector(self, _parameters: Any, unknown: Any, direction: Vector, _functions: Any) -> tuple[Vector, Vector]:
        """The vector, and its derivative by the unknown."""
        x, y = self.direction(direction)
        return (unknown * x, unknown * y), (x, y)

    def carry(self, total: Vector, vector: Vector, _derivative: Vector) -> Vector:
        """Add the derivative by the input angle at a constant unknown."""
        return (total[0] - vector[1], total[1] + vector[0]) if self.turns else total

    def carry_twice(self, total: Vector, vector: Vector, derivative: Vector, rate: Any) -> Vector:
        """Add the second derivative by the input angle at a constant rate of the unknown."""
        if not self.turns:
            return total
        twice = 2.0 * rate
        return total[0] - twice * derivative[1] - vector[0], total[1] + twice * derivative[0] - vector[1]

    def scale(self, size: Any) -> Any:
        """What errors of the unknown are relative to."""
        return size


def _solve(first: Vector, second: Vector, x: Any, y: Any) -> tuple[Any, Any]:
    """Solve the linear equations with two columns by Cramer's rule."""
    (a, b), (c, d) = first, second
    determinant = a * d - b * c
    return (x * d - y * c) / determinant, (y * a - x * b) / determinant


class LinearLoop(NamedTuple):
    """The loop about given unknowns: both vectors with their derivatives, and the gap."""

    first: Vector
    first_derivative: Vector
    second: Vector
    second_derivative: Vector
    gap: Vector

    @property
    def determinant(self) -> Any:
        """Determinant of the Jacobian."""
        (a, b), (c, d) = self.first_derivative, self.second_derivative
        return a * d - b * c

    def solve(self, x: Any, y: Any) -> tuple[Any, Any]:
        """Solve the Jacobian's linear equations for right-hand sides."""
        return _solve(self.first_derivative, self.second_derivative, x, y)

    def correction(self) -> tuple[Any, Any]:
        """Newton's step of both unknowns."""
        return self.solve(-self.gap[0], -self.gap[1])


@dataclass(frozen=True, eq=False, kw_only=True)
class VectorLoop:
    """The loop of a mechanism, and what the methods need to know of it.

    Attributes
    ----------
    mechanism
        The mechanism with this loop.
    parameters, links
        The parameters that the loop depends on, and which of them are lengths of links.
    names
        Names of both unknowns.
    first, second
        Their vectors.
    known
        ``known(parameters, input_angle, direction, order)``: the known vector, or its derivative of an order up to 2;
        `direction` is cosine and sine of the input angle.
    orientation
        ``orientation(parameters, input_angle)``: sign of the Jacobian's determinant on branch 1.
    status
        ``status(parameters)``: code of each design, for parameters of shape (n, p).
    fill_closed_form
        ``fill_closed_form(parameters, branch, input_angle, signals)`` fills signals of shape (2 level, n, t).
    derive
        ``derive(motion, parameters)``: the signals of the mechanism, by their rows, that follow from the unknowns and
        their derivatives, shape (6, t), of one design; in the kernel's units.
    fallback
        Unknowns from which an iteration starts where the closed form has none, on branch 1.
    """

    mechanism: Mechanism
    parameters: tuple[str, ...]
    links: slice
    names: tuple[str, str]
    first: UnknownAngle | UnknownLength
    second: UnknownAngle
    known: Callable[[Any, Any, Vector, int], Vector]
    orientation: Callable[[Any, Any], Any]
    status: Callable[[FloatArray], npt.NDArray[np.int8]]
    fill_closed_form: Callable[[FloatArray, FloatArray, FloatArray, FloatArray], None]
    derive: Callable[[FloatArray, FloatArray], dict[int, FloatArray]]
    fallback: tuple[float, float] = (0.0, 0.0)

    @property
    def name(self) -> str:
        """Name of the mechanism."""
        return self.mechanism.name

    def size(self, parameters: FloatArray) -> FloatArray:
        """The longest link; parameters on the first axis."""
        return np.asarray(np.abs(parameters[self.links]).max(axis=0))

    def scales(self, parameters: FloatArray) -> FloatArray:
        """Scales of the errors of both unknowns, first axis 2: 1 rad or the longest link."""
        size = self.size(parameters)
        return np.stack([self.first.scale(size), self.second.scale(size)])

    def linearise(self, parameters: Any, angle: Any, first: Any, second: Any) -> LinearLoop:
        """The loop about given unknowns."""
        direction = np.cos(angle), np.sin(angle)
        u, du = self.first.vector(parameters, first, direction, np)
        v, dv = self.second.vector(parameters, second, direction, np)
        k = self.known(parameters, angle, direction, 0)
        return LinearLoop(u, du, v, dv, (k[0] + u[0] + v[0], k[1] + u[1] + v[1]))

    def gap(self, parameters: Any, angle: Any, first: Any, second: Any) -> FloatArray:
        """Components x and y of the gap in the loop, in the unit of the lengths, first axis 2."""
        return np.stack(np.broadcast_arrays(*self.linearise(parameters, angle, first, second).gap))

    def rate_terms(self, parameters: Any, angle: Any, loop: LinearLoop) -> Vector:
        """Right-hand sides of the linear equations for the rates of both unknowns."""
        known = self.known(parameters, angle, (np.cos(angle), np.sin(angle)), 1)
        total = self.first.carry(known, loop.first, loop.first_derivative)
        x, y = self.second.carry(total, loop.second, loop.second_derivative)
        return -x, -y

    def acceleration_terms(self, parameters: Any, angle: Any, loop: LinearLoop, rates: Any) -> Vector:
        """Right-hand sides of the linear equations for the second derivatives of both unknowns."""
        total = self.known(parameters, angle, (np.cos(angle), np.sin(angle)), 2)
        total = self.first.carry_twice(total, loop.first, loop.first_derivative, rates[0])
        x, y = self.second.carry_twice(total, loop.second, loop.second_derivative, rates[1])
        return -x, -y

    def rates(self, parameters: Any, angle: Any, first: Any, second: Any, functions: Any = np) -> tuple[Any, Any]:
        """First derivatives of both unknowns by the input angle; `functions` is `math` for floats."""
        direction = functions.cos(angle), functions.sin(angle)
        u, du = self.first.vector(parameters, first, direction, functions)
        v, dv = self.second.vector(parameters, second, direction, functions)
        x, y = self.second.carry(self.first.carry(self.known(parameters, angle, direction, 1), u, du), v, dv)
        return _solve(du, dv, -x, -y)

    def fill_signals(self, signals: FloatArray, parameters: Any, angle: Any, first: Any, second: Any) -> None:
        """Fill ``signals[2 level, …]`` with the unknowns, and as far as it has rows with their derivatives."""
        signals[0], signals[1] = first, second
        with np.errstate(all="ignore"):  # at a singular position the quotients are not finite
            loop = self.linearise(parameters, angle, first, second)
            if len(signals) > 2:
                signals[2], signals[3] = loop.solve(*self.rate_terms(parameters, angle, loop))
            if len(signals) > 4:
                signals[4], signals[5] = loop.solve(*self.acceleration_terms(parameters, angle, loop, signals[2:4]))

    def mirror(self, parameters: Any, angle: Any, first: Any, second: Any) -> FloatArray:
        """The unknowns on the other branch, from the ones on this branch, first axis 2."""
        direction = np.cos(angle), np.sin(angle)
        x, y = self.known(parameters, angle, direction, 0)
        if isinstance(self.first, UnknownAngle):
            twice = 2.0 * np.arctan2(y, x)
            return np.stack([twice - first, twice - second])
        dx, dy = self.first.direction(direction)
        other = -2.0 * (x * dx + y * dy) - first
        return np.stack([other, np.arctan2(-(y + other * dy), -(x + other * dx))])
