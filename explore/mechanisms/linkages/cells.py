"""Cells of a part of the turn: functions by values and slopes at two angles, halved where these do not decide.

A cell has its start and width, rad, then the values of all functions at its start, their slopes there, and both at its
end. Between the ends a function is its cubic but for `SAFETY` sixteenths of what the cubic over a cell of twice the
width misses in its middle.
"""

import math

from explore.base.compiling import LANES, compiled
from explore.base.subroutines import subroutine

#: Nodes of each half of a turn or of an interval; its ends are nodes of both halves.
NODES = 17
#: Number of cells of a quarter of a turn.
QUARTER = (NODES - 1) // 2
#: Largest number of cells of one design that wait to be halved.
MOST_CELLS = 512
#: Factor on what a cubic misses, where the sign of a function is told from it.
SAFETY = 4.0
#: Half-tangents of the nodes of half a turn, from its anchor.
_TANGENTS = tuple(math.tan(0.25 * math.pi * (2.0 * j / (NODES - 1) - 1.0)) for j in range(NODES))
#: Type of an array of numbers.
_F1 = "float64[::1]"


@subroutine(inlined=True)
def place_angle(angle):
    """Half-tangent of an angle, rad, from the anchor or its opposite, and which: 0 or 1."""
    half_turns = math.floor(angle / math.pi + 0.5)
    return math.tan(0.5 * (angle - half_turns * math.pi)), half_turns % 2.0


@subroutine(inlined=True)
def node_angle(start, length, j):
    """Angle of node j of both halves of an interval, rad."""
    return start + length * ((j - j // NODES) / (2.0 * (NODES - 1)))


@compiled(f"void(float64, float64, boolean, int64, {_F1}, {_F1})")
def place_node(start, length, is_turn, j, tangents, anchors):
    """Fill the half-tangent and the anchor of node j of an interval, or of a turn, in all lanes."""
    if is_turn:
        for lane in range(LANES):
            tangents[lane], anchors[lane] = _TANGENTS[j % NODES], 1.0 * (j // NODES)
    else:
        place_lanes(node_angle(start, length, j), tangents, anchors)


@subroutine()
def place_lanes(angle, tangents, anchors):
    """Fill the half-tangent and the anchor of an angle, rad, the same in all lanes."""
    tangent, anchor = place_angle(angle)
    for lane in range(LANES):
        tangents[lane], anchors[lane] = tangent, anchor


@subroutine(inlined=True)
def least(f0, f1, d0, d1, width):
    """Least Bernstein coefficient of the cubic over a cell."""
    return min(min(f0, f0 + width * d0 / 3.0), min(f1, f1 - width * d1 / 3.0))


@subroutine(inlined=True)
def missed(f0, f1, d0, d1, width, middle):
    """What the cubic over a cell misses in its middle."""
    return abs(0.5 * (f0 + f1) + 0.125 * width * (d0 - d1) - middle)


@compiled(f"int64({_F1}, int64, int64, int64, float64, float64, int64, {_F1})")
def collect_cells(values, rows, count, slopes, start, length, lane, cells):
    """Fill all cells of one lane, from nodes with `count` values from row 0 and slopes from row `slopes`.

    Return their number. The first cell is last, because the last cells are halved first.
    """
    size, width, number = 2 + 4 * count, length / (2.0 * (NODES - 1)), 0
    for half in range(1, -1, -1):
        for node in range(NODES - 2, -1, -1):
            j, cell = half * NODES + node, cells[number * size :]
            cell[0], cell[1] = node_angle(start, length, j), width
            for s in range(count):
                cell[2 + s] = values[(j * rows + s) * LANES + lane]
                cell[2 + count + s] = values[(j * rows + slopes + s) * LANES + lane]
                cell[2 + 2 * count + s] = values[((j + 1) * rows + s) * LANES + lane]
                cell[2 + 3 * count + s] = values[((j + 1) * rows + slopes + s) * LANES + lane]
            number += 1
    return number


@compiled(f"int64({_F1}, int64, int64, {_F1}, {_F1})")
def place_middles(cells, count, waiting, tangents, anchors):
    """Place the middles of the last of the `waiting` cells, one a lane; return the number of cells."""
    taken = min(waiting, LANES)
    for lane in range(LANES):
        cell = cells[(waiting - taken + min(lane, taken - 1)) * (2 + 4 * count) :]
        tangents[lane], anchors[lane] = place_angle(cell[0] + 0.5 * cell[1])
    return taken


@subroutine()
def exceeds(cell, child, count, s, sign, middle, tiny):
    """Whether function s times a sign exceeds a tiny number in one half of a cell; it is `middle` in its middle."""
    f0, d0, f1, d1 = child[2 + s], child[2 + count + s], child[2 + 2 * count + s], child[2 + 3 * count + s]
    error = missed(
        cell[2 + s], cell[2 + 2 * count + s], cell[2 + count + s], cell[2 + 3 * count + s], cell[1], middle
    )  # fmt: skip
    return least(sign * f0, sign * f1, sign * d0, sign * d1, child[1]) - SAFETY / 16.0 * error > tiny


@subroutine()
def halve_cell(cell, count, slopes, middles, lane, side, child):
    """Fill one half, 0 or 1, of a cell from the values and slopes of its middle in a lane."""
    width = 0.5 * cell[1]
    child[0], child[1] = cell[0] + side * width, width
    for s in range(2 * count):
        row = s if s < count else slopes + s - count
        middle = middles[row * LANES + lane]
        child[2 + s] = cell[2 + s] if side == 0 else middle
        child[2 + 2 * count + s] = middle if side == 0 else cell[2 + 2 * count + s]


@subroutine(inlined=True)
def copy_cell(source, at, target, to, size):
    """Copy cell `at` of some cells to the place `to` of others."""
    for k in range(size):
        target[to * size + k] = source[at * size + k]


@subroutine()
def copy_lane(tile, lane, rows, lanes):
    """Fill all lanes of a tile with one lane of another."""
    for row in range(rows):
        for other in range(LANES):
            lanes[row * LANES + other] = tile[row * LANES + lane]
