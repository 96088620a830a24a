"""CPU time of a block by stage, and the bytes that it moves.

Run with ``python benchmarks/stages.py [folder]``; the folder selects the disk. CPU time per design,
least of nine. The stages of sampling are differences: the same compiled functions as in explore.quadrature.loop, in a
loop that ends after one more stage each time. One window, one panel per design, default columns, tolerance 1e-9.
"""

from __future__ import annotations

import math
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from numba import njit, types

from explore.designs.spaces import BLOCK_SIZE, Grid, SpacedAxis
from explore.evaluation.evaluate import evaluate_columns, output_columns
from explore.quadrature.loop import FILL_TYPE, HEADROOM, MOST_PIECES, NODE_CAPACITY, PIECES_TYPE
from explore.quadrature.moments import mean_and_variance
from explore.quadrature.node_placement import map_panel, model_errors, node_count, place_nodes
from explore.quadrature.rules import gauss_legendre_rules
from explore.request.names import find_mechanism
from explore.request.requests import make_request
from explore.store.all_designs_writer import AllDesignsWriter

REPETITIONS, TOLERANCE, SLOW_DRIVE, NEEDS = 9, 1e-9, (1, 0), 3
STAGES = ("pieces", "panel", "node count", "error model", "place nodes", "fill", "moments")
_F2, _I1 = types.float64[:, ::1], types.int64[::1]
ATTRIBUTES = {"config": "", "request_sha256": "", "determines": "{}", "kernel": "none"}


@njit(types.float64(FILL_TYPE, PIECES_TYPE, _F2, _F2, types.int64, _I1, _I1, _F2), error_model="numpy", nogil=True)
def sampled(fill, pieces, kernel, singular, stage, size_of, row_of, table):
    """The first stages of explore.quadrature.loop for every design; the sum keeps the compiler from omitting them."""
    scratch, target, sum_ = np.empty((7, NODE_CAPACITY)), math.log(TOLERANCE) - HEADROOM, 0.0
    t, sin_half = np.empty(NODE_CAPACITY), np.empty(NODE_CAPACITY)
    cos_half, weight = np.empty(NODE_CAPACITY), np.empty(NODE_CAPACITY)
    parts, shapes = np.zeros((MOST_PIECES + 1, 3)), np.zeros((MOST_PIECES, 4))
    for i in range(len(kernel)):
        row = kernel[i]
        sum_ += pieces(row, SLOW_DRIVE[0], SLOW_DRIVE[1], 0.0, 0.0, parts)
        if stage < 1:
            continue
        map_panel(parts, 0, singular, i, shapes)
        if stage < 2:
            continue
        count = node_count(target, shapes[0, 1], shapes[0, 3], 4, size_of)
        sum_ += count
        if stage < 3:
            continue
        sum_ += model_errors(count, shapes[0, 1], shapes[0, 3])[1]
        if stage < 4:
            continue
        place_nodes(shapes, 0, int(parts[0, 0]), count, 0, row_of, table, False, t, sin_half, cos_half, weight)
        if stage < 5:
            continue
        fill(row, sin_half, cos_half, count, NEEDS, scratch)
        if stage < 6:
            continue
        for s in range(4):
            sum_ += mean_and_variance(scratch, s, weight, count, parts[3, 0], parts[3, 1])[1]
    return sum_


def least_times(jobs):
    """CPU nanoseconds per design of a block, by job; interleaved, so that a busy moment harms all alike."""
    seconds = {name: [] for name in jobs}
    for repetition in range(REPETITIONS + 1):
        for name, job in jobs.items():
            start = time.process_time()
            job()
            if repetition:  # the first run warms up
                seconds[name].append(time.process_time() - start)
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
    geometry = np.column_stack([*designs.values(), np.full(n, 3.0), np.ones(n)])
    geometric = mechanism.evaluate_closed_form(geometry)
    kernel, singular = geometric.kernel, geometric.singular

    def stage(number):
        return lambda: sampled(mechanism.fill, mechanism.pieces, kernel, singular, number, *gauss_legendre_rules())

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
    table["error bounds, columns of the statistics"] = whole - nanoseconds["screened"] - before
    for name, cost in table.items():
        print(f"{name:44s}{cost:6.0f} ns {cost / whole:6.1%}")
    columns = evaluate_columns(request, designs).columns
    print(f"{'evaluation':44s}{whole:6.0f} ns, {columns['nodes'].mean():.1f} nodes a design")
    with tempfile.TemporaryDirectory(dir=sys.argv[1] if len(sys.argv) > 1 else ".") as folder:
        wall, cpu = commit(folder, output_columns(request, designs), columns)
    print(f"{'commit':44s}{cpu:6.0f} ns of CPU, {wall:.0f} ns until durable")
    size = sum(values.itemsize for values in columns.values())
    inner = 8 * (geometry.shape[1] + len(geometric.metrics) + kernel.shape[1] + singular.shape[1] + 1 + 15)
    rate = 2 * source.nbytes / (nanoseconds["copy"] * BLOCK_SIZE)
    print(f"bytes of a design: {size} in its columns, {inner} in the arrays before them")
    once = 2 * (size + inner) / rate
    print(f"all of them written and read once: {once:.0f} ns, at the {rate:.0f} GB/s of a copy that fits no cache")


if __name__ == "__main__":
    main()
