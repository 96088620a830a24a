"""How far the links of a linkage turn, and the middles of their ranges, from which their angles are continuous."""

import math

from explore.base.compiling import LANES, compiled
from explore.base.lanes.arctangent import arctangent

#: Nodes of a turn or an interval at which the directions of links are followed.
DIRECTION_NODES = 256
#: Largest turn of a link between two nodes that is followed, rad.
_LARGEST_STEP = 1.0
#: Largest half swing of a link about the middle of its range, rad: less than half a turn.
_LARGEST_SWING = 3.0
#: Type of an array of numbers.
_F1 = "float64[::1]"


@compiled(f"void(int64, int64, {_F1}, {_F1}, {_F1})", no_alias=True)
def follow_directions(j, links, directions, before, ranges):
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


@compiled(f"void(int64, boolean, {_F1}, {_F1})", no_alias=True)
def place_references(links, is_turn, ranges, references):
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
