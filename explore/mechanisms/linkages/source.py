"""The functions `close` and `fill` of a linkage as the text of a module, for the signals that are asked for.

Names of the table never enter the text: parameters, links and signals are rows.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from explore.mechanisms.linkages import statuses
from explore.mechanisms.linkages.equations import Equations
from explore.mechanisms.linkages.graph import Number
from explore.mechanisms.linkages.lane_text import (
    DISTANCE_ROW,
    GREATEST_ROW,
    LEAST_ROW,
    Rows,
    disturbed_function,
    fill_function,
    node_function,
)

_HEAD = '''"""Made from the table of a linkage by explore.mechanisms.linkages.source."""

import math

import numpy as np

from explore.base.compiling import CLOSE_SIGNATURE, FILL_SIGNATURE, LANES, compiled
from explore.base.lanes.arctangent import arctangent
from explore.base.lanes.disturbance import FACTORS as DISTURBANCES
from explore.base.lanes.disturbance import first_factor
from explore.base.lanes.elementary import exact_sum
from explore.base.subroutines import subroutine
from explore.mechanisms.linkages import cells as cell
from explore.mechanisms.linkages import directions as direction
from explore.mechanisms.linkages import reaches as reach
from explore.mechanisms.linkages import reversals as reversal
from explore.mechanisms.linkages import turning as turn
from explore.mechanisms.linkages.degrees import (
    cosine_of_degrees,
    degrees_of,
    larger,
    sine_of_degrees,
    smaller,
    tangent_of_degrees,
)

'''

_CLOSE = """

@compiled(CLOSE_SIGNATURE, allocates=True)
def close(record):
    is_turn = record[(INTERVAL + 1) * LANES] == 0.0
    start = -0.5 * math.pi if is_turn else record[INTERVAL * LANES]
    length = 2.0 * math.pi if is_turn else record[(INTERVAL + 1) * LANES]
    constants, values = np.empty(CONSTANTS * LANES), np.empty(2 * cell.NODES * ROWS * LANES)
    tangents, anchors, verdicts = np.empty(LANES), np.empty(LANES), np.empty(LANES)
    for lane in range(LANES):
{constants}
    for j in range(2 * cell.NODES):
        cell.place_node(start, length, is_turn, j, tangents, anchors)
        check(constants, tangents, anchors, values[j * ROWS * LANES :])
    work = np.empty(FUNCTIONS * LANES)
    turn.sift(values, FACTORS, FUNCTIONS, length, verdicts, work)
    turn.locate(values, FACTORS, FUNCTIONS, constants[DISTANCE * LANES :], work)
    blocked = 0
    for lane in range(LANES):
        blocked += 1 if verdicts[lane] != turn.TURNS else 0
        record[STATUS * LANES + lane] = 1.0
    reach.tell_turns(verdicts, record[REACH * LANES :])
    if blocked > 0:
        tile, middles = np.empty(CONSTANTS * LANES), np.empty(ROWS * LANES)
        cells, children = np.empty(cell.MOST_CELLS * CELL), np.empty(2 * LANES * CELL)
        borders = np.empty(3 * reach.MOST_BORDERS)
        for lane in range(LANES):
            if verdicts[lane] == turn.TURNS:
                continue
            cell.copy_lane(constants, lane, CONSTANTS, tile)
            if verdicts[lane] == turn.DOUBTFUL:
                waiting, verdict = cell.collect_cells(values, ROWS, FACTORS, FUNCTIONS, start, length, lane, cells), 0.0
                while waiting > 0 and waiting < cell.MOST_CELLS - LANES:
                    taken = cell.place_middles(cells, FACTORS, waiting, tangents, anchors)
                    check(tile, tangents, anchors, middles)
                    waiting, verdict = turn.halve_doubtful(
                        cells, FACTORS, FUNCTIONS, waiting, taken, middles, children
                    )
                verdicts[lane] = verdict if verdict != turn.DOUBTFUL else turn.TURNS
                record[STATUS * LANES + lane] = 1.0 if waiting == 0 else TURN_NOT_DECIDED
                reach.tell_turn(waiting == 0 and verdict == turn.DOUBTFUL, lane, record[REACH * LANES :])
            for s in range(FACTORS):
                if verdicts[lane] == -1.0 - s or verdicts[lane] == turn.FIRST_TIE + s:
                    tie = 1.0 if verdicts[lane] > 0.0 else 0.0
                    record[STATUS * LANES + lane] = STATUS_OF_FACTOR[s] + tie
            node = reach.assembling_node(values, ROWS, FACTORS, lane)
            stuck = verdicts[lane] < 0.0 or record[STATUS * LANES + lane] == TURN_NOT_DECIDED
            if stuck and is_turn and (TELLS_REACH or node < 0):
                waiting, found = cell.collect_cells(values, ROWS, FACTORS, FUNCTIONS, start, length, lane, cells), 0
                rounds = 0
                while waiting > 0 and waiting < cell.MOST_CELLS - LANES and rounds < reach.MOST_ROUNDS:
                    rounds += 1
                    taken = cell.place_middles(cells, FACTORS, waiting, tangents, anchors)
                    check(tile, tangents, anchors, middles)
                    waiting, found = reach.halve_borders(
                        cells, FACTORS, FUNCTIONS, waiting, taken, middles, children, borders, found
                    )
                for k in range(found):
                    while borders[3 * k + 1] > reach.NARROWEST:
                        reach.place_in_border(borders, k, tangents, anchors)
                        check(tile, tangents, anchors, middles)
                        reach.narrow_border(borders, k, middles, FACTORS)
                if waiting == 0:
                    reach.tell_reaches(borders, found, node >= 0, lane, record[REACH * LANES :])
                    if record[REACH * LANES + lane] == 0.0:
                        record[STATUS * LANES + lane] = CANNOT_ASSEMBLE
    for lane in range(LANES):
        constants[LEAST * LANES + lane] = constants[GREATEST * LANES + lane] = math.nan
        record[TIME_RATIO * LANES + lane] = math.nan
{references}{reversals}
    for k in range(STATUS * LANES):
        record[k] = constants[k]
"""

_REFERENCES = """    directed, before = np.empty(2 * LINKS * LANES), np.empty(2 * LINKS * LANES)
    ranges = np.empty(5 * LINKS * LANES)
    for j in range(direction.DIRECTION_NODES + 1):
        angle = (0.0 if is_turn else start) + length * (j / direction.DIRECTION_NODES)
        cell.place_lanes(angle, tangents, anchors)
        direct(constants, tangents, anchors, directed)
        direction.follow_directions(j, LINKS, directed, before, ranges)
    direction.place_references(LINKS, is_turn, ranges, constants[REFERENCE * LANES :])
"""

_REVERSALS = """    rates, sizes = np.empty((reversal.CELLS + 1) * reversal.RATE_ROWS * LANES), np.empty(LANES)
    counts, doubts, places = np.empty(LANES), np.empty(LANES), np.empty(4 * LANES)
    low, high, marks = np.empty(LANES), np.empty(LANES), np.empty(reversal.RATE_ROWS * LANES)
    for j in range(reversal.CELLS + 1):
        cell.place_lanes(reversal.reversal_node(j), tangents, anchors)
        rate(constants, tangents, anchors, rates[j * reversal.RATE_ROWS * LANES :])
    reversal.find_reversals(rates, counts, doubts, places)
    for lane in range(LANES):
        if doubts[lane] == 1.0 and counts[lane] <= 2.0 and record[STATUS * LANES + lane] == 1.0:
            lanes = np.empty(CONSTANTS * LANES)
            rate_cells = np.empty(cell.MOST_CELLS * reversal.CELL_SIZE)
            halves = np.empty(2 * LANES * reversal.CELL_SIZE)
            cell.copy_lane(constants, lane, CONSTANTS, lanes)
            waiting, count = reversal.collect_rates(rates, lane, rate_cells), 0.0
            while waiting > 0 and waiting < cell.MOST_CELLS - LANES:
                taken = cell.place_middles(rate_cells, 1, waiting, tangents, anchors)
                rate(lanes, tangents, anchors, marks)
                waiting, count = reversal.halve_rates(
                    rate_cells, waiting, taken, marks, halves, count, lane, places
                )
            counts[lane] = count if waiting == 0 else reversal.UNDECIDED
    for number in range(2):
        reversal.begin_search(places, counts, 2 * number, tangents, anchors, low, high)
        change, rounds = 1.0, 0
        while change > reversal.SAME and rounds < 60:
            rate(constants, tangents, anchors, marks)
            change, rounds = reversal.improve(marks, 1.0 - 2.0 * number, tangents, low, high), rounds + 1
        for lane in range(LANES):
            constants[(LEAST + number) * LANES + lane] = reversal.from_anchor(tangents[lane], anchors[lane])
    for lane in range(LANES):
        turns = record[STATUS * LANES + lane] == 1.0
        least, greatest = constants[LEAST * LANES + lane], constants[GREATEST * LANES + lane]
        has_strokes = turns and counts[lane] == 2.0
        record[TIME_RATIO * LANES + lane] = reversal.time_ratio(least, greatest) if has_strokes else math.nan
        constants[LEAST * LANES + lane] = least if has_strokes else math.nan
        constants[GREATEST * LANES + lane] = greatest if has_strokes else math.nan
        if turns and not has_strokes:
            undecided = counts[lane] == reversal.UNDECIDED
            record[STATUS * LANES + lane] = STROKES_NOT_DECIDED if undecided else NO_STROKES
"""


@dataclass(frozen=True)
class Source:
    """The text of a module and the rows of its records.

    Attributes
    ----------
    text
        Defines `close`, `fill` and `disturbed_fill`.
    n_constants
        Constants of a design that `fill` reads; `close` computes more than it keeps.
    """

    text: str
    n_constants: int


def write_source(
    equations: Equations,
    outputs: Sequence[Number],
    links: Sequence[str],
    joints: Sequence[str],
    rate: Sequence[Number],
    *,
    tells_reach: bool,
) -> Source:
    """Write the functions that fill these rows of signals.

    Parameters
    ----------
    outputs
        Rows of the signals.
    links
        Links whose angles are among them, in the order of their references.
    joints
        Joints in the order of their statuses.
    rate
        The rate of the output, its slope and its size, if its reversals are asked for; else none.
    tells_reach
        Whether the intervals at which a design assembles that does not turn are asked for.
    """
    graph = equations.graph
    checks = _check_rows(equations)
    directions = [term.terms[0] for link in links for term in equations.directions[link]]
    rows = Rows(graph, links)
    rows.add(outputs)
    rows.add_parameters(outputs)
    status = rows.count
    for others in (checks, directions, rate):
        rows.add(others)
    parameters = {p.name: status + 1 + k for k, p in enumerate(equations.table.parameters)}
    interval = status + 1 + len(parameters)
    factors = len(equations.factors)
    numbers = {
        "FACTORS": factors, "FUNCTIONS": factors + len(equations.squares), "ROWS": len(checks), "CELL": 2 + 4 * factors,
        "LINKS": len(links), "CONSTANTS": rows.count, "DISTANCE": DISTANCE_ROW, "LEAST": LEAST_ROW,
        "GREATEST": GREATEST_ROW, "REFERENCE": rows.first_reference, "STATUS": status, "INTERVAL": interval,
        "TIME_RATIO": interval + 2, "REACH": interval + 3, "TELLS_REACH": tells_reach,
        "TURN_NOT_DECIDED": float(statuses.TURN_NOT_DECIDED), "CANNOT_ASSEMBLE": float(statuses.CANNOT_ASSEMBLE),
        "NO_STROKES": float(statuses.NO_STROKES), "STROKES_NOT_DECIDED": float(statuses.STROKES_NOT_DECIDED),
        "STATUS_OF_FACTOR": tuple(float(statuses.blocked_at(joints.index(each.joint))) for each in equations.factors),
    }  # fmt: skip
    parts = [
        _HEAD,
        *(f"{name} = {value}\n" for name, value in numbers.items()),
        node_function("check", rows, checks),
        node_function("direct", rows, directions) if links else "",
        node_function("rate", rows, rate) if rate else "",
        _CLOSE.format(
            constants="\n".join(rows.constant_lines(parameters)),
            references=_REFERENCES if links else "",
            reversals=_REVERSALS if rate else "",
        ),
        fill_function(rows, outputs),
        disturbed_function(rows, outputs),
    ]
    return Source("".join(parts), status)


def _check_rows(equations: Equations) -> list[Number]:
    """The rows that `turning` takes."""
    zero = equations.graph.constant(0.0)
    factors = equations.factors
    functions = [*(factor.value for factor in factors), *equations.squares]
    return [
        *(function.terms[0] for function in functions),
        *(function.terms[1] for function in functions),
        *(factor.size or zero for factor in factors),
    ]
