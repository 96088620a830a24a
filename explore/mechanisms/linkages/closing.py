"""What is known of designs of a linkage without sampling: constants, statuses, intervals, strokes.

Written once for all linkages: what a table differs by are sizes, and functions of its own.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import types

from explore.base.compiling import LANES, compiled, function_type
from explore.base.subroutines import subroutine
from explore.mechanisms.linkages import anchoring, following, harmonics, phases, singularities, statuses, strokes
from explore.mechanisms.linkages import cells as cell
from explore.mechanisms.linkages import directions as direction
from explore.mechanisms.linkages import reaches as reach
from explore.mechanisms.linkages import turning as turn
from explore.mechanisms.linkages.programs import (
    CLOSED_ERROR_ROW,
    DISTANCE_ROW,
    GREATEST_PLACE_ROW,
    GREATEST_ROW,
    LEAST_PLACE_ROW,
    LEAST_ROW,
    MIDDLE_ROW,
    OTHERS_ROW,
    REACH_ROW,
    SINGULAR_ANGLE_ROW,
)

#: Signature of the function that fills the constants from a record.
DESIGN_SIGNATURE = "void(float64[::1], float64[::1])"
#: Signature of functions that fill rows at one node of each lane, from constants, half-tangents and anchors.
NODE_SIGNATURE = "void(float64[::1], float64[::1], float64[::1], float64[::1])"


class Sizes(NamedTuple):
    """What tables differ by.

    Attributes
    ----------
    factors, functions
        Number of factors, and of factors and squares of distances; see `turning`.
    of_motion
        Number of the first functions, on which motions depend; on the others only loads do.
    links
        Number of links whose references are filled.
    constants
        Rows of the constants, more than a record keeps.
    status
        Row of the status in a record, behind the constants that it keeps.
    interval
        Row of the interval, two rows, behind the parameters; behind it the metrics, the time ratio first.
    harmonics, is_harmonic
        Bits of the functions that are first harmonics of the angle, of the first MOST_HARMONICS; whether all are.
    groups, first_group
        Number of groups of links, and the first of their constants.
    has_strokes, tells_reach
        Whether reversals of the output are looked for, and intervals at which designs assemble that do not turn.
    lines
        Bits of the factors that vanish where two lines are parallel, of the first MOST_LINES.
    """

    factors: int
    functions: int
    of_motion: int
    links: int
    constants: int
    status: int
    interval: int
    harmonics: int
    is_harmonic: int
    groups: int
    first_group: int
    has_strokes: int
    tells_reach: int
    lines: int


_F1 = types.float64[::1]
_SIZES = types.NamedUniTuple(types.int64, len(Sizes._fields), Sizes)
_DESIGN, _NODE = function_type(DESIGN_SIGNATURE), function_type(NODE_SIGNATURE)
#: Type of `close_designs`.
CLOSING_SIGNATURE = types.void(_F1, _SIZES, _F1, _F1, _DESIGN, _DESIGN, _NODE, _NODE, _NODE)


@compiled(CLOSING_SIGNATURE, allocates=True)
def close_designs(record, sizes, blocked, starts, fill_constants, fill_ties, check, direct, rate):
    """Fill a record.

    `blocked` are the statuses of designs that are blocked at each factor, and `starts` are where groups are sketched.
    `fill_constants` and `fill_ties` fill the constants and the ties of groups from the record; `check`, `direct`
    and `rate` fill rows of a node for `turning`, `directions` and `reversals`.
    """
    constants = np.empty(sizes.constants * LANES)
    fill_constants(record, constants)
    if sizes.groups > 0:
        ties = np.empty(sizes.groups * following.TIES_SIZE * LANES)
        fill_ties(record, ties)
        following.track_groups(ties, starts, sizes.groups, sizes.first_group, constants)
    for lane in range(LANES):
        constants[CLOSED_ERROR_ROW * LANES + lane] = 0.0
        constants[SINGULAR_ANGLE_ROW * LANES + lane], constants[OTHERS_ROW * LANES + lane] = math.nan, 1.0
    is_turn = record[(sizes.interval + 1) * LANES] == 0.0
    start = -0.5 * math.pi if is_turn else record[sizes.interval * LANES]
    length = 2.0 * math.pi if is_turn else record[(sizes.interval + 1) * LANES]
    doubtful = 1
    if is_turn and sizes.is_harmonic > 0:
        doubtful = _take_harmonics(record, sizes, check, constants, start, length)
    if doubtful > 0:
        _decide_all(record, sizes, blocked, check, constants, start, length, is_turn)
    if sizes.groups > 0:
        _mark_groups(record, sizes, starts, constants, start, length)
    for lane in range(LANES):
        constants[LEAST_ROW * LANES + lane] = constants[GREATEST_ROW * LANES + lane] = math.nan
        constants[LEAST_PLACE_ROW * LANES + lane] = constants[GREATEST_PLACE_ROW * LANES + lane] = math.nan
        constants[MIDDLE_ROW * LANES + lane] = 1.0 if is_turn else start + 0.5 * length
        constants[REACH_ROW * LANES + lane] = 1.0 if is_turn else 0.5 * length
        record[(sizes.interval + 2) * LANES + lane] = math.nan
    if sizes.links > 0:
        direction.follow_links(record, sizes, direct, constants, start, length, is_turn)
    if sizes.has_strokes > 0:
        strokes.find_strokes(record, sizes, check, rate, constants)
    for k in range(sizes.status * LANES):
        record[k] = constants[k]


@subroutine()
def _mark_groups(record, sizes, starts, constants, start, length):
    """Fill the status of lanes with a group that has no assembly, or that is in another one after a turn."""
    for group in range(sizes.groups):
        for lane in range(LANES):
            at = (sizes.first_group + group * following.GROUP_ROWS) * LANES + lane
            status, reaches = sizes.status * LANES + lane, record[(sizes.interval + 3) * LANES :]
            if following.is_nowhere(constants, at):
                record[status] = statuses.NO_ASSEMBLY
            elif record[status] == 1.0 and following.passes_seam(constants, at, start, length):
                # over less than a turn the end of the path blocks the crank, if it is a fold
                is_blocked = following.has_fold(constants, at) and length < 2.0 * math.pi
                record[status] = starts[following.START_SIZE * group + 3] if is_blocked else statuses.RETURNS_NOT
                reach.tell_turn(False, lane, reaches)


@subroutine(allocates=True)
def _take_harmonics(record, sizes, check, constants, start, length):
    """Decide lanes of a turn whose functions are first harmonics as if all turned; return the number of other lanes."""
    size = (2 * sizes.functions + sizes.factors) * LANES
    values, tangents, anchors = np.empty(4 * size), np.empty(LANES), np.empty(LANES)
    for quarter in range(4):
        cell.place_node(start, length, True, quarter * cell.QUARTER + quarter // 2, tangents, anchors)
        check(constants, tangents, anchors, values[quarter * size :])
    for lane in range(LANES):
        tangents[lane], record[sizes.status * LANES + lane] = turn.TURNS, 1.0
    reach.tell_turns(tangents, record[(sizes.interval + 3) * LANES :])
    distances, angles = constants[DISTANCE_ROW * LANES :], constants[SINGULAR_ANGLE_ROW * LANES :]
    doubtful = harmonics.decide_harmonics(values, sizes.factors, sizes.functions, distances)
    others, farthest = constants[OTHERS_ROW * LANES :], math.inf if sizes.has_strokes > 0 else anchoring.NEAR
    anchoring.anchor_harmonics(values, sizes.factors, sizes.functions, farthest, distances, angles, others)
    return doubtful


@subroutine(allocates=True)
def _decide_all(record, sizes, blocked, check, constants, start, length, is_turn):
    """Fill the status of each lane, the intervals at which it assembles, and the distance of its singularities."""
    rows = 2 * sizes.functions + sizes.factors
    values, verdicts = np.empty(2 * cell.NODES * rows * LANES), np.empty(LANES)
    tangents, anchors, tile = np.empty(LANES), np.empty(LANES), np.empty(sizes.constants * LANES)
    for j in range(2 * cell.NODES):
        cell.place_node(start, length, is_turn, j, tangents, anchors)
        check(constants, tangents, anchors, values[j * rows * LANES :])
    work = np.empty((sizes.functions + singularities.WORK_ROWS) * LANES)
    turn.sift(values, sizes.factors, sizes.functions, length, verdicts, work)
    if is_turn and sizes.is_harmonic == 0:
        distances = constants[DISTANCE_ROW * LANES :]
        singularities.locate(values, sizes.factors, sizes.functions, sizes.harmonics, verdicts, distances, work)
    reach.tell_turns(verdicts, record[(sizes.interval + 3) * LANES :])
    for lane in range(LANES):
        record[sizes.status * LANES + lane] = 1.0
        if verdicts[lane] != turn.TURNS:
            cell.copy_lane(constants, lane, sizes.constants, tile)
            _decide(record, sizes, blocked, check, tile, values, start, length, lane, verdicts)
            if _tells_reach(record, sizes, values, is_turn, lane, verdicts):
                errors = constants[CLOSED_ERROR_ROW * LANES :]
                _find_reaches(record, sizes, check, tile, values, start, length, lane, errors)
    if is_turn and sizes.is_harmonic == 0:
        _anchor(sizes, check, constants, start, values)
    if not is_turn:
        _locate_beside_interval(sizes, check, constants, start, length, verdicts, values, work)


@subroutine(allocates=True)
def _anchor(sizes, check, constants, start, values):
    """Fill the angle of the nearest singularity of lanes with a near one, and the distance of all others."""
    search, distances = np.empty(anchoring.SEARCH_SIZE), constants[DISTANCE_ROW * LANES :]
    others = constants[OTHERS_ROW * LANES :]
    if anchoring.begin_search(values, sizes.factors, sizes.functions, start, distances, others, search) == 0:
        return
    rows = (2 * sizes.functions + sizes.factors) * LANES
    tangents, anchors, here, beside = np.empty(LANES), np.empty(LANES), np.empty(rows), np.empty(rows)
    for number in range(anchoring.ROUNDS + 1):
        anchoring.place_search(search, 0.0, tangents, anchors)
        check(constants, tangents, anchors, here)
        if number < anchoring.ROUNDS:
            anchoring.improve_search(here, sizes.functions, search)
    anchoring.place_search(search, anchoring.STEP, tangents, anchors)
    check(constants, tangents, anchors, beside)
    anchoring.end_search(here, beside, sizes.functions, search, distances, constants[SINGULAR_ANGLE_ROW * LANES :])


@subroutine(allocates=True)
def _locate_beside_interval(sizes, check, constants, start, length, verdicts, values, work):
    """Fill minus the half-tangent of the distance of singularities by the angle phi over the interval."""
    rows, moves = (2 * sizes.functions + sizes.factors) * LANES, False
    tangents, anchors, distances = np.empty(LANES), np.empty(LANES), constants[DISTANCE_ROW * LANES :]
    for lane in range(LANES):
        moves = moves or verdicts[lane] >= 0.0
        distances[lane] = 0.0
    if moves:
        for j in range(2 * cell.NODES):
            phases.place_phase(start, length, j, tangents, anchors)
            check(constants, tangents, anchors, values[j * rows :])
            phases.slope_by_phase(values[j * rows :], sizes.functions, length, j)
        singularities.locate(values, sizes.factors, sizes.functions, 0, verdicts, distances, work)
        for lane in range(LANES):
            distances[lane] = -distances[lane]


@subroutine(allocates=True)
def _decide(record, sizes, blocked, check, tile, values, start, length, lane, verdicts):
    """Decide whether a lane turns that is not sifted out, and fill its status; all lanes of the tile are its design."""
    factors, functions, status = sizes.factors, sizes.functions, sizes.status * LANES + lane
    rows, size = 2 * functions + factors, 2 + 4 * factors
    if verdicts[lane] == turn.DOUBTFUL:
        tangents, anchors, middles = np.empty(LANES), np.empty(LANES), np.empty(rows * LANES)
        cells, children = np.empty(cell.MOST_CELLS * size), np.empty(2 * LANES * size)
        waiting, verdict = cell.collect_cells(values, rows, factors, functions, start, length, lane, cells), 0.0
        while waiting > 0 and waiting < cell.MOST_CELLS - LANES:
            taken = cell.place_middles(cells, factors, waiting, tangents, anchors)
            check(tile, tangents, anchors, middles)
            waiting, verdict = turn.halve_doubtful(cells, factors, functions, waiting, taken, middles, children)
        verdicts[lane] = verdict if verdict != turn.DOUBTFUL else turn.TURNS
        record[status] = 1.0 if waiting == 0 else statuses.TURN_NOT_DECIDED
        reach.tell_turn(waiting == 0 and verdict == turn.DOUBTFUL, lane, record[(sizes.interval + 3) * LANES :])
    for s in range(factors):
        if verdicts[lane] == -1.0 - s or verdicts[lane] == turn.FIRST_TIE + s:
            record[status] = blocked[s] + (1.0 if verdicts[lane] > 0.0 else 0.0)


@subroutine()
def _tells_reach(record, sizes, values, is_turn, lane, verdicts):
    """Whether to look for the intervals at which a lane assembles that does not turn, or for the first one."""
    rows = 2 * sizes.functions + sizes.factors
    is_undecided = record[sizes.status * LANES + lane] == statuses.TURN_NOT_DECIDED
    is_stuck = verdicts[lane] < 0.0 or is_undecided
    assembles = reach.assembling_node(values, rows, sizes.factors, lane) >= 0
    return is_turn and is_stuck and (sizes.tells_reach > 0 or not assembles)


@subroutine(allocates=True)
def _find_reaches(record, sizes, check, tile, values, start, length, lane, errors):
    """Fill the intervals at which a lane assembles, the error of their ends, and its status if there are none."""
    factors, functions = sizes.factors, sizes.functions
    rows, size = 2 * functions + factors, 2 + 4 * factors
    tangents, anchors, middles = np.empty(LANES), np.empty(LANES), np.empty(rows * LANES)
    cells, children = np.empty(cell.MOST_CELLS * size), np.empty(2 * LANES * size)
    borders, found, rounds = np.empty(reach.BORDER_SIZE * reach.MOST_BORDERS), 0, 0
    waiting = cell.collect_cells(values, rows, factors, functions, start, length, lane, cells)
    while waiting > 0 and waiting < cell.MOST_CELLS - LANES and rounds < reach.MOST_ROUNDS:
        rounds += 1
        taken = cell.place_middles(cells, factors, waiting, tangents, anchors)
        check(tile, tangents, anchors, middles)
        waiting, found = reach.halve_borders(
            cells, factors, functions, sizes.lines, waiting, taken, middles, children, borders, found
        )  # fmt: skip
    for k in range(found):
        if borders[reach.BORDER_SIZE * k + 3] > 0.0:
            errors[lane] = max(errors[lane], borders[reach.BORDER_SIZE * k + 3])
            continue
        while borders[reach.BORDER_SIZE * k + 1] > reach.NARROWEST:
            reach.place_in_border(borders, k, tangents, anchors)
            check(tile, tangents, anchors, middles)
            reach.narrow_border(borders, k, middles, factors)
        errors[lane] = max(errors[lane], reach.border_error(middles, factors, functions))
    if waiting == 0:
        reaches = record[(sizes.interval + 3) * LANES :]
        assembles = reach.assembling_node(values, rows, factors, lane) >= 0
        reach.tell_reaches(borders, found, assembles, lane, reaches)
        if reaches[lane] == 0.0:
            record[sizes.status * LANES + lane] = statuses.CANNOT_ASSEMBLE
