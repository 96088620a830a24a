"""Designs per CPU-second of `explore.evaluate`'s core with the default columns, at three tolerances.

Run with ``python benchmarks/evaluate.py``. The same run measures the closed form alone, the cost of a screened design.
``benchmarks/requests.py`` compares with NumPy, JAX and Numba.
"""

import statistics

import numpy as np
from timing import cpu_times

from explore.evaluation.evaluate import evaluate_columns
from explore.studies.request.names import find_mechanism
from explore.studies.request.requests import make_request

DESIGNS, REPETITIONS = 65_536, 9


def main() -> None:
    mechanism, rng = find_mechanism("crank-rocker"), np.random.default_rng(0)
    ranges = {"crank": (60, 140), "coupler": (900, 1000), "rocker": (500, 600), "ground": (700, 800)}
    designs = {name: rng.uniform(*bounds, DESIGNS) for name, bounds in ranges.items()}
    closed = [metric.name for metric in mechanism.metrics]
    jobs = {
        "default columns, 1e-9": lambda: evaluate_columns(make_request(mechanism), designs),
        "default columns, 1e-6": lambda: evaluate_columns(make_request(mechanism, tolerance=1e-6), designs),
        "default columns, 1e-12": lambda: evaluate_columns(make_request(mechanism, tolerance=1e-12), designs),
        "closed form only": lambda: evaluate_columns(make_request(mechanism, metrics=closed), designs),
    }
    for name, times in cpu_times(jobs, REPETITIONS).items():
        print(f"{name:24s}{DESIGNS / statistics.median(times) / 1e6:8.2f} million designs per CPU-second")


if __name__ == "__main__":
    main()
