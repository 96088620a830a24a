"""How far the links of a linkage turn, and the middles of their ranges, from which their angles are continuous."""

import math

import numpy as np

from explore.base.compiling import LANES, compiled
from explore.base.lanes.arctangent import arctangent
from explore.base.subroutines import subroutine
from explore.mechanisms.linkages.cells import copy_lane, place_angle, place_lanes
from explore.mechanisms.linkages.programs import FIRST_REFERENCE

#: Nodes of a turn or an interval at which the directions of links are followed.
DIRECTION_NODES = 256
#: Largest turn of a link between two nodes that is followed, rad.
_LARGEST_STEP = 1.0
#: Largest half swing of a link about the middle of its range, rad: less than half a turn.
_LARGEST_SWING = 3.0
#: Type of an array of numbers.
_F1 = "float64[::1]"


@compiled(f"void(int64, int64, {_F1}, {_F1}, {_F1})", no_alias=True)
def _follow(j, links, directions, before, ranges):
    """Follow the angles of links from the node before to node j.

    Rows of `directions` and `before`: cosine and sine of each link. Rows of `ranges` for each link: the angle at the
    first node, rad, the turn since, its least and greatest value, the largest step.
    """
    for link in range(links):
        cosine, sine = directions[2 * link * LANES :], directions[(2 * link + 1) * LANES :]
        old_cosine, old_sine = before[2 * link * LANES :], before[(2 * link + 1) * LANES :]
        start, turn, least = (
            ranges[5 * link * LANES :],
            ranges[(5 * link + 1) * LANES :],
            ranges[(5 * link + 2) * LANES :],
        )
        greatest, largest = ranges[(5 * link + 3) * LANES :], ranges[(5 * link + 4) * LANES :]
        for lane in range(LANES):
            c, s = cosine[lane], sine[lane]
            if j == 0:
                start[lane] = arctangent(s, c)
                turn[lane] = least[lane] = greatest[lane] = largest[lane] = 0.0
            else:
                step = arctangent(old_cosine[lane] * s - old_sine[lane] * c, old_cosine[lane] * c + old_sine[lane] * s)
                turn[lane] += step
                least[lane] = turn[lane] if turn[lane] < least[lane] else least[lane]
                greatest[lane] = turn[lane] if turn[lane] > greatest[lane] else greatest[lane]
                largest[lane] = abs(step) if not abs(step) <= largest[lane] else largest[lane]
            old_cosine[lane], old_sine[lane] = c, s


@compiled(f"boolean(int64, {_F1}, int64)")
def _is_quick(links, ranges, lane):
    """Whether a link of a lane turns too fast between two nodes."""
    largest = 0.0
    for link in range(links):
        largest = max(largest, ranges[(5 * link + 4) * LANES + lane])
    return largest >= _LARGEST_STEP


@compiled(f"void(int64, int64, {_F1}, {_F1}, {_F1}, int64)")
def _follow_nodes(j, links, directions, before, ranges, lane):
    """Follow the angles of the links of one lane as `_follow`, over nodes of it in place of lanes.

    They come before node j and end there, where j is not 0.
    """
    for link in range(links):
        at, old = 5 * link * LANES + lane, 2 * link
        for node in range(LANES - 1 if j == 0 else 0, LANES):
            c, s = directions[2 * link * LANES + node], directions[(2 * link + 1) * LANES + node]
            if j == 0:
                ranges[at] = arctangent(s, c)
                ranges[at + LANES] = ranges[at + 2 * LANES] = ranges[at + 3 * LANES] = ranges[at + 4 * LANES] = 0.0
            else:
                step = arctangent(before[old] * s - before[old + 1] * c, before[old] * c + before[old + 1] * s)
                turn = ranges[at + LANES] + step
                ranges[at + LANES] = turn
                ranges[at + 2 * LANES] = min(ranges[at + 2 * LANES], turn)
                ranges[at + 3 * LANES] = max(ranges[at + 3 * LANES], turn)
                ranges[at + 4 * LANES] = max(ranges[at + 4 * LANES], abs(step))
            before[old], before[old + 1] = c, s


@compiled(f"void(int64, boolean, {_F1}, {_F1})", no_alias=True)
def _place_references(links, is_turn, ranges, references):
    """Fill the middle of each link's range, rad, its cosine and sine; NaN for links that turn fully or too fast."""
    for link in range(links):
        for lane in range(LANES):
            at = 5 * link * LANES + lane
            start, turn, largest = ranges[at], ranges[at + LANES], ranges[at + 4 * LANES]
            least, greatest = ranges[at + 2 * LANES], ranges[at + 3 * LANES]
            returns = (not is_turn) | (abs(turn) < 1.0)
            rocks = returns & (greatest - least < 2.0 * _LARGEST_SWING) & (largest < _LARGEST_STEP)
            middle = start + 0.5 * (least + greatest) if rocks else math.nan
            references[3 * link * LANES + lane] = middle
            references[(3 * link + 1) * LANES + lane] = math.cos(middle)
            references[(3 * link + 2) * LANES + lane] = math.sin(middle)


@subroutine(allocates=True)
def follow_links(record, sizes, direct, constants, start, length, is_turn):
    """Fill the references of the links."""
    links, first = sizes.links, 0.0 if is_turn else start
    directed, before = np.empty(2 * links * LANES), np.empty(2 * links * LANES)
    ranges, tangents, anchors = np.empty(5 * links * LANES), np.empty(LANES), np.empty(LANES)
    for j in range(DIRECTION_NODES + 1):
        place_lanes(first + length * (j / DIRECTION_NODES), tangents, anchors)
        direct(constants, tangents, anchors, directed)
        _follow(j, links, directed, before, ranges)
    for lane in range(LANES):
        if record[sizes.status * LANES + lane] == 1.0 and _is_quick(links, ranges, lane):
            _follow_closely(sizes, direct, constants, first, length, ranges, lane)
    _place_references(links, is_turn, ranges, constants[FIRST_REFERENCE * LANES :])


@subroutine(allocates=True)
def _follow_closely(sizes, direct, constants, first, length, ranges, lane):
    """Follow the directions of one lane once more, at LANES times as many nodes."""
    links, step = sizes.links, length / DIRECTION_NODES
    directed, before, tile = np.empty(2 * links * LANES), np.empty(2 * links), np.empty(sizes.constants * LANES)
    tangents, anchors = np.empty(LANES), np.empty(LANES)
    copy_lane(constants, lane, sizes.constants, tile)
    for j in range(DIRECTION_NODES + 1):
        for node in range(LANES):
            angle = first + step * (j - (LANES - 1.0 - node) / LANES)
            tangents[node], anchors[node] = place_angle(angle)
        direct(tile, tangents, anchors, directed)
        _follow_nodes(j, links, directed, before, ranges, lane)
