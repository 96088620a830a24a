"""The table of the slider-crank, by the names of its drawing: the rod's coordinates begin at the crank's pin."""

from collections.abc import Mapping
from dataclasses import replace

from explore.mechanisms.linkages.coordinate import ZERO, Coordinate, constant, joined, length
from explore.mechanisms.linkages.equations import Equations
from explore.mechanisms.linkages.load_table import Element, Loads, Mass, PointForce
from explore.mechanisms.linkages.quantity import Quantity
from explore.mechanisms.linkages.table import FRAME, Body, LinkageTable, Slot, TableParameter, parameter_of_table
from explore.mechanisms.slider_crank.loads import PARAMETERS

#: Signal of the table for each of these signals of `loads`.
_SIGNALS = {
    "guide_force": "slider_normal_force", "crank_pivot_force": "crank pivot_force_on_frame",
    "crank_pin_force": "crank pin_force_on_rod", "slider_pin_force": "slider pin_force_on_rod",
}  # fmt: skip

_ORIGIN = ZERO, ZERO


def _middle() -> Coordinate:
    """The slider's position at mid-stroke."""
    crank, rod, offset = map(length, ("crank", "rod", "offset"))
    ends = (joined("sqrt", reach * reach - offset * offset) for reach in (rod + crank, rod - crank))
    return constant(0.5) * joined("+", *ends)


def _loads() -> Loads:
    """The loads of `loads`."""
    elements = (
        Element("opposing", "slider", ("slider",), length("opposing_force")),
        Element("damper", "slider", ("slider",), length("damping")),
        Element("friction", "slider", ("slider",), length("friction")),
        Element("spring", "slider", ("slider",), length("stiffness"), _middle()),
    )
    crank, rod = (
        (length(f"{link}_mass"), (length(f"{link}_centroid") * length(link), ZERO)) for link in ("crank", "rod")
    )
    return Loads(
        gravity=(ZERO, joined("negate", length("gravity"))),
        masses=(
            Mass("slider pin", length("mass"), "slider pin", ZERO),
            Mass("crank", *crank, ZERO),
            Mass("rod", *rod, length("rod_inertia")),
        ),
        forces=(PointForce("slider pin", (length("constant_force"), ZERO)),),
        elements=elements,
    )


def signals_of_slider_crank(_equations: Equations, quantities: Mapping[str, Quantity]) -> dict[str, Quantity]:
    """The signals of `loads` by those of the table."""
    along = quantities["slider pin_force_on_rod_x"]
    return {
        **{name: quantities[source] for name, source in _SIGNALS.items()},
        "thrust": replace(along, number=-along.number),
    }


TABLE = LinkageTable(
    driver="crank",
    output="slider",
    frame=Body(FRAME, (("crank pivot", _ORIGIN),)),
    links=(
        Body("crank", (("crank pivot", _ORIGIN), ("crank pin", (length("crank"), ZERO)))),
        Body("rod", (("crank pin", _ORIGIN), ("slider pin", (length("rod"), ZERO)))),
    ),
    slots=(Slot("slider", "slider pin", FRAME, ((ZERO, length("offset")), (constant(1.0), length("offset")))),),
    slides=(),
    parameters=(
        TableParameter("crank", "mm", lower=0.0),
        TableParameter("rod", "mm", lower=0.0),
        TableParameter("offset", "mm"),
    ),
)
#: Table under load.
LOADED_TABLE = replace(TABLE, parameters=(*TABLE.parameters, *map(parameter_of_table, PARAMETERS)), loads=_loads())
