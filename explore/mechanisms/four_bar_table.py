"""The table of a four-bar, by the names of its drawing: the coupler's coordinates begin at the joint with the crank."""

from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction

from explore.mechanisms.four_bar_loads import LOADS
from explore.mechanisms.linkages.coordinate import ZERO, Coordinate, constant, joined, length
from explore.mechanisms.linkages.equations import Equations
from explore.mechanisms.linkages.load_table import Element, Loads, Mass, PivotedMass
from explore.mechanisms.linkages.quantity import Quantity
from explore.mechanisms.linkages.table import FRAME, Body, LinkageTable, TableParameter, parameter_of_table
from explore.mechanisms.linkages.vectors import cross, dot, minus

#: Names of the lengths.
LENGTHS = ("crank", "coupler", "rocker", "ground")
#: Names of signals of the table by the pins of `four_bar_loads`.
_PINS = {
    "a": "crank pivot_force_on_frame", "b": "crank joint_force_on_coupler", "c": "rocker joint_force_on_rocker",
    "d": "rocker pivot_force_on_frame",
}  # fmt: skip

_ORIGIN = ZERO, ZERO


def four_bar_table(branch: str = "") -> LinkageTable:
    """The four-bar whose `branch` is a parameter of this name, 1 or -1; 1 without."""
    return LinkageTable(
        driver="crank",
        output="rocker",
        frame=Body(FRAME, (("crank pivot", _ORIGIN), ("rocker pivot", (length("ground"), ZERO)))),
        links=(
            Body("crank", (("crank pivot", _ORIGIN), ("crank joint", (length("crank"), ZERO)))),
            Body("coupler", (("crank joint", _ORIGIN), ("rocker joint", (length("coupler"), ZERO)))),
            Body("rocker", (("rocker pivot", _ORIGIN), ("rocker joint", (length("rocker"), ZERO)))),
        ),
        slots=(),
        slides=(),
        parameters=(
            *(TableParameter(name, "mm", lower=0.0) for name in LENGTHS),
            *([TableParameter(branch, "1")] if branch else []),
        ),
        branches=(("rocker joint", branch),) if branch else (),
    )


def loaded_four_bar(branch: str = "") -> LinkageTable:
    """The same under load."""
    table, loads = four_bar_table(branch), _loads(length(branch) if branch else constant(1.0))
    return replace(table, parameters=(*table.parameters, *map(parameter_of_table, LOADS)), loads=loads)


def _loads(side: Coordinate) -> Loads:
    """The loads of `four_bar_loads`, with the coupler joint at the `side` 1 or -1."""
    elements = (
        Element("torque", "constant_torque", ("rocker",), length("constant_torque")),
        Element("opposing", "opposing_torque", ("rocker",), length("opposing_torque")),
        Element("damper", "damping", ("rocker",), length("damping")),
        Element("spring", "stiffness", ("rocker",), length("stiffness"), side * _middle()),
    )
    crank, coupler, rocker = (
        (length(f"{link}_mass"), (length(f"{link}_centroid") * length(link), ZERO)) for link in LENGTHS[:3]
    )
    return Loads(
        gravity=(ZERO, joined("negate", length("gravity"))),
        masses=(
            Mass("crank", *crank, ZERO),
            Mass("coupler", *coupler, length("coupler_inertia")),
            PivotedMass("rocker", *rocker, length("rocker_inertia"), about="rocker pivot"),
            Mass("rocker", ZERO, "rocker pivot", length("inertia")),
        ),
        elements=elements,
    )


def _middle() -> Coordinate:
    """The mean of the rocker's limit angles, deg, where coupler and crank are in line in a triangle with the others."""
    crank, coupler, rocker, ground = map(length, LENGTHS)
    sides, double = rocker * rocker + ground * ground, constant(2.0) * rocker * ground
    cosines = [sides - reach * reach for reach in (coupler - crank, coupler + crank)]
    first, second = (joined("atan2", joined("sqrt", double * double - each * each), each) for each in cosines)
    return constant(180.0) - constant(0.5) * (first + second)


def signals_of_four_bar(equations: Equations, quantities: Mapping[str, Quantity]) -> dict[str, Quantity]:
    """The signals of `four_bar_loads` by those of the table."""
    parts = [quantities[f"{_PINS['c']}_{axis}"] for axis in "xy"]
    force, joint, pivot = (parts[0].number, parts[1].number), "rocker joint", "rocker pivot"
    along, axial = (
        dot(force, (x.terms[0], y.terms[0])) for x, y in (equations.directions[link] for link in ("coupler", "rocker"))
    )
    arm_x, arm_y = minus(equations.points[joint], equations.points[pivot])
    moment = cross((arm_x.terms[0], arm_y.terms[0]), force) * equations.graph.constant(Fraction(1, 1000))
    numbers = {"coupler_force": along, "rocker_axial_force": axial, "rocker_moment": moment}
    return {
        **{f"pin_force_{pin}": quantities[name] for pin, name in _PINS.items()},
        **{name: replace(parts[0], number=number) for name, number in numbers.items()},
        "power": quantities["drive_power"],
    }
