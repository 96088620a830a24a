"""CPU time of a block by stage, and the bytes of a design.

Run with ``python benchmarks/stages.py [folder]``; the folder selects the disk. CPU time per design, least of nine;
default columns, drive stroke, tolerance 1e-9.
"""

import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from timing import cpu_times

from explore.evaluation import sampled
from explore.evaluation.evaluate import evaluate_columns, output_columns
from explore.model.request import Objective
from explore.results.ranking.pareto import find_front
from explore.results.store.all_designs_writer import AllDesignsWriter
from explore.studies.designs.spaces import BLOCK_SIZE, Grid, SpacedAxis
from explore.studies.request.names import find_mechanism
from explore.studies.request.requests import make_request

REPETITIONS, TOLERANCE = 9, 1e-9
RANGES = {"crank": (60, 140, 16), "coupler": (900, 1000, 16), "rocker": (500, 600, 16), "ground": (700, 800, 16)}
ATTRIBUTES = {"config": "", "request_sha256": "", "determines": "{}", "kernel": "none"}


def least_times(jobs):
    """CPU nanoseconds per design of a block, by job."""
    seconds = cpu_times(jobs, REPETITIONS)
    return {name: min(times) / BLOCK_SIZE * 1e9 for name, times in seconds.items()}


def loop_time(request, designs):
    """CPU nanoseconds per design in the compiled loop of the samples, least of nine."""
    times, loop = [], sampled.sample

    def timed(*arguments):
        start = time.process_time()
        loop(*arguments)
        times.append(time.process_time() - start)

    sampled.sample = timed
    try:
        for _ in range(REPETITIONS):
            evaluate_columns(request, designs)
    finally:
        sampled.sample = loop
    return min(times) / BLOCK_SIZE * 1e9


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
    """Print the stages, each with its share of an evaluation."""
    mechanism = find_mechanism("crank-rocker")
    request = make_request(mechanism, tolerance=TOLERANCE)
    space = Grid.over(tuple(SpacedAxis(name, *values) for name, values in RANGES.items()))
    designs = space.designs(0, BLOCK_SIZE)
    given = [designs.get(p.name, np.full(BLOCK_SIZE, p.default)) for p in mechanism.kernel_parameters]
    geometry = np.array(given, dtype=np.float64)
    closed = make_request(mechanism, metrics=[metric.name for metric in mechanism.metrics])
    nanoseconds = least_times(
        {
            "designs of a grid": lambda: space.designs(0, BLOCK_SIZE),
            "closed form": lambda: mechanism.evaluate_closed_form(geometry),
            "its columns": lambda: evaluate_columns(closed, designs),
            "evaluation": lambda: evaluate_columns(request, designs),
        }
    )
    whole, loop = nanoseconds["evaluation"], loop_time(request, designs)
    table = {
        "closed form": nanoseconds["closed form"],
        "its columns": nanoseconds["its columns"] - nanoseconds["closed form"],
        "compiled loop of the samples": loop,
        "arguments, columns of the statistics": whole - nanoseconds["its columns"] - loop,
    }
    print(f"{'designs of a grid':44s}{nanoseconds['designs of a grid']:6.0f} ns")
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
    print(f"bytes of the columns of a design: {sum(values.itemsize for values in columns.values())}")


if __name__ == "__main__":
    main()
