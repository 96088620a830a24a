"""The table of the slider-crank, by the names of its drawing: the rod's coordinates begin at the crank's pin."""

from explore.mechanisms.linkages.coordinate import ZERO, constant, length
from explore.mechanisms.linkages.table import FRAME, Body, LinkageTable, Slot, TableParameter

_ORIGIN = ZERO, ZERO
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
