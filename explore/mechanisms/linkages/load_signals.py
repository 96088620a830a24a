"""The signals of a linkage under load, and the metrics that follow from them."""

from collections.abc import Iterator

from explore.mechanisms.linkages.equations import Equations
from explore.mechanisms.linkages.graph import Number
from explore.mechanisms.linkages.loads import Loading
from explore.mechanisms.linkages.quantity import Quantity
from explore.mechanisms.linkages.table import LinkageTable
from explore.mechanisms.load_metrics import WORK_FORMULAS
from explore.model.drawing import Panel
from explore.model.quantities import Formula, Signal

_TORQUE = "drive_torque"
#: Pole order of products of accelerations and velocities.
_POLE_ORDER = 6


def find_load_quantities(equations: Equations) -> Iterator[Quantity]:
    """The signals under load of a linkage; none where its table has no loads."""
    table = equations.table
    if table.loads is None:
        return
    loading = Loading(equations, table.loads)
    torque = loading.torque
    if not table.driven_slot:
        yield _quantity(
            loading, torque, _TORQUE, "N m", "torque of the drive on the driver, counter-clockwise positive", 0
        )
    yield _quantity(loading, torque, "drive_power", "W", "power of the drive")
    positive = torque.call("maximum", equations.graph.constant(0.0))
    yield _quantity(
        loading, positive, "positive_power", "W", "power of the drive where it drives, else 0", corners_at="drive_power"
    )
    if loses_power(table):
        yield _quantity(loading, loading.loss, "friction_power", "W", "power that dampers take")


def _quantity(
    loading: Loading, number: Number, name: str, unit: str, long_name: str, speed_power: int = 1, corners_at: str = ""
) -> Quantity:
    signal = Signal(
        name, unit, long_name, -1, 1, speed_power=speed_power, pole_order=_POLE_ORDER, depends_on_load=True,
        has_corners=corners_at != "", corners_at=corners_at,
    )  # fmt: skip
    return Quantity(signal, number, tuple(dict.fromkeys(loading.angles)), tuple(loading.squares))


def loses_power(table: LinkageTable) -> bool:
    """Whether loads take power whichever way the linkage moves."""
    return table.loads is not None and any(element.kind == "damper" for element in table.loads.elements)


def load_formulas(table: LinkageTable) -> tuple[Formula, ...]:
    """Works of the drive in a turn; none where the driver does not turn fully."""
    if table.loads is None or table.limits is not None:
        return ()
    return tuple(formula for formula in WORK_FORMULAS if formula.name == "positive_work" or loses_power(table))


def balanced_signals(table: LinkageTable) -> tuple[str, ...]:
    """The signals whose mean over the turn is exactly 0, as all loads give back what they take."""
    if table.loads is None or loses_power(table) or any(each.kind == "torque" for each in table.loads.elements):
        return ()
    return ("drive_power",) if table.driven_slot else (_TORQUE, "drive_power")


def load_panels(table: LinkageTable) -> tuple[Panel, ...]:
    """Panels of a motion under load."""
    if table.loads is None:
        return ()
    torque = () if table.driven_slot else (Panel("drive torque", (_TORQUE,), shows_mean=True),)
    return (*torque, Panel("drive power", ("drive_power",), shows_mean=True))
