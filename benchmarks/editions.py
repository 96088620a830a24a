"""CPU time per design of this source tree and of another edition's, in turns, one process each.

Run with ``python benchmarks/editions.py FOLDER``, the folder a checkout of the other edition, for the first one
``git worktree add FOLDER 0ccb847``. Random crank-rockers, tolerance 1e-9, one core.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import time
from pathlib import Path

DESIGNS, REPETITIONS = 65_536, 15
RANGES = {"crank": (60, 140), "coupler": (900, 1000), "rocker": (500, 600), "ground": (700, 800)}
#: Options of `make_request` by job, and how many times as fast as the first edition each is to be.
JOBS = {
    "default columns, drive stroke": ({}, 3),
    "default columns, full turn": ({"window": "cycle"}, 3),
    "default columns, clutch": ({"window": "clutch"}, 3),
    "cv alone, drive stroke": ({"metrics": ["cv"]}, 4),
    "largest acceleration, full turn": ({"metrics": ["rocker_acceleration_max"], "window": "cycle"}, 3),
    "closed form alone": ({"metrics": "closed"}, 8),
}


def serve() -> None:
    """Run the jobs whose names are read, and print the CPU nanoseconds per design of each."""
    import numpy as np

    from explore.evaluation.evaluate import evaluate_columns
    from explore.request.names import find_mechanism
    from explore.request.requests import make_request

    mechanism, rng = find_mechanism("crank-rocker"), np.random.default_rng(0)
    designs = {name: rng.uniform(*bounds, DESIGNS) for name, bounds in RANGES.items()}
    closed = [metric.name for metric in mechanism.metrics]
    requests = {
        name: make_request(mechanism, **options | ({"metrics": closed} if options.get("metrics") == "closed" else {}))
        for name, (options, _) in JOBS.items()
    }
    for line in sys.stdin:
        start = time.process_time()
        evaluate_columns(requests[line.rstrip("\n")], designs)
        print((time.process_time() - start) / DESIGNS * 1e9, flush=True)


def nanoseconds(process: subprocess.Popen[str], job: str) -> float:
    process.stdin.write(f"{job}\n")
    process.stdin.flush()
    return float(process.stdout.readline())


def main() -> None:
    trees = {"other": Path(sys.argv[1]).resolve(), "here": Path(__file__).resolve().parents[1]}
    processes = {
        name: subprocess.Popen(
            [sys.executable, __file__, "--serve"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
            env={**os.environ, "PYTHONPATH": str(tree)},
        )
        for name, tree in trees.items()
    }  # fmt: skip
    times: dict[tuple[str, str], list[float]] = {(job, name): [] for job in JOBS for name in processes}
    for repetition in range(REPETITIONS + 1):
        for job, name in times:
            spent = nanoseconds(processes[name], job)
            if repetition:  # the first run compiles
                times[job, name].append(spent)
    for process in processes.values():
        process.stdin.close()
        process.wait()
    print(f"{'CPU per design':34s}{'other':>10s}{'here':>10s}{'ratio':>8s}{'asked':>8s}")
    for job, (_, asked) in JOBS.items():
        other, here = (statistics.median(times[job, name]) for name in processes)
        print(f"{job:34s}{other:7.0f} ns{here:7.0f} ns{other / here:8.1f}{asked:8d}")


if __name__ == "__main__":
    serve() if "--serve" in sys.argv else main()
