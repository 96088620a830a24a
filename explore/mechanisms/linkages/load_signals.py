"""The signals of a linkage under load, and the metrics that follow from them."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from explore.mechanisms.linkages.coordinate import Coordinate
from explore.mechanisms.linkages.curves import levels_of_curve, place_unit
from explore.mechanisms.linkages.equations import Equations
from explore.mechanisms.linkages.expressions import evaluate_coordinate
from explore.mechanisms.linkages.friction import balance_friction
from explore.mechanisms.linkages.graph import Number
from explore.mechanisms.linkages.load_table import Curve, Loads
from explore.mechanisms.linkages.loads import SPEED, Loading
from explore.mechanisms.linkages.quantity import Quantity
from explore.mechanisms.linkages.reactions import Reactions
from explore.mechanisms.linkages.table import FRAME, LinkageTable
from explore.mechanisms.load_metrics import ENERGY_FLUCTUATION, NET_WORK_OF_DRIVE, WORK_FORMULAS, largest
from explore.model.drawing import Panel
from explore.model.quantities import FloatArray, Formula, Signal

_TORQUE = "drive_torque"
#: Signal of how near friction is to locking, where its forces are solved for together.
_LOCK_RATIO = "lock_ratio"
#: Pole order of products of accelerations and velocities.
_POLE_ORDER = 6


def find_load_quantities(equations: Equations) -> Iterator[Quantity]:
    """The signals under load of a linkage; none where its table has no loads."""
    table = equations.table
    if table.loads is None:
        return
    loading = Loading(equations, table.loads)
    reactions, sizes, sum_of_gains = balance_friction(equations, loading)
    loading.take_friction(reactions.across, sizes)
    yield from _find_curves(loading, table, table.loads)
    yield from _find_rates(equations, loading)
    torque = loading.torque
    if not table.driven_slot:
        words = "torque of the drive on the driver, counter-clockwise positive"
        of_driver = _quantity(loading, torque, _TORQUE, "N m", words, 0)
        signal = replace(of_driver.signal, has_fluctuation=table.limits is None)
        yield replace(of_driver, signal=signal, lag_rate=loading.lag_rate)
    yield _quantity(loading, torque, "drive_power", "W", "power of the drive")
    positive = torque.call("maximum", equations.graph.constant(0.0))
    yield _quantity(
        loading, positive, "positive_power", "W", "power of the drive where it drives, else 0",
        corners_at=("drive_power",),
    )  # fmt: skip
    if table.loads.lose_power:
        words = "power that dampers, friction and what opposes motions take"
        yield _quantity(loading, loading.loss, "friction_power", "W", words)
    if sum_of_gains is not None:
        words = "friction over that at which it may lock"
        ratio = _quantity(loading, sum_of_gains, _LOCK_RATIO, "1", words, 0)
        yield replace(ratio, signal=replace(ratio.signal, corner_levels=(1.0,)))
    yield from _find_forces(loading, reactions, table, table.loads)


def _find_rates(equations: Equations, loading: Loading) -> Iterator[Quantity]:
    """The rates against friction of pins and slides; of links against the frame they are signals of the links."""
    for bearing in loading.bearings.values():
        if bearing.holder != FRAME and bearing.rate.value is None:
            words = f"angular velocity of {bearing.link} against {bearing.holder} at {bearing.pin}"
            signal = Signal(bearing.turning, "rad/s", words, -1, 1, speed_power=1, pole_order=4)
            yield Quantity(signal, bearing.rate)
    for slide in (each for each in equations.table.slides if each.sliding in loading.senses):
        words = f"velocity of {slide.link} along its direction against {slide.body}"
        rate = equations.slide_position(slide).terms[1]
        yield Quantity(Signal(slide.sliding, "mm/s", words, -1, 1, speed_power=1, pole_order=4), rate)


def _find_curves(loading: Loading, table: LinkageTable, loads: Loads) -> Iterator[Quantity]:
    """The place and the value of each curve."""
    for curve in loads.curves:
        name, unit, words = place_signal(curve), place_unit(table, curve), f"place that the curve {curve.name} is over"
        place = _quantity(loading, loading.places[curve.name], name, unit, words, 0)
        yield replace(place, signal=replace(place.signal, corner_levels=levels_of_curve(table, curve)))
        value, words = loading.values[curve.name], f"value of the curve {curve.name}, in the unit of its loads"
        yield _quantity(loading, value, f"{curve.name}_value", "1", words, 0)


def _find_forces(loading: Loading, reactions: Reactions, table: LinkageTable, loads: Loads) -> Iterator[Quantity]:
    """The forces in the joints, and how near friction is to locking them."""
    for name, ratio in reactions.lock_ratios.items():
        words = f"friction of the slot {name} over that at which it locks"
        quantity = _quantity(loading, ratio, f"{name}_lock_ratio", "1", words, 0)
        yield replace(quantity, signal=replace(quantity.signal, corner_levels=(-1.0, 1.0)))
    if table.driven_slot:
        words = f"force that drives {table.driven_slot.pin} along {table.driver}"
        yield _quantity(loading, reactions.along, "drive_force", "N", words, 0)
    for point, body in force_places(table, loads):
        x, y = reactions.on_bodies[point, body]
        name, words = f"{point}_force_on_{body}", f"force of pin {point} on {body}"
        square = _quantity(loading, x * x + y * y, name, "N", f"{words}, its magnitude", 0)
        yield replace(square, signal=replace(square.signal, is_magnitude=True))
        yield _quantity(loading, x, f"{name}_x", "N", f"{words} along x", 0)
        yield _quantity(loading, y, f"{name}_y", "N", f"{words} along y", 0)
    for slot in table.slots:
        words = f"force of the slot {slot.name} on {slot.pin}, to the left of its direction positive"
        yield _quantity(loading, reactions.across[slot.name], f"{slot.name}_normal_force", "N", words, 0)
    for slide in table.slides:
        words = f"force of {slide.body} on {slide.link}, to the left of its direction positive"
        yield _quantity(loading, reactions.across[slide.link], f"{slide.link}_normal_force", "N", words, 0)


def force_places(table: LinkageTable, loads: Loads) -> Iterator[tuple[str, str]]:
    """The points where bodies take up forces, each with each body that has the point."""
    pins = {slot.pin for slot in table.slots} | {force.point for force in loads.forces}
    pins |= {mass.owner for mass in loads.masses}.union(*(element.ends for element in loads.elements))
    for point in table.points:
        bodies = table.bodies_at(point)
        if len(bodies) > 1 or point in pins:
            yield from ((point, body.name) for body in bodies)


def _quantity(
    loading: Loading, number: Number, name: str, unit: str, long_name: str, speed_power: int = 1,
    corners_at: tuple[str, ...] = (),
) -> Quantity:  # fmt: skip
    whats = ("normal_force",) if loading.needs_sizes else ("lock_ratio", "normal_force")
    rough = [f"{slot}_{what}" for slot in loading.loads.rough for what in whats]
    rough += [_LOCK_RATIO] if loading.needs_sizes else []
    # A force that passes through 0 has a corner in its size, such as that along a link without a mass.
    rough += [f"{each.pin}_force_on_{each.body}_x" for each in loading.bearings.values()]
    corners_at = (*corners_at, *loading.senses, *map(place_signal, loading.loads.curves), *rough)
    signal = Signal(
        name, unit, long_name, -1, 1, speed_power=speed_power, pole_order=_POLE_ORDER, depends_on_load=True,
        has_corners=bool(corners_at), corners_at=corners_at, needs_stroke=loading.loads.need_strokes,
        has_own_singularities=bool(loading.bearings),  # where the force of a pin is 0
    )  # fmt: skip
    return Quantity(signal, number, tuple(dict.fromkeys(loading.angles)), tuple(loading.squares))


def place_signal(curve: Curve) -> str:
    """The name of the signal of the place that a curve is over."""
    return f"{curve.name}_place"


def load_formulas(table: LinkageTable, window: str) -> tuple[Formula, ...]:
    """The largest force over a window, and works of the drive in a turn where the driver turns fully."""
    if table.loads is None:
        return ()
    peaks = tuple(f"{point}_force_on_{body}_max_{window}" for point, body in force_places(table, table.loads))
    words = f"largest force in a pin over the {'turn' if window == 'cycle' else window}"
    peak = Formula("pin_force_peak", "N", words, "min", peaks, largest, selects_one=True)
    if table.limits is not None:
        return (peak,)
    positive, net = WORK_FORMULAS
    works = (positive, net) if table.loads.lose_power else (positive,)
    works = (positive, NET_WORK_OF_DRIVE) if table.loads.gain_power else works
    return (peak, *works) if table.driven_slot else (peak, *works, ENERGY_FLUCTUATION, *_motor_formulas(table.loads))


def _motor_formulas(loads: Loads) -> tuple[Formula, ...]:
    """How much the speed fluctuates, to first order, and the largest torque of the motor."""
    if loads.motor is None:
        return ()
    names = tuple(dict.fromkeys((*loads.motor.flywheel.names, SPEED)))
    return (
        Formula("speed_fluctuation", "1", "greatest less least speed of the driver, over its mean, to first order",
                "min", (f"{_TORQUE}_lagged_fluctuation_cycle", *names), _Fluctuation(loads.motor.flywheel, names),
                is_proportional=True),
        Formula("motor_torque_max", "N m", "largest torque of the motor, to first order", "min",
                (f"{_TORQUE}_lagged_max_cycle",), np.positive, is_proportional=True),
    )  # fmt: skip


@dataclass(frozen=True)
class _Fluctuation:
    """How much the speed of a flywheel fluctuates that stores an energy; the parameters have these names."""

    flywheel: Coordinate
    names: tuple[str, ...]

    def __call__(self, energy: FloatArray, *columns: FloatArray) -> FloatArray:
        given = dict(zip(self.names, columns, strict=True))
        return np.asarray(energy / (evaluate_coordinate(self.flywheel, given) * given[SPEED] ** 2))


def sense_signals(equations: Equations) -> tuple[str, ...]:
    """The signals whose signs loads jump with, in the order of `graph.SENSES`."""
    loads = equations.table.loads
    return tuple(Loading(equations, loads).senses) if loads else ()


def balanced_signals(table: LinkageTable) -> tuple[str, ...]:
    """The signals whose mean over the turn is exactly 0, as all loads give back what they take."""
    if table.loads is None or table.loads.lose_power or table.loads.gain_power:
        return ()
    return ("drive_power",) if table.driven_slot else (_TORQUE, "drive_power")


def load_panels(table: LinkageTable) -> tuple[Panel, ...]:
    """Panels of a motion under load."""
    if table.loads is None:
        return ()
    names = [f"{point}_force_on_{body}" for point, body in force_places(table, table.loads) if body == FRAME]
    guides = [*(slot.name for slot in table.slots), *(slide.link for slide in table.slides)]
    panels = (
        Panel("drive force", ("drive_force",))
        if table.driven_slot
        else Panel("drive torque", (_TORQUE,), shows_mean=True),
        Panel("drive power", ("drive_power",), shows_mean=True),
        Panel("forces on the frame", tuple(names)),
        Panel("normal forces", tuple(f"{name}_normal_force" for name in guides)),
    )
    return tuple(panel for panel in panels if panel.signals)
