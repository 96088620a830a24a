"""CPU time per design of this source tree and of another edition's, in turns, one process each.

Run with ``python benchmarks/editions.py FOLDER``, the folder a checkout of the other edition, for the first one
``git worktree add FOLDER 0ccb847``. Random crank-rockers, tolerance 1e-9, one core.
"""

import statistics
import sys
import time
from collections.abc import Callable
from importlib import import_module
from importlib.util import find_spec

from timing import edition_times, serve

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


def make_measurement() -> Callable[[str], list[float]]:
    """A function that gives the CPU nanoseconds per design of a job."""
    import numpy as np

    from explore.evaluation.evaluate import evaluate_columns

    # Where editions before the one with rooms have these modules.
    package = "explore.studies.request" if find_spec("explore.studies") else "explore.request"
    find_mechanism = import_module(f"{package}.names").find_mechanism
    make_request = import_module(f"{package}.requests").make_request

    mechanism, rng = find_mechanism("crank-rocker"), np.random.default_rng(0)
    designs = {name: rng.uniform(*bounds, DESIGNS) for name, bounds in RANGES.items()}
    closed = [metric.name for metric in mechanism.metrics]
    requests = {
        name: make_request(mechanism, **options | ({"metrics": closed} if options.get("metrics") == "closed" else {}))
        for name, (options, _) in JOBS.items()
    }

    def measure(job: str) -> list[float]:
        start = time.process_time()
        evaluate_columns(requests[job], designs)
        return [(time.process_time() - start) / DESIGNS * 1e9]

    return measure


def main() -> None:
    times = edition_times(__file__, sys.argv[1], {job: job for job in JOBS}, REPETITIONS)
    print(f"{'CPU per design':34s}{'other':>10s}{'here':>10s}{'ratio':>8s}{'asked':>8s}")
    for job, (_, asked) in JOBS.items():
        other, here = (statistics.median(spent for (spent,) in measured) for measured in times[job])
        print(f"{job:34s}{other:7.0f} ns{here:7.0f} ns{other / here:8.1f}{asked:8d}")


if __name__ == "__main__":
    serve(make_measurement()) if "--serve" in sys.argv else main()
