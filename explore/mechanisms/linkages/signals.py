"""The signals of a linkage: of its points, links, slots and joints, each with its number of the graph."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

from explore.mechanisms.linkages.equations import Equations
from explore.mechanisms.linkages.graph import Number, Series
from explore.mechanisms.linkages.table import FRAME
from explore.model.quantities import Signal

#: Beginning of the names of inputs for the middle of a link's range (rad, ":0"), its cosine (":1") and sine (":2").
REFERENCE = "@reference:"


@dataclass(frozen=True)
class Quantity:
    """A signal, whose rows are not placed yet.

    Attributes
    ----------
    signal
        The declaration.
    number
        Its number of the graph, in rad and per radian.
    link
        The link of an angle; empty for other signals.
    """

    signal: Signal
    number: Number
    link: str = ""


def find_quantities(equations: Equations) -> list[Quantity]:
    """All signals of a linkage, in the order in which they are listed."""
    table = equations.table
    fixed = {point for point, _ in table.frame.points}
    result: list[Quantity] = []
    for point in table.points:
        if point not in fixed:
            result += _of_point(point, equations)
    for body in table.links:
        if body.name != table.driver and equations.directions[body.name] is not equations.directions[FRAME]:
            result += _of_link(body.name, equations)
    for slot in table.slots:
        result += _rates(slot.name, f"pin {slot.pin} in the slot {slot.name}", equations.slot_position(slot))
    for joint, (sine, cosine) in equations.transmission.items():
        name = f"{joint}_transmission_angle"
        signal = Signal(name, "deg", f"transmission angle at {joint}", -1, 1)
        result.append(Quantity(signal, sine.call("arctangent", cosine)))
    return result


def _of_point(point: str, equations: Equations) -> Iterator[Quantity]:
    x, y = equations.points[point]
    for axis, series in (("x", x), ("y", y)):
        yield _quantity(f"{point}_{axis}", "mm", f"{axis} of {point}", series.terms[0])
    squares = []
    for order, (word, unit) in enumerate((("velocity", "mm/s"), ("acceleration", "mm/s^2")), 1):
        for axis, series in (("x", x), ("y", y)):
            below = f"{point}_{axis}" if order == 1 else f"{point}_velocity_{axis}"
            yield _quantity(
                f"{point}_{word}_{axis}",
                unit,
                f"{word} of {point} along {axis}",
                series.terms[order],
                order,
                below,
            )
        square = x.terms[order] * x.terms[order] + y.terms[order] * y.terms[order]
        squares.append(square)
        quantity = _quantity(f"{point}_{word}", unit, f"{word} of {point}, its magnitude", square, order)
        yield replace(quantity, signal=replace(quantity.signal, is_magnitude=True))
    speed = squares[0].sqrt()
    cube = squares[0] * speed
    curvature = (x.terms[1] * y.terms[2] - y.terms[1] * x.terms[2]) / cube
    long_name = f"curvature of the path of {point}, positive where it turns left"
    quantity = _quantity(f"{point}_curvature", "1/mm", long_name, curvature)
    yield replace(quantity, signal=replace(quantity.signal, has_corners=True))


def _of_link(link: str, equations: Equations) -> Iterator[Quantity]:
    graph = equations.graph
    cosine, sine = equations.directions[link]
    middle, to_cosine, to_sine = (graph.input(f"{REFERENCE}{link}:{part}") for part in range(3))
    c, s = cosine.terms[0], sine.terms[0]
    angle = middle + (s * to_cosine - c * to_sine).call("arctangent", c * to_cosine + s * to_sine)
    yield replace(_quantity(f"{link}_angle", "deg", f"angle of {link}", angle), link=link)
    for order, (word, unit) in enumerate((("velocity", "rad/s"), ("acceleration", "rad/s^2")), 1):
        rate = c * sine.terms[order] - s * cosine.terms[order]
        # The angle of a link that turns fully is not the same after a turn, so its rate has a mean.
        below = "" if order == 1 else f"{link}_velocity"
        yield _quantity(f"{link}_{word}", unit, f"angular {word} of {link}", rate, order, below)


def _rates(name: str, words: str, series: Series) -> Iterator[Quantity]:
    names = ("position", "velocity", "acceleration")
    for order, (word, unit) in enumerate(zip(names, ("mm", "mm/s", "mm/s^2"), strict=True)):
        below = f"{name}_{names[order - 1]}" if order else ""
        yield _quantity(f"{name}_{word}", unit, f"{word} of the {words}", series.terms[order], order, below)


def _quantity(
    name: str, unit: str, long_name: str, number: Number, order: int = 0, derivative_of: str = ""
) -> Quantity:
    signal = Signal(
        name, unit, long_name, -1, 1, speed_power=order, pole_order=2 + 2 * order, derivative_of=derivative_of
    )
    return Quantity(signal, number)
