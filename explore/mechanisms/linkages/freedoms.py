"""How many freedoms the joints of a table leave its links, and which links they hold too often."""

from collections.abc import Iterable
from dataclasses import replace
from typing import TypeVar

from explore.mechanisms.linkages.table import Body, LinkageTable, Slot

_Item = TypeVar("_Item", Body, Slot)


def count_freedoms(table: LinkageTable) -> int:
    """The mobility less 1 for the driver: 0 for a linkage that moves as the driver does."""
    table = table.pinned
    pins = sum(2 * (len(table.bodies_at(point)) - 1) for point in table.points)
    return 3 * len(table.links) - pins - len(table.slots) - 2 * len(table.slides) - (table.driver in table.body_of)


def part_of(table: LinkageTable, links: Iterable[Body]) -> LinkageTable:
    """Some links of a table, with the frame and what joins these."""
    part = replace(table, links=tuple(links))
    bodies, points = {body.name for body in part.bodies}, set(part.points)
    slots = tuple(slot for slot in table.slots if slot.body in bodies and slot.pin in points)
    slides = tuple(slide for slide in table.slides if slide.link in bodies and slide.body in bodies)
    return replace(part, slots=slots, slides=slides)


def held_too_often(table: LinkageTable) -> LinkageTable:
    """The part of a table with too many equations that these are of."""
    for link in table.links:
        other = part_of(table, without(table.links, link))
        if count_freedoms(other) <= count_freedoms(table):
            return held_too_often(other)
    return table


def is_joined(table: LinkageTable) -> bool:
    """Whether each link has two joints or more."""
    slides = [name for slide in table.slides for name in (slide.link, slide.body)]
    return all(
        sum(len(table.bodies_at(point)) > 1 for point, _ in body.points)
        + sum(slot.body == body.name or slot.pin in body.place_of for slot in table.slots)
        + slides.count(body.name)
        > 1
        for body in table.links
    )


def without(items: tuple[_Item, ...], item: _Item) -> tuple[_Item, ...]:
    """The items but one."""
    return tuple(each for each in items if each is not item)
