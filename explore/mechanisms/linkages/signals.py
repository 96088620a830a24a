"""The signals of a linkage: of its points, links, slots and joints, each with its number of the graph."""

from collections.abc import Iterator
from dataclasses import replace

from explore.mechanisms.linkages.equations import Equations
from explore.mechanisms.linkages.graph import Number, Series
from explore.mechanisms.linkages.load_signals import find_load_quantities
from explore.mechanisms.linkages.quantity import Quantity
from explore.mechanisms.linkages.table import FRAME
from explore.model.quantities import Signal


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
    for slide in table.slides:
        if slide.link in table.sliders:
            result += _rates(slide.link, f"link {slide.link} along {slide.body}", equations.slide_position(slide))
    for joint, (sine, cosine) in equations.transmission.items():
        name = f"{joint}_transmission_angle"
        signal = Signal(name, "deg", f"transmission angle at {joint}", -1, 1)
        result.append(Quantity(signal, sine.call("arctangent", cosine)))
    return [*result, *find_load_quantities(equations)]


def _of_point(point: str, equations: Equations) -> Iterator[Quantity]:
    x, y = equations.points[point]
    for axis, series in (("x", x), ("y", y)):
        yield _quantity(f"{point}_{axis}", "mm", f"{axis} of {point}", series.terms[0])
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
        quantity = _quantity(f"{point}_{word}", unit, f"{word} of {point}, its magnitude", square, order)
        yield replace(quantity, signal=replace(quantity.signal, is_magnitude=True))
    curvature, link = equations.curvature(point)
    long_name = f"curvature of the path of {point}, positive where it turns left"
    quantity = _quantity(f"{point}_curvature", "1/mm", long_name, curvature)
    jumps_at = (f"{link}_velocity",) if link else ()
    signal = replace(quantity.signal, has_own_singularities=not link, has_corners=bool(link), corners_at=jumps_at)
    yield replace(quantity, signal=signal)


def _of_link(link: str, equations: Equations) -> Iterator[Quantity]:
    yield replace(_quantity(f"{link}_angle", "deg", f"angle of {link}", equations.angle_of(link)), links=(link,))
    rates = zip(("velocity", "acceleration"), ("rad/s", "rad/s^2"), equations.turning_of(link), strict=True)
    for order, (word, unit, rate) in enumerate(rates, 1):
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
