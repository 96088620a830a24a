"""The table of a four-bar, by the names of its drawing: the coupler's coordinates begin at the joint with the crank."""

from explore.mechanisms.linkages.coordinate import ZERO, length
from explore.mechanisms.linkages.table import FRAME, Body, LinkageTable, TableParameter

#: Names of the lengths.
LENGTHS = ("crank", "coupler", "rocker", "ground")


def four_bar_table(branch: str = "") -> LinkageTable:
    """The four-bar whose `branch` is a parameter of this name, 1 or -1; 1 without."""
    origin = ZERO, ZERO
    return LinkageTable(
        driver="crank",
        output="rocker",
        frame=Body(FRAME, (("crank pivot", origin), ("rocker pivot", (length("ground"), ZERO)))),
        links=(
            Body("crank", (("crank pivot", origin), ("crank joint", (length("crank"), ZERO)))),
            Body("coupler", (("crank joint", origin), ("rocker joint", (length("coupler"), ZERO)))),
            Body("rocker", (("rocker pivot", origin), ("rocker joint", (length("rocker"), ZERO)))),
        ),
        slots=(),
        slides=(),
        parameters=(
            *(TableParameter(name, "mm", lower=0.0) for name in LENGTHS),
            *([TableParameter(branch, "1")] if branch else []),
        ),
        branches=(("rocker joint", branch),) if branch else (),
    )
