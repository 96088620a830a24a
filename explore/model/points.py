"""Points of a floating link that a user names: their parameters, signals and drawing, as data.

The floating link, such as the coupler of a four-bar, turns about no pivot of the ground. A point of it has two
coordinates, along the link from the crank's pin and across it counter-clockwise, which are parameters of the design.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Any, Literal, TypeVar

import numpy as np

from explore.model.drawing import Drawing, Link, Panel, Path, Vector
from explore.model.quantities import FloatArray, Formula, Parameter, Signal

Number = TypeVar("Number")
#: Largest number of points of one mechanism: the rows of the kernels are for so many.
MOST_POINTS = 4
#: Coordinates of a point, in the order of the kernel's parameters.
COORDINATES = ("along", "across")
#: Number of the coordinates of all points.
PLACES_SIZE = len(COORDINATES) * MOST_POINTS
#: Names of the rows of the kernel's parameters for points.
SLOT_ROWS = tuple(f"POINT_{k + 1}_{coordinate.upper()}" for k in range(MOST_POINTS) for coordinate in COORDINATES)
#: Names of the rows of the constants that hold these parameters for `fill`.
PLACE_ROWS = ("PLACES", *(f"PLACES_{k}" for k in range(1, PLACES_SIZE)))
# Rows of one point: position, velocity and acceleration, each with the square of its magnitude but for the position;
# curvature of the path; sizes of the terms that these are sums of.
X, Y, VELOCITY_X, VELOCITY_Y, VELOCITY_SQUARE, ACCELERATION_X, ACCELERATION_Y, ACCELERATION_SQUARE, CURVATURE = range(9)
POSITION_TERMS, VELOCITY_TERMS, ACCELERATION_TERMS, CURVATURE_TERMS = range(9, 13)
POINT_ROWS = 13


@dataclass(frozen=True)
class FloatingLink:
    """The link of a mechanism whose points can be named.

    Attributes
    ----------
    name, pin
        Name of the link, and in words what its points are measured from.
    origin, angle
        Point of the drawing and signal in deg: where the coordinates begin, and the direction of `along`.
    first_row
        First row of the points among the signals; each point has `POINT_ROWS`. Of kernels from `kernels`, 0: they have
        rows of their own.
    first_need
        The bit of `needs` for the positions of the first point; the next is for its rates, then those of other points.
    rate_power
        Power of the speed that rows of velocities are to be multiplied by: 0 where they are per second.
    kernels
        ``kernels(mechanism, points)`` is the mechanism with these points and kernels that fill their signals beside
        its own. None where its own kernel has rows for them.
    """

    name: str
    pin: str
    origin: str
    angle: str
    first_row: int = 0
    first_need: int = 0
    rate_power: int = 1
    kernels: Callable[..., Any] | None = None


@dataclass(frozen=True)
class Extent:
    """The function of a formula that is the extent of all positions of a mechanism, and of its points, along an axis.

    `axis` is one of the drawing. `ends` takes one array of shape (n,) for each input of the formula, and returns the
    least and the greatest coordinate of the links; those of so many `points` are the last inputs.
    """

    axis: Literal["x", "y"]
    ends: Callable[..., tuple[FloatArray, FloatArray]]
    points: int = 0

    def __call__(self, *inputs: FloatArray) -> FloatArray:
        """The extent, mm; NaN where an input that it depends on is."""
        own = len(inputs) - 2 * self.points
        least, greatest = self.ends(*inputs[:own])
        for low, high in zip(inputs[own::2], inputs[own + 1 :: 2], strict=True):
            least, greatest = np.minimum(least, low), np.maximum(greatest, high)
        return greatest - least


def include_points(formula: Formula, points: tuple[str, ...], turn: str) -> Formula:
    """The formula with the extremes of the paths of points over the window `turn`, if it is an extent."""
    extent = formula.function
    if not isinstance(extent, Extent):
        return formula
    extremes = [f"{point}_{extent.axis}_{extreme}_{turn}" for point in points for extreme in ("min", "max")]
    return replace(formula, inputs=(*formula.inputs, *extremes), function=replace(extent, points=len(points)))


def record_rows(name: str, rows: Iterable[str], first: int, module: str) -> Any:
    """Rows of a record from the number `first` on, by their names; Numba's cache finds them by `name` in `module`."""
    return IntEnum(name, list(rows), start=first, module=module)


def point_parameters(link: FloatingLink, points: tuple[str, ...]) -> tuple[Parameter, ...]:
    """The coordinates of points."""
    meanings = (f"along the {link.name} from {link.pin}", f"across the {link.name}, counter-clockwise positive")
    return tuple(
        Parameter(f"{point}_{coordinate}", "mm", f"place of {point} {meaning}", None, -float("inf"), affects="point")
        for point in points
        for coordinate, meaning in zip(COORDINATES, meanings, strict=True)
    )


def coordinates(points: Iterable[str], parameters: Mapping[str, Number]) -> dict[str, tuple[Number, ...]]:
    """The coordinates of each point among the parameters of a design."""
    return {point: tuple(parameters[f"{point}_{coordinate}"] for coordinate in COORDINATES) for point in points}


def point_signals(link: FloatingLink, points: tuple[str, ...]) -> tuple[Signal, ...]:
    """The signals of points, in the order of their rows."""
    return tuple(signal for number, point in enumerate(points) for signal in _signals_of(link, number, point))


def _signals_of(link: FloatingLink, number: int, point: str) -> tuple[Signal, ...]:
    first, place = link.first_row + number * POINT_ROWS, link.first_need << (2 * number)

    def declare(
        name: str, unit: str, long_name: str, row: int, terms_row: int, power: int = 0, pole_order: int = 2,
        *, squares: bool = False, rate_of: str = "", has_own_singularities: bool = False,
    ) -> Signal:  # fmt: skip
        return Signal(
            f"{point}_{name}", unit, long_name, first + row, place if unit == "mm" else place << 1,
            power * link.rate_power, pole_order, is_magnitude=squares, terms_row=first + terms_row, point=point,
            has_own_singularities=has_own_singularities,
            derivative_of=f"{point}_{rate_of}" if rate_of and link.rate_power else "",
        )  # fmt: skip

    curvature = f"curvature of the path of {point}, positive where it turns left"
    return (
        *(declare(axis, "mm", f"{axis} of {point}", X + k, POSITION_TERMS) for k, axis in enumerate("xy")),
        *(
            # the link's direction and its rate have the same poles
            declare(f"velocity_{axis}", "mm/s", f"velocity of {point} along {axis}", VELOCITY_X + k, VELOCITY_TERMS, 1,
                    4, rate_of=axis)
            for k, axis in enumerate("xy")
        ),
        declare("velocity", "mm/s", f"velocity of {point}, its magnitude", VELOCITY_SQUARE, VELOCITY_TERMS, 1, 4,
                squares=True),
        *(
            declare(f"acceleration_{axis}", "mm/s^2", f"acceleration of {point} along {axis}", ACCELERATION_X + k,
                    ACCELERATION_TERMS, 2, 6, rate_of=f"velocity_{axis}")
            for k, axis in enumerate("xy")
        ),
        declare("acceleration", "mm/s^2", f"acceleration of {point}, its magnitude", ACCELERATION_SQUARE,
                ACCELERATION_TERMS, 2, 6, squares=True),
        # where the path would stop, at a complex angle
        declare("curvature", "1/mm", curvature, CURVATURE, CURVATURE_TERMS, has_own_singularities=True),
    )  # fmt: skip


def zero_means(points: tuple[str, ...], window: str) -> frozenset[tuple[str, str]]:
    """The pairs of a signal and the full turn over which its mean is 0: a point returns to where it was."""
    return frozenset(
        (f"{point}_{rate}_{axis}", window) for point in points for rate in ("velocity", "acceleration") for axis in "xy"
    )


def point_panels(points: tuple[str, ...]) -> tuple[Panel, ...]:
    """Panels of a motion for the signals of points."""
    return tuple(
        Panel(f"{point.replace('_', ' ')} {label}".rstrip(), tuple(f"{point}_{signal}" for signal in signals))
        for point in points
        for label, signals in (
            ("position", ("x", "y")), ("velocity", ("velocity",)), ("acceleration", ("acceleration",)),
            ("curvature", ("curvature",)),
        )
    )  # fmt: skip


def drawn_name(point: str) -> str:
    """What a drawing calls a point."""
    return f"point {point}"


def draw_points(drawing: Drawing, link: FloatingLink, points: tuple[str, ...]) -> Drawing:
    """The drawing with the paths of points, each a corner of the link."""
    first, *_, last = next(each.points for each in drawing.links if each.name == link.name)
    keys = {point: drawn_name(point) for point in points}
    vectors = {
        key: (
            *drawing.points[link.origin],
            Vector(f"{point}_along", link.angle),
            Vector(f"{point}_across", link.angle, turn=90.0),
        )
        for point, key in keys.items()
    }
    corners = tuple(Link(f"{link.name} with {point}", (first, key, last)) for point, key in keys.items())
    paths = tuple(Path(key, f"path of {point.replace('_', ' ')}", "point") for point, key in keys.items())
    return replace(
        drawing, points={**drawing.points, **vectors}, links=(*drawing.links, *corners), paths=(*drawing.paths, *paths)
    )
