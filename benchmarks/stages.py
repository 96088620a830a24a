"""CPU time of a block by stage, and the bytes that it moves.

Run with ``python benchmarks/stages.py [folder]``; the folder selects the disk. CPU time per design,
least of nine. The stages of sampling are differences: the same compiled functions as in quadrature.loop, in a
loop that ends after one more stage each time. One window, one panel per design, default columns, tolerance 1e-9.
"""

import math
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numba import njit, types
from timing import cpu_times

from explore.base.compiling import LANES
from explore.evaluation.evaluate import evaluate_columns, output_columns
from explore.evaluation.quadrature import panels as panel
from explore.evaluation.quadrature.bounds import BOUNDS_SIZE, CHUNK, FLAG_CV, FLAG_MOMENTS
from explore.evaluation.quadrature.chunks import (
    CLOSE_TYPE,
    CODES,
    MOST_KINDS,
    add_panels,
    close_chunk,
    gather_constants,
    sort_by_rule,
)
from explore.evaluation.quadrature.loop import HEADROOM
from explore.evaluation.quadrature.merging import bound_rows, collect, merge_regular
from explore.evaluation.quadrature.panels import PANEL_CAPACITY, PANELS_SIZE, count_nodes, map_panels
from explore.evaluation.quadrature.rules import gauss_legendre_rules
from explore.evaluation.quadrature.tails import check_model, fill_roots, place_factors
from explore.evaluation.quadrature.tiles import (
    DEVIATIONS,
    FILL_TYPE,
    FIRST_TAIL,
    INTEGRAL,
    NODE_CAPACITY,
    SHAPE_SIZE,
    SUMS_SIZE,
    fill_moments,
    gather_shapes,
    place_nodes,
)
from explore.evaluation.windows import specify_window
from explore.model.request import Objective
from explore.results.ranking.pareto import find_front
from explore.results.store.all_designs_writer import AllDesignsWriter
from explore.studies.designs.spaces import BLOCK_SIZE, Grid, SpacedAxis
from explore.studies.request.names import find_mechanism
from explore.studies.request.requests import make_request

REPETITIONS, TOLERANCE, NEEDS, SAMPLED_ROWS, POLE_ORDER = 9, 1e-9, 3, 4, 4
STAGES = ("close", "windows", "map", "count", "sort", "place", "fill", "moments", "merge", "bounds")
CLOSE, WINDOWS, MAP, COUNT, SORT, PLACE, FILL, MOMENTS, MERGE, BOUNDS = range(10)
_F2, _I1, _I2 = types.float64[:, ::1], types.int64[::1], types.int64[:, ::1]


class Rows(NamedTuple):
    """Those of the tables of the loop that bounds need."""

    flags: np.ndarray
    orders: np.ndarray
    term_rows: np.ndarray
    references: np.ndarray
    tolerance: float
    is_adaptive: bool


ROWS_TYPE = types.NamedTuple((_I2, _I2, _I1, _I1, types.float64, types.boolean), Rows)
_INT = types.int64
ATTRIBUTES = {"config": "", "request_sha256": "", "determines": "{}", "kernel": "none"}


@njit(
    types.float64(
        CLOSE_TYPE, FILL_TYPE, _INT, _INT, _INT, _INT, _INT, _F2, _I1, _I1, _I1, ROWS_TYPE, _INT, _I1, _I1, _F2
    ),
    error_model="numpy",
    nogil=True,
)
def sampled(
    close, fill, record_rows, first_parameter, constant_count, fill_rows, rows, parameters, window, singular_rows,
    anchors, tables, stage, size_of, row_of, table,
):  # fmt: skip
    """The first stages of quadrature.loop for every design; the sum keeps the compiler from omitting them."""
    record, constants = np.zeros(record_rows * LANES), np.empty((CHUNK + LANES) * constant_count)
    panels, b, sum_ = np.zeros(PANELS_SIZE), np.zeros(BOUNDS_SIZE), 0.0
    owner, first_panel, live = np.empty(PANEL_CAPACITY, _INT), np.empty(CHUNK, _INT), np.empty(CHUNK, _INT)
    panel_count, masses_of_tile = np.empty(CHUNK, _INT), np.empty(LANES)
    is_sampled = (np.arange(rows) < SAMPLED_ROWS).astype(np.int64)
    tile, shape, sums = np.empty(constant_count * LANES), np.zeros(SHAPE_SIZE), np.empty(rows * SUMS_SIZE)
    tangents, weights = np.empty(NODE_CAPACITY * LANES), np.empty(NODE_CAPACITY * LANES)
    signals = np.empty(rows * NODE_CAPACITY * LANES)
    lane_panels, lane_designs, offsets = np.empty(LANES, _INT), np.empty(LANES, _INT), np.empty(LANES, np.uint64)
    roots, factors = np.empty(NODE_CAPACITY * LANES), np.empty(2 * NODE_CAPACITY)
    tails = np.empty(rows * PANEL_CAPACITY)
    masses, integrals = np.empty(PANEL_CAPACITY), np.empty(rows * PANEL_CAPACITY)
    deviations, row_bounds = np.empty(rows * PANEL_CAPACITY), np.empty(rows * CHUNK)
    means, variances, terms = np.empty(rows * CHUNK), np.empty(rows * CHUNK), np.empty(CHUNK)
    averaging, rest, noise = np.empty(CHUNK), np.zeros(CHUNK), np.zeros(CHUNK)
    todo, order = np.arange(PANEL_CAPACITY), np.empty(PANEL_CAPACITY, _INT)
    codes, starts = np.empty(PANEL_CAPACITY, _INT), np.empty(PANEL_CAPACITY + 1, _INT)
    kinds, histogram = np.empty(MOST_KINDS, _INT), np.empty(MOST_KINDS * CODES + 1, _INT)
    designs, no_breaks, positions = np.arange(parameters.shape[1]), np.empty(0, _INT), np.empty(1)
    for start in range(0, len(designs), CHUNK):
        here = designs[start : start + CHUNK]
        n = len(here)
        close_chunk(close, parameters, parameters[:0], here, first_parameter, constant_count, record, constants)
        sum_ += constants[0]
        if stage < WINDOWS:
            continue
        _, count, stride = add_panels(
            constants, constant_count, 0, n, window, 0.0, 0.0, no_breaks, singular_rows, -1, panels, first_panel,
            panel_count, owner, positions,
        )  # fmt: skip
        if stage < MAP:
            continue
        map_panels(panels, count, anchors)
        if stage < COUNT:
            continue
        for k in range(count):
            panels[panel.TARGET + k] = math.log(TOLERANCE) - HEADROOM
        count_nodes(panels, count, POLE_ORDER)
        if stage < SORT:
            continue
        bins = sort_by_rule(panels, todo, count, size_of, kinds, codes, histogram, order, starts)
        if stage < PLACE:
            continue
        for number in range(bins):
            first = order[starts[number]]
            nodes, anchor = int(panels[panel.COUNT + first]), int(panels[panel.ANCHOR + first])
            for begin in range(starts[number], starts[number + 1], LANES):
                lanes = min(LANES, starts[number + 1] - begin)
                for lane in range(LANES):
                    lane_panels[lane] = order[begin + min(lane, lanes - 1)]
                    lane_designs[lane] = owner[lane_panels[lane]]
                gather_constants(constants, constant_count, fill_rows, lane_designs, offsets, tile)
                gather_shapes(panels, lane_panels, False, shape)
                place_nodes(shape, nodes, False, row_of, table, tangents, weights)
                if stage >= FILL:
                    fill(tile, tangents, anchor, 0, 0, nodes, NEEDS, signals)
                if stage < MOMENTS:
                    continue
                place_factors(nodes, False, False, row_of, table, factors)
                fill_roots(weights, nodes, False, roots)
                fill_moments(signals, rows, is_sampled, nodes, weights, roots, factors, masses_of_tile, sums)
                for lane in range(lanes):
                    masses[lane_panels[lane]] = masses_of_tile[lane]
                for s in range(SAMPLED_ROWS):
                    for lane in range(lanes):
                        k = s * PANEL_CAPACITY + lane_panels[lane]
                        integrals[k] = sums[s * SUMS_SIZE + INTEGRAL + lane]
                        deviations[k] = sums[s * SUMS_SIZE + DEVIATIONS + lane]
                        tails[k] = sums[s * SUMS_SIZE + FIRST_TAIL + lane] ** 2
        if stage < MERGE:
            continue
        for i in range(n):
            averaging[i], live[i] = panels[panel.LENGTH + first_panel[i]], i
        collect(b, panels, count, False, n, live, first_panel, panel_count, stride, 0, averaging, rest, noise)
        for s in range(SAMPLED_ROWS):
            merge_regular(b, n, 1, s, masses, integrals, deviations, means, variances)
        if stage >= BOUNDS:
            bound_rows(b, n, 0, tables, parameters, here, live, terms, means, variances, row_bounds, terms)
            check_model(b, n, True, 1, live, first_panel, panel_count, stride, 0, tables, tails, means, variances)
    return sum_


def least_times(jobs):
    """CPU nanoseconds per design of a block, by job."""
    seconds = cpu_times(jobs, REPETITIONS)
    return {name: min(times) / BLOCK_SIZE * 1e9 for name, times in seconds.items()}


def commit(folder, columns, block):
    """Wall and CPU nanoseconds per design of making blocks durable, medians."""
    wall, cpu, count = [], [], 8
    with AllDesignsWriter(Path(folder) / "stages.h5", columns, count * BLOCK_SIZE, BLOCK_SIZE, ATTRIBUTES) as writer:
        for number in range(count):
            start = time.perf_counter(), time.process_time()
            writer.commit(number, block)
            wall.append(time.perf_counter() - start[0])
            cpu.append(time.process_time() - start[1])
    return [float(np.median(times)) / BLOCK_SIZE * 1e9 for times in (wall, cpu)]


def main() -> None:
    mechanism = find_mechanism("crank-rocker")
    request = make_request(mechanism, tolerance=TOLERANCE)
    ranges = {"crank": (60, 140, 16), "coupler": (900, 1000, 16), "rocker": (500, 600, 16), "ground": (700, 800, 16)}
    space = Grid.over(tuple(SpacedAxis(name, *values) for name, values in ranges.items()))
    designs = space.designs(0, BLOCK_SIZE)
    n, closed = BLOCK_SIZE, [metric.name for metric in mechanism.metrics]
    geometry = np.array([*designs.values(), np.full(n, 3.0), np.ones(n)])
    window = np.array(specify_window(mechanism, mechanism.window("drive"), "slow"), dtype=np.int64)
    flags, orders = np.zeros((1, mechanism.signal_rows), np.int64), np.full((1, mechanism.signal_rows), 2)
    flags[0, :SAMPLED_ROWS], orders[0, 2:SAMPLED_ROWS] = FLAG_MOMENTS | FLAG_CV, POLE_ORDER
    arguments = (
        mechanism.close, mechanism.fill, mechanism.record_rows, mechanism.first_parameter, mechanism.n_constants,
        mechanism.n_fill_constants, mechanism.signal_rows, geometry, window,
        *np.array(mechanism.singularities, dtype=np.int64).T.copy(),
        Rows(flags, orders, np.full(mechanism.signal_rows, -1), np.full(mechanism.signal_rows, -1), TOLERANCE, False),
    )  # fmt: skip

    def stage(number):
        return lambda: sampled(*arguments, number, *gauss_legendre_rules())

    source = np.ones(2**25)
    target = np.empty_like(source)
    nanoseconds = least_times(
        {name: stage(number) for number, name in enumerate(STAGES)}
        | {
            "grid": lambda: space.designs(0, n),
            "closed": lambda: mechanism.evaluate_closed_form(geometry),
            "screened": lambda: evaluate_columns(make_request(mechanism, metrics=closed), designs),
            "whole": lambda: evaluate_columns(request, designs),
            "copy": lambda: np.copyto(target, source),
        }
    )
    whole, before = nanoseconds["whole"], 0.0
    print(f"{'designs of a grid':44s}{nanoseconds['grid']:6.0f} ns")
    table = {"closed form": nanoseconds["closed"], "its columns": nanoseconds["screened"] - nanoseconds["closed"]}
    for name in STAGES:
        table[name], before = nanoseconds[name] - before, nanoseconds[name]
    table["arguments, columns of the statistics"] = whole - nanoseconds["screened"] - before
    for name, cost in table.items():
        print(f"{name:44s}{cost:6.0f} ns {cost / whole:6.1%}")
    columns = evaluate_columns(request, designs).columns
    print(f"{'evaluation':44s}{whole:6.0f} ns, {columns['nodes'].mean():.1f} nodes a design")
    with tempfile.TemporaryDirectory(dir=sys.argv[1] if len(sys.argv) > 1 else ".") as folder:
        wall, cpu = commit(folder, output_columns(request, designs), columns)
    print(f"{'commit':44s}{cpu:6.0f} ns of CPU, {wall:.0f} ns until durable")
    objectives = [Objective("cv", "min"), Objective("transmission_angle_min", "max")]
    front = least_times({"front": lambda: find_front([columns], objectives)})["front"]
    print(f"{'front of a block, two objectives':44s}{front:6.0f} ns")
    size = sum(values.itemsize for values in columns.values())
    inner = 8 * (2 * mechanism.record_rows - mechanism.n_constants + PANELS_SIZE // PANEL_CAPACITY + 15)
    rate = 2 * source.nbytes / (nanoseconds["copy"] * BLOCK_SIZE)
    print(f"bytes of a design: {size} in its columns, {inner} in the arrays before them")
    once = 2 * (size + inner) / rate
    print(f"all of them written and read once: {once:.0f} ns, at the {rate:.0f} GB/s of a copy that fits no cache")


if __name__ == "__main__":
    main()
