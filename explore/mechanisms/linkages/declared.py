"""The tables that mechanisms declare, with the points that a user names."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING

from explore.mechanisms.linkages.coordinate import length
from explore.mechanisms.linkages.table import LinkageTable, TableParameter
from explore.model.points import COORDINATES

if TYPE_CHECKING:
    from explore.model.mechanism import Mechanism

#: Number of tables with points that are kept.
_MOST_KEPT = 64


def table_of(mechanism: Mechanism) -> LinkageTable | None:
    """The table of a mechanism, by its parameters and the names of its drawing; None where it declares none.

    Points that a user names are points of the floating link, by their own names.
    """
    table, link = mechanism.table, mechanism.floating_link
    if not isinstance(table, LinkageTable):
        return None
    return add_points(table, link.name, mechanism.points) if link and mechanism.points else table


@lru_cache(_MOST_KEPT)
def add_points(table: LinkageTable, link: str, points: tuple[str, ...]) -> LinkageTable:
    """The table with points of a link whose coordinates are parameters."""
    names = {point: tuple(f"{point}_{coordinate}" for coordinate in COORDINATES) for point in points}
    places = tuple((point, (length(along), length(across))) for point, (along, across) in names.items())
    bodies = (replace(body, points=(*body.points, *places)) if body.name == link else body for body in table.links)
    parameters = (TableParameter(name, "mm") for point in points for name in names[point])
    return replace(table, links=tuple(bodies), parameters=(*table.parameters, *parameters))
