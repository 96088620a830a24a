"""Where each group of links is sketched: the directions of two links, which choose its assembly."""

import cmath
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from explore.base.entries import note_unknown, read_number
from explore.base.errors import KeyPath, Problems
from explore.base.suggest import format_value
from explore.mechanisms.linkages.coordinate import Coordinate
from explore.mechanisms.linkages.graph import MOST_GROUPS
from explore.mechanisms.linkages.group_steps import Bar, PoseGroup
from explore.mechanisms.linkages.table import Slot
from explore.studies.linkages.coordinates import value_of
from explore.studies.linkages.sketch import Sketch
from explore.studies.linkages.structure import SECTION

_ANGLES = ("crank_angle", "angle")
#: A turn, deg.
_TURN = 360.0
#: Start of a group, where it is sketched: the crank angle and the directions of both links, deg.
Start = tuple[float, float, float]


def note_groups(groups: Sequence[PoseGroup], problems: Problems) -> None:
    """Note more groups than are followed."""
    if len(groups) > MOST_GROUPS:
        reason = f"has {len(groups)} groups of links that no dyad solves; at most {MOST_GROUPS} are possible"
        problems.append(((SECTION, "links"), reason))


def read_starts(
    entries: Mapping[str, Any],
    groups: Iterable[PoseGroup],
    sketch: Sketch | None,
    phases: Mapping[str, tuple[str, Coordinate]],
    problems: Problems,
) -> tuple[Start, ...]:
    """Where groups are sketched, by their links in [linkage.branch], or by the sketch; for tables without problems.

    A group of a copy, whose links have `phases`, is where its original is as many degrees before.
    """
    starts: dict[tuple[str, str], Start] = {}
    for group in groups:
        links = (group.first, group.second)
        if group.first in phases:
            start = _start_of_copy(links, starts, phases, problems)
        elif any(link in entries for link in links):
            start = _written(entries, links, problems)
        elif sketch is not None:
            start = _sketched(sketch, links)
        else:
            reason = (
                f"{group.first} and {group.second} form a group with {' and '.join(map(_name_of, group.ties))} "
                "that no dyad solves; draw a [linkage.sketch], which chooses its assembly"
            )
            problems.append(((SECTION,), reason))
            start = None
        crank_angle, *directions = start or (0.0, 0.0, 0.0)
        starts[links] = (math.fmod(crank_angle, _TURN), directions[0], directions[1])
    return tuple(starts.values())


def _start_of_copy(
    links: tuple[str, str],
    starts: Mapping[tuple[str, str], Start],
    phases: Mapping[str, tuple[str, Coordinate]],
    problems: Problems,
) -> Start | None:
    """The start of a group of a copy, from that of its original; None after a problem is noted."""
    (first, phase), (second, _) = (phases[link] for link in links)
    if phase.names:
        reason = f"the phase of {links[0]} must be a number, as of all links of groups that no dyad solves"
        problems.append(((SECTION, "copies"), reason))
        return None
    crank_angle, *directions = starts[first, second]
    return crank_angle - value_of(phase, {}), directions[0], directions[1]


def _name_of(tie: Bar | Slot) -> str:
    return tie.link if isinstance(tie, Bar) else tie.name


def branch_of(group: PoseGroup, start: Start) -> dict[str, dict[str, float]]:
    """The entries of [linkage.branch] that say where a group is sketched."""
    crank_angle, *angles = start
    return {
        link: dict(zip(_ANGLES, (crank_angle, angle), strict=True))
        for link, angle in zip((group.first, group.second), angles, strict=True)
    }


def _written(entries: Mapping[str, Any], links: tuple[str, str], problems: Problems) -> Start | None:
    """The start that the entries of both links say; None after a problem is noted."""
    read, before = [], len(problems)
    for link in links:
        key: KeyPath = (SECTION, "branch", link)
        entry = entries.get(link)
        if not isinstance(entry, Mapping):
            reason = f"must be {{ crank_angle = 40, angle = 110 }}, got {format_value(entry)}"
            problems.append(
                (key, reason if link in entries else f"is missing beside that of {links[link == links[0]]}")
            )
            continue
        note_unknown(entry, _ANGLES, problems, key)
        read.append([_angle(entry, name, key, problems) for name in _ANGLES])
    if len(problems) > before:
        return None
    (crank_angle, first), (other, second) = read
    if crank_angle != other:
        problems.append(((SECTION, "branch", links[1], "crank_angle"), f"must be that of {links[0]}, {crank_angle:g}"))
    return crank_angle, first, second


def _angle(entry: Mapping[str, Any], name: str, key: KeyPath, problems: Problems) -> float:
    if name not in entry:
        problems.append((key, f"the key '{name}' is missing"))
        return 0.0
    return read_number(entry[name], "deg", (*key, name), problems) or 0.0


def _sketched(sketch: Sketch, links: tuple[str, str]) -> Start | None:
    directions = [sketch.direction_of(link) for link in links]
    if not all(directions):
        return None
    first, second = (math.degrees(cmath.phase(each)) for each in directions)
    return sketch.angle, first, second
